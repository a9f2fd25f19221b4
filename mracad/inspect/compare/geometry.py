"""Distances between matched faces, and between their outlines."""

from __future__ import annotations

from collections import Counter, defaultdict
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from mracad.brief import line
from mracad.bspline.closest import distances
from mracad.inspect.compare.subject import EQUAL, Array, CompareLimits, Match, Point, Subject, layer, paired
from mracad.inspect.verdict import Finding, Layer
from mracad.model.brep import Face, Model
from mracad.model.region import covered, supported

_LINES = 40  # largest number of sample lines across a face

SAME = 1e-6
"""Distance, mm, within which a face counts as unmoved."""

LAID_ANEW = 1e-4
"""Largest difference of an outline in another format, mm: readers rebuild curves within the edges' tolerances."""


@dataclass(frozen=True)
class Spread:
    """Distances of points of one face from another: largest, mean, 95th percentile, and the point of the largest."""

    largest: float = 0.0
    mean: float = 0.0
    p95: float = 0.0
    where: Point | None = None


@dataclass(frozen=True)
class FaceDeviation:
    """Distances between a face and its partner.

    Attributes
    ----------
    ref, new : int
        Indices of the two faces in their documents.
    there, back : Spread
        From the reference to the new surface, and from the new to the reference.
    bound : float or None
        Certified bound on both where the parameterisations match: the largest distance of two control points.
    outline : Spread
        Distances between the two boundaries.
    tolerance : float
        The larger tolerance of the edges of either boundary, mm.
    """

    ref: int
    new: int
    there: Spread
    back: Spread
    bound: float | None
    outline: Spread
    tolerance: float

    __repr__ = line

    @property
    def worst(self) -> Spread:
        return max(self.there, self.back, key=lambda s: s.largest)


Measured = list[tuple[tuple[int, int], FaceDeviation]]
"""Matched faces of the two models, and their distances."""


def deviation(ref: Subject, new: Subject, measured: Measured, limits: CompareLimits, exact: bool) -> Layer:
    """Deviations of faces; unless ``exact``, outlines may differ as much as another format requires."""
    findings, within = [], []
    for (i, j), d in measured:
        if not d.worst.largest <= limits.deviation:
            findings.append(_beyond(ref, new, i, j, "deviates", d.worst))
        slack = 0.0 if exact else min(d.tolerance, LAID_ANEW)
        if not d.outline.largest <= max(limits.deviation, slack):
            findings.append(_beyond(ref, new, i, j, "outline", d.outline))
        elif d.outline.largest > limits.deviation:
            within.append(d)
    each = [d for _, d in measured]
    worst = max(each, key=lambda d: d.worst.largest, default=None)
    largest = worst.worst.largest if worst else 0.0
    outline = max((d.outline.largest for d in each), default=0.0)
    where = f" on #{worst.new + 1}" if worst and largest > EQUAL * ref.model.diagonal else ""
    text = f"max {largest:.3g} mm{where}, outlines {outline:.3g} mm"
    figures = {"largest": largest, "outline": outline, "limit": limits.deviation, "each": each}
    return layer("deviation", text, findings, figures, [_within(within)] if within else [])


def _beyond(ref: Subject, new: Subject, i: int, j: int, rule: str, spread: Spread) -> Finding:
    found = paired(ref, new, i, j, rule, by=spread.largest)
    return Finding(rule, found.faces, where=spread.where, figures=found.figures)


def _within(found: list[FaceDeviation]) -> Finding:
    """The note that outlines were rebuilt."""
    worst = max(found, key=lambda d: d.outline.largest)
    figures = {"by": worst.outline.largest, "count": len(found)}
    return Finding("outline-tolerance", (worst.new,), where=worst.outline.where, figures=figures)


def deviations(ref: Subject, new: Subject, groups: Sequence[Match]) -> Measured:
    """Distances of every matched pair of faces, in the order of the reference; parts of one face together."""
    edges = _edges(ref.model), _edges(new.model)
    found = []
    for group in groups:
        rims = [_rim(e, faces) for e, faces in zip(edges, (group.ref, group.new), strict=True)]
        if group.ref == group.new and len(group.ref) == 1 and group.ref[0] in new.same:
            face = ref.model.faces[group.ref[0]]
            off = new.same[face.index]
            there = back = outline = Spread(off, off, off, _middle(face))
            bound = off if face.surface is not None else None
        else:
            there, back, bound = _apart(ref, new, group)
            outline = _outline(ref, new, rims[0], rims[1])
        tolerance = max(_loosest(subject, rim) for subject, rim in zip((ref, new), rims, strict=True))
        for i, j in group.pairs():
            numbers = int(ref.face_numbers[i]), int(new.face_numbers[j])
            found.append(((i, j), FaceDeviation(*numbers, there, back, bound, outline, tolerance)))
    return found


def unchanged(ref: Subject, measured: Measured) -> frozenset[int]:
    """The faces of the new model whose surface and outline have not moved."""
    near = max(SAME, EQUAL * ref.model.diagonal)
    moved = {j for (_, j), d in measured if not max(d.worst.largest, d.outline.largest) <= near}
    return frozenset(j for (_, j), _ in measured if j not in moved)


