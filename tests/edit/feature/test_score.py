"""Figures of copies."""

import numpy as np
import pytest

from mracad.edit.feature.score import Figures, copied


def test_the_figures_of_a_copy_are_those_of_all_its_patches():
    one = Figures(np.array([3.0, 4.0]), np.array([0.5, 0.1]), np.array([0.0, 0.2]), np.array([2, 0]))
    two = Figures(np.array([5.0]), np.array([0.3]), np.array([0.1]), np.array([-1]))
    copy = copied("there", np.array([1.0, 2.0, 3.0]), [one, two], True)
    assert (copy.place, copy.at, copy.faces, copy.exact) == ("there", (1.0, 2.0, 3.0), (0, 2), True)
    assert (copy.deviation, copy.lost, copy.short) == (5.0, 0.5, 0.2)
    assert copy.rms == pytest.approx(np.sqrt((9 + 16 + 25) / 3))


def test_a_copy_that_lies_nowhere_is_off_by_nothing():
    copy = copied("nowhere", np.zeros(3), [])
    assert (copy.deviation, copy.rms, copy.lost, copy.short, copy.faces) == (0.0, 0.0, 0.0, 0.0, ())
