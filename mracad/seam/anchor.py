"""Displacements that move points to their goals and change as little as possible.

Of all displacements that seams and rims allow, with δ(u_i, v_i) = d_i at some points, the one with the least

    δᵀ B M⁻¹ B δ,      B = M + 2 ℓ² G + ℓ⁴ K,

M, G and K of the values, gradients and second derivatives of δ: ∫ |(1 − ℓ² ∇²)² δ|² on a plane.  With Φ the rows of
basis functions at the points and P = B⁻¹ on the control points that may move, it is

    δ = P M P Φᵀ μ,      (Φ P M P Φᵀ) μ = d,

one column of the response P M P Φᵀ per point: on a plane the kernel with the spectrum 1 / (1 + (ℓ k)²)⁴, which is
(r/ℓ)³ K₃(r/ℓ) / 8, K₃ the modified Bessel function.  It is smooth at its point, where that of P alone has infinite
curvature, never changes its sign, as it would without G, and falls off like exp(−r/ℓ).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from mracad.bspline.functions import functions
from mracad.seam.solve import Problem

Array = np.ndarray

ALONE = 1 / (12 * np.pi)
"""The kernel at its point on a plane, times ℓ²."""

PASSES = 3
"""How often the remaining error is corrected."""


@dataclass(frozen=True, eq=False)
class Anchors:
    """Points with goals for a displacement.

    Attributes
    ----------
    matrix : scipy.sparse.csr_array (anchors, points)
        Φ.
    response : ndarray (points, anchors)
        P M P Φᵀ.
    form : ndarray (anchors, anchors)
        Φ P M P Φᵀ.
    freedom : ndarray (anchors,)
        Its diagonal, over that on a plane where nothing is held.
    """

    matrix: Any
    response: Array
    form: Array
    freedom: Array

    @classmethod
    def of(cls, problem: Problem, places: dict[int, Array], stiffness: float) -> Anchors:
        """Anchors at parameters ``(k, 2)`` by surface, in the order of the problem; ``stiffness`` is ℓ⁴, mm⁴."""
        matrix = _rows(problem, places)
        response = problem.response(matrix, stiffness)
        form = np.asarray(matrix @ response)
        form = (form + form.T) / 2
        return cls(matrix, response, form, form.diagonal() * stiffness**0.5 / ALONE)

    def led(self, delta: Array, goal: Array) -> Array:
        """A displacement ``(points, 3)`` with the least correction that takes anchors to their goals ``(anchors, 3)``,
        mm."""
        scale = 1 / np.sqrt(self.form.diagonal())
        inverse = np.linalg.pinv(self.form * scale * scale[:, None], rcond=1e-13, hermitian=True)
        for _ in range(PASSES):
            lacking = goal - self.matrix @ delta
            delta = delta + self.response @ (scale[:, None] * (inverse @ (scale[:, None] * lacking)))
        return np.asarray(delta)


def _rows(problem: Problem, places: dict[int, Array]) -> Any:
    """Φ, ``scipy.sparse.csr_array``."""
    from scipy.sparse import csr_array

    index, values, begin = [], [], 0
    for i, space in problem.spaces.items():
        if i in places:
            found, table = functions(space.net, places[i], 0)
            index += list(found + begin)
            values += list(table[0])
        begin += space.free.size
    row = np.repeat(np.arange(len(index)), [len(each) for each in index])
    return csr_array((np.concatenate(values), (row, np.concatenate(index))), shape=(len(index), begin))
