"""Minima over many joined surfaces, by subspaces: insides of surfaces alternating with strips along their joints.

The effect of a joint on a surface fades within the length ℓ of the filter, or within a few knot spans.  So we take the
minimum over the control points without joints, surface by surface, then over a strip along every joint under its
conditions, then over the insides again, until the corrections are small: a multiplicative Schwarz method, whose error
falls by about e^(−√2 w / ℓ) in every sweep, w the width of the strips.  Every step lowers the objective.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from mracad.seam.along import Along
from mracad.seam.constrained import part
from mracad.seam.factor import Definite
from mracad.seam.strips import Division

Array = np.ndarray

LEFT = 1e-4
"""Share of the first strips' correction that may remain."""

SWEEPS = 20
"""Largest number of sweeps; one or two are usually enough."""


class Divided(Along):
    """The same as :class:`mracad.seam.constrained.Constrained`, for many surfaces.

    Parameters
    ----------
    form, diagonal, soft, rows, free, division
        See :class:`mracad.seam.along.Along`.
    left : float
        Share of the first strips' correction that may remain.
    """

    def __init__(
        self,
        form: Callable[[int], Any],
        diagonal: Array,
        soft: Any,
        rows: Any,
        free: Array,
        division: Division,
        left: float = LEFT,
    ) -> None:
        from scipy.sparse import vstack

        self.left = left
        self.insides: list[tuple[Array, Definite]] = []
        self._firm: list[Any] = []
        super().__init__(form, diagonal, soft, rows, free, division)
        self.tied_form = vstack(self._firm, format="csr")
        del self._firm
        place = np.empty(self.size, int)
        place[self.about] = np.arange(len(self.about))
        self.at = place[self.tied]
        self.inner = np.flatnonzero(~np.isin(self.about, self.tied))

    def _asked(self, making: Any, surface: int) -> bool:
        return True

    def _take(self, begin: int, form: Any, inside: Array, firm: Any) -> None:
        self.insides.append((begin + inside, Definite(part(form, inside))))
        self._firm.append(firm)

    def __call__(
        self, right: Array, start: Array | None = None, goal: Array | None = None, exactly: bool = True
    ) -> Array:
        """x − start, of which b is the right-hand side; see :class:`mracad.seam.constrained.Constrained`."""
        b, owed, size = self.scale[:, None] * right, self._wanted(goal, right.shape[1]), 0.0
        if start is not None:
            scaled = self._scaled(start)
            owed -= self.rows @ scaled
            size = float(np.abs(scaled).max(initial=0.0))
        begun = self.met(owed, size, b) if owed.any() else None
        found = self._within(b)
        if begun is not None:
            found += begun
        if exactly and len(owed):
            found += self.met(owed - self.rows @ found, max(size, float(np.abs(found).max(initial=0.0))))
        found *= self.scale[:, None]
        return found

    def _within(self, right: Array) -> Array:
        """The minimum under L x = 0, up to the remainder of one pass; overwrites the right-hand side."""
        found, left = right, np.zeros((len(self.about), right.shape[1]))
        left[self.at] = found[self.tied]
        found[self.tied] = 0.0
        self._inside(found)
        left[self.at] -= self.tied_form @ found
        first = np.linalg.norm(left)
        for sweep in range(SWEEPS):
            for colour in self.colours[:: 1 - 2 * (sweep % 2)]:
                moved = colour(left[colour.points])
                left[colour.points] = 0.0
                left -= colour.outside @ moved
                found[self.about[colour.points]] += moved
            rest = np.zeros_like(found)
            rest[self.about[self.inner]] = left[self.inner]
            self._inside(rest)
            found += rest
            left[self.inner] = 0.0
            left[self.at] -= self.tied_form @ rest
            if np.linalg.norm(left) <= self.left * first:
                break
        return found

    def _inside(self, x: Array) -> None:
        """Overwrite the right-hand side with the minimum over the points without joints."""
        for points, factor in self.insides:
            x[points] = factor(x[points])
