"""What the result of an edit may be worse in: one answer for conditions, the judge and the verdict on a document."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from mracad.inspect.roughness import Growth
from mracad.model.brep import Edge, Model
from mracad.spec.quantity import length
from mracad.spec.steps import Fitting, Selection

GROWTH = Growth(0.005, 0.005, 0.005, 0.02, 30.0, 0.25)
"""What the judge lets pass by default: a quarter of the 2 % that count as worse where faces are compared, and waves
at a place of an eighth more than about it."""

RESHAPED = Growth(np.inf, np.inf, np.inf, np.inf, 30.0, np.inf)
"""What the judge lets pass where an edit changes what faces are: they must not fold."""

MORE = 0.02
"""Share by which an edge may gape more that gapes as far as it may."""


@dataclass(frozen=True)
class Tolerances:
    """What a result may be worse in.

    Attributes
    ----------
    gap : float
        Of a seam that moves along a trim curve, mm: by how much it may gape more; most that any other edge may.
    least : float
        What any edge may gape, mm, however exact it is.
    angle, bend : float
        By which the angle (radians) and the curvature (over the wavelength of the edit) along an edge may grow.
    jump : float
        Jumps of curvature along edges, over the wavelength, that count for none: more shows beside them.
    growth : Growth
        Of roughness.
    deviation : float
        Largest deviation along the normal, mm.
    fairer : bool
        Whether faces must get fairer to be touched.
    """

    gap: float = 1e-4
    least: float = 1e-5
    angle: float = math.radians(0.01)
    bend: float = 1e-3
    jump: float = 1e-2
    growth: Growth = GROWTH
    deviation: float = np.inf
    fairer: bool = True

    def contact(self, width: float) -> tuple[float, float, float]:
        """Gap (mm), angle and curvature (1/mm) of a seam along a trim curve, for an edit of a wavelength (mm)."""
        return self.gap, self.angle, self.bend / width

    def wider(self, edge: Edge, gap: float) -> float:
        """By how much an edge that gapes by ``gap`` (mm) may gape more where it stays, mm: up to its own tolerance."""
        return max(min(max(edge.tolerance, self.least), self.gap) - gap, MORE * gap)


def tolerances(model: Model, options: Selection) -> Tolerances:
    """What an edit of a model may be worse in.

    Raises
    ------
    UsageError
        For a length that is none.
    """
    if not isinstance(options, Fitting):
        return Tolerances()
    gap = length(options.gap_tolerance, model.diagonal, "gap-tolerance")
    bound = options.max_deviation
    deviation = np.inf if bound is None else length(bound, model.diagonal, "max-deviation")
    return Tolerances(gap, deviation=deviation)
