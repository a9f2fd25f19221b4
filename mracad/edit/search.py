"""The search for the wavelengths of smoothing splines: in closed form for a surface alone, then near there."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from itertools import product

import numpy as np

from mracad.bspline.surface import Net
from mracad.seam.ladders import Creases
from mracad.seam.white import bends

Array = np.ndarray
Stiffness = Mapping[int, tuple[float, float]]
"""λ along u and v, by surface."""

STEPS = 10.0, 10.0**0.5
"""Factors by which stiffnesses are changed in search of the least risk."""

FIRST, LAST = 1e-4, 1e7
"""Range of stiffnesses."""

MOST = 600
"""Largest number of control points along an axis that are used in closed form."""


def searched(start: Stiffness, score: Callable[[Stiffness], float]) -> Stiffness:
    """The stiffnesses with the least score, changed by common factors; for a single surface separately along u and
    v."""
    along = ((1, 0), (0, 1), (-1, 0), (0, -1)) if len(start) == 1 else ((1, 1), (-1, -1))
    now, least = start, score(start)
    for factor in STEPS:
        moves = [(factor ** float(u), factor ** float(v)) for u, v in along]
        waiting = list(moves)
        while waiting:
            move = waiting.pop(0)
            other = _times(now, move)
            value = score(other) if other != now else np.inf
            if value < least:
                now, least, waiting = other, value, [move, *(each for each in moves if each != move)]
    return now


def _times(stiffness: Stiffness, factors: tuple[float, float]) -> Stiffness:
    """Stiffnesses multiplied by factors, within their range."""
    u, v = factors
    return {
        i: (min(max(along * u, FIRST), LAST), min(max(across * v, FIRST), LAST))
        for i, (along, across) in stiffness.items()
    }


def alone(net: Net, where: Array, creases: Creases, score: Callable[[float, float], float]) -> tuple[float, float]:
    """λ along u and v of the spline of a surface with the least score, in closed form.

    Parameters
    ----------
    net : Net
    where : ndarray of bool (nu, nv)
        Control points with noise: the box around them is taken by itself; of many, those in the middle.
    creases : pair of frozenset of float
    score : callable
        From |δ|² and −3 div δ.
    """
    within, squares = net.poles, []
    for axis, knots in enumerate((net.u, net.v)):
        inside = np.flatnonzero(where.any(axis=1 - axis))
        points = inside[max((len(inside) - MOST) // 2, 0) :][:MOST]
        whole = bends(knots, knots, creases[axis])
        inner = whole[:, points][np.abs(np.delete(whole, points, axis=1)).sum(axis=1) == 0]
        values, modes = np.linalg.eigh(inner.T @ inner)
        squares.append(np.maximum(values, 0.0))
        within = np.moveaxis(np.tensordot(modes, within.take(points, axis), (0, axis)), 0, axis)
    power, found = (within**2).sum(axis=2), []
    for u, v in product(10.0 ** np.arange(np.log10(FIRST), np.log10(LAST) + 0.1), repeat=2):
        bent = u * squares[0][:, None] + v * squares[1]
        taken = bent / (1 + bent)
        found.append((score(float((power * taken**2).sum()), 3 * float(taken.sum())), float(u), float(v)))
    return min(found)[1:]
