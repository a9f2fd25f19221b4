"""One attempt of an edit on surfaces that move together: their problem, and the judge's verdict on displacements."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from mracad.bspline.surface import Net
from mracad.bspline.vectors import cross
from mracad.edit.jumps import Jumps
from mracad.edit.pose import Scene, pose
from mracad.edit.target import Sheet, eased, stiffness
from mracad.edit.tolerances import Tolerances
from mracad.edit.watch import PART, STEPS, Tried, Watch, amounts, displaced
from mracad.inspect.places import Placed
from mracad.inspect.roughness import Change, Worse, better, places, worse
from mracad.seam.interface import Joints

Array = np.ndarray

GAIN = 0.01, 0.25, 0.01
"""Share of its bending or curvature variation that a face must lose to be changed at all; or the share that one of its
places must lose, and the mean of all places."""

ENOUGH = 0.9
"""If more than this share of a displacement is allowed, no other is tried."""

WHOLE = 1.25
"""A displacement that is allowed in full is preferred to part of one that comes nearer to the target by less than this
factor: a part leaves some of every wave everywhere."""

SHARES = 0.125, 0.25, 0.5, 1.0
"""Amounts to choose from, place by place, where a displacement is not allowed in full: the largest allowed is taken."""

EASINGS = 2
"""How often that is done at most to one displacement."""

FINER = 3
"""Steps from one Greville point to the next at which deviations are sampled."""


@dataclass(frozen=True, eq=False)
class Gains:
    """By how much an amount a of a displacement δ brings each surface nearer to a target t, as a squared norm.

    ‖t‖² − ‖t − a δ‖² = a (2 δᵀ M t − a δᵀ M δ)

    Attributes
    ----------
    linear, square : ndarray (surfaces,)
        δᵀ M t and δᵀ M δ.
    """

    linear: Array
    square: Array

    def of(self, amounts: Array | float) -> Array:
        """The gains of amounts ``(surfaces,)``."""
        return np.asarray(amounts * (2 * self.linear - amounts * self.square))


@dataclass(frozen=True, eq=False)
class Verdict:
    """The judge's verdict on a displacement.

    Attributes
    ----------
    tried : Tried
        The displacement of each surface.
    amounts : sequence of float
        The share of it that is allowed.
    changes : sequence of mapping of int to Change
        The change of roughness of its faces, by face.
    limits : sequence of tuple of Worse
        The figures that limit the amount.
    nearer : Gains
        How much nearer amounts bring each surface to the target.
    extra : float
        A gain that counts besides: what others have to exceed.
    """

    tried: Tried
    amounts: Sequence[float]
    changes: Sequence[Mapping[int, Change]]
    limits: Sequence[tuple[Worse, ...]]
    nearer: Gains
    extra: float = 0.0

    @cached_property
    def gains(self) -> Array:
        """How much nearer each surface comes to the target, as a squared norm."""
        return self.nearer.of(np.array(self.amounts))

    @cached_property
    def gain(self) -> float:
        """The same for all surfaces, with the least of their amounts."""
        return self.extra + float(self.nearer.of(self.least).sum())

    @property
    def parts(self) -> Sequence[Array]:
        """The allowed displacement of each surface, mm, ``(nu, nv, 3)`` each."""
        return self.tried.parts

    @property
    def least(self) -> float:
        """The amount allowed for all of them."""
        return min(self.amounts)


@dataclass(frozen=True, eq=False)
class Unheld:
    """The judge's view of a target for which nothing is held.

    Attributes
    ----------
    tried : Tried
    tolerances : Tolerances
    least : sequence of float
        Least displacement of each surface that counts, mm.
    """

    tried: Tried
    tolerances: Tolerances
    least: Sequence[float]

    @property
    def allowed(self) -> bool:
        """Whether it would be allowed in full."""
        return not any(worse(change, self.tolerances.growth) for faces in self._whole for change in faces.values())

    @property
    def fairer(self) -> list[bool]:
        """Whether it would reduce the roughness of each surface, whatever it adds to others."""
        return [_fairer(faces, least, GAIN[0]) for faces, least in zip(self._whole, self.least, strict=True)]

    @property
    def gaining(self) -> list[bool]:
        """Whether some amount of it would make each surface fairer by enough to change it."""
        self._at(PART)
        return [
            any(gained(self.tried.about(i, amount), self.tolerances, least) for amount in reversed(SHARES))
            for i, least in enumerate(self.least)
        ]

    @property
    def _whole(self) -> list[Mapping[int, Change]]:
        return self._at(1.0)

    def _at(self, amount: float) -> list[Mapping[int, Change]]:
        return list(self.tried.changes(dict.fromkeys(range(len(self.least)), amount)).values())


class Trial:
    """Surfaces that move together: their problem, and the judge of their displacements."""

    def __init__(self, scene: Scene, members: Mapping[int, Sheet], joined: Joints, finer: Collection[int] = ()) -> None:
        self.width = max(sheet.wavelength for sheet in members.values())
        self.tolerances = scene.tolerances
        detail = max(sheet.detail for sheet in members.values())
        self.pose = pose(scene, members, joined, self.width, detail, finer=finer)
        self.problem = self.pose.problem
        spaces = self.problem.spaces
        self.jumps = Jumps(scene, {i: space.net for i, space in spaces.items()}, joined, self.width)
        surfaces = [(space.net, members[i].base, members[i].faces) for i, space in spaces.items()]
        self.nets = [space.net for space in spaces.values()]
        self.stretches = [members[i].stretch for i in spaces]
        self.least = [members[i].least for i in spaces]
        self.watch = Watch(surfaces, self.width, [members[i].reach for i in spaces])

    def most(self, target: Array) -> float:
        """The largest possible gain: that of the admissible displacement nearest to a target, without contacts; 0 if no
        control point may move."""
        if not self.problem.free.any():
            return 0.0
        nearest = target if self.problem.soft is not None else self.problem.nearest(target)
        return float(self.gains(nearest, target).of(1.0).sum())

    def gains(self, delta: Array, target: Array) -> Gains:
        """By how much a displacement brings each surface nearer to a target, both ``(points, 3)``."""
        return Gains(*self.problem.products(delta, target))

    def nothing(self, least: float = 0.0) -> Verdict:
        """The verdict on no change, with a gain that others have to exceed."""
        still = Tried(self.watch, self.nets, [np.zeros(net.poles.shape) for net in self.nets])
        none = np.zeros(len(self.nets))
        return Verdict(still, none.tolist(), self.watch.still, [()] * len(none), Gains(none, none), least)

    def judged(self, delta: Array, target: Array, others: Sequence[Verdict] = (), *, wholly: bool = False) -> Verdict:
        """The share of a displacement allowed for each surface; 0 where it could not do better than ``others``, or with
        ``wholly`` where not all of it is allowed."""
        bound = self.tolerances.deviation
        if np.isfinite(bound) and np.linalg.norm(delta, axis=1).max(initial=0.0) > bound:
            every = zip(self.nets, self._split(delta), self.stretches, strict=True)
            within = [bounded(net, part, bound, s.times(self.width)).reshape(-1, 3) for net, part, s in every]
            delta = self.problem.nearest(np.concatenate(within))
        tried, nearer = Tried(self.watch, self.nets, self._split(delta)), self.gains(delta, target)
        if wholly:
            return self._verdict(tried, nearer, np.zeros(len(self.nets)), 0)
        return self._verdict(tried, nearer, self._floor(nearer, others), STEPS[len(self.nets) > 1])

    def shared(self, verdict: Verdict, others: Sequence[Verdict]) -> Verdict:
        """The verdict on the displacement of one that knows only what is allowed in full."""
        floor = self._floor(verdict.nearer, others)
        return self._verdict(verdict.tried, verdict.nearer, floor, STEPS[len(self.nets) > 1])

    def settled(self, verdict: Verdict) -> Verdict:
        """The same verdict, with amounts found in more steps."""
        if not verdict.least or verdict.least == 1.0:
            return verdict
        return self._verdict(verdict.tried, verdict.nearer, np.zeros(len(self.nets)), STEPS[1])

    def left(self, verdict: Verdict, shares: Sequence[float]) -> Verdict:
        """The same verdict with other amounts."""
        return replace(verdict, amounts=shares, extra=0.0)

    def _verdict(self, tried: Tried, nearer: Gains, floor: Array, steps: int) -> Verdict:
        ceilings = self._ceilings(tried) if np.isfinite(floor).any() else np.zeros(len(floor))
        shares, found, limits = amounts(tried, floor, ceilings, self.tolerances, steps)
        for i, (faces, least) in enumerate(zip(found, self.least, strict=True)):
            if not gained(faces, self.tolerances, least):
                shares[i], found[i] = 0.0, {face: change.undone() for face, change in faces.items()}
        return Verdict(tried, shares, found, limits, nearer)

    def eased(self, verdict: Verdict, target: Array, others: Sequence[Verdict] = ()) -> Verdict:
        """The best verdict on a displacement that is scaled back at places that allow less of it."""
        found = [verdict]
        while found[-1].least <= ENOUGH and len(found) <= EASINGS and not self.tolerances.whole:
            if np.isinf(self._floor(found[-1].nearer, others)).all():
                break
            share = self._shares(found[-1].tried)
            if np.ptp(share) == 0:
                break
            delta = np.concatenate([part.reshape(-1, 3) for part in found[-1].parts])
            easier = self.problem.nearest(share * delta, stiffness(self.width))
            found.append(self.judged(easier, target, [*others, *found]))
        return max(found, key=rank)

    def blended(self, chosen: Sequence[tuple[Verdict, int]], target: Array, others: Sequence[Verdict]) -> Verdict:
        """The best displacement of each surface, from different verdicts, made to meet as smoothly as possible."""
        wanted = np.concatenate([each.amounts[i] * each.parts[i].reshape(-1, 3) for each, i in chosen])
        together = self.judged(self.problem.nearest(wanted, stiffness(self.width)), target, others)
        return self.eased(together, target, others)

    def unheld(self, target: Array) -> Unheld:
        """What the judge says of a whole target, as if nothing were held."""
        return Unheld(Tried(self.watch, self.nets, self._split(target)), self.tolerances, self.least)

    def _floor(self, nearer: Gains, others: Sequence[Verdict]) -> Array:
        """Amounts below which a displacement is worth less than another; infinite if it always is."""
        best, count = max((worth(each) for each in others), default=0.0), len(self.nets)
        if best and count == 1:
            return np.array([_beating(best, nearer)])
        gains = nearer.of(1.0)
        beaten = [any(each.gains[i] >= most for each in others) for i, most in enumerate(gains)]
        return np.full(count, np.inf if WHOLE * gains.sum() <= best and all(beaten) else 0.0)

    def _split(self, delta: Array) -> list[Array]:
        return list(self.problem.split(delta).values())

    def _shares(self, tried: Tried) -> Array:
        """The largest of :data:`SHARES` of a displacement that makes no place rougher, smoothed, ``(points, 1)``."""
        found: dict[tuple[int, int], tuple[Placed, Array]] = {}
        for amount in (PART, 1.0):
            tried.changes(dict.fromkeys(range(len(self.nets)), amount))
        for amount in SHARES:
            for i in range(len(self.nets)):
                for face, change in tried.about(i, amount).items():
                    assert change.placed is not None
                    _, share = found.get((i, face), (None, np.zeros(change.placed.area.shape)))
                    share = np.where(places(change, self.tolerances.growth), share, amount)
                    found[i, face] = change.placed, share
        least = [np.ones(net.poles.shape[:2]) for net in self.nets]
        for (i, _), (placed, share) in found.items():
            at = placed.at(self.nets[i].u.greville(), self.nets[i].v.greville())
            least[i] = np.minimum(least[i], share[np.ix_(*at)])
        both = zip(self.nets, least, self.stretches, strict=True)
        return np.concatenate([eased(net, share, s.times(self.width / 2)).ravel() for net, share, s in both])[:, None]

    def _ceilings(self, tried: Tried) -> Array:
        """The share of a displacement that contacts allow for each surface."""
        ceiling = dict.fromkeys(self.problem.spaces, 1.0)
        delta = np.concatenate([part.reshape(-1, 3) for part in tried.parts])
        room = self.pose.contacts.room(delta, self.pose.opened, self.pose.limits)
        for surfaces, most in zip(self.pose.owners, room, strict=True):
            for i in surfaces & ceiling.keys():
                ceiling[i] = min(ceiling[i], most)
        both = zip(ceiling, self.nets, tried.parts, strict=True)
        for i, most in self.jumps.room({i: displaced(net, part) for i, net, part in both}).items():
            ceiling[i] = min(ceiling[i], most)
        return np.array(list(ceiling.values()))


def gained(faces: Mapping[int, Change], tolerances: Tolerances, least: float) -> bool:
    """Whether one of the faces of a surface gained enough to be changed, and moved by more than ``least`` (mm)."""
    return not tolerances.fairer or _fairer(faces, least, *GAIN)


def _fairer(faces: Mapping[int, Change], least: float, *gain: float) -> bool:
    return any(each.motion > least and better(each, *gain) for each in faces.values())


def worth(verdict: Verdict) -> float:
    """The worth of a verdict, to compare it with others."""
    return verdict.gain * (WHOLE if verdict.least > ENOUGH else 1.0)


def _beating(best: float, nearer: Gains) -> float:
    """The least amount of the displacement of a surface that is worth more than the best."""
    amounts = np.arange(1, 65) / 64
    more = amounts[nearer.of(amounts) * np.where(amounts > ENOUGH, WHOLE, 1.0) > best]
    return float(more[0]) if len(more) else np.inf


def rank(verdict: Verdict) -> tuple[float, float]:
    """A sort key: its worth, then the gain of those surfaces that may move."""
    return worth(verdict), sum(verdict.gains)


def bounded(net: Net, offset: Array, bound: float, widths: tuple[float, float]) -> Array:
    """Offsets ``(nu, nv, 3)`` scaled back, smoothly within widths along u and v, until none exceeds a bound along the
    normal; all in mm.

    Each gets the share min(1, bound / |δ · n|), smoothed, for the largest |δ · n| beside its Greville point.
    """
    share = bound / np.maximum(heights(net, offset), bound)
    return np.asarray(offset * eased(net, share, widths)[..., None])


def heights(net: Net, offset: Array, steps: int = FINER) -> Array:
    """The largest |δ · n| beside the Greville point of each control point, mm, for offsets ``(nu, nv, 3)``.

    It is sampled in ``steps`` steps from one Greville point to the next.
    """
    from scipy.ndimage import maximum_filter

    us, vs = (_between(knots.greville(), steps) for knots in (net.u, net.v))
    normals = cross(net.tangents(us, vs, 0), net.tangents(us, vs, 1))
    normals /= np.maximum(np.linalg.norm(normals, axis=-1, keepdims=True), 1e-300)
    far = np.abs((np.asarray(net.with_poles(offset).grid(us, vs)) * normals).sum(axis=-1))
    return np.asarray(maximum_filter(far, 2 * steps + 1, mode="nearest")[::steps, ::steps])


def _between(places: Array, steps: int) -> Array:
    """Parameters, with each interval between two of them divided into equal steps."""
    return np.asarray(np.interp(np.arange(steps * (len(places) - 1) + 1) / steps, np.arange(len(places)), places))
