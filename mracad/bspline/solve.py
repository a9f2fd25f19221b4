"""Direct solution of square banded systems by one pivoted LU factorisation."""

from __future__ import annotations

from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from mracad.bspline.knots import Array
from mracad.bspline.rows import LARGE, Rows
from mracad.errors import MracadError

if TYPE_CHECKING:
    from mracad.bspline.sweeps import Triangles


def folded(n: int) -> Array:
    """Order in which a cyclic band becomes an ordinary one of twice the width: 0, n−1, 1, n−2, …"""
    order = np.empty(n, dtype=int)
    half = (n + 1) // 2
    order[::2] = np.arange(half)
    order[1::2] = np.arange(n - 1, half - 1, -1)
    return order


class BandSolver:
    """Solver of ``A x = b`` for a square matrix with a narrow band once its rows and columns are ordered.

    Parameters
    ----------
    row, column, value : ndarray
        The entries that are not zero.
    row_order, column_order : ndarray (n,) of int
        The order of rows and columns in which the band is narrow.

    Raises
    ------
    MracadError
        The matrix is singular.

    Notes
    -----
    LAPACK ``gbtrf``: partial pivoting, so column scaling does not matter.
    """

    def __init__(self, row: Array, column: Array, value: Array, row_order: Array, column_order: Array) -> None:
        from scipy.linalg.lapack import dgbtrf

        self.row_order, self.column_order = row_order, column_order
        n = len(row_order)
        self._place = np.empty(n, dtype=int)
        self._place[column_order] = np.arange(n)
        place = np.empty(n, dtype=int)
        place[row_order] = np.arange(n)
        r, c = place[row], self._place[column]
        self._below, self._above = int((r - c).max(initial=0)), int((c - r).max(initial=0))
        band = np.zeros((2 * self._below + self._above + 1, n))
        band[self._below + self._above + r - c, c] = value
        self._factor, self._pivots, info = dgbtrf(band, self._below, self._above, overwrite_ab=1)
        if info:
            raise MracadError("a banded system is singular")

    @property
    def pivots(self) -> Array:
        """Magnitudes on the diagonal of the factor U, in column order."""
        return np.asarray(np.abs(self._factor[self._below + self._above]))

    def solve(self, b: Array, axis: int = 0, overwrite: bool = False, compiled: bool = False) -> Array:
        """The solution of ``A x = b`` along ``axis``; with ``overwrite`` it may overwrite ``b``.

        Few values are left to LAPACK, unless ``compiled`` code is wanted for them, too.
        """
        b = np.asarray(b, dtype=float)
        if compiled or b.size >= LARGE:
            x = b if overwrite else np.empty(b.shape)
            self._triangles.solve(b, axis % b.ndim, x)
            return x
        from scipy.linalg.lapack import dgbtrs

        moved = np.moveaxis(b, axis, 0)
        flat = moved.reshape(len(self.row_order), -1)[self.row_order]
        x, _ = dgbtrs(self._factor, self._below, self._above, flat, self._pivots)
        return np.moveaxis(x[self._place].reshape(moved.shape), 0, axis)

    @cached_property
    def _triangles(self) -> Triangles:
        from mracad.bspline.sweeps import Triangles

        n, below, reach = len(self.row_order), self._below, self._below + self._above
        # gbtrf leaves each multiplier in the row's place at its step: follow the rows to their final places.
        at = np.arange(n + below)
        owner = np.empty((n, below), dtype=int)
        for j, p in enumerate(self._pivots.tolist()):
            at[j], at[p] = at[p], at[j]
            owner[j] = at[j + 1 : j + 1 + below]
        final = np.empty(n + below, dtype=int)
        final[at] = np.arange(n + below)
        multipliers = self._factor[reach + 1 :].T
        column, k = np.nonzero(multipliers)
        lower = Rows.from_coo(final[owner[column, k]], column, multipliers[column, k], (n, n))
        k, column = np.nonzero(self._factor[:reach])
        upper = Rows.from_coo(column + k - reach, column, self._factor[k, column], (n, n))
        order = self.row_order[at[:n]], self.column_order
        return Triangles.of(order, lower, upper, 1.0 / self._factor[reach])
