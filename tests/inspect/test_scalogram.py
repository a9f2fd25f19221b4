"""Scalograms: waves are where they are, in the octave of their length, with their height."""

import numpy as np
import pytest

from mracad.bspline.knots import KnotVector
from mracad.inspect.scalogram import PLACES, scalogram
from tests.edit.models import fitted, sheet

SIZE, AMPLITUDE = 100.0, 0.05


@pytest.mark.parametrize("axis", [0, 1])
def test_a_ripple_on_one_half_is_seen_there(axis):
    along, across = KnotVector.clamped(np.linspace(0, 1, 81), 3), KnotVector.clamped(np.linspace(0, 1, 9), 3)

    def ripple(*xy):
        s = xy[axis]
        return AMPLITUDE * np.sin(2 * np.pi * s / 7.0) * (s > SIZE / 2) + 0 * xy[1 - axis]

    model = sheet(fitted(*(along, across)[:: 1 - 2 * axis], ripple, SIZE))
    found = scalogram(model.surfaces[0].net, model.faces[0], axis)
    assert found.length == pytest.approx(SIZE, rel=1e-3)
    (octave,) = np.flatnonzero((found.lows <= 7.0) & (2 * found.lows > 7.0))
    assert found.rms.max() == found.rms[octave].max()
    calm, rippled = found.rms[octave, : PLACES // 2 - 12], found.rms[octave, PLACES // 2 + 12 : -8]
    assert rippled == pytest.approx(AMPLITUDE / np.sqrt(2), rel=0.15) and calm.max() < 0.05 * AMPLITUDE
