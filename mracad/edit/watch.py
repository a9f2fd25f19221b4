"""Faces watched while displacements of their surfaces are tried: how much of each is allowed."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from mracad.bspline.surface import Net
from mracad.edit.tolerances import Tolerances
from mracad.inspect.ramp import Ramp
from mracad.inspect.roughness import Change, Worse, worse
from mracad.inspect.survey import POINTS, Survey, surveys
from mracad.model.brep import Face

Array = np.ndarray

BISECTIONS = 3, 5
"""Bisections by which an amount is found: few among several displacements of one surface, otherwise more."""

SINGULAR = 1e5
"""Curvature over the wavelength above which a face is singular."""


@dataclass(frozen=True, eq=False)
class Watch:
    """The faces of surfaces, surveyed one by one when first needed.

    Attributes
    ----------
    surfaces : sequence of (Net, Net, sequence of Face)
        Surfaces before an edit, their bases and faces.
    width : float
        The edit removes waves up to this length, mm.
    reaches : sequence of (float, float)
        Distances within which the edit spreads changes of each surface along u and v, mm.
    points : int
        Points per span.
    """

    surfaces: Sequence[tuple[Net, Net, Sequence[Face]]]
    width: float
    reaches: Sequence[tuple[float, float]]
    points: int = POINTS

    @cached_property
    def owners(self) -> list[tuple[int, int]]:
        """Position of the surface of each face, and index of the face."""
        return [(place, face.index) for place, (*_, faces) in enumerate(self.surfaces) for face in faces]

    @cached_property
    def surveys(self) -> Sequence[Survey]:
        """The faces before the edit."""
        both = zip(self.surfaces, self.reaches, strict=True)
        every = [(net, base, face, reach) for (net, base, faces), reach in both for face in faces]
        looked = [(net, (face,)) for net, _, face, _ in every]
        bases = [base for _, base, *_ in every] if np.isfinite(self.reaches).all() else ()
        return surveys(looked, self.points, SINGULAR / self.width, [reach for *_, reach in every], bases)

    def ramp(self, parts: Sequence[Array]) -> Ramp:
        """The faces along displacements of the surfaces."""
        return Ramp(self.surveys, [parts[place] for place, _ in self.owners])

    def still(self) -> list[dict[int, Change]]:
        """The changes of the faces of each surface if nothing moves, by position of the surface."""
        found: list[dict[int, Change]] = [{} for _ in self.surfaces]
        for (place, face), survey in zip(self.owners, self.surveys, strict=True):
            found[place][face] = Change(survey.roughness, survey.roughness, survey.noise)
        return found


@dataclass(frozen=True, eq=False)
class Tried:
    """Displacements of surfaces; each amount is evaluated once.

    Attributes
    ----------
    watch : Watch
    nets : sequence of Net
    parts : sequence of ndarray (nu, nv, 3)
        The whole displacements, mm.
    """

    watch: Watch
    nets: Sequence[Net]
    parts: Sequence[Array]
    _seen: dict[tuple[int, float], Mapping[int, Change]] = field(default_factory=dict)

    @cached_property
    def ramp(self) -> Ramp:
        """The faces along the displacements."""
        return self.watch.ramp(self.parts)

    def changes(self, amounts: Mapping[int, float]) -> dict[int, Mapping[int, Change]]:
        """The changes of the faces of each surface after the given amount of its displacement."""
        new = {i for i, amount in amounts.items() if (i, amount) not in self._seen}
        those = [k for k, (place, _) in enumerate(self.watch.owners) if place in new]
        found: dict[int, dict[int, Change]] = {i: {} for i in new}
        for k, change in self.ramp.changes({k: amounts[self.watch.owners[k][0]] for k in those}).items():
            place, face = self.watch.owners[k]
            found[place][face] = change
        self._seen.update({(i, amounts[i]): faces for i, faces in found.items()})
        return {i: self._seen[i, amount] for i, amount in amounts.items()}


def amounts(
    tried: Tried, floor: Array, ceiling: Array, tolerances: Tolerances, steps: int = BISECTIONS[1]
) -> tuple[list[float], list[Mapping[int, Change]], list[tuple[Worse, ...]]]:
    """For each surface the largest amount of its displacement that makes no face rougher, by bisection.

    Parameters
    ----------
    tried : Tried
    floor, ceiling : ndarray (surfaces,)
        Amounts below which nothing is done, and that must not be exceeded.
    tolerances : Tolerances
    steps : int
        Bisections.
    """
    low, high = np.zeros(len(floor)), np.where(floor < ceiling, ceiling, 0.0)
    best: list[Mapping[int, Change]] = [*tried.watch.still()]
    why: list[tuple[Worse, ...]] = [()] * len(floor)
    for step in range(steps + 1):
        test = high if not step else np.where(low < floor, floor, (low + high) / 2)
        now = {i: float(test[i]) for i in np.flatnonzero(low < high).tolist()}
        for i, faces in tried.changes(now).items():
            wrong = tuple(w for each in faces.values() for w in worse(each, tolerances.growth))
            far = any(each.deviation > tolerances.deviation * (1 + 1e-9) for each in faces.values())
            if wrong or far:
                high[i], why[i] = (now[i] if now[i] > floor[i] else 0.0), why[i] or wrong
            else:
                low[i], best[i] = now[i], faces
    return low.tolist(), best, why


def displaced(net: Net, offset: Array) -> Net:
    """The surface with control points moved by ``(nu, nv, 3)``, mm."""
    return net.with_poles(net.poles + offset)
