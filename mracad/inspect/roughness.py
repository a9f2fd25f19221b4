"""How rough faces are, and whether an edit made them rougher: the figures and their verdict."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from enum import Enum
from operator import attrgetter, mul
from typing import Any

import numpy as np

from mracad.inspect.places import Placed

Array = np.ndarray


class Rougher(Enum):
    """The figure in which a face got worse."""

    BENDING = "bending"
    VARIATION = "curvature variation"
    CURVATURE = "largest curvature"
    KINK = "kink"
    FOLD = "fold"
    SINGULAR = "singular point"
    SPREAD = "new waves in smooth places"


SUMS = {Rougher.BENDING: "bending", Rougher.VARIATION: "variation"}
"""Figures that are integrals over a face, and their names."""

SETTLED = 0.005
"""Share by which the curvature at singular points may change."""


@dataclass(frozen=True)
class Roughness:
    """Figures of the faces of one surface, inside their trims.

    Attributes
    ----------
    area : float
        Area, mm².
    bending : float
        ∫ κ₁² + κ₂² dA.
    variation : float
        ∫ |∇H|² dA, H the mean curvature, 1/mm².
    curvature : float
        Largest |κ₁| or |κ₂|, 1/mm, less the possible effect of rounding.
    kink : float
        Largest angle between the normals on the two sides of a knot line, degrees.
    """

    area: float = 0.0
    bending: float = 0.0
    variation: float = 0.0
    curvature: float = 0.0
    kink: float = 0.0


@dataclass(frozen=True)
class Change:
    """What an edit did to the faces of one surface.

    Attributes
    ----------
    before, after : Roughness
    noise : Roughness
        The figures of a negligible ripple, see :data:`mracad.inspect.survey.RIPPLE`; ``kink`` is its steepest slope.
    opened : float
        Largest growth of the angle across a knot line, degrees.
    turn : float
        Largest angle between the normals before and after, degrees; where noise is removed, to the nearest normal
        before within a knot span.
    deviation : float
        Largest motion along the normal, mm.
    motion : float
        Largest motion, mm.
    unsettled : float
        Largest relative change of the curvature at singular points that stay singular.
    placed : Placed, optional
        Changes of its places.
    goal : Roughness, optional
        The figures of what was asked for, which it may reach however smooth the face was.
    """

    before: Roughness
    after: Roughness
    noise: Roughness
    opened: float = 0.0
    turn: float = 0.0
    deviation: float = 0.0
    motion: float = 0.0
    unsettled: float = 0.0
    placed: Placed | None = None
    goal: Roughness | None = None

    def start(self, figure: str) -> float:
        """A figure before, or of what was asked for if that is larger."""
        before = float(getattr(self.before, figure))
        return before if self.goal is None else max(before, float(getattr(self.goal, figure)))

    @property
    def spread(self) -> float:
        """Largest relative excess of bending or curvature variation of a place over the largest around it before."""
        return 0.0 if self.placed is None else float(self.placed.spread.max(initial=0.0))

    @property
    def lost(self) -> float:
        """Largest share of bending or curvature variation that a place lost."""
        return 0.0 if self.placed is None else float(self.placed.lost.max(initial=0.0))

    @property
    def fairer(self) -> float:
        """The mean, by area, of the shares that places lost; gains are negative."""
        if self.placed is None or not self.placed.area.any():
            return 0.0
        return float((self.placed.lost * self.placed.area).sum() / self.placed.area.sum())

    def undone(self) -> Change:
        """No change instead."""
        return Change(self.before, self.before, self.noise)


@dataclass(frozen=True)
class Growth:
    """How much rougher an edit may make a face.

    Attributes
    ----------
    bending, variation, curvature : float
        Relative growth.
    kink : float
        Allowed growth of an angle across a knot line, degrees.
    fold : float
        Allowed turn of a normal, degrees.
    spread : float
        Relative excess allowed for the figures of a place over the largest around it before.
    singular : float
        Share by which the curvature at singular points may change.
    each : bool
        Whether no angle across a knot line may grow; otherwise only the largest of a face is limited, because noise
        opens them at random.
    """

    bending: float = 0.0
    variation: float = 0.0
    curvature: float = 0.0
    kink: float = 0.0
    fold: float = 30.0
    spread: float = 0.0
    singular: float = SETTLED
    each: bool = True


@dataclass(frozen=True)
class Worse:
    """One figure of a face that got worse, before and after; for a fold 0 and the angle (degrees), for a singular point
    0 and the relative change of its curvature, for a place 1 and its figure over the largest around it before."""

    what: Rougher
    before: float
    after: float


def worse(change: Change, allowed: Growth) -> tuple[Worse, ...]:
    """The figures by which a change made faces rougher than allowed, in the order of :class:`Rougher`."""
    before, after, noise = change.before, change.after, change.noise
    found = [
        Worse(what, getattr(before, figure), getattr(after, figure))
        for what, figure in SUMS.items()
        if _grown(change, figure, allowed)
    ]
    if after.curvature > _most(change.start("curvature"), allowed.curvature) + noise.curvature:
        found.append(Worse(Rougher.CURVATURE, before.curvature, after.curvature))
    opened = change.opened if allowed.each else after.kink - change.start("kink")
    if opened > allowed.kink + noise.kink:
        found.append(Worse(Rougher.KINK, before.kink, after.kink))
    if change.turn > allowed.fold:
        found.append(Worse(Rougher.FOLD, 0.0, change.turn))
    if change.unsettled > max(allowed.singular, allowed.curvature):
        found.append(Worse(Rougher.SINGULAR, 0.0, change.unsettled))
    if change.spread > allowed.spread:
        found.append(Worse(Rougher.SPREAD, 1.0, 1.0 + change.spread))
    return tuple(found)


def _grown(change: Change, figure: str, allowed: Growth) -> bool:
    """Whether total bending or curvature variation grew by more than allowed."""
    most = _most(change.start(figure), getattr(allowed, figure))
    return bool(getattr(change.after, figure) > max(most, getattr(change.noise, figure)))


def _most(old: float, share: float) -> float:
    """The largest allowed value of a figure that may grow by a share."""
    return old * (1 + share) if share < np.inf else np.inf


def places(change: Change, allowed: Growth) -> Array:
    """Mask ``(nu, nv)`` of the places of a face that got worse than allowed, or that made the whole face worse."""
    found = change.placed
    assert found is not None
    most = _most(change.start("curvature"), allowed.curvature) + change.noise.curvature
    opened = np.radians(allowed.kink + change.noise.kink) if allowed.each else np.inf
    steep = (found.turn > np.radians(allowed.fold)) | (found.opened > opened)
    rough = (found.spread > allowed.spread) | (found.curvature > most)
    grown = [_grown(change, figure, allowed) for figure in SUMS.values()]
    more = (found.rise[grown] > 1.0).any(axis=0)
    return np.asarray(steep | rough | more | (found.unsettled > max(allowed.singular, allowed.curvature)))


def better(change: Change, share: float, local: float = np.inf, mean: float = 0.0) -> bool:
    """Whether a change reduced bending or curvature variation by more than ``share`` in total; or by more than
    ``local`` at a place and more than ``mean`` as the mean over places."""
    both = (change.before.bending, change.after.bending), (change.before.variation, change.after.variation)
    noise = change.noise.bending, change.noise.variation
    whole = any(old - new > share * old + ripple for (old, new), ripple in zip(both, noise, strict=True))
    return whole or (change.lost > local and change.fairer > mean)


def between(known: Mapping[float, Change], amount: float) -> Change:
    """About the change after an amount of a displacement: a parabola through the three nearest that are known.

    Sums over places are nearly quadratic in the amount, motions linear.
    """
    near = sorted(known, key=lambda at: abs(at - amount))[:3]
    weights = [math.prod((amount - other) / (at - other) for other in near if other != at) for at in near]
    parts = [known[at] for at in near]
    after, opened, turn, deviation, motion, unsettled = zip(*map(_FIGURES, parts), strict=True)

    def mixed(figures: Iterable[Any]) -> Any:
        return sum(map(mul, weights, figures))

    first, placed = parts[0], parts[0].placed
    if placed is not None:
        placed = Placed(mixed(part.placed.figures for part in parts if part.placed), placed.area, placed.ends)
    sums = (mixed(each) for each in zip(*map(_AFTER, after), strict=True))
    return Change(
        first.before, Roughness(first.after.area, *sums), first.noise,
        mixed(opened), mixed(turn), mixed(deviation), mixed(motion), mixed(unsettled), placed, first.goal,
    )  # fmt: skip


_FIGURES = attrgetter("after", "opened", "turn", "deviation", "motion", "unsettled")
_AFTER = attrgetter("bending", "variation", "curvature", "kink")
