"""Filters of control points along both axes of a surface, by their modes: every wavelength costs one product."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from mracad.bspline.surface import Net
from mracad.wavelet.ladder import arc_lengths

Array = np.ndarray

MOST = 600
"""Largest number of control points along an axis that are used."""


@dataclass(frozen=True, eq=False)
class Axis:
    """Control points along an axis.

    Attributes
    ----------
    points : ndarray (n,) of int
        Indices of those that are used.
    modes : ndarray (n, n)
        Orthonormal, ordered by bending.
    squares : ndarray (n,)
        Their squared wavenumbers, 1/mm².
    step : float
        Mean spacing, mm.
    """

    points: Array
    modes: Array
    squares: Array
    step: float


def modes(net: Net, axis: int) -> Axis:
    """The control points of a surface along an axis, with free ends; of many, those in the middle."""
    knots = (net.u, net.v)[axis]
    along = np.concatenate([[0.0], np.cumsum(arc_lengths(net, axis))])
    at = np.interp(knots.greville(), knots.breaks, along)
    step = float(along[-1]) / max(len(at) - 1, 1)
    points = np.arange(len(at))[max((len(at) - MOST) // 2, 0) :][:MOST]
    gaps = np.diff(at[points] + step * 1e-6 * points)
    second = np.zeros((max(len(points) - 2, 0), len(points)))
    for k, (a, b) in enumerate(pairwise(gaps)):
        second[k, k : k + 3] = 2 / (a * (a + b)), -2 / (a * b), 2 / (b * (a + b))
    values, found = np.linalg.eigh(second.T @ second)
    return Axis(points, found, np.sqrt(np.maximum(values, 0.0)), step)


def inside(axes: Sequence[Axis], values: Array) -> Array:
    """Values of control points ``(nu, nv, k)`` as shares of the modes along both axes."""
    for axis, each in enumerate(axes):
        values = np.moveaxis(np.tensordot(each.modes, values.take(each.points, axis), (0, axis)), 0, axis)
    return values


def outside(axes: Sequence[Axis], shares: Array, shape: tuple[int, ...]) -> Array:
    """Values of control points, an array of the given shape, from shares of the modes; 0 for points that are not
    used."""
    for axis, each in enumerate(axes):
        shares = np.moveaxis(np.tensordot(each.modes, shares, (1, axis)), 0, axis)
    found = np.zeros(shape)
    found[np.ix_(axes[0].points, axes[1].points)] = shares
    return found
