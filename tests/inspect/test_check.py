"""Faces that look the other way, told from how faces use their edges."""

import numpy as np
import pytest

from mracad.inspect.check import turned

BOX = {  # the faces of a box as loops of corners, looking outward
    0: (0, 2, 3, 1), 1: (4, 5, 7, 6), 2: (0, 1, 5, 4), 3: (2, 6, 7, 3), 4: (0, 4, 6, 2), 5: (1, 3, 7, 5),
}  # fmt: skip


def uses(flipped=(), first=0):
    for face, loop in BOX.items():
        for a, b in zip(loop, [*loop[1:], loop[0]], strict=True):
            yield first + 8 * min(a, b) + max(a, b), first + face, (a < b) != (face in flipped)


@pytest.mark.parametrize("flipped", [set(), {2}, {0, 5}])
def test_the_fewer_are_turned(flipped):
    assert turned(uses(flipped)) == flipped
    others = set(BOX) - flipped
    assert turned(uses(others)) == (flipped if flipped else set())


def test_bodies_are_looked_at_one_by_one():
    assert turned([*uses({1}), *uses({3, 4}, first=100)]) == {1, 103, 104}


def test_the_order_does_not_matter():
    shuffled = np.random.default_rng(1).permutation(list(uses({4}))).tolist()
    assert turned((a, b, bool(c)) for a, b, c in shuffled) == {4}
