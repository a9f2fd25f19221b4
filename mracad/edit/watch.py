"""Faces watched while displacements of their surfaces are tried: how much of each is allowed."""

from __future__ import annotations

from bisect import bisect_left
from collections import defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cache, cached_property
from typing import Any

import numpy as np

from mracad.bspline.surface import Net
from mracad.edit.tolerances import Tolerances
from mracad.inspect.ramp import Ramp
from mracad.inspect.roughness import Change, Roughness, Worse, between, worse
from mracad.inspect.survey import POINTS, Survey, surveys
from mracad.model.brep import Face

Array = np.ndarray

STEPS = 8, 32
"""Steps in which an amount is found: few among several displacements of one surface, otherwise more."""

LEAST = 1 / 32, 1 / 16
"""Amounts below all steps."""

PART, MEASURED = 0.25, 5
"""The part of a displacement that is measured where the whole is too much; how many amounts are measured at most."""

MANY = 400_000
"""Number of control points above which faces are surveyed again for every look: surveys take 1 kB for each."""

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
    targets : sequence of ndarray (nu, nv, 3), optional
        For each surface the displacement that is wanted if nothing is held, mm: faces may become as rough as that.
    """

    surfaces: Sequence[tuple[Net, Net, Sequence[Face]]]
    width: float
    reaches: Sequence[tuple[float, float]]
    points: int = POINTS
    targets: Sequence[Array] = ()

    @cached_property
    def owners(self) -> list[tuple[int, int]]:
        """Position of the surface of each face, and index of the face."""
        return [(place, face.index) for place, (*_, faces) in enumerate(self.surfaces) for face in faces]

    @cached_property
    def lasting(self) -> bool:
        """Whether what is known of faces is kept."""
        return sum(net.poles[..., 0].size for net, *_ in self.surfaces) <= MANY

    @cached_property
    def surveys(self) -> Sequence[Survey]:
        """The faces before the edit."""
        made = _Surveyed(self.surfaces, self.points, SINGULAR / self.width, self.reaches)
        return [*made] if self.lasting else made

    @cached_property
    def at_rest(self) -> dict[int, Mapping[int, Change]]:
        """The changes of the faces of each surface after none of a displacement, with those of places, once known."""
        return {}

    @cached_property
    def goals(self) -> dict[int, Roughness]:
        """The figures of faces after the wanted displacements, by face; none if these do not matter."""
        if not len(self.targets):
            return {}
        reached = self.ramp(self.targets).changes(dict.fromkeys(range(len(self.owners)), 1.0))
        return {self.owners[k][1]: change.after for k, change in reached.items()}

    def ramp(self, parts: Sequence[Array]) -> Ramp:
        """The faces along displacements of the surfaces."""
        return Ramp(self.surveys, [parts[place] for place, _ in self.owners], self.lasting)

    @cached_property
    def still(self) -> list[Mapping[int, Change]]:
        """The changes of the faces of each surface if nothing moves, by position of the surface."""
        found: list[dict[int, Change]] = [{} for _ in self.surfaces]
        for (place, face), survey in zip(self.owners, self.surveys, strict=True):
            found[place][face] = Change(survey.roughness, survey.roughness, survey.noise)
        return [*found]


@dataclass(frozen=True, eq=False)
class _Surveyed(Sequence[Survey]):
    """The faces of surfaces, each surveyed when asked for; attributes as for :class:`Watch`."""

    surfaces: Sequence[tuple[Net, Net, Sequence[Face]]]
    points: int
    singular: float
    reaches: Sequence[tuple[float, float]]

    @cached_property
    def _every(self) -> list[tuple[int, Face]]:
        return [(place, face) for place, (*_, faces) in enumerate(self.surfaces) for face in faces]

    @cached_property
    def _based(self) -> bool:
        return bool(np.isfinite(self.reaches).all())

    def __len__(self) -> int:
        return len(self._every)

    def __getitem__(self, k: Any) -> Any:
        place, face = self._every[k]
        net, base, _ = self.surfaces[place]
        bases = [base] if self._based else ()
        (found,) = surveys([(net, (face,))], self.points, self.singular, [self.reaches[place]], bases)
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
    _seen: dict[int, dict[float, Mapping[int, Change]]] = field(default_factory=lambda: defaultdict(dict))

    @cached_property
    def ramp(self) -> Ramp:
        """The faces along the displacements."""
        return self.watch.ramp(self.parts)

    def changes(self, amounts: Mapping[int, float]) -> dict[int, Mapping[int, Change]]:
        """The changes of the faces of each surface after the given amount of its displacement."""
        new = {i for i, amount in amounts.items() if amount not in self._seen[i]}
        those = [k for k, (place, _) in enumerate(self.watch.owners) if place in new]
        found: dict[int, dict[int, Change]] = {i: {} for i in new}
        for k, change in self.ramp.changes({k: amounts[self.watch.owners[k][0]] for k in those}).items():
            place, face = self.watch.owners[k]
            goal = self.watch.goals.get(face)
            found[place][face] = replace(change, goal=goal) if goal else change
        for i, faces in found.items():
            self._seen[i][amounts[i]] = faces
        return {i: self._seen[i][amount] for i, amount in amounts.items()}

    def measured(self, i: int) -> list[float]:
        """The amounts of the displacement of a surface that have been evaluated, increasing."""
        return sorted(self._seen[i])

    def about(self, i: int, amount: float) -> Mapping[int, Change]:
        """About the changes of the faces of a surface after an amount of its displacement, from those that are
        known."""
        seen = self._seen[i]
        if amount in seen:
            return seen[amount]
        seen[0.0] = self.watch.at_rest.get(i) or self.changes({i: 0.0})[i]
        self.watch.at_rest[i] = seen[0.0]
        return {face: between({at: faces[face] for at, faces in seen.items()}, amount) for face in seen[0.0]}


def amounts(
    tried: Tried, floor: Array, ceiling: Array, tolerances: Tolerances, steps: int = STEPS[1]
) -> tuple[list[float], list[Mapping[int, Change]], list[tuple[Worse, ...]]]:
    """For each surface the largest amount of its displacement that makes no face rougher.

    Where the ceiling is too much, a part of it is measured, and then only what will probably be the largest.

    Parameters
    ----------
    tried : Tried
    floor, ceiling : ndarray (surfaces,)
        Amounts below which nothing is done, and that must not be exceeded.
    tolerances : Tolerances
    steps : int
        The amount is found in this number of steps up to the ceiling; two more are very small. With 0,
        the ceiling is all that is tried.
    """
    search = _Search(tried, np.where(floor < ceiling, np.inf, 0.0), tolerances)
    for i, most in enumerate(ceiling):
        search.recall(i, float(most))
    search.measure(ceiling)
    if not steps or tolerances.whole:
        return search.low.tolist(), search.best, search.why
    search.measure(np.maximum(floor, PART * ceiling))
    for _ in range(MEASURED - 2):
        choices = (most * _choices(steps) for most in ceiling)
        search.measure(np.array([search.likely(i, each[each > floor[i]]) for i, each in enumerate(choices)]))
    return search.low.tolist(), search.best, search.why


@cache
def _choices(steps: int) -> Array:
    """Shares of a ceiling from which an amount is chosen."""
    return np.unique([*LEAST, *np.arange(1, steps) / steps])


class _Search:
    """The largest amounts that were allowed so far, ``low``, and the least that were not, ``high``."""

    def __init__(self, tried: Tried, high: Array, tolerances: Tolerances) -> None:
        self._tried = tried
        self._tolerances = tolerances
        self.low, self.high = np.zeros(len(high)), high
        self.best: list[Mapping[int, Change]] = [*tried.watch.still]
        self.why: list[tuple[Worse, ...]] = [()] * len(high)

    def measure(self, amounts: Array) -> None:
        """Measure an amount of the displacement of each surface, where it may be the largest allowed."""
        those = np.flatnonzero((self.low < amounts) & (amounts < self.high)).tolist()
        for i, faces in self._tried.changes({i: float(amounts[i]) for i in those}).items():
            self._take(i, float(amounts[i]), faces)

    def recall(self, i: int, most: float) -> None:
        """Take amounts of the displacement of a surface that were measured before, up to a ceiling."""
        for amount in self._tried.measured(i):
            if self.low[i] < amount < self.high[i] and amount <= most:
                self._take(i, amount, self._tried.changes({i: amount})[i])

    def _take(self, i: int, amount: float, faces: Mapping[int, Change]) -> None:
        wrong, far = _wrong(faces, self._tolerances)
        if wrong or far:
            self.high[i], self.why[i] = amount, self.why[i] or wrong
        else:
            self.low[i], self.best[i] = amount, faces

    def likely(self, i: int, choices: Array) -> float:
        """The largest of some increasing amounts of the displacement of a surface that will probably be allowed, if it
        was neither allowed nor refused; 0 for none."""
        inside = choices[(self.low[i] < choices) & (choices < self.high[i])].tolist()
        about, tolerances = self._tried.about, self._tolerances
        count = bisect_left(inside, True, key=lambda amount: any(_wrong(about(i, amount), tolerances)))
        return float(inside[count - 1]) if count else 0.0


def _wrong(faces: Mapping[int, Change], tolerances: Tolerances) -> tuple[tuple[Worse, ...], bool]:
    """The figures by which faces are rougher than allowed, and whether one moves too far."""
    wrong = tuple(w for each in faces.values() for w in worse(each, tolerances.growth))
    return wrong, any(each.deviation > tolerances.deviation * (1 + 1e-9) for each in faces.values())


def displaced(net: Net, offset: Array) -> Net:
    """The surface with control points moved by ``(nu, nv, 3)``, mm."""
    return net.with_poles(net.poles + offset)
