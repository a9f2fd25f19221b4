"""Crease lines: knot lines inside a face along which it is sharp."""

from __future__ import annotations

import math

import numpy as np

from mracad.bspline.basis import basis
from mracad.bspline.surface import Net

Array = np.ndarray

KINK = math.radians(0.1)
"""A knot line of full multiplicity is a crease line if the normal turns by more than this across it."""


def crease_lines(net: Net, axis: int, visible: Array) -> frozenset[float]:
    """Knots of full multiplicity, including one at the end of a period, across which the normal turns by more than the
    kink angle.

    Parameters
    ----------
    axis : int
        0 for lines u = const, 1 for v = const.
    visible : ndarray of bool (nu, nv)
        Control points on which some face depends; a line counts only if one of the points on it is visible.
    """
    knots, other = (net.u, net.v)[axis], (net.u, net.v)[1 - axis]
    lines, across = knots.full, other.greville()
    if not len(lines):
        return frozenset()
    first, values = basis(knots, lines)
    on = (first + values.argmax(axis=1)) % knots.count
    line, place = np.nonzero((visible if axis == 0 else visible.T)[on])
    points = np.ascontiguousarray(np.stack([lines[line], across[place]], axis=1)[:, :: 1 - 2 * axis])
    before = net.normals(points, side=("left", "right") if axis == 0 else ("right", "left"))
    after = net.normals(points)
    turn = np.arctan2(np.linalg.norm(np.cross(before, after), axis=1), (before * after).sum(axis=1))
    return frozenset(float(x) for x in lines[np.unique(line[turn > KINK])])
