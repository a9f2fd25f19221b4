"""Seams that can move: where two edited faces meet along isoparametric curves, and the joint they have there.

Let S and T be the surfaces of a seam, n the parameter across it and t the one along it on S, φ the affine map to T's.
The joint of the input is

    G0   S = T∘φ,    G1   T_n = a S_n + b S_t,    G2   T_nn = a² S_nn + r S_n + s S_t   (a constant, b = 0)

with scalar functions of t that are polynomials as simple as the input allows.  With a, b, r, s kept, these are linear
conditions on a displacement; what the input misses them by (gap, tilt) is then carried unchanged.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from mracad.bspline.knots import Side as Limit
from mracad.bspline.net import cross
from mracad.constraint.coincide import apart, coinciding, length, reach, touching
from mracad.constraint.frozen import CONTINUITY, ISO, local_span
from mracad.constraint.sides import between, inner_side, views
from mracad.model import Edge, Model, Side

Array = np.ndarray
_Jet = tuple[Array, ...]

TRIMMED, UNEVEN = "trimmed", "parameters differ along the seam"
"""Reasons for which a seam cannot move exactly, though it may to a tolerance."""

HELD = "held by --hold"

FREE, ELSEWHERE = "free edge", "touches another instance, which moves by itself"

WHOLE = 1e-2
"""Edges that coincide and differ by less than this in length coincide as a whole."""

CREASE = np.radians(1.0)
"""A seam along which the normals differ by more anywhere is a crease: it keeps G0 only."""

AFFINE = 1e-7
"""Largest deviation, as a fraction of the seam, from an affine map between the parameters along it."""

SLIP = 1e-4
"""Largest distance between points of equal parameter measured along the seam, as a share of its length."""

EXACT, CLOSE = 1e-8, 2e-3
"""A joint's polynomials fit when they miss the input by EXACT of |T_n|; they serve up to CLOSE: the angle of the seam
then grows by at most CLOSE of the angle by which the normal turns."""

BENT = 0.01
"""Share of the curvature by which it may jump along a seam that counts as continuous in curvature."""

_SAMPLES = 0.5 - 0.5 * np.cos(np.pi * (np.arange(33) + 0.5) / 33)
_SHAPES = ((0, -1), (0, 0), (1, -1), (1, 1), (2, -1), (2, 2))


@dataclass(frozen=True)
class Wishes:
    """What seams are to keep, and what is to be mended.

    Attributes
    ----------
    keep : {"g0", "g1", "g2", "as-is"}
        As it is: as much as each of them has.
    fit : float
        Seams whose normals differ by up to this angle anywhere are made tangent.
    close_gaps : bool
    hold : frozenset of int
        Edges that must not move.
    bend : float
        Jump of the curvature, 1/mm, that counts for nothing beside :data:`BENT` of the curvature itself.
    """

    keep: str = "g1"
    fit: float = 0.0
    close_gaps: bool = False
    hold: frozenset[int] = frozenset()
    bend: float = 1e-9

    def order(self, angles: Array, one: Array, other: Array) -> int:
        """Derivatives across an edge that are kept, from what there is along it.

        Parameters
        ----------
        angles : ndarray (q,)
            Between the normals of its two faces.
        one, other : ndarray (q,)
            Curvatures of the two across it, 1/mm; NaN where there is none.
        """
        if not np.nanmax(angles, initial=0.0) <= max(CREASE, self.fit):
            return 0
        if self.keep in CONTINUITY:
            return CONTINUITY[self.keep]
        allowed = self.bend + BENT * np.maximum(np.abs(one), np.abs(other))
        return 2 if bool((np.abs(one - other) <= allowed).all()) else 1


@dataclass(frozen=True, eq=False)
class Border:
    """One side of a seam: an isoparametric curve of a surface.

    Attributes
    ----------
    face, surface : int
    axis : {0, 1}
        The direction across the seam: 0 where it lies on a line u = const.
    at : float
        Parameter of the line.
    limit : {"right", "left"}
        The side of the line on which the face lies.
    start, stop : float
        Parameters along the line where the edge begins and ends.
    """

    face: int
    surface: int
    axis: int
    at: float
    limit: Limit
    start: float
    stop: float

    def places(self, share: Array) -> Array:
        """Parameters ``(q, 2)`` at fractions of the edge."""
        along = (1.0 - share) * self.start + share * self.stop
        return np.stack([np.full_like(along, self.at), along][:: 1 - 2 * self.axis], axis=-1)

    def limits(self, along: Limit) -> tuple[Limit, Limit]:
        """Limits in u and in v."""
        return (self.limit, along) if self.axis == 0 else (along, self.limit)

    def part(self, low: float, high: float) -> Border:
        """What lies between two fractions of it."""
        start, stop = ((1.0 - share) * self.start + share * self.stop for share in (low, high))
        return replace(self, start=start, stop=stop)


@dataclass(frozen=True, eq=False)
class Joint:
    """How smoothly two surfaces meet: coefficients of polynomials in the fraction of the edge, lowest degree first.

    Attributes
    ----------
    order : {0, 1, 2}
        Cross derivatives that the seam keeps.
    across, along : ndarray
        a and b; b is empty where it vanishes.
    bend, shear : float
        r and s.
    missed : float
        Largest part of T_n within the tangent plane that a S_n + b S_t misses, relative.
    close, fit : bool
        Whether the gap and the tilt of the input are to be pulled shut instead of carried.
    smoother : Joint or None
        What there is of second order, where only the first is kept.
    """

    order: int
    across: Array
    along: Array
    bend: float = 0.0
    shear: float = 0.0
    missed: float = 0.0
    close: bool = False
    fit: bool = False
    smoother: Joint | None = None

    @property
    def varying(self) -> bool:
        """Whether a smooth T does not follow from a smooth S of the same degree."""
        return self.order > 0 and (len(self.across) > 1 or len(self.along) > 0)

    def part(self, low: float, high: float) -> Joint:
        """The same between two fractions of the edge, of which it is then the whole."""
        size = high - low
        across, along = (_composed(law, low, size) for law in (self.across, self.along))
        smoother = self.smoother and self.smoother.part(low, high)
        return replace(self, across=across, along=along / size, shear=self.shear / size, smoother=smoother)


@dataclass(frozen=True, eq=False)
class Seam:
    """Two borders of edited faces that meet, and their joint; its fractions run from start to stop on both.

    Attributes
    ----------
    edge, twin : int
        The edge; twice, or the two free edges that coincide in an unsewn model.
    gap, angle : float
        Largest distance at equal fractions, mm, and angle between the outward normals.
    loose : bool
        Whether the joint keeps less than was asked for, no law being known for the rest.
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
        """What lies between two fractions of it."""
        a, b = (border.part(low, high) for border in (self.a, self.b))
        return replace(self, a=a, b=b, joint=self.joint.part(low, high))


