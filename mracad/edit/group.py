"""Smoothing of surfaces that seams join, all at once.

The target is the coupled projection (:mod:`mracad.constraint.couple`) in place of the projection of each surface by
itself.  Points that some other edge freezes stay, and the seam conditions are restored where that broke them.  Trimmed
seams are then shut (:mod:`mracad.constraint.shut`); where one stays open, the spans under it are halved.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from mracad.bspline.knots import KnotVector
from mracad.bspline.net import Net
from mracad.constraint.couple import Coupling, Patch
from mracad.constraint.frozen import REFINED_SHARE, Separation, halvings, jet_support, separate
from mracad.constraint.seam import TRIMMED, Border, Seam, opening
from mracad.constraint.shut import Sheet, shut
from mracad.constraint.strip import Coarse, Direction, Line, Strip, line, members, strips
from mracad.constraint.trimmed import TrimmedSeam, coarse_sites
from mracad.edit.bound import OVERSHOOT, bounded, deviation
from mracad.model import Model, Surface
from mracad.options import Smooth, length
from mracad.wavelet.ladder import arc_lengths, ladder_for_scale, rungs_by_level

Array = np.ndarray
_Spaces = dict[Direction, Coarse]

WIDER = 1e-6
"""A seam may end up with so much more of a gap, mm; otherwise it is frozen."""

STEEPER = math.radians(0.008)
"""A seam that was smooth may end up with so much more of an angle; otherwise it is frozen."""

MENDED, BENT = 0.1, math.radians(0.1)
"""The same where defects are mended: beside points that stay, the shares that gap and angle may gain are these and the
gap tolerance."""

BUMPIER = 1e-3
"""A trimmed seam that keeps G2 may end up with so much more of a curvature jump, over the wavelength of the edit."""

HALVINGS = 4
"""How often the spans under a trimmed seam that stays open are halved."""

MOST_POINTS, MOST_GROWTH = 40_000, 4
"""Most control points to which a surface is refined for that; a group may have as many, or so many times its own."""

WORK, LEAST_WORK, LAST_WORK = 20, 300_000, 8
"""A group may cost so much for each of its control points, or so much in all; and so much for each again once seams
were given up for that.  Solving for one point of a bicubic net costs 1, its coupled projection PROJECTION."""

PROJECTION = 3

SHORTEST = 1e-2
"""Spans shorter than this, mm, are not halved."""

CLUSTER = 1e-6, 1e-4
"""Knots closer than this fraction of the curve, or this in mm, are not set apart."""

CROWDED = "knots of the two sides nearly meet"
OPEN = f"{TRIMMED}: not within the tolerance"
ENTANGLED = "control points of a face there cannot move one by one"
FOLDED = "would kink where a face closes on itself"
STUCK = "a face there has no free control points"

LEAST = 0.5
"""A seam with less of the freedom of the smoother of its two sides is frozen."""


@dataclass(frozen=True)
class Allowance:
    """What a group may still cost.

    Attributes
    ----------
    work : float
        What it may still cost, in solutions for one point of a bicubic net.
    rounds : int
        Rounds done so far.
    given_up : bool
        Whether trimmed seams were given up already because the allowance had run out.
    """

    work: float
    rounds: int = 0
    given_up: bool = False


@dataclass(frozen=True, eq=False)
class Moved:
    """A surface that moves together with others.

    Attributes
    ----------
    net : Net
        The surface, refined so that it can follow the others.
    inserted : (ndarray, ndarray)
        Knots inserted in u and v.
    separation : Separation
        On that net.
    change, offset : ndarray (nu, nv, 3)
        What the edit would do were nothing frozen, and what it does, mm.
    """

    net: Net
    inserted: tuple[Array, Array]
    separation: Separation
    change: Array
    offset: Array


@dataclass(frozen=True, eq=False)
class Setting:
    """An edit of surfaces that move together.

    Attributes
    ----------
    model : Model
    movable : collection of int
        Faces that the edit may move.
    options : Smooth
    spans : mapping of int to pair of ndarray
        Arc lengths of the knot spans in u and v of each surface, mm.
    creases : mapping of int to pair of frozenset
        Crease lines of each surface.
    held : frozenset of int
        Edges that must not move.
    """

    model: Model
    movable: Collection[int]
    options: Smooth
    spans: Mapping[int, tuple[Array, Array]]
    creases: Mapping[int, tuple[frozenset[float], frozenset[float]]]
    held: frozenset[int] = frozenset()

    @cached_property
    def gap(self) -> float:
        """Gap that trimmed seams may have, mm."""
        return length(self.options.gap_tolerance, self.model.diagonal, "gap-tolerance")

    @property
    def mending(self) -> bool:
        """Whether defects are pulled shut."""
        return self.options.close_gaps or self.options.fit_g1 is not None


class Group:
    """Surfaces that seams join, directly or through others.

    Parameters
    ----------
    setting : Setting
    found, trimmed : list of Seam, list of TrimmedSeam
        All seams of these surfaces.
    closing : mapping of int to (Border, Border)
        Closing edges of the model that need no condition.

    Attributes
    ----------
    cost : float
        Of solving once for all control points of the surfaces.
    allowance : Allowance
        What the group may cost; by default that of a new one.
    freedom : dict of int to int
        Degrees of freedom of seams, by edge.
    """

    def __init__(
        self,
        setting: Setting,
        found: list[Seam],
        trimmed: list[TrimmedSeam],
        closing: Mapping[int, tuple[Border, Border]],
    ) -> None:
        self.model, self.movable, self.options = setting.model, setting.movable, setting.options
        self.spans, self.creases, self.gap, self.mending = setting.spans, setting.creases, setting.gap, setting.mending
        self.found, self.trimmed, self.closing = found, trimmed, closing
        self.surfaces = sorted({side.surface for seam in self._every() for side in (seam.a, seam.b)})
        self.moving = set(closing) | {edge for seam in self._every() for edge in (seam.edge, seam.twin)}
        nets = [self.model.surfaces[i].net for i in self.surfaces]
        self.cost, self.points = _cost(nets), _points(nets)
        self.allowance = Allowance(max(WORK * self.points, LEAST_WORK))
        self.freedom: dict[int, int] = {}
        self.inserted: dict[int, tuple[Array, Array]] = {}
        self.scales: dict[int, float] = {}

    def smoothed(self, scale: float | None, bound: float | None) -> tuple[dict[int, Moved], dict[int, str]]:
        """Smooth the surfaces; or find seams that would not hold, by edge, and why.

        Parameters
        ----------
        scale : float or None
            Wavelength, mm; None for the level of the options.
        bound : float or None
            On the displacement of any control point, mm.
        """
        self.allowance = replace(self.allowance, rounds=self.allowance.rounds + 1)
        self._spend(self.cost)
        joined, refused = strips(self.found, self._knots)
        if refused:
            return {}, refused
        there = {m for strip in joined for m in strip.members}
        lone = [(i, axis) for i in self.surfaces for axis in (0, 1) if (i, axis) not in there]
        every = joined + [Strip({direction: (1.0, 0.0)}) for direction in lone]
        steps = self._steps([(s, line(s, self._knots, self._lengths, self._creases)) for s in every], scale)
        nets = self._refined([coarse for _, coarse in steps])
        broken = self._crowded()
        if broken:
            return {}, broken
        separations = {i: self._separated(self.model.surfaces[i], net) for i, net in nets.items()}
        if self.options.refine:
            for i in [i for i, separation in separations.items() if not separation.free.any()]:
                self._free(i, nets, separations)
        broken = self._stuck(separations)
        if broken:
            return {}, broken
        couplings = [(weight, self._coupling(nets, coarse)) for weight, coarse in steps]
        coupling = couplings[0][1]
        broken = self._locked(coupling)
        if broken:
            return {}, broken
        moved = self._moved(couplings, separations, bound)
        broken = self._overshot(moved, self._every())
        if not broken and self.trimmed:
            moved = self._shut(moved, coupling, bound)
            broken = self._overshot(moved, self.trimmed)
        broken = broken or self._broken(moved)
        return ({}, broken) if broken else (moved, {})

    @property
    def affordable(self) -> bool:
        """Whether the allowance suffices for one more round."""
        return self.allowance.work >= (1 + PROJECTION) * self.cost

    def give_up(self) -> dict[int, str]:
        """The trimmed seams, or all where that was done before, with the reason for leaving them as they are."""
        some = self._every() if self.allowance.given_up or not self.trimmed else self.trimmed
        self.allowance = Allowance(LAST_WORK * self.points, self.allowance.rounds, given_up=True)
        rounds = f"{self.allowance.rounds} round" + "s" * (self.allowance.rounds != 1)
        return {seam.edge: f"given up after {rounds}" for seam in some}

    def _spend(self, work: float) -> None:
        self.allowance = replace(self.allowance, work=self.allowance.work - work)

    def _every(self) -> list[Seam | TrimmedSeam]:
        return [*self.found, *self.trimmed]

    def _knots(self, direction: Direction) -> KnotVector:
        net = self.model.surfaces[direction[0]].net
        return (net.u, net.v)[direction[1]]

    def _lengths(self, direction: Direction) -> Array:
        return self.spans[direction[0]][direction[1]]

    def _creases(self, direction: Direction) -> frozenset[float]:
        return self.creases[direction[0]][direction[1]]

    def _steps(self, lines: list[tuple[Strip, Line]], scale: float | None) -> list[tuple[float, _Spaces]]:
        """Coarse spaces to blend and their weights."""
        if scale is not None:
            steps = [(1.0, [_at_scale(each, scale) for _, each in lines])]
        else:
            steps = _at_level([each for _, each in lines], self.options.level or 0.0)
        return [(weight, self._members(lines, knots)) for weight, knots in steps]

    def _refined(self, spaces: list[_Spaces]) -> dict[int, Net]:
        """The surfaces' nets with the knots that all coarse spaces need."""
        self.inserted = {
            i: (_union([c[i, 0].inserted for c in spaces]), _union([c[i, 1].inserted for c in spaces]))
            for i in self.surfaces
        }
        return {i: self.model.surfaces[i].net.refined(*inserted) for i, inserted in self.inserted.items()}

    def _crowded(self) -> dict[int, str]:
        """Seams along which a surface would get a knot next to one that it has."""
        crowded = set()
        for i, inserted in self.inserted.items():
            for axis, new in enumerate(inserted):
                knots, spans = self._knots((i, axis)), self.spans[i][axis]
                fresh = np.setdiff1d(new, knots.breaks)
                if len(fresh):
                    walked = np.append(0.0, np.cumsum(spans))
                    at = np.interp(fresh, knots.breaks, walked)
                    if np.abs(at[:, None] - walked).min() < max(CLUSTER[0] * walked[-1], CLUSTER[1]):
                        crowded.add((i, axis))
        return {
            seam.edge: CROWDED
            for seam in self.found
            if crowded & {(seam.a.surface, 1 - seam.a.axis), (seam.b.surface, 1 - seam.b.axis)}
        }

    def _free(self, surface: int, nets: dict[int, Net], separations: dict[int, Separation]) -> None:
        """Halve the spans of a surface, the longer ones first, until enough of its points are free."""
        own = self.inserted[surface]
        for net, u, v in halvings(nets[surface]):
            separation = self._separated(self.model.surfaces[surface], net)
            if separation.free.sum() >= REFINED_SHARE * separation.visible.sum():
                nets[surface], separations[surface] = net, separation
                self.inserted[surface] = np.sort(np.r_[own[0], u]), np.sort(np.r_[own[1], v])
                break

    def _stuck(self, separations: Mapping[int, Separation]) -> dict[int, str]:
        """Seams of surfaces of which no point can move even if all their seams do."""
        stuck = {i for i, separation in separations.items() if not separation.free.any()}
        return {seam.edge: STUCK for seam in self._every() if stuck & {seam.a.surface, seam.b.surface}}

    def _coupling(self, nets: Mapping[int, Net], coarse: _Spaces) -> Coupling:
        patches = {i: self._patch(i, net, (coarse[i, 0], coarse[i, 1])) for i, net in nets.items()}
        return Coupling(patches, self.found, self.trimmed)

    def _locked(self, coupling: Coupling) -> dict[int, str]:
        """Seams whose conditions leave too little freedom; counts the freedom of all."""
        result = {}
        bases = {i: patch.base for i, patch in coupling.patches.items()}
        self.freedom = {seam.edge: len(coarse_sites(seam, bases)) for seam in self.trimmed}
        for number, seam in enumerate(self.found):
            whole = min(self._functions(coupling.patches[b.surface].base, b) for b in (seam.a, seam.b))
            degrees = {coupling.patches[b.surface].base[1 - b.axis].degree for b in (seam.a, seam.b)}
            plain = len(degrees) == 1 and not seam.joint.varying
            self.freedom[seam.edge] = whole if plain else coupling.freedom(number)
            if self.freedom[seam.edge] < LEAST * whole:
                result[seam.edge] = f"would lock ({self.freedom[seam.edge]} of {whole} degrees of freedom)"
        return result

    @staticmethod
    def _functions(base: tuple[KnotVector, KnotVector], border: Border) -> int:
        """Coarse functions that a border depends on."""
        knots = base[1 - border.axis]
        low, high = sorted((border.start, border.stop))
        inside = (knots.breaks > low) & (knots.breaks < high)
        return min(int(knots.multiplicities[inside].sum()) + knots.degree + 1, knots.count)

    def _moved(
        self, couplings: list[tuple[float, Coupling]], separations: Mapping[int, Separation], bound: float | None
    ) -> dict[int, Moved]:
        coupling = couplings[0][1]
        self._spend(PROJECTION * _cost(patch.net for patch in coupling.patches.values()))
        change: dict[int, Array] = {}
        for weight, each in couplings:
            for i, delta in each.displacement().items():
                change[i] = weight * delta + change.get(i, 0.0)
        free = {i: s.free for i, s in separations.items()}
        wanted = {i: self._wanted(x, bound) for i, x in change.items()}
        offsets = _within(coupling.held(wanted, free, self.options.amount), bound)
        return {
            i: Moved(patch.net, self.inserted[i], separations[i], change[i], offsets[i])
            for i, patch in coupling.patches.items()
        }

    def _wanted(self, change: Array, bound: float | None) -> Array:
        """What is to be done of a change."""
        wanted = self.options.amount * change
        return wanted if bound is None else bounded(wanted, bound)

    def _shut(self, moved: dict[int, Moved], coupling: Coupling, bound: float | None) -> dict[int, Moved]:
        """The same with trimmed seams shut, as far as halving the spans under them serves."""
        self.scales = {i: self._wavelength(patch, i) for i, patch in coupling.patches.items()}
        amount = self.options.amount
        for halving in range(HALVINGS + 1):
            sheets = {
                i: Sheet(m.net, self._wanted(m.change, bound), m.offset, m.separation.free, self.scales[i])
                for i, m in moved.items()
            }
            self._spend(_cost(m.net for m in moved.values()))
            allowed = self.gap, STEEPER, BUMPIER / min(self.scales.values())
            offsets = shut(sheets, self.trimmed, coupling.fine.matrix, allowed, amount)
            free = {i: m.separation.free for i, m in moved.items()}
            offsets = _within(coupling.held(offsets, free, amount), bound)
            moved = {i: replace(m, offset=offsets[i]) for i, m in moved.items()}
            finer = self._halved(moved) if halving < HALVINGS else {}
            if not finer:
                break
            moved |= finer
            coupling = coupling.over({i: m.net for i, m in moved.items()})
        return moved

    def _wavelength(self, patch: Patch, surface: int) -> float:
        """Shortest wavelength, mm, that the coarse space of a surface holds in a direction in which it is coarser."""
        own = [self._knots((surface, axis)) for axis in (0, 1)]
        spacing = [float(s.sum()) / (len(k.breaks) - 1) for s, k in zip(self.spans[surface], patch.base, strict=True)]
        coarser = [x for x, k, base in zip(spacing, own, patch.base, strict=True) if k != base]
        return math.sqrt(2) * min(coarser or spacing)

    def _halved(self, moved: Mapping[int, Moved]) -> dict[int, Moved]:
        """Surfaces with spans halved where trimmed seams stay open, or all along those for which points move too far.

        Empty when there is nothing to halve.
        """
        after, far = self._after(moved), self._overshot(moved, self.trimmed)
        cells: dict[int, Array] = {}
        for seam in self.trimmed:
            share, excess = self._excess(seam, after)
            open_at = share[(excess > 1.0) | (seam.edge in far)]
            for trace in (seam.a, seam.b):
                met = trace.cells(moved[trace.surface].net, open_at)
                cells[trace.surface] = met | cells.get(trace.surface, False)
        result, total = {}, _points(m.net for m in moved.values())
        for i, met in cells.items():
            net = moved[i].net
            halves = [
                ((k.breaks[:-1] + k.breaks[1:]) / 2)[met.any(axis=1 - axis) & (arc_lengths(net, axis) > SHORTEST)]
                for axis, k in enumerate((net.u, net.v))
            ]
            points = math.prod(k.count + len(x) for k, x in zip((net.u, net.v), halves, strict=True))
            if any(map(len, halves)) and points <= MOST_POINTS:
                total += points - _points([net])
                result[i] = halves
        if total > max(MOST_POINTS, MOST_GROWTH * self.points):
            return {}
        finer = {i: self._finer(i, moved[i], halves) for i, halves in result.items()}
        return finer if _cost(m.net for m in {**moved, **finer}.values()) <= self.allowance.work else {}

    def _finer(self, surface: int, moved: Moved, halves: Sequence[Array]) -> Moved:
        """A surface with more knots."""
        net, u, v = moved.net, moved.net.u.refined(halves[0]), moved.net.v.refined(halves[1])
        fine = net.over(u, v)

        def over(offset: Array) -> Array:
            return Net(net.u, net.v, net.poles + offset, net.weights).over(u, v).poles - fine.poles

        inserted = np.sort(np.r_[moved.inserted[0], halves[0]]), np.sort(np.r_[moved.inserted[1], halves[1]])
        separation = self._separated(self.model.surfaces[surface], fine)
        return Moved(fine, inserted, separation, over(moved.change), over(moved.offset))

    def _members(self, lines: list[tuple[Strip, Line]], coarse: list[KnotVector]) -> _Spaces:
        """Coarse knots and knots to insert of every direction."""
        found = (
            members(strip, each, knots, self._knots, self._creases)
            for (strip, each), knots in zip(lines, coarse, strict=True)
        )
        return {direction: vectors for part in found for direction, vectors in part.items()}

    def _patch(self, surface: int, net: Net, coarse: tuple[Coarse, Coarse]) -> Patch:
        near = np.zeros(coarse[0].base.count, bool), np.zeros(coarse[1].base.count, bool)
        for seam in self.found:
            for border in (seam.a, seam.b):
                if border.surface == surface:
                    near[border.axis][:] |= jet_support(coarse[border.axis].base, border.at, seam.joint.order)
        base, lifted = (coarse[0].base, coarse[1].base), (coarse[0].lifted, coarse[1].lifted)
        return Patch(net, base, lifted, near, self._area(surface))

    def _separated(self, surface: Surface, net: Net) -> Separation:
        faces = [self.model.faces[i] for i in surface.faces]
        return separate(net, faces, [i for i in surface.faces if i in self.movable], self.options.keep, self.moving)

    def _area(self, surface: int) -> float:
        """Area per unit of the parameter plane."""
        net = self.model.surfaces[surface].net
        return math.prod(
            float(lengths.sum()) / knots.period
            for lengths, knots in zip(self.spans[surface], (net.u, net.v), strict=True)
        )

    def _overshot(self, moved: Mapping[int, Moved], seams: Sequence[Seam | TrimmedSeam]) -> dict[int, str]:
        """Those of ``seams`` with a surface that deviates by more than smoothing it and its neighbours freely would."""
        most = {i: deviation(m.net, m.change) for i, m in moved.items()}
        allowed = dict(most)
        for seam in seams:
            for one, other in ((seam.a.surface, seam.b.surface), (seam.b.surface, seam.a.surface)):
                allowed[one] = max(allowed[one], most[other])
        far = {i for i, m in moved.items() if deviation(m.net, m.offset) > OVERSHOOT * allowed[i]}
        return {seam.edge: ENTANGLED for seam in seams if far & {seam.a.surface, seam.b.surface}}

    def _after(self, moved: Mapping[int, Moved]) -> Model:
        surfaces = list(self.model.surfaces)
        for i, m in moved.items():
            surfaces[i] = Surface(i, Net(m.net.u, m.net.v, m.net.poles + m.offset, m.net.weights), surfaces[i].faces)
        return self.model.with_surfaces(surfaces)

    def _excess(self, seam: TrimmedSeam, after: Model) -> tuple[Array, Array]:
        scale = min(self.scales[seam.a.surface], self.scales[seam.b.surface])
        return seam.excess(self.model, after, (self.gap, 0.0, 0.0), (0.0, STEEPER, BUMPIER / scale))

    def _broken(self, moved: Mapping[int, Moved]) -> dict[int, str]:
        """Seams that are wider or steeper than they may be, and what is wrong with them."""
        after = self._after(moved)
        excess = {seam.edge: self._excess(seam, after)[1].max() for seam in self.trimmed}
        worst = max(excess.values(), default=0.0)
        if worst > 1.0:
            # what is far off spoils its neighbours: try again without it before judging them
            return {edge: OPEN for edge, x in excess.items() if x >= math.sqrt(worst)}
        result: dict[int, str] = {}
        for a, b in self.closing.values():
            if a.surface in moved and opening(after, a, b)[1] > opening(self.model, a, b)[1] + STEEPER:
                result |= {s.edge: FOLDED for s in self._every() if a.surface in (s.a.surface, s.b.surface)}
        for seam in self.found:
            gap, angle = opening(after, seam.a, seam.b)
            wider = MENDED * seam.gap + self.gap if self.mending else WIDER
            if gap > seam.gap + wider:
                result[seam.edge] = "would gape"
            elif seam.joint.order and angle > seam.angle + (BENT if self.mending else STEEPER):
                result[seam.edge] = "would kink"
        return result


