"""How much worse the result of an edit may be: shared by conditions, the judge and the verdict on a document."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from mracad.brief import line
from mracad.inspect.roughness import Growth
from mracad.model.brep import Edge, Model
from mracad.spec.quantity import length
from mracad.spec.steps import Fitting, Selection

ANGLE = 0.01
"""Allowed growth of an angle along an edge or a knot line, degrees: of a closing line, which is both, too."""

GROWTH = Growth(0.005, 0.005, 0.005, ANGLE, 30.0, 0.25)
"""Growth that the judge allows by default: a quarter of the 2 % that count as worse in comparisons, and waves at a
place an eighth larger than those around it."""

NOISY = replace(GROWTH, singular=0.25, each=False, spread=np.inf)
"""Growth that the judge allows if noise is removed: kinks and singular points that noise makes are random, and so is
where it makes places smoother; that noise goes rather than shape, its risk tells."""

RESHAPED = Growth(np.inf, np.inf, np.inf, np.inf, 30.0, np.inf)
"""Growth that the judge allows if an edit changes the shape of faces: they must not fold."""

TURNED = replace(RESHAPED, fold=90.0)
"""The same if normals may turn, too: not beyond a right angle."""
COARSE = replace(RESHAPED, fold=135.0)
"""Growth that the judge allows if the coarse shape of faces is wanted: it must not fold, which turns normals over, but
where it leaves a nose out they turn by a right angle and more."""

CALM = replace(GROWTH, fold=135.0, singular=np.inf, each=False, spread=np.inf)
"""The same if what is held must not make it rougher than the face or the coarse shape."""

RESTORED = replace(RESHAPED, fold=np.inf)
"""Growth that the judge allows if what was there before comes back: any."""

MORE = 0.02
"""Share by which the gap of an edge may grow if it is already as wide as allowed."""


@dataclass(frozen=True)
class Tolerances:
    """How much worse a result may be.

    Attributes
    ----------
    gap : float
        Allowed growth of the gap of a seam that moves along a trim curve, mm; the upper limit for any other edge.
    least : float
        Gap that any edge may have, mm, however exact it was.
    angle, bend : float
        Allowed growth of the angle (radians) and of the curvature (over the wavelength of the edit) along an edge.
    jump : float
        Largest jump of curvature along an edge, over the wavelength, that counts as none: larger ones would show.
    growth : Growth
        Of roughness.
    deviation : float
        Largest deviation along the normal, mm.
    fairer : bool
        Whether faces must get fairer to be touched.
    whole : bool
        Whether a change is made in full or not at all.
    """

    gap: float = 1e-4
    least: float = 1e-5
    angle: float = math.radians(ANGLE)
    bend: float = 1e-3
    jump: float = 1e-2
    growth: Growth = GROWTH
    deviation: float = np.inf
    fairer: bool = True
    whole: bool = False

    __repr__ = line

    def contact(self, width: float) -> tuple[float, float, float]:
        """Gap (mm), angle and curvature (1/mm) of a seam along a trim curve, for an edit of a wavelength (mm)."""
        return self.gap, self.angle, self.bend / width

    def wider(self, edge: Edge, gap: float) -> float:
        """Allowed growth (mm) of the ``gap`` (mm) of an edge that stays: up to the edge's own tolerance."""
        return max(min(max(edge.tolerance, self.least), self.gap) - gap, MORE * gap)


def tolerances(model: Model, options: Selection) -> Tolerances:
    """How much worse an edit of a model may be.

    Raises
    ------
    UsageError
        For an invalid length.
    """
    if not isinstance(options, Fitting):
        return Tolerances()
    gap = length(options.gap_tolerance, model.diagonal, "gap-tolerance")
    bound = options.max_deviation
    deviation = np.inf if bound is None else length(bound, model.diagonal, "max-deviation")
    return Tolerances(gap, deviation=deviation)