@dataclass(frozen=True)
class Treatment:
    """What an edit did about one seam or free edge.

    Attributes
    ----------
    edge : int
        Index in ``Model.edges``.
    faces : tuple of int
        Faces that meet there.
    how : {"coupled", "to tolerance", "mended", "frozen"}
        ``mended``: it moves as a coupled one does, and its gap or tilt is pulled shut.
    reason : str
        Why it is frozen.
    """

    edge: int
    faces: tuple[int, ...]
    how: str
    reason: str = ""


@dataclass(frozen=True, eq=False)
class Seams:
    """What is known of the edges of the faces that an edit may move.

    Attributes
    ----------
    found : list of Seam
        Those that can move exactly.
    closing : dict of int to (Border, Border)
        Closing edges inside a periodic direction, which its spline space keeps as smooth as its knots say by itself.
    frozen : dict of int to str
        Every other edge, and why it does not move.
    twins : dict of int to int
        Free edges that coincide with another one, as a whole.
    orders : dict of int to int
        Derivatives that edges keep with what lies beyond them, if it stays.
    """

    found: list[Seam] = field(default_factory=list)
    closing: dict[int, tuple[Border, Border]] = field(default_factory=dict)
    frozen: dict[int, str] = field(default_factory=dict)
    twins: dict[int, int] = field(default_factory=dict)
    orders: dict[int, int] = field(default_factory=dict)


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
    unsewn = [(edge, (one, two)) for edge, one, two in coinciding(model) if one.face in movable or two.face in movable]
    result = Seams(orders=_orders(model, wishes, [*sewn, *unsewn]))
    for edge in own:
        _sort(result, edge, _still(edge, wishes) or _seam(result, model, movable, wishes, (edge, edge), edge.sides))
    for edge, sides in unsewn:
        _unsewn(result, model, movable, wishes, edge, sides)
    for index in touching(model) & result.frozen.keys():
        if result.frozen[index] == FREE:
            result.frozen[index] = ELSEWHERE
    return result