def _apart(ref: Subject, new: Subject, group: Match) -> tuple[Spread, Spread, float | None]:
    """Distances there and back, and their bound."""
    bound = None
    if len(group.ref) == len(group.new) == 1:
        i, j = group.ref[0], group.new[0]
        bound = _bound(ref.model, new.model, i, j)
        if bound is not None and bound <= EQUAL * ref.model.diagonal:
            same = Spread(bound, bound, bound, _middle(ref.model.faces[i]))
            return same, same, bound
    return _one_way(ref, group.ref, new, group.new), _one_way(new, group.new, ref, group.ref), bound


def _one_way(one: Subject, faces: Sequence[int], other: Subject, targets: Sequence[int]) -> Spread:
    """Distances of points of faces from the nearest of other faces."""
    points = np.concatenate([one.gauge.sample(face, _density(one.model, face)) for face in faces])
    off = np.stack([_off(other, target, points) for target in targets])
    return _spread(points, np.fmin.reduce(off, axis=0))


def _middle(face: Face) -> Point:
    x, y, z = face.box.mean(axis=0).tolist()
    return x, y, z


def _bound(ref: Model, new: Model, i: int, j: int) -> float | None:
    """Largest distance of two control points that the faces depend on; None where the parameterisations differ."""
    a, b = ref.faces[i], new.faces[j]
    if a.surface is None or b.surface is None:
        return None
    old, fresh = ref.surfaces[a.surface].net, new.surfaces[b.surface].net
    if old.poles.shape != fresh.poles.shape or (old.weights is None) != (fresh.weights is None):
        return None
    for p, q in ((old.u, fresh.u), (old.v, fresh.v)):
        if p.degree != q.degree or p.periodic != q.periodic or len(p.knots) != len(q.knots):
            return None
        if np.abs(p.knots - q.knots).max() > 1e-12 * p.period:
            return None
    if old.weights is not None and np.abs(old.weights - fresh.weights).max() > 1e-12 * old.weights.max():
        return None
    placed = [face.placed(net.poles) for net, face in ((old, a), (fresh, b))]
    seen = supported(old, covered(old, a)) | supported(fresh, covered(fresh, b))
    return float(np.linalg.norm(placed[1] - placed[0], axis=-1)[seen].max(initial=0.0))


def _density(model: Model, index: int) -> tuple[int, int]:
    """Number of sample lines in u and v, enough to meet every span, up to a limit."""
    surface = model.faces[index].surface
    if surface is None:
        return 0, 0
    net = model.surfaces[surface].net
    return min(2 * net.u.spans + 1, _LINES), min(2 * net.v.spans + 1, _LINES)


def _off(subject: Subject, index: int, points: Array) -> Array:
    """Distances of points from the surface under a face."""
    if not len(points):
        return np.empty(0)
    face = subject.model.faces[index]
    if face.surface is None:
        return subject.gauge.distances(index, points)
    return distances(subject.model.surfaces[face.surface].net, face.local(points))


def _spread(points: Array, off: Array) -> Spread:
    if not len(points):
        return Spread()
    worst = int(np.nanargmax(off)) if not np.isnan(off).all() else 0
    x, y, z = points[worst].tolist()
    return Spread(float(off[worst]), float(np.nanmean(off)), float(np.nanpercentile(off, 95)), (x, y, z))


def _edges(model: Model) -> dict[int, list[int]]:
    """The edges of each face, one entry per use."""
    edges: dict[int, list[int]] = defaultdict(list)
    for edge in model.edges:
        if len(edge.points):
            for side in edge.sides:
                edges[side.face].append(edge.index)
    return edges


def _rim(edges: dict[int, list[int]], faces: Sequence[int]) -> list[int]:
    """The edges around some faces, without closing ones and those between them."""
    uses = Counter(edge for face in faces for edge in edges[face])
    return [edge for edge, count in uses.items() if count == 1]


def _loosest(subject: Subject, rim: Sequence[int]) -> float:
    """The largest tolerance of some edges, mm."""
    return max((float(subject.model.edges[edge].tolerance) for edge in rim), default=0.0)


def _outline(ref: Subject, new: Subject, old: list[int], fresh: list[int]) -> Spread:
    """Distances between two boundaries."""
    from scipy.spatial import cKDTree

    nothing = np.empty((0, 3))
    a, b = (
        np.concatenate([nothing, *(subject.model.edges[e].points for e in rim)])
        for subject, rim in ((ref, old), (new, fresh))
    )
    if not len(a) or not len(b):
        return Spread() if len(a) == len(b) else Spread(float("inf"))
    near = [cKDTree(b).query(a)[0], cKDTree(a).query(b)[0]]
    if max(near[0].max(), near[1].max()) > EQUAL * ref.model.diagonal:
        near = [new.gauge.edge_distances(fresh, a), ref.gauge.edge_distances(old, b)]
    return _spread(np.concatenate([a, b]), np.concatenate(near))
