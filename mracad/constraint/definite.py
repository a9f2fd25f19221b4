"""Sparse symmetric positive definite systems."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

Array = np.ndarray


FLOOR = 1e-14
"""Added to the unit diagonal of the scaled matrix, which rounding may have made singular."""


def definite(matrix: Any) -> Callable[[Array], Array]:
    """Multiplication of ``(n, k)`` by the inverse of a sparse symmetric positive definite matrix.

    Scaled to a unit diagonal; SuperLU in minimum-degree order, without the pivoting that such a matrix does not need
    and that would fill it.
    """
    from scipy.sparse import diags_array, eye_array
    from scipy.sparse.linalg import splu

    scale = 1.0 / np.sqrt(matrix.diagonal())
    scaled = diags_array(scale) @ matrix @ diags_array(scale) + FLOOR * eye_array(len(scale))
    factor = splu(scaled.tocsc(), permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options={"SymmetricMode": True})
    return lambda right: scale[:, None] * factor.solve(scale[:, None] * right)
