"""Sparse symmetric positive definite systems."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

Array = np.ndarray


def definite(matrix: Any) -> Callable[[Array], Array]:
    """Multiplication of ``(n, k)`` by the inverse of a sparse symmetric positive definite matrix.

    SuperLU in minimum-degree order, without the pivoting that such a matrix does not need and that would fill it.
    """
    from scipy.sparse.linalg import splu

    factor = splu(matrix.tocsc(), permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options={"SymmetricMode": True})
    solve: Callable[[Array], Array] = factor.solve
    return solve
