"""Solutions of sparse positive definite systems: by band Cholesky where a band is narrow, as on nets of surfaces."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

Array = np.ndarray

WIDEST = 50.0
"""Widest band, over the fourth root of the number of unknowns, that takes less time than nested elimination."""


class Definite:
    """The factor of a matrix.

    Parameters
    ----------
    matrix : scipy.sparse matrix (n, n)
        Symmetric, positive definite; one that rounding made indefinite is borne.
    """

    def __init__(self, matrix: Any) -> None:
        from scipy.linalg.lapack import dpbtrf

        matrix = matrix.tocsr()
        self._band: Array | None = None
        self._other: Callable[[Array], Array] = np.asarray
        if not matrix.shape[0]:
            return
        self._order, width = _ordered(matrix)
        if width <= WIDEST * matrix.shape[0] ** 0.25:
            band, failed = dpbtrf(_band(matrix, self._order, width), lower=1, overwrite_ab=1)
            self._band = None if failed else band
        if self._band is None:
            self._other = nested(matrix)

    def __call__(self, right: Array) -> Array:
        """The solution for a right-hand side ``(n, k)``."""
        from scipy.linalg.lapack import dpbtrs

        if not right.size:
            return right
        if self._band is None:
            return self._other(right)
        found = np.empty_like(right)
        found[self._order] = dpbtrs(self._band, np.asfortranarray(right[self._order]), lower=1, overwrite_b=1)[0]
        return found


def nested(matrix: Any) -> Callable[[Array], Array]:
    """Solutions with a symmetric matrix that needs no pivoting, by sparse factors."""
    from scipy.sparse.linalg import splu

    factor = splu(matrix.tocsc(), permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options={"SymmetricMode": True})
    return lambda right: np.asarray(factor.solve(right))


def _ordered(matrix: Any) -> tuple[Array, int]:
    """The order of the unknowns in which a band is narrower, as they come or by Cuthill and McKee, and its width."""
    from scipy.sparse.csgraph import reverse_cuthill_mckee

    n = matrix.shape[0]
    row = np.repeat(np.arange(n), np.diff(matrix.indptr))
    found = []
    for order in (np.arange(n), reverse_cuthill_mckee(matrix, symmetric_mode=True)):
        place = np.empty(n, int)
        place[order] = np.arange(n)
        found.append((int(np.abs(place[row] - place[matrix.indices]).max(initial=0)), order))
    width, order = min(found, key=lambda each: each[0])
    return order, width


def _band(matrix: Any, order: Array, width: int) -> Array:
    """The lower half of a matrix in an order as LAPACK stores bands, ``(width + 1, n)``."""
    n = matrix.shape[0]
    place = np.empty(n, int)
    place[order] = np.arange(n)
    row, column = place[np.repeat(np.arange(n), np.diff(matrix.indptr))], place[matrix.indices]
    lower = row >= column
    band = np.zeros((n, width + 1))
    band[column[lower], (row - column)[lower]] = matrix.data[lower]
    return band.T