def _orders(model: Model, wishes: Wishes, found: Sequence[tuple[Edge, Sequence[Side]]]) -> dict[int, int]:
    """Derivatives that edges keep, from how their two faces meet there."""
    looks = views(model, [(edge, side) for edge, sides in found for side in sides])
    result: dict[int, int] = {}
    for (edge, _), a, b in zip(found, looks[::2], looks[1::2], strict=True):
        order = wishes.order(between(a[:, 3:6], b[:, 3:6]), a[:, 6], b[:, 6])
        result[edge.index] = max(order, result.get(edge.index, 0))
    return result


def _still(edge: Edge, wishes: Wishes) -> str:
    """Why an edge stays whatever its faces do; empty where it may move."""
    if edge.index in wishes.hold:
        return HELD
    if edge.degenerate:
        return "pole"
    if len(edge.sides) == 1:
        return FREE
    return "more than two faces" if len(edge.sides) > 2 else ""


def _sort(result: Seams, edge: Edge, seam: Seam | str | tuple[Border, Border]) -> None:
    """Put what is known of an edge where it belongs."""
    if isinstance(seam, Seam):
        result.found.append(seam)
        for each in (seam.edge, seam.twin):
            result.frozen.pop(each, None)
    elif isinstance(seam, str):
        result.frozen[edge.index] = seam
    else:
        result.closing[edge.index] = seam


def _unsewn(
    result: Seams, model: Model, movable: Collection[int], wishes: Wishes, edge: Edge, sides: tuple[Side, Side]
) -> None:
    """Look at a free edge that coincides with one of another face."""
    other = _twin(model, edge, sides[1].face)
    if other:
        result.orders[other.index] = max(result.orders[edge.index], result.orders.get(other.index, 0))
    if edge.index not in result.frozen or (other and other.index not in result.frozen):
        return
    if other is None:
        result.frozen[edge.index] = "coincides with a part of another edge"
        return
    result.twins[edge.index] = other.index
    if wishes.hold & {edge.index, other.index}:
        result.frozen.update(dict.fromkeys((edge.index, other.index), HELD))
        return
    seam = _seam(result, model, movable, wishes, (edge, other), (sides[0], other.sides[0]))
    if not isinstance(seam, tuple):
        _sort(result, edge, seam)


def _twin(model: Model, edge: Edge, face: int) -> Edge | None:
    """The free edge of a face that coincides with another free edge, known to lie on one of that face, as a whole."""
    own = length(edge)
    others = [
        other
        for other in model.edges
        if other.free and other.sides[0].face == face and abs(length(other) - own) <= WHOLE * own
    ]
    nearest = min(others, key=lambda other: apart(edge, other), default=None)
    return nearest if nearest and apart(edge, nearest) <= reach(model, edge, nearest) else None


def runs_back(one: Array, other: Array) -> bool:
    """Whether a curve that coincides with another one runs the other way; both are given by points."""
    at = np.linspace(0, len(other) - 1, len(one)).round().astype(int)
    ahead, behind = (np.linalg.norm(one - other[k], axis=1).mean() for k in (at, at[::-1]))
    return bool(behind < ahead)


def _seam(
    known: Seams,
    model: Model,
    movable: Collection[int],
    wishes: Wishes,
    edges: tuple[Edge, Edge],
    sides: Sequence[Side],
) -> Seam | str | tuple[Border, Border]:
    """The seam, why there is none, or its borders where a periodic space closes it."""
    for side in sides:
        face = model.faces[side.face]
        if face.surface is None:
            return f"{face.kind} neighbour"
        if side.face not in movable:
            return "neighbour does not move"
    a, b = (border(model, edge, side, use) for use, (edge, side) in enumerate(zip(edges, sides, strict=True)))
    if a is None or b is None:
        return TRIMMED
    if edges[0] is not edges[1] and runs_back(edges[0].points, edges[1].points):
        b = replace(b, start=b.stop, stop=b.start)
    fa, fb = model.faces[a.face], model.faces[b.face]
    if np.abs(fa.frame[:3, :3] - fb.frame[:3, :3]).max() > 1e-12:
        return "faces are placed differently"
    if a.surface == b.surface and a.axis == b.axis:
        net = model.surfaces[a.surface].net
        knots = (net.u, net.v)[a.axis]
        if knots.periodic and abs(abs(a.at - b.at) - knots.period) <= ISO * knots.period:
            return a, b
    found = jets(model, a, _SAMPLES, 2), jets(model, b, _SAMPLES, 2)
    order = known.orders.get(edges[0].index, 0)
    if wishes.keep not in CONTINUITY:
        order = min(order, *(_room(model, border) for border in (a, b)))
    joint = _joint(model, (a, b), found, order, wishes)
    if isinstance(joint, str):
        return joint
    gap, angle = _opening(model, (a, b), found)
    return Seam(edges[0].index, edges[1].index, a, b, joint, gap, angle, joint.order < order)


