"""Splines that take given values at the Greville points."""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from mracad.bspline.basis import basis
from mracad.bspline.knots import Array, KnotVector
from mracad.bspline.solve import BandSolver, folded


def interpolated(u: KnotVector, v: KnotVector, values: Array) -> Array:
    """Poles ``(nu, nv, k)`` of the polynomial surface with ``values`` at the Greville points of both knot vectors."""
    return np.asarray(_solver(v).solve(_solver(u).solve(values, 0), 1))


@lru_cache(maxsize=64)
def _solver(kv: KnotVector) -> BandSolver:
    first, values = basis(kv, kv.greville())
    n, width = values.shape
    row = np.repeat(np.arange(n), width)
    column = (first[:, None] + np.arange(width)).ravel() % n
    order = folded(n) if kv.periodic else np.arange(n)
    if kv.periodic and width > n:
        dense = np.zeros((n, n))
        np.add.at(dense, (row, column), values.ravel())
        row, column = np.nonzero(dense)
        return BandSolver(row, column, dense[row, column], order, order)
    return BandSolver(row, column, values.ravel(), order, order)
