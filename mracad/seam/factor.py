"""Sparse positive definite systems: band Cholesky where the band is narrow, as on small nets of surfaces."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from typing import Any

import numpy as np

from mracad.seam.fronts import Fronts

Array = np.ndarray

WIDEST = 50.0
"""Largest bandwidth, over the fourth root of the number of unknowns, for which a band is faster than nested
dissection."""

BROAD = 400
"""Smallest bandwidth for which the fronts of a net are faster than a band."""

LOST = 1e-9
"""Relative residual allowed after one refinement; factors that leave more need pivoting."""


class Definite:
    """The factor of a matrix.

    Parameters
    ----------
    matrix : scipy.sparse matrix (n, n)
        Symmetric positive definite, up to rounding.
    places : ndarray (n, 2) of int, optional
        Places of the unknowns on a net: only near ones depend on each other.
    """

    def __init__(self, matrix: Any, places: Array | None = None) -> None:
        from scipy.linalg.lapack import dpbtrf

        matrix = matrix.tocsr()
        self._band: Array | None = None
        self._other: Callable[[Array], Array] = np.asarray
        if not matrix.shape[0]:
            return
        self._order, width = _ordered(matrix)
        if width >= BROAD and places is not None:
            with suppress(np.linalg.LinAlgError):
                self._other = Fronts(matrix, places)
                return
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
        ordered = right if self._order is None else right[self._order]
        found = dpbtrs(self._band, np.array(ordered, order="F"), lower=1, overwrite_b=1)[0]
        if self._order is None:
            return np.ascontiguousarray(found)
        whole = np.empty_like(right)
        whole[self._order] = found
        return whole


def nested(matrix: Any) -> Callable[[Array], Array]:
    """Solve with sparse factors of a symmetric matrix: without pivoting, unless refinement then fails."""
    from scipy.sparse.linalg import splu

    matrix = matrix.tocsc()
    right, lost = np.asarray(matrix @ np.sin(np.arange(matrix.shape[0]))), np.inf
    with np.errstate(invalid="ignore", over="ignore"), suppress(RuntimeError):  # of a pivot that is zero
        factor = splu(matrix, permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options={"SymmetricMode": True})
        found = factor.solve(right)
        found += factor.solve(right - matrix @ found)
        lost = np.abs(matrix @ found - right).max(initial=0.0)
    if not lost <= LOST * np.abs(right).max(initial=0.0):
        factor = splu(matrix, permc_spec="COLAMD", diag_pivot_thresh=1.0)
    return lambda right: np.asarray(factor.solve(right))


def _ordered(matrix: Any) -> tuple[Array | None, int]:
    """The order of unknowns with the narrower band, as given (None) or Cuthill-McKee, and its bandwidth."""
    from scipy.sparse.csgraph import reverse_cuthill_mckee

    row = np.repeat(np.arange(matrix.shape[0]), np.diff(matrix.indptr))
    width = int(np.abs(row - matrix.indices).max(initial=0))
    order = reverse_cuthill_mckee(matrix, symmetric_mode=True)
    place = _places(order)
    other = int(np.abs(place[row] - place[matrix.indices]).max(initial=0))
    return (order, other) if other < width else (None, width)


def _places(order: Array) -> Array:
    place = np.empty(len(order), int)
    place[order] = np.arange(len(order))
    return place


def _band(matrix: Any, order: Array | None, width: int) -> Array:
    """The lower half of a matrix in an order as LAPACK stores bands, ``(width + 1, n)``."""
    n = matrix.shape[0]
    row, column = np.repeat(np.arange(n), np.diff(matrix.indptr)), matrix.indices
    if order is not None:
        place = _places(order)
        row, column = place[row], place[column]
    lower = row >= column
    band = np.zeros((n, width + 1))
    band[column[lower], (row - column)[lower]] = matrix.data[lower]
    return band.T