def _room(model: Model, border: Border) -> int:
    """Derivatives across a border that may be kept, and on the other side of the surface, without tying all points."""
    net = model.surfaces[border.surface].net
    return 2 if (net.u, net.v)[border.axis].count > 6 else 1


def border(model: Model, edge: Edge, side: Side, use: int) -> Border | None:
    """The isoparametric curve by which a face meets an edge, run through at a steady pace; None for any other."""
    face = model.faces[side.face]
    assert face.surface is not None and side.uv is not None
    net = model.surfaces[face.surface].net
    trims = [trim for trim in face.trims if trim.edge == edge.index]
    trim = trims[use if len(trims) > 1 else 0]
    ends = trim.curve.evaluate(np.array(trim.curve.knots.domain))[0]
    for axis, knots in enumerate((net.u, net.v)):
        at = trim.curve.poles[:, axis]
        place = float(at.mean())
        if np.ptp(at) > 2 * ISO * local_span(knots, place):
            continue
        low, high = knots.domain
        nearest = float(knots.breaks[np.argmin(np.abs(knots.breaks - place))])
        place = nearest if abs(nearest - place) <= ISO * local_span(knots, place) else place
        along = (net.u, net.v)[1 - axis]
        start, stop = (_snapped(along.breaks, float(x)) for x in ends[:, 1 - axis])
        share = (side.uv[:, 1 - axis] - ends[0, 1 - axis]) / (ends[1, 1 - axis] - ends[0, 1 - axis])
        if abs(share - _pace(len(share))).max() > AFFINE:
            return None
        limit: Limit = "right" if place <= low else "left"
        if low < place < high:
            limit = inner_side(face, trim.edge, axis, place)
        return Border(face.index, face.surface, axis, place, limit, start, stop)
    return None


def _pace(count: int) -> Array:
    """Fractions of an edge at which the model samples it."""
    return 0.5 - 0.5 * np.cos(np.pi * (np.arange(count) + 0.5) / count)


def _snapped(breaks: Array, x: float) -> float:
    nearest = float(breaks[np.argmin(np.abs(breaks - x))])
    return nearest if abs(nearest - x) <= 1e-9 * (breaks[-1] - breaks[0]) else x


def jets(model: Model, border: Border, share: Array, order: int) -> tuple[Array, ...]:
    """``S, S_n, S_t`` and for order 2 ``S_nn`` at fractions of the edge in the part's frame; t is the fraction."""
    face, net = model.faces[border.face], model.surfaces[border.surface].net
    values = net.evaluate(border.places(share), order, border.limits("right"))
    s, su, sv, *second = (x @ face.frame[:3, :3].T for x in values)
    pace = border.stop - border.start
    first = (su, sv * pace) if border.axis == 0 else (sv, su * pace)
    return (s + face.frame[:3, 3], *first, *second[:: 2 if border.axis == 0 else -2][:1])


def opening(model: Model, a: Border, b: Border) -> tuple[float, float]:
    """Largest distance (mm) and angle between the outward normals of two borders at equal fractions."""
    return _opening(model, (a, b), (jets(model, a, _SAMPLES, 1), jets(model, b, _SAMPLES, 1)))


def _opening(model: Model, borders: tuple[Border, Border], found: tuple[_Jet, _Jet]) -> tuple[float, float]:
    normals = [_outward(model, border, *jet[1:3]) for border, jet in zip(borders, found, strict=True)]
    apart = np.linalg.norm(found[0][0] - found[1][0], axis=1)
    return float(apart.max()), float(between(*normals).max())


