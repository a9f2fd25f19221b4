"""What is kept is told apart by value, cannot be written to, and is forgotten when asked."""

import numpy as np
import pytest

from mracad import memo
from mracad.bspline.curve import Curve
from mracad.bspline.gram import gram
from mracad.bspline.knots import KnotVector
from mracad.memo import kept

calls = []


@kept(2)
def table(knots: KnotVector, count: int) -> tuple[np.ndarray, list[np.ndarray]]:
    calls.append(count)
    return np.zeros(count), [np.ones(count)]


def test_equal_arguments_give_the_same_result_until_it_is_forgotten():
    calls.clear()
    first = table(KnotVector.clamped([0, 1, 2], 3), 4)
    assert table(KnotVector.clamped([0, 1, 2], 3), 4) is first and calls == [4]
    table(KnotVector.clamped([0, 1, 3], 3), 4)
    assert calls == [4, 4]
    memo.clear()
    assert table(KnotVector.clamped([0, 1, 2], 3), 4) is not first and calls == [4, 4, 4]


def test_no_more_are_kept_than_were_said():
    memo.clear()
    knots = KnotVector.clamped([0, 1], 1)
    first = table(knots, 1)
    for count in (2, 3):
        table(knots, count)
    assert table(knots, 1) is not first


def test_arrays_of_what_is_kept_are_read_only():
    values, (ones,) = table(KnotVector.clamped([0, 1], 1), 7)
    for array in (values, ones, gram(KnotVector.clamped([0, 1, 2], 2)).bands):
        with pytest.raises(ValueError, match="read-only"):
            array[0] = 1.0


def test_curves_are_equal_where_their_numbers_are():
    knots, poles = KnotVector.clamped([0, 1], 1), np.array([[0.0, 0.0], [1.0, 2.0]])
    one, same = Curve(knots, poles), Curve(KnotVector.clamped([0, 1], 1), poles.copy())
    assert one == same and hash(one) == hash(same)
    assert one != Curve(knots, poles + 1) and one != Curve(knots, poles, np.array([1.0, 2.0]))
