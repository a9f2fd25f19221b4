"""Sparse positive definite systems: band Cholesky where the band is narrow, as on small nets of surfaces."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from typing import Any

import numpy as np

from mracad.seam.bands import BROAD, Bands, Cholesky
from mracad.seam.fronts import Fronts

Array = np.ndarray

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
        self._solve: Callable[[Array], Array] = np.asarray
        matrix = matrix.tocsr()
        if not matrix.shape[0]:
            return
        bands = Bands([matrix], places)
        with suppress(np.linalg.LinAlgError):
            if bands.width >= BROAD and places is not None:
                self._solve = Fronts(matrix, places)
                return
            if bands.narrow and (lower := bands.lower[0]) is not None:
                self._solve = Cholesky(bands, lower)
                return
        self._solve = nested(matrix)

    def __call__(self, right: Array) -> Array:
        """The solution for a right-hand side ``(n, k)``."""
        return self._solve(right) if right.size else right


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