def _points(nets: Iterable[Net]) -> int:
    """Control points of nets."""
    return sum(math.prod(net.poles.shape[:2]) for net in nets)


def _cost(nets: Iterable[Net]) -> float:
    """What it costs to solve once for all control points of nets: each is joined to others by its degrees."""
    return sum(_points([net]) * (net.u.degree + 1) * (net.v.degree + 1) / 16 for net in nets)


def _within(offsets: dict[int, Array], bound: float | None) -> dict[int, Array]:
    """Offsets made smaller alike until none is longer than the bound."""
    if bound is None:
        return offsets
    largest = max(float(np.linalg.norm(x, axis=-1).max()) for x in offsets.values())
    return {i: min(1.0, bound / max(largest, 1e-300)) * x for i, x in offsets.items()}


def _at_scale(line: Line, scale: float) -> KnotVector:
    return ladder_for_scale(line.knots, line.lengths, scale, keep=line.kept)


def _at_level(lines: list[Line], level: float) -> list[tuple[float, list[KnotVector]]]:
    """Weights and coarse knots of the one or two levels to blend."""
    ladders = [rungs_by_level(each.knots, keep=each.kept, lengths=each.lengths) for each in lines]
    whole, part = int(level), level % 1.0
    weights = [(1.0 - part, whole)] + ([(part, whole + 1)] if part else [])
    return [(weight, [rungs[min(rung, len(rungs) - 1)] for rungs in ladders]) for weight, rung in weights]


def _union(knots: list[Array]) -> Array:
    """Knots of several lists, each as often as where it is most frequent."""
    counts: dict[float, int] = {}
    for each in knots:
        for value, count in zip(*np.unique(each, return_counts=True), strict=True):
            counts[float(value)] = max(counts.get(float(value), 0), int(count))
    return np.sort(np.repeat(list(counts), list(counts.values()))) if counts else np.empty(0)
