"""Minima of the one solver under conditions that join the three coordinates: edges that slide along a neighbour.

The solver works on each coordinate alone, with one symmetric operator P that takes the pull b on control points to
their displacement.  A condition

    nᵀ (Φ δ) = r,      Φ a row of basis functions, n a direction,

joins the coordinates.  There are few such conditions, so the displacement under all of them follows from P by

    δ = P b + P Φᵀ (n ∘ μ),      (W⁻¹ + (Φ P Φᵀ) ∘ (n nᵀ)) μ = r − nᵀ Φ P b

(∘ entry by entry; W the weights of conditions that need not be exact, W⁻¹ = 0 for exact ones).
The matrix is positive semidefinite, as the entrywise product of two such matrices.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from mracad.seam.constrained import MET, SLACK, Banded, Constrained
from mracad.seam.divided import Divided

Array = np.ndarray

PASSES = 12
"""Largest number of proximal passes: conditions may depend on each other."""


@dataclass(frozen=True, eq=False)
class Guides:
    """Conditions that join the coordinates.

    Attributes
    ----------
    matrix : scipy.sparse.csr_array (conditions, points)
        Φ.
    ways : ndarray (conditions, 3)
        n.
    slack : ndarray (conditions,)
        W⁻¹; 0 for exact ones.
    goal : ndarray (conditions,)
        r, mm.
    """

    matrix: Any
    ways: Array
    slack: Array
    goal: Array

    def of(self, delta: Array) -> Array:
        """nᵀ Φ δ of a displacement ``(points, 3)``, ``(conditions,)``."""
        return np.asarray(((self.matrix @ delta) * self.ways).sum(axis=1))


class Guided:
    """A solver under conditions that join the coordinates besides its own.

    Parameters
    ----------
    base : Banded, Constrained or Divided
    guides : Guides
    """

    def __init__(self, base: Banded | Constrained | Divided, guides: Guides, response: Array | None = None) -> None:
        from scipy.linalg import cho_factor

        self.base, self.guides = base, guides
        self.response = base(guides.matrix.T.toarray()) if response is None else response
        alone = guides.matrix @ self.response
        self.form = (alone + alone.T) / 2 * (guides.ways @ guides.ways.T) + np.diag(guides.slack)
        least = SLACK * max(float(self.form.diagonal().max(initial=0.0)), 1e-300)
        self._factor = cho_factor(self.form + least * np.eye(len(self.form)), lower=True)

    def __call__(
        self, right: Array, start: Array | None = None, goal: Array | None = None, exactly: bool = True
    ) -> Array:
        """x − start, of which b is the right-hand side; see :class:`mracad.seam.constrained.Constrained`."""
        found = self.base(right, start, goal, exactly)
        return self._led(found, found if start is None else start + found)

    def settled(self, x: Array) -> Array:
        """A point near x, ``(n, 3)``, that meets the conditions with r = 0."""
        near = self.base.settled(x)
        return self._led(near, near)

    def aimed(self, ways: Array, goal: Array) -> Guided:
        """The same solver with other directions and goals."""
        return Guided(self.base, replace(self.guides, ways=ways, goal=goal), self.response)

    def _led(self, found: Array, whole: Array) -> Array:
        """A displacement corrected so that ``whole``, of which it is a part, meets the conditions."""
        from scipy.linalg import cho_solve

        ways = self.guides.ways
        lacking = self.guides.goal - self.guides.of(whole)
        enough = MET * max(float(np.abs(whole).max(initial=0.0)), 1e-300)
        pull, left = np.zeros_like(lacking), lacking
        for _ in range(PASSES):
            pull = pull + cho_solve((self._factor[0], True), left)
            left = lacking - self.form @ pull
            if np.abs(left).max(initial=0.0) <= enough:
                break
        return np.asarray(found + self.response @ (pull[:, None] * ways))
