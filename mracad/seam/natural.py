"""Seams that can move, where two edited faces meet along isoparametric curves, and why other edges stay."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from mracad.bspline.vectors import across, between
from mracad.model.adjacency import apart, coinciding, length, reach, touching
from mracad.model.brep import Edge, Model, Side
from mracad.seam.border import Border, border
from mracad.seam.cause import Cause, Still
from mracad.seam.hold import CONTINUITY, ISO
from mracad.seam.joint import Joint, met
from mracad.seam.sides import views
from mracad.seam.wishes import Wishes

Array = np.ndarray

WHOLE = 1e-2
"""Edges that coincide and differ by less than this in length coincide as a whole."""


@dataclass(frozen=True, eq=False)
class Seam:
    """Two borders of edited faces that meet, and their joint; fractions run from start to stop on both.

    Attributes
    ----------
    edge, twin : int
        The edge, twice; or the two free edges that coincide in an unsewn model.
    gap, angle : float
        Largest distance at equal fractions, mm, and angle between the outward normals.
    loose : bool
        Whether the joint keeps less than was asked for, because the rest has no law.
    """

    edge: int
    twin: int
    a: Border
    b: Border
    joint: Joint
    gap: float
    angle: float
    loose: bool = False

    def part(self, low: float, high: float) -> Seam:
        """The part between two fractions."""
        a, b = (border.part(low, high) for border in (self.a, self.b))
        return replace(self, a=a, b=b, joint=self.joint.part(low, high))


@dataclass(frozen=True)
class Treatment:
    """The treatment of one seam or free edge by an edit.

    Attributes
    ----------
    edge : int
        Index in ``Model.edges``.
    faces : tuple of int
        Faces that meet there.
    how : {"coupled", "to tolerance", "mended", "slid", "frozen"}
        ``mended``: coupled, and its gap or angle is closed; ``slid``: it moved along a face that stays.
    reason : Cause or None
        Why it is frozen.
    """

    edge: int
    faces: tuple[int, ...]
    how: str
    reason: Cause | None = None


@dataclass(frozen=True, eq=False)
class Meeting:
    """How two faces meet at an edge.

    Attributes
    ----------
    order : {0, 1, 2}
        Number of derivatives that both sides share.
    gap, bend : float
        Largest distance between them, mm, and jump of the curvature across it, 1/mm.
    faces : tuple of int
    sides : tuple of Side
        Both sides at the samples of the edge; empty for the longer edge at a T-junction.
    """

    order: int
    gap: float
    bend: float
    faces: tuple[int, ...]
    sides: tuple[Side, ...] = ()

    def with_(self, other: Meeting | None) -> Meeting:
        """The two meetings of one edge, combined."""
        if other is None:
            return self
        faces = (*self.faces, *(face for face in other.faces if face not in self.faces))
        order, gap, bend = (max(getattr(each, name) for each in (self, other)) for name in ("order", "gap", "bend"))
        return Meeting(order, gap, bend, faces, other.sides or self.sides)


@dataclass(frozen=True, eq=False)
class Seams:
    """The edges of the faces that an edit may move, by kind.

    Attributes
    ----------
    found : list of Seam
        Seams that can move exactly.
    closing : dict of int to (Border, Border)
        Closing edges inside a periodic direction, which its spline space keeps as smooth as its knots allow.
    frozen : dict of int to Cause
        All other edges, and why they do not move.
    twins : dict of int to int
        Free edges that coincide as a whole with another one.
    meetings : dict of int to Meeting
        Edges at which two faces meet.
    """

    found: list[Seam] = field(default_factory=list)
    closing: dict[int, tuple[Border, Border]] = field(default_factory=dict)
    frozen: dict[int, Cause] = field(default_factory=dict)
    twins: dict[int, int] = field(default_factory=dict)
    meetings: dict[int, Meeting] = field(default_factory=dict)

    @property
    def orders(self) -> dict[int, int]:
        """Number of derivatives that edges keep with their other side, if that stays."""
        return {edge: each.order for edge, each in self.meetings.items()}


def seams(model: Model, movable: Collection[int], wishes: Wishes) -> Seams:
    """The seams of the faces that an edit may move.

    Parameters
    ----------
    model : Model
    movable : collection of int
        Faces that the edit may move.
    wishes : Wishes
    """
    own = [edge for edge in model.edges if any(side.face in movable for side in edge.sides)]
    sewn = [(edge, edge.sides) for edge in own if len(edge.sides) == 2 and not edge.degenerate and len(edge.points)]
    unsewn = [each for each in coinciding(model) if any(side.face in movable for side in each[2])]
    every = [*((edge, edge, sides) for edge, sides in sewn), *unsewn]
    result = Seams(meetings=_meetings(model, wishes, every))
    pairs = [_still(edge, wishes) or _pair(model, movable, (edge, edge), edge.sides) for edge in own]
    _sort(result, own, _seams(result, model, wishes, pairs))
    free: dict[int, list[Edge]] = {}
    for edge in (each for each in model.edges if each.free and unsewn):
        free.setdefault(edge.sides[0].face, []).append(edge)
    for edge, _, sides in unsewn:
        _unsewn(result, model, movable, wishes, edge, sides, free[sides[1].face])
    for edge, other, sides in unsewn:
        _bound(result, (edge.index, other.index), _fixed(model, movable, sides) or Cause(Still.PART))
    _bound(result, touching(model), Cause(Still.ELSEWHERE))
    return result


def _bound(result: Seams, edges: Iterable[int], cause: Cause) -> None:
    """Say why edges stay that are free in the topology, but not in space."""
    for edge in edges:
        if edge in result.frozen and result.frozen[edge].still is Still.FREE:
            result.frozen[edge] = cause


def _meetings(model: Model, wishes: Wishes, found: Sequence[tuple[Edge, Edge, Sequence[Side]]]) -> dict[int, Meeting]:
    """How two faces meet: at one edge, or at an edge and another one that contains it."""
    looks = views(model, [(edge, side) for edge, _, sides in found for side in sides])
    result: dict[int, Meeting] = {}
    for (edge, other, sides), a, b in zip(found, looks[::2], looks[1::2], strict=True):
        order = wishes.order(between(a[:, 3:6], b[:, 3:6]), a[:, 6], b[:, 6])
        gap = float(np.linalg.norm(across(a[:, :3] - b[:, :3], edge.tangents), axis=1).max())
        jump = float(np.nanmax(np.abs(a[:, 6] - b[:, 6]), initial=0.0))
        for each in {edge.index: edge, other.index: other}.values():
            met = Meeting(order, gap, jump, tuple(s.face for s in sides), tuple(sides) if each is edge else ())
            result[each.index] = met.with_(result.get(each.index))
    return result


def _still(edge: Edge, wishes: Wishes) -> Cause | None:
    """Why an edge stays even if its faces move; None if it may move."""
    if edge.index in wishes.hold:
        return Cause(Still.HELD)
    if edge.degenerate:
        return Cause(Still.POLE)
    if len(edge.sides) == 1:
        return Cause(Still.FREE)
    return Cause(Still.CROWDED) if len(edge.sides) > 2 else None


def _sort(result: Seams, edges: Sequence[Edge], found: Sequence[Seam | Cause | tuple[Border, Border]]) -> None:
    """File edges under their kind."""
    for edge, seam in zip(edges, found, strict=True):
        if isinstance(seam, Seam):
            result.found.append(seam)
            for each in (seam.edge, seam.twin):
                result.frozen.pop(each, None)
        elif isinstance(seam, Cause):
            result.frozen[edge.index] = seam
        else:
            result.closing[edge.index] = seam


def _unsewn(
    result: Seams,
    model: Model,
    movable: Collection[int],
    wishes: Wishes,
    edge: Edge,
    sides: tuple[Side, Side],
    free: Sequence[Edge],
) -> None:
    """Treat a free edge that coincides with one of another face, given the free edges of that."""
    other = _twin(model, edge, free)
    if edge.index not in result.frozen or (other and other.index not in result.frozen):
        return
    if other is None:
        result.frozen[edge.index] = Cause(Still.PART)
        return
    result.twins[edge.index] = other.index
    if wishes.hold & {edge.index, other.index}:
        result.frozen.update(dict.fromkeys((edge.index, other.index), Cause(Still.HELD)))
        return
    pair = _pair(model, movable, (edge, other), (sides[0], other.sides[0]))
    (seam,) = _seams(result, model, wishes, [pair])
    if not isinstance(seam, tuple):
        _sort(result, [edge], [seam])


def _twin(model: Model, edge: Edge, free: Sequence[Edge]) -> Edge | None:
    """The one of the free edges of a face that coincides as a whole with another free edge."""
    own = length(edge)
    others = [other for other in free if abs(length(other) - own) <= WHOLE * own]
    nearest = min(others, key=lambda other: apart(model, edge, other), default=None)
    return nearest if nearest and apart(model, edge, nearest) <= reach(model, edge, nearest) else None


def runs_back(one: Array, other: Array) -> bool:
    """Whether a curve runs opposite to another one that coincides with it; both are given by points."""
    at = np.linspace(0, len(other) - 1, len(one)).round().astype(int)
    ahead, behind = (np.linalg.norm(one - other[k], axis=1).mean() for k in (at, at[::-1]))
    return bool(behind < ahead)


@dataclass(frozen=True, eq=False)
class _Pair:
    """Two edges, which may be the same, and the borders that meet there."""

    edges: tuple[Edge, Edge]
    borders: tuple[Border, Border]


def _pair(
    model: Model, movable: Collection[int], edges: tuple[Edge, Edge], sides: Sequence[Side]
) -> _Pair | Cause | tuple[Border, Border]:
    """The borders of a seam, the cause if there is none, or only its borders if a periodic space closes it."""
    if reason := _fixed(model, movable, sides):
        return reason
    a, b = (border(model, edge, side, use) for use, (edge, side) in enumerate(zip(edges, sides, strict=True)))
    if a is None or b is None:
        return Cause(Still.TRIMMED)
    if edges[0] is not edges[1] and runs_back(edges[0].points, edges[1].points):
        b = replace(b, start=b.stop, stop=b.start)
    fa, fb = model.faces[a.face], model.faces[b.face]
    if np.abs(fa.frame[:3, :3] - fb.frame[:3, :3]).max() > 1e-12:
        return Cause(Still.PLACED)
    if a.surface == b.surface and a.axis == b.axis:
        net = model.surfaces[a.surface].net
        knots = (net.u, net.v)[a.axis]
        if knots.periodic and abs(abs(a.at - b.at) - knots.period) <= ISO * knots.period:
            return a, b
    return _Pair(edges, (a, b))


def _seams(
    known: Seams, model: Model, wishes: Wishes, found: Sequence[_Pair | Cause | tuple[Border, Border]]
) -> list[Seam | Cause | tuple[Border, Border]]:
    """The same, with seams for pairs of borders that have a joint, and the cause for others."""
    pairs, orders = [each for each in found if isinstance(each, _Pair)], []
    for pair in pairs:
        index = pair.edges[0].index
        order = known.meetings[index].order if index in known.meetings else 0
        if wishes.keep not in CONTINUITY:
            order = min(order, *(_room(model, border) for border in pair.borders))
        orders.append(order)
    how = met(model, [pair.borders for pair in pairs], orders, wishes)
    figures = zip(pairs, orders, how.joints, how.gaps, how.angles, strict=True)
    ready = iter(
        joint
        if isinstance(joint, Cause)
        else Seam(pair.edges[0].index, pair.edges[1].index, *pair.borders, joint, gap, angle, joint.order < order)
        for pair, order, joint, gap, angle in figures
    )
    return [next(ready) if isinstance(each, _Pair) else each for each in found]


def _fixed(model: Model, movable: Collection[int], sides: Sequence[Side]) -> Cause | None:
    """Why one of two faces cannot move; None if both can."""
    for side in sides:
        face = model.faces[side.face]
        if face.surface is None:
            return Cause(Still.ANALYTIC, face.kind)
        if side.face not in movable:
            return Cause(Still.NEIGHBOUR)
    return None


def _room(model: Model, border: Border) -> int:
    """Number of derivatives that can be kept across a border and its opposite without fixing all control points."""
    net = model.surfaces[border.surface].net
    return 2 if (net.u, net.v)[border.axis].count > 6 else 1