def _outward(model: Model, border: Border, across: Array, along: Array) -> Array:
    """Outward normals, not of unit length, from the derivatives across and along a border."""
    turned = model.faces[border.face].reversed != (border.stop < border.start)
    return (-1 if turned else 1) * cross(*((across, along) if border.axis == 0 else (along, across)))


def _joint(
    model: Model, borders: tuple[Border, Border], found: tuple[_Jet, _Jet], order: int, wishes: Wishes
) -> Joint | str:
    """The joint between two borders, as much of an order as has a law; or why there is none."""
    (a, b), ((s, sn, st, snn), (t, tn, tt, tnn)) = borders, found
    length = np.linalg.norm(st, axis=1).mean()
    slip = np.abs(((s - t) * st).sum(axis=1) / np.maximum(np.linalg.norm(st, axis=1), 1e-12 * length)).max()
    if slip > SLIP * length:
        return UNEVEN
    normals = _outward(model, a, sn, st), _outward(model, b, tn, tt)
    sizes = [np.linalg.norm(n, axis=1) for n in normals]
    if min(size.min() / max(size.max(), 1e-300) for size in sizes) < 1e-9:
        return "degenerate along the seam"
    close = wishes.close_gaps
    if order == 0:
        return Joint(0, np.ones(1), np.empty(0), close=close)
    fit = bool(between(*normals).max() <= wishes.fit)
    across, along = _components(sn, st, tn)
    size = np.linalg.norm(tn, axis=1)
    for limit in (EXACT, CLOSE):
        for degree, shear in _SHAPES:
            p, q = _polynomial(across, degree), _polynomial(along, shear)
            off = sn * (across - _value(p))[:, None] + st * (along - _value(q))[:, None]
            missed = float((np.linalg.norm(off, axis=1) / size).max())
            if missed <= limit:
                joint = Joint(1, p, q, missed=missed, close=close, fit=fit)
                bent = _bent(joint, sn, st, snn, tnn)
                return bent if order == 2 or bent is joint else replace(joint, smoother=bent)
    return Joint(0, np.ones(1), np.empty(0), close=close)


def _bent(joint: Joint, sn: Array, st: Array, snn: Array, tnn: Array) -> Joint:
    """The joint with its second derivatives, where they have a law."""
    if joint.varying:
        return joint
    bend, shear = _components(sn, st, tnn - joint.across[0] ** 2 * snn)
    scale = np.linalg.norm(tnn, axis=1).max() + 1e-300
    fitted = [
        float(x.mean()) if np.abs(x[:, None] * d).max() > EXACT * scale else 0.0 for x, d in ((bend, sn), (shear, st))
    ]
    off = sn * (bend - fitted[0])[:, None] + st * (shear - fitted[1])[:, None]
    if np.linalg.norm(off, axis=1).max() > CLOSE * scale:
        return joint
    return replace(joint, order=2, bend=fitted[0], shear=fitted[1])


def _components(sn: Array, st: Array, vector: Array) -> tuple[Array, Array]:
    """``x`` and ``y`` of the part x S_n + y S_t of ``vector`` in the tangent plane."""
    nn, nt, tt = ((p * q).sum(axis=1) for p, q in ((sn, sn), (sn, st), (st, st)))
    vn, vt = ((vector * p).sum(axis=1) for p in (sn, st))
    det = nn * tt - nt * nt
    return (vn * tt - vt * nt) / det, (vt * nn - vn * nt) / det


def _polynomial(values: Array, degree: int) -> Array:
    """Coefficients in the fraction of the edge that fit values at the samples; none for degree −1."""
    return np.polynomial.polynomial.polyfit(_SAMPLES, values, degree) if degree >= 0 else np.empty(0)


def _composed(coefficients: Array, low: float, size: float) -> Array:
    """Coefficients of p(low + size x) from those of p(x)."""
    result = np.zeros(len(coefficients))
    for k in range(len(result)):
        result[k] = np.polynomial.polynomial.polyval(low, coefficients) * size**k / math.factorial(k)
        coefficients = np.polynomial.polynomial.polyder(coefficients)
    return result


def _value(coefficients: Array) -> Array:
    return np.polynomial.polynomial.polyval(_SAMPLES, coefficients) if len(coefficients) else np.zeros_like(_SAMPLES)
