"""The scalogram of a face: where along it waves of which length are.

Heights of profiles above their slow part are split into octaves by the modes of a free beam, as in
:mod:`mracad.inspect.spectrum`.  The squares of each octave are averaged over a wavelength, and over all profiles at
equal shares of their lengths.
"""

from __future__ import annotations

from collections import defaultdict
from dataclasses import dataclass

import numpy as np

from mracad.bspline.surface import Net
from mracad.inspect.profiles import Profiles, profiles
from mracad.inspect.spectrum import EDGE, SLOW, heights, modes
from mracad.model.brep import Face

Array = np.ndarray

PLACES = 96
"""Number of places along a face."""


@dataclass(frozen=True, eq=False)
class Scalogram:
    """Heights by place and octave, in one direction.

    Attributes
    ----------
    length : float
        Mean length of the profiles, mm.
    lows : ndarray (b,)
        Shortest wavelengths of the octaves, mm.
    rms : ndarray (b, PLACES)
        Root mean square heights, mm, at even places from the beginning of the profiles to their end.
    """

    length: float
    lows: Array
    rms: Array


def scalogram(net: Net, face: Face, axis: int) -> Scalogram | None:
    """The scalogram along u (axis 0) or v; None for a face without profiles."""
    squares: defaultdict[int, Array] = defaultdict(lambda: np.zeros(PLACES))
    lengths = np.zeros(0)
    for group in profiles(net, face, axis):
        for octave, found in _octaves(group):
            squares[octave] += found
        lengths = np.append(lengths, group.lengths)
    if not squares:
        return None
    numbers = np.arange(min(squares), max(squares) + 1)
    rms = np.sqrt([squares[int(k)] / lengths.sum() for k in numbers])
    return Scalogram(float(lengths.mean()), EDGE * 2.0**numbers, rms)


def _octaves(group: Profiles) -> list[tuple[int, Array]]:
    """Octaves, and sums over profiles of squares times lengths, mm³, by place."""
    from scipy.ndimage import gaussian_filter1d

    count = group.points.shape[1]
    beam = modes(count)
    parts = heights(group.points, group.normals) @ beam.shapes
    found: defaultdict[int, Array] = defaultdict(lambda: np.zeros(PLACES))
    fast = beam.lengths <= SLOW
    at = np.linspace(0.0, 1.0, count)
    for part, length in zip(parts, group.lengths.tolist(), strict=True):
        octaves = np.floor(np.log2(length * beam.lengths[fast] / EDGE)).astype(int)
        for octave in np.unique(octaves):
            own = np.flatnonzero(fast)[octaves == octave]
            wave = beam.shapes[:, own] @ part[own]
            steps = EDGE * 2.0 ** (octave + 0.5) / length * (count - 1)
            mean = gaussian_filter1d(wave**2, 0.5 * steps, mode="nearest")
            found[int(octave)] += length * np.interp((np.arange(PLACES) + 0.5) / PLACES, at, mean)
    return list(found.items())
