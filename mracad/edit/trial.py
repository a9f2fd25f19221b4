"""One attempt of an edit on surfaces that move together: their problem, and what the judge makes of displacements."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from mracad.bspline.surface import Net, cross
from mracad.edit.jumps import Jumps
from mracad.edit.pose import Scene, pose
from mracad.edit.target import Sheet, eased, stiffness
from mracad.edit.tolerances import Tolerances
from mracad.inspect.places import Placed
from mracad.inspect.roughness import Change, Worse, better, places, worse
from mracad.inspect.survey import POINTS, Survey, changes, surveys
from mracad.model.brep import Face
from mracad.seam.interface import Joints

Array = np.ndarray

BISECTIONS = 5
"""Steps in which the amount is found."""

GAIN = 0.01, 0.25, 0.01
"""Least share of its bending or curvature variation that a face must lose to be touched at all; or one of its places,
and all in the mean."""

ENOUGH = 0.9
"""Where more than this of a displacement may be done, no other is tried."""

WHOLE = 1.25
"""What may be done in whole is preferred to a part of what comes nearer to the target by less than this factor: a part
leaves something of every wave everywhere."""

SHARES = 0.125, 0.25, 0.5, 1.0
"""Amounts of which the largest that serves is done place by place, where not all can be done everywhere."""

EASINGS = 2
"""Most times that this is done to one displacement."""

SINGULAR = 1e5
"""Curvature over the wavelength from which on a face is singular."""

FINER = 3
"""Steps from one Greville point to the next in which deviations are looked for."""


@dataclass(frozen=True, eq=False)
class Verdict:
    """What the judge makes of a displacement.

    Attributes
    ----------
    parts : sequence of ndarray (nu, nv, 3)
        What is done to each surface, mm.
    amounts : sequence of float
        How much of it may be done.
    changes : sequence of mapping of int to Change
        What that makes of the roughness of its faces, by face.
    limits : sequence of tuple of Worse
        What keeps it from more.
    gains : sequence of float
        By how much each comes nearer to the target, as a squared norm.
    gain : float
        The same of all, the least of the amounts of each.
    """

    parts: Sequence[Array]
    amounts: Sequence[float]
    changes: Sequence[Mapping[int, Change]]
    limits: Sequence[tuple[Worse, ...]]
    gains: Sequence[float]
    gain: float

    @property
    def least(self) -> float:
        """What may be done to all of them."""
        return min(self.amounts)


class Trial:
    """Surfaces that move together: their problem, and the judge of what is done to them."""

    def __init__(self, scene: Scene, members: Mapping[int, Sheet], joined: Joints, finer: Collection[int] = ()) -> None:
        self.width = max(sheet.wavelength for sheet in members.values())
        self.tolerances = scene.tolerances
        detail = max(sheet.detail for sheet in members.values())
        self.pose = pose(scene, members, joined, self.width, detail, finer=finer)
        self.problem = self.pose.problem
        self.jumps = Jumps(scene, members, joined, self.width)
        surfaces = [(space.net, members[i].faces) for i, space in self.problem.spaces.items()]
        self.watch = Watch.of(surfaces, self.width, max(sheet.reach for sheet in members.values()))

    def nothing(self) -> Verdict:
        """What the judge makes of leaving everything as it is."""
        parts = [np.zeros(space.net.poles.shape) for space in self.problem.spaces.values()]
        return Verdict(parts, [0.0] * len(parts), self.watch.still(), [()] * len(parts), [0.0] * len(parts), 0.0)

    def judged(self, delta: Array, target: Array) -> Verdict:
        """How much of a displacement may be done to each surface."""
        problem = self.problem
        bound = self.tolerances.deviation
        if np.isfinite(bound) and np.linalg.norm(delta, axis=1).max(initial=0.0) > bound:
            both = zip(problem.spaces.values(), problem.split(delta).values(), strict=True)
            within = [bounded(space.net, part, bound, self.width).reshape(-1, 3) for space, part in both]
            delta = problem.nearest(np.concatenate(within))
        parts = list(problem.split(delta).values())
        ceiling = self._ceilings(delta)
        nets = [space.net for space in problem.spaces.values()]
        shares, found, limits = amounts(self.watch, nets, parts, ceiling, self.tolerances)
        for i, faces in enumerate(found):
            if not gained(faces, self.tolerances):
                shares[i], found[i] = 0.0, {face: change.undone() for face, change in faces.items()}
        gains = problem.gains(delta, target, shares)
        gain = sum(problem.gains(delta, target, [min(shares)] * len(parts)))
        return Verdict(parts, shares, found, limits, gains, gain)

    def eased(self, verdict: Verdict, target: Array) -> Verdict:
        """The best that becomes of a displacement that is scaled back where places allow less of it."""
        found = [verdict]
        while found[-1].least <= ENOUGH and len(found) <= EASINGS:
            delta = np.concatenate([part.reshape(-1, 3) for part in found[-1].parts])
            share = self._shares(delta)
            if np.ptp(share) == 0:
                break
            found.append(self.judged(self.problem.nearest(share * delta, stiffness(self.width)), target))
        return max(found, key=worth)

    def blended(self, chosen: Sequence[tuple[Verdict, int]], target: Array) -> Verdict:
        """For each surface another verdict on it, by place, made to meet as smoothly as can be."""
        wanted = np.concatenate([each.amounts[i] * each.parts[i].reshape(-1, 3) for each, i in chosen])
        return self.eased(self.judged(self.problem.nearest(wanted, stiffness(self.width)), target), target)

    def fairer(self, delta: Array) -> list[bool]:
        """Whether a displacement would take anything off the roughness of each surface, whatever it adds to others."""
        both = zip(self.problem.spaces.values(), self.problem.split(delta).values(), strict=True)
        found = self.watch.changes({i: displaced(space.net, part) for i, (space, part) in enumerate(both)})
        return [any(better(change, GAIN[0]) for change in faces.values()) for faces in found.values()]

    def _shares(self, delta: Array) -> Array:
        """The largest of :data:`SHARES` of a displacement that makes no place rougher, eased, ``(points, 1)``."""
        nets = [space.net for space in self.problem.spaces.values()]
        parts = list(self.problem.split(delta).values())
        found: dict[tuple[int, int], tuple[Placed, Array]] = {}
        for amount in SHARES:
            tried = {i: displaced(net, amount * part) for i, (net, part) in enumerate(zip(nets, parts, strict=True))}
            for i, faces in self.watch.changes(tried).items():
                for face, change in faces.items():
                    assert change.placed is not None
                    _, share = found.get((i, face), (None, np.zeros(change.placed.area.shape)))
                    share = np.where(places(change, self.tolerances.growth), share, amount)
                    found[i, face] = change.placed, share
        least = [np.ones(net.poles.shape[:2]) for net in nets]
        for (i, _), (placed, share) in found.items():
            at = placed.at(nets[i].u.greville(), nets[i].v.greville())
            least[i] = np.minimum(least[i], share[np.ix_(*at)])
        both = zip(nets, least, strict=True)
        return np.concatenate([eased(net, share, self.width / 2).ravel() for net, share in both])[:, None]

    def _ceilings(self, delta: Array) -> Array:
        """How much of a displacement contacts allow each surface."""
        ceiling = dict.fromkeys(self.problem.spaces, 1.0)
        room = self.pose.contacts.room(delta, self.pose.opened, self.pose.limits)
        for surfaces, most in zip(self.pose.owners, room, strict=True):
            for i in surfaces & ceiling.keys():
                ceiling[i] = min(ceiling[i], most)
        both = zip(self.problem.spaces.items(), self.problem.split(delta).values(), strict=True)
        moved = {i: displaced(space.net, part) for (i, space), part in both}
        for i, most in self.jumps.room(moved).items():
            ceiling[i] = min(ceiling[i], most)
        return np.array(list(ceiling.values()))


def gained(faces: Mapping[int, Change], tolerances: Tolerances) -> bool:
    """Whether one of the faces of a surface gained enough to be touched."""
    return not tolerances.fairer or any(better(change, *GAIN) for change in faces.values())


def worth(verdict: Verdict) -> float:
    """What a verdict counts for among others."""
    return verdict.gain * (WHOLE if verdict.least > ENOUGH else 1.0)


def bounded(net: Net, offset: Array, bound: float, width: float) -> Array:
    """Offsets ``(nu, nv, 3)`` that are scaled back, smoothly within a width, until none leads far along the normal.

    Each takes the share min(1, bound / |δ · n|), eased, of what is largest beside its Greville point.

    Parameters
    ----------
    net : Net
    offset : ndarray (nu, nv, 3)
    bound, width : float
        mm.
    """
    from scipy.ndimage import maximum_filter

    us, vs = (_between(knots.greville()) for knots in (net.u, net.v))
    normals = cross(net.tangents(us, vs, 0), net.tangents(us, vs, 1))
    normals /= np.maximum(np.linalg.norm(normals, axis=-1, keepdims=True), 1e-300)
    far = np.abs((np.asarray(net.with_poles(offset).grid(us, vs)) * normals).sum(axis=-1))
    far = maximum_filter(far, 2 * FINER + 1, mode="nearest")[::FINER, ::FINER]
    share = bound / np.maximum(far, bound)
    return np.asarray(offset * eased(net, share, width)[..., None])


def _between(places: Array) -> Array:
    """Parameters with more between each and the next."""
    return np.asarray(np.interp(np.arange(FINER * (len(places) - 1) + 1) / FINER, np.arange(len(places)), places))


def displaced(net: Net, offset: Array) -> Net:
    """The surface with control points moved by ``(nu, nv, 3)``, mm."""
    return net.with_poles(net.poles + offset)


@dataclass(frozen=True, eq=False)
class Watch:
    """The faces of surfaces, each looked at by itself.

    Attributes
    ----------
    surveys : sequence of Survey
    owners : sequence of (int, int)
        Place of the surface of each, and the face.
    """

    surveys: Sequence[Survey]
    owners: Sequence[tuple[int, int]]

    @classmethod
    def of(
        cls, surfaces: Sequence[tuple[Net, Sequence[Face]]], width: float, reach: float, points: int = POINTS
    ) -> Watch:
        """Look at faces of surfaces before an edit that takes waves up to a width and spreads them within a reach (mm),
        at so many points a span."""
        every = [(place, net, face) for place, (net, faces) in enumerate(surfaces) for face in faces]
        return cls(
            surveys([(net, (face,), net.u, net.v) for _, net, face in every], points, SINGULAR / width, reach),
            [(place, face.index) for place, _, face in every],
        )

    def still(self) -> list[dict[int, Change]]:
        """What becomes of the faces of each surface where nothing moves."""
        found: list[dict[int, Change]] = [{} for _ in range(self.owners[-1][0] + 1)]
        for (place, face), survey in zip(self.owners, self.surveys, strict=True):
            found[place][face] = Change(survey.roughness, survey.roughness, survey.noise)
        return found

    def changes(self, nets: Mapping[int, Net]) -> dict[int, dict[int, Change]]:
        """What became of the faces of some surfaces, by place."""
        found: dict[int, dict[int, Change]] = {place: {} for place in nets}
        looked = [(*owner, survey) for owner, survey in zip(self.owners, self.surveys, strict=True) if owner[0] in nets]
        now = changes([survey for *_, survey in looked], [nets[place] for place, *_ in looked])
        for (place, face, _), change in zip(looked, now, strict=True):
            found[place][face] = change
        return found


def amounts(
    watch: Watch, nets: Sequence[Net], parts: Sequence[Array], ceiling: Array, tolerances: Tolerances
) -> tuple[list[float], list[dict[int, Change]], list[tuple[Worse, ...]]]:
    """For each surface the largest amount of its displacement that makes no face rougher, by bisection."""
    low, high, best = np.zeros(len(parts)), ceiling.copy(), watch.still()
    why: list[tuple[Worse, ...]] = [()] * len(parts)
    for step in range(BISECTIONS + 1):
        test = (low + high) / 2 if step else high.copy()
        tried = {i: displaced(nets[i], test[i] * parts[i]) for i in np.flatnonzero(low < high).tolist()}
        for i, faces in watch.changes(tried).items():
            wrong = tuple(w for each in faces.values() for w in worse(each, tolerances.growth))
            far = any(each.deviation > tolerances.deviation * (1 + 1e-9) for each in faces.values())
            if wrong or far:
                high[i], why[i] = test[i], why[i] or wrong
            else:
                low[i], best[i] = test[i], faces
    return low.tolist(), best, why
