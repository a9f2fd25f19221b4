"""Seams that can move only to a tolerance: along trim curves, or where the parameters of the two sides have no law.

On such a seam no two spline spaces match.  Its conditions on a displacement δ are asked at points of the two curves in
the parameter planes that belong together:

    G0   δ_b = δ_a,      G1   D_c δ_b = D_c δ_a,      G2   D_c² δ_b + D_z δ_b = D_c² δ_a,

D_c the derivative in the direction of the conormal c of the input (the unit vector in the tangent plane of side a,
across the edge), z the direction that makes the second derivatives of the input differ along the normal only.  The
coarse spaces meet them at about as many points as the coarser of the two has spans along the seam; on the fine nets
they are shut to the tolerance (:mod:`mracad.constraint.shut`).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from mracad.bspline.curve import Curve
from mracad.bspline.functions import functions
from mracad.bspline.knots import KnotVector
from mracad.bspline.knots import Side as Limit
from mracad.bspline.net import Net, curvature
from mracad.constraint.frozen import local_span
from mracad.constraint.region import meeting
from mracad.constraint.seam import UNEVEN, Border, Seam, Wishes, runs_back
from mracad.constraint.sides import between, from_inside
from mracad.model import Edge, Face, Model, Trim

Array = np.ndarray

SAMPLES = 1025
"""Points of a trace between which it counts as straight in search of crossings."""

NEAR = 1e-9
"""Crossings closer than this fraction of the edge are one."""

GAUSS = 4
"""Conditions in each piece of a seam between crossings."""

NEWTON = 6
"""Steps in which the fractions of two edges that belong together are found."""

_EVENLY = np.linspace(0.0, 1.0, SAMPLES)
_SHARES = 0.5 - 0.5 * np.cos(np.pi * (np.arange(75) + 0.5) / 75)


@dataclass(frozen=True, eq=False)
class Trace:
    """One side of a trimmed seam.

    Attributes
    ----------
    face, surface : int
    curve : Curve
        In the parameter plane, over the edge's range.
    law : (ndarray, ndarray), optional
        Fractions of the seam and the fractions of the curve that belong to them, where these are not the same.
    line : (int, float), optional
        The axis and the knot line on which it lies.
    limits : (str, str)
        The sides of knot lines in u and v on which the face lies.
    """

    face: int
    surface: int
    curve: Curve
    law: tuple[Array, Array] | None = None
    line: tuple[int, float] | None = None
    limits: tuple[Limit, Limit] = ("right", "right")

    def places(self, share: Array) -> Array:
        """Parameters ``(q, 2)`` at fractions of the seam."""
        uv = self.curve.evaluate(self._at(share))[0]
        if self.line is not None:
            uv[:, self.line[0]] = self.line[1]
        return uv

    def on(self, net: Net, share: Array, derivatives: int) -> tuple[Array, ...]:
        """A surface and its derivatives at fractions of the seam, seen from inside the face."""
        return tuple(np.asarray(x) for x in net.evaluate(self.places(share), derivatives, self.limits))

    def inside(self, net: Net, share: Array) -> Array:
        """Parameters ``(q, 2)`` in the knot cells in which the face meets the seam at fractions of it."""
        uv = self.places(share)
        if self.line is not None:
            axis, at = self.line
            step = 0.5 * local_span((net.u, net.v)[axis], at)
            uv[:, axis] += step if self.limits[axis] == "right" else -step
        return uv

    def cells(self, net: Net, share: Array) -> Array:
        """Knot cells of a surface on which the face meets the seam at fractions of it, a mask."""
        uv = self.inside(net, share)
        return meeting(net, np.stack([uv, uv], axis=1))

    def part(self, low: float, high: float) -> Trace:
        """What lies between two fractions of the seam, itself from 0 to 1."""
        share = np.linspace(low, high, 2 if self.law is None else SAMPLES)
        whole = share if self.law is None else np.interp(share, *self.law)
        return replace(self, law=(np.linspace(0.0, 1.0, len(share)), whole))

    def way(self, share: Array) -> Array:
        """Derivative of the curve by its own fraction, in the sense of the seam, ``(q, 2)``."""
        start, stop = self.curve.knots.domain
        back = self.law is not None and self.law[1][-1] < self.law[1][0]
        return self.curve.evaluate(self._at(share), 1)[1] * (start - stop if back else stop - start)

    def _at(self, share: Array) -> Array:
        start, stop = self.curve.knots.domain
        return start + (share if self.law is None else np.interp(share, *self.law)) * (stop - start)


@dataclass(frozen=True, eq=False)
class TrimmedSeam:
    """Two traces that meet.

    Attributes
    ----------
    edge, twin : int
        The edge; twice, or the two free edges that coincide in an unsewn model.
    order : {0, 1, 2}
        Cross derivatives that the seam keeps.
    opening : ndarray (3,)
        Largest gap, angle and curvature jump of the input, as :func:`parted` measures them.
    close, fit : bool
        Whether the gap and the tilt of the input are to be pulled shut instead of carried.
    since : {0, 1, 2}
        The least of the derivatives that are kept to the tolerance: an exact seam keeps those below.
    """

    edge: int
    twin: int
    a: Trace
    b: Trace
    order: int
    opening: Array
    close: bool
    fit: bool
    since: int = 0

    def excess(
        self, before: Model, after: Model, allowed: Sequence[float], more: Sequence[float]
    ) -> tuple[Array, Array]:
        """Opening after an edit, relative to what it may be, the worst of all that the seam keeps.

        It may be what the input had at its worst; the gap no more than what it had at the same place and the tolerance.

        Parameters
        ----------
        before, after : Model
        allowed, more : sequence of float
            Gap (mm), angle and curvature jump (1/mm) that a seam may have whatever it had, and that it may have more
            than it had.

        Returns
        -------
        share, excess : ndarray (q,)
            Fractions of the edge, and the excess there.
        """
        share = judged(after, (self.a, self.b))
        old, now = (parted(model, self.a, self.b, share) for model in (before, after))
        worst = np.fmax(self.opening, np.fmax.reduce(old, axis=1))  # there are more places on finer nets
        limit = np.repeat(np.maximum(allowed, worst + more)[:, None], len(share), axis=1)
        limit[0] = np.minimum(limit[0], old[0] + allowed[0] + more[0])
        return share, (now / limit)[: self.order + 1].max(axis=0)


def trimmed(model: Model, edge: Edge, twin: Edge, wishes: Wishes) -> TrimmedSeam | str:
    """The seam of an edge between two NURBS faces along their trim curves, or why it cannot move.

    Parameters
    ----------
    model : Model
    edge, twin : Edge
        The edge; twice, or the two free edges that coincide in an unsewn model.
    wishes : Wishes
    """
    faces = [model.faces[i] for i in (edge.sides[0].face, twin.sides[-1].face)]
    if not np.allclose(faces[0].frame, faces[1].frame, rtol=0, atol=1e-12):
        return "faces are placed differently"
    if faces[0] is faces[1]:
        return "a face that meets itself"
    a, b = (trace_of(model, face, _trim(face, each)) for face, each in zip(faces, (edge, twin), strict=True))
    if edge is not twin:
        fractions = _followed(model, a, b, runs_back(edge.points, twin.points))
        if (np.diff(fractions) * (fractions[-1] - fractions[0]) <= 0).any():
            return UNEVEN
        b = replace(b, law=(_EVENLY, fractions))
    return _judged(model, edge.index, twin.index, (a, b), wishes)


def _followed(model: Model, a: Trace, b: Trace, back: bool) -> Array:
    """Fractions of the curve of b nearest to points at even fractions of a."""
    points = model.surfaces[a.surface].net.evaluate(a.places(_EVENLY))
    fractions = _EVENLY[::-1] if back else _EVENLY
    net = model.surfaces[b.surface].net
    for _ in range(NEWTON):
        s, su, sv = net.evaluate(b.places(fractions), 1)
        way = b.way(fractions)
        along = su * way[:, :1] + sv * way[:, 1:]
        step = ((points - s) * along).sum(axis=1) / np.maximum((along**2).sum(axis=1), 1e-300)
        fractions = np.clip(fractions + step, 0.0, 1.0)
    ends = [1.0, 0.0] if back else [0.0, 1.0]
    return np.concatenate([ends[:1], fractions[1:-1], ends[1:]])


def beside(model: Model, seam: Seam, wishes: Wishes) -> TrimmedSeam | str:
    """What the joint of a seam does not keep, to the tolerance."""
    found = _judged(model, seam.edge, seam.twin, (along(seam.a), along(seam.b)), wishes)
    return replace(found, since=seam.joint.order + 1) if isinstance(found, TrimmedSeam) and seam.joint.order else found


def along(border: Border) -> Trace:
    """The trace of a border."""
    ends = Curve(KnotVector.clamped([0.0, 1.0], 1), border.places(np.array([0.0, 1.0])))
    return Trace(border.face, border.surface, ends, line=(border.axis, border.at), limits=border.limits("right"))


def _judged(model: Model, edge: int, twin: int, traces: tuple[Trace, Trace], wishes: Wishes) -> TrimmedSeam | str:
    apart, angles, bends = _opened(model, traces, judged(model, traces))
    opening = np.array([apart.max(), angles.max(), np.abs(bends[0] - bends[1]).max()])
    angle = opening[1]
    if not np.isfinite(angle):
        return "degenerate along the seam"
    order = wishes.order(angles, *bends)
    if order == 2 and not np.isfinite(opening[2]):
        return "no curvature along the seam"
    close, fit = wishes.close_gaps, order > 0 and bool(angle <= wishes.fit)
    return TrimmedSeam(edge, twin, *traces, order, opening, close, fit)


def _trim(face: Face, edge: Edge) -> Trim:
    return next(trim for trim in face.trims if trim.edge == edge.index)


def trace_of(model: Model, face: Face, trim: Trim) -> Trace:
    """The trace by which a face meets one of its edges."""
    assert face.surface is not None
    net = model.surfaces[face.surface].net
    trace = Trace(face.index, face.surface, trim.curve)
    uv, limits = from_inside(face, net, trim.edge, trace.places(_SHARES))
    lines = [axis for axis in (0, 1) if np.ptp(uv[:, axis]) == 0.0]
    return replace(trace, line=(lines[0], float(uv[0, lines[0]])) if lines else None, limits=limits)


def judged(model: Model, traces: tuple[Trace, Trace]) -> Array:
    """Fractions of an edge at which a seam is judged: those of the report, and the Gauss points of all spans."""
    spaces = {t.surface: (model.surfaces[t.surface].net.u, model.surfaces[t.surface].net.v) for t in traces}
    return np.sort(np.concatenate([_SHARES, fine_sites(traces, spaces)[0]]))


def parted(model: Model, a: Trace, b: Trace, share: Array) -> Array:
    """Gap (mm, what lies along the seam left out), angle between outward normals, curvature jump (1/mm): ``(3, q)``."""
    apart, angles, bends = _opened(model, (a, b), share)
    return np.stack([apart, angles, np.abs(bends[0] - bends[1])])


def _opened(model: Model, traces: tuple[Trace, Trace], share: Array) -> tuple[Array, Array, list[Array]]:
    """Gap (mm) and angle between outward normals at fractions of a seam, and the curvatures of both sides across it."""
    points, normals, bends = [], [], []
    for trace in traces:
        face, net = model.faces[trace.face], model.surfaces[trace.surface].net
        s, *derivatives = (x @ face.frame[:3, :3].T for x in trace.on(net, share, 2))
        way = trace.way(share)
        along = derivatives[0] * way[:, :1] + derivatives[1] * way[:, 1:]
        sign = -1 if face.reversed else 1
        points.append(s + face.frame[:3, 3])
        normals.append(sign * np.cross(derivatives[0], derivatives[1]))
        bends.append(sign * curvature(tuple(derivatives), np.cross(normals[-1], along)))
    apart = across(points[0] - points[1], along)
    angle = between(*normals)
    angle[np.minimum(*(np.linalg.norm(n, axis=1) for n in normals)) == 0.0] = np.nan
    return np.linalg.norm(apart, axis=1), angle, bends


def across(vectors: Array, along: Array) -> Array:
    """The part of vectors ``(q, 3)`` across directions ``along``."""
    along = along / np.maximum(np.linalg.norm(along, axis=1, keepdims=True), 1e-300)
    return vectors - (vectors * along).sum(axis=1, keepdims=True) * along


def crossings(trace: Trace, spaces: tuple[KnotVector, KnotVector]) -> Array:
    """Fractions of the edge, 0 and 1 among them, at which a trace crosses the knot lines of a space."""
    share = _EVENLY
    found = [share[[0, -1]]]
    for knots, x in zip(spaces, trace.places(share).T, strict=True):
        lines = knots.breaks
        if knots.periodic:
            lines = np.unique(lines[None] + knots.period * np.arange(-2, 3)[:, None])
        low, high = np.minimum(x[:-1], x[1:]), np.maximum(x[:-1], x[1:])
        first, last = np.searchsorted(lines, low, "right"), np.searchsorted(lines, high, "left")
        step = np.repeat(np.arange(len(low)), np.maximum(last - first, 0))
        line = lines[first[step] + np.arange(len(step)) - np.searchsorted(step, step)]
        inside = (line - x[step]) / (x[step + 1] - x[step])
        found.append(share[step] + inside * (share[1] - share[0]))
    every = np.sort(np.concatenate(found))
    return every[np.append(True, np.diff(every) > NEAR)]


def coarse_sites(seam: TrimmedSeam, spaces: Mapping[int, tuple[KnotVector, KnotVector]]) -> Array:
    """Fractions at which conditions are asked of coarse spaces: the Greville points of cubics over the fewer spans."""
    breaks = min((crossings(trace, spaces[trace.surface]) for trace in (seam.a, seam.b)), key=len)
    return KnotVector.clamped(breaks, 3).greville()


def fine_sites(traces: tuple[Trace, Trace], spaces: Mapping[int, tuple[KnotVector, KnotVector]]) -> tuple[Array, Array]:
    """Fractions at which conditions are asked of fine spaces, and their weights: Gauss points of all spans."""
    breaks = np.sort(np.concatenate([crossings(trace, spaces[trace.surface]) for trace in traces]))
    breaks = breaks[np.append(True, np.diff(breaks) > NEAR)]
    place, weight = np.polynomial.legendre.leggauss(GAUSS)
    width = np.diff(breaks)[:, None]
    return (breaks[:-1, None] + width * (place + 1) / 2).ravel(), (width * weight / 2).ravel()


def collocation(
    nets: Mapping[int, Net], ground: Mapping[int, Net], seams: Sequence[TrimmedSeam], shares: Sequence[Array]
) -> Any:
    """The conditions of trimmed seams on the control points of nets, laid out one after another.

    Parameters
    ----------
    nets : mapping of int to Net
        Spaces of the displacement by surface.
    ground : mapping of int to Net
        The input's surfaces, from which the conormals are taken.
    seams, shares
        The seams and the fractions at which each is asked.

    Returns
    -------
    scipy.sparse.csr_array (conditions, points)
        For each seam in turn the conditions of order 0, then those of order 1 and 2 where it keeps them.
    """
    from scipy.sparse import csr_array

    sizes = [net.u.count * net.v.count for net in nets.values()]
    first = dict(zip(nets, np.cumsum([0, *sizes])[:-1].tolist(), strict=True))
    entries: list[tuple[Array, Array, Array]] = [(np.empty(0, int), np.empty(0, int), np.empty(0))]
    count = 0
    for seam, share in zip(seams, shares, strict=True):
        ways = conormals(ground, seam.a, seam.b, share)
        for order in range(seam.order + 1):
            row = count + np.arange(len(share))
            for trace, (way, bend), sign in zip((seam.b, seam.a), ways[::-1], (1.0, -1.0), strict=True):
                index, table = functions(nets[trace.surface], trace.places(share), order, trace.limits)
                value = derived(table, way, bend, order)
                where = np.repeat(row, index.shape[1])
                entries.append((where, first[trace.surface] + index.ravel(), sign * value.ravel()))
            count += len(share)
    row, column, value = (np.concatenate(x) for x in zip(*entries, strict=True))
    return csr_array((value, (row, column)), shape=(count, sum(sizes)))


def derived(table: Sequence[Array], way: Array, bend: Array, order: int) -> Array:
    """D_c of an order of basis functions, and D_z with the second.

    Parameters
    ----------
    table : sequence of ndarray (q, k)
        As :func:`mracad.bspline.functions.functions` gives them.
    way, bend : ndarray (q, 2)
        c and z.
    order : {0, 1, 2}

    Returns
    -------
    ndarray (q, k)
    """
    x, y = way[:, :1], way[:, 1:]
    if order == 0:
        return table[0]
    if order == 1:
        return x * table[1] + y * table[2]
    twice = x * x * table[3] + 2 * x * y * table[4] + y * y * table[5]
    return twice + bend[:, :1] * table[1] + bend[:, 1:] * table[2]


def conormals(ground: Mapping[int, Net], a: Trace, b: Trace, share: Array) -> list[tuple[Array, Array]]:
    """For a and b the directions c and z ``(q, 2)`` in the parameter planes."""
    _, su, sv, *second = a.on(ground[a.surface], share, 2)
    way = a.way(share)
    conormal = np.cross(np.cross(su, sv), su * way[:, :1] + sv * way[:, 1:])
    conormal /= np.maximum(np.linalg.norm(conormal, axis=1, keepdims=True), 1e-300)
    _, tu, tv, *other = b.on(ground[b.surface], share, 2)
    ways = _components(su, sv, conormal), _components(tu, tv, conormal)
    bends = [_twice(x, y) for x, y in zip(ways, (second, other), strict=True)]
    return [(ways[0], np.zeros_like(way)), (ways[1], _components(tu, tv, bends[0] - bends[1]))]


def _twice(way: Array, second: Sequence[Array]) -> Array:
    """Second derivative in a direction, from those along u and v."""
    x, y = way[:, :1], way[:, 1:]
    return x * x * second[0] + 2 * x * y * second[1] + y * y * second[2]


def _components(su: Array, sv: Array, vector: Array) -> Array:
    """``(x, y)`` with x S_u + y S_v the part of ``vector`` in the tangent plane."""
    e, f, g, p, q = ((x * y).sum(axis=1) for x, y in ((su, su), (su, sv), (sv, sv), (su, vector), (sv, vector)))
    determinant = np.maximum(e * g - f * f, 1e-300)
    return np.stack([p * g - q * f, q * e - p * f], axis=1) / determinant[:, None]
