"""Free edges that coincide: the seams of a model whose faces were never sewn.

Each edge is known at samples with unit tangents; between two samples it is taken as the cubic Hermite arc, whose error
is of fourth order in the step.  An edge coincides with another if all of its samples lie on the other's arcs.

The distance for that scales with the model: the tolerances of the edges, or a share of the edge and of the model,
whichever is less (:func:`reach`).  Parts with a single instance in the same place (the roots of an IGES file, the
products of many STEP files) share one space.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace

import numpy as np

from mracad.bspline.vectors import across, unit
from mracad.memo import kept
from mracad.model.brep import Edge, Model, Side
from mracad.model.sampling import between, hermite, slopes
from mracad.model.sampling import length as polygon

Array = np.ndarray

GAP = 1.0
"""Distance, in units of :func:`reach`, within which free edges of different faces count as a seam."""

TORN = 5.0
"""Distance, in the same units, within which two free edges count as a torn seam."""

OF_MODEL, OF_EDGE, PRECISION = 1e-4, 2e-3, 1e-6
"""Shares of the diagonal and of the length of an edge, and the precision of coordinates as a share of the diagonal."""

BEYOND = 0.125
"""Share of the first and last steps by which an edge continues beyond its samples."""

NEWTON, SETTLED = 4, 1e-13
"""Newton steps to the nearest point of a curve, and the change of its fraction after which no more follow."""

COARSE = 0.1
"""Distance from an edge, over the step between its samples, beyond which it is certainly not its seam: arcs between
samples miss bumps that are narrower than a few steps."""


def reach(model: Model, edge: Edge, other: Edge) -> float:
    """Distance, mm, within which an edge that lies along another one coincides with it."""
    share = min(OF_MODEL * model.diagonal, OF_EDGE * length(edge))
    return max(share, edge.tolerance + other.tolerance, PRECISION * model.diagonal)


def coinciding(model: Model, gap: float = GAP) -> list[tuple[Edge, Edge, tuple[Side, Side]]]:
    """Seams of free edges within ``gap`` times their :func:`reach` of each other: an edge, the other one, and the sides
    of both faces at the places of the first.

    Where one edge is part of the other (a T-junction) the shorter one comes first.
    """
    free = [e for e in model.edges if e.free and len(e.points) > 1]
    found: dict[tuple[int, int], tuple[Edge, Edge, tuple[Side, Side]]] = {}
    space = np.array([model.spaces[e.part] if model.spaces else 0 for e in free])
    for i, j in _candidates(model, free, gap, lambda those, i: space[those] == space[i]):
        edge, other = free[i], free[j]
        if (j, i) in found:
            continue
        side, off = _laid(model, edge, other)
        if off <= gap * reach(model, edge, other):
            found[i, j] = (edge, other, (edge.sides[0], side))
    return list(found.values())


def touching(model: Model) -> frozenset[int]:
    """Free edges that coincide in space with one of another instance, whose coordinates are in another space."""
    if len(set(model.spaces)) < 2 and all(len(frames) == 1 for frames in model.places):
        return frozenset()
    free = [
        (edge, number, _placed(edge, frame))
        for edge in model.edges
        if edge.free and len(edge.points) > 1
        for number, frame in enumerate(model.places[edge.part])
    ]
    stands = np.array([(model.spaces[edge.part], number) for edge, number, _ in free]).reshape(-1, 2)
    placed = [edge for _, _, edge in free]
    found: set[int] = set()
    for i, j in _candidates(model, placed, GAP, lambda those, i: (stands[those] != stands[i]).any(axis=1), alike=True):
        if placed[i].index not in found or placed[j].index not in found:
            off, _ = _carried(placed[i].points, placed[j])
            if np.linalg.norm(off, axis=1).max() <= reach(model, placed[i], placed[j]):
                found |= {placed[i].index, placed[j].index}
    return frozenset(found)


def _placed(edge: Edge, frame: Array) -> Edge:
    """An edge in the place of an instance of its part."""
    turn = frame[:3, :3].T
    return replace(edge, points=edge.points @ turn + frame[:3, 3], tangents=edge.tangents @ turn)


def _candidates(
    model: Model, free: list[Edge], gap: float, eligible: Callable[[Array, int], Array], alike: bool = False
) -> Iterator[tuple[int, int]]:
    """Pairs (i, j) of edges where j is among those ``eligible`` for i, of different faces (or ``alike``), and ends and
    middle of i are near points of j."""
    if len(free) < 2:
        return
    lines = [hermite(e.points, slopes(e.points, e.tangents), *between(len(e.points))) for e in free]
    share = [max(OF_MODEL * model.diagonal, 2 * e.tolerance, PRECISION * model.diagonal) * gap for e in free]
    steps = np.array([np.linalg.norm(np.diff(line, axis=0), axis=1).max() for line in lines]) + np.max(share)
    low = np.array([line.min(axis=0) for line in lines]) - steps[:, None]
    high = np.array([line.max(axis=0) for line in lines]) + steps[:, None]
    face = np.array([e.sides[0].face for e in free])
    boxes = _Boxes(low, high)
    for i, line in enumerate(lines):
        probes = line[[0, len(line) // 2, -1]]
        inside = boxes.around(probes)
        inside = inside[eligible(inside, i)]
        for j in inside if alike else inside[face[inside] != face[i]]:
            apart = np.linalg.norm(probes[:, None] - lines[j], axis=2).min(axis=1)
            if (apart <= steps[j]).all():
                yield i, int(j)


class _Boxes:
    """Boxes, from which those around points are found: sorted by their lower ends, those of a size together."""

    def __init__(self, low: Array, high: Array) -> None:
        self.low, self.high = low, high
        self.axis = int(np.ptp(low, axis=0).argmax())
        size = (high - low)[:, self.axis]
        kind = np.ceil(np.log2(np.maximum(size / size.max(initial=1e-300), 1e-9)))
        self.kinds: list[tuple[float, Array, Array]] = []
        for each in np.unique(kind):
            of = np.flatnonzero(kind == each)
            of = of[np.argsort(low[of, self.axis], kind="stable")]
            self.kinds.append((float(size[of].max()) * (1 + 1e-9), of, low[of, self.axis]))

    def around(self, points: Array) -> Array:
        """Indices of the boxes with all of some points inside, ascending."""
        at, found = points[:, self.axis], []
        first, last = float(at.min()), float(at.max())
        for size, order, low in self.kinds:
            begin = np.searchsorted(low, last - size - 1e-9 * abs(last))
            near = order[begin : np.searchsorted(low, first, side="right")]
            found.append(near[((points >= self.low[near][:, None]) & (points <= self.high[near][:, None])).all((1, 2))])
        return np.sort(np.concatenate(found))


def length(edge: Edge) -> float:
    """Length of an edge, mm, as the polygon of its samples."""
    return polygon(edge.points)


def apart(model: Model, edge: Edge, other: Edge) -> float:
    """Largest distance of an edge's samples from another edge, mm."""
    return _laid(model, edge, other)[1]


@kept(4096)
def _laid(model: Model, edge: Edge, other: Edge) -> tuple[Side, float]:
    """The side of another edge at the samples of an edge, and their largest distance from it, mm."""
    off, at = _carried(edge.points, other)
    far = float(np.linalg.norm(off, axis=1).max())
    if other.sides[0].uv is None:
        return _baked(edge.points - off, other), far
    if far > COARSE * np.linalg.norm(np.diff(other.points, axis=0), axis=1).max():
        return other.sides[0], far
    return _sided(model, _seen(model, edge), other, at)


def _carried(points: Array, edge: Edge) -> tuple[Array, Array]:
    """Offsets of ``points`` (k, 3) from an edge, and where they lie among its samples, as fractional indices."""
    start, chord = edge.points[:-1], np.diff(edge.points, axis=0)
    square = np.maximum((chord**2).sum(axis=1), np.finfo(float).tiny)
    low, high = np.zeros(len(chord)), np.ones(len(chord))
    away = points.T[:, :, None] - start.T[:, None]
    along = sum(one * step for one, step in zip(away, chord.T, strict=True)) / square
    middle = along[len(points) // 2]
    if middle[0] > 0 and middle[-1] < 1:
        low[0], high[-1] = -BEYOND, 1.0 + BEYOND
    along = np.clip(along, low, high)
    off = sum((one - along * step) ** 2 for one, step in zip(away, chord.T, strict=True))
    segment = off.argmin(axis=1)
    s = along[np.arange(len(points)), segment][:, None]
    on = hermite(edge.points, slopes(edge.points, edge.tangents), segment, s)
    apart = points - on
    tangent = chord[segment] / np.sqrt(square[segment])[:, None]
    shift = (apart * tangent).sum(axis=1, keepdims=True)
    inner = ((s > low[segment][:, None]) & (s < high[segment][:, None])).astype(float)
    return apart - inner * shift * tangent, segment + s[:, 0]


def _seen(model: Model, edge: Edge) -> Array:
    """The points of an edge's face at its samples; its own samples if the face has no surface of control points."""
    side = edge.sides[0]
    face = model.faces[side.face]
    if side.uv is None or face.surface is None:
        return edge.points
    return face.placed(model.surfaces[face.surface].net.evaluate(side.uv))


def _sided(model: Model, points: Array, edge: Edge, at: Array) -> tuple[Side, float]:
    """The side of an edge at the points of its curve nearest to ``points``, which lie at fractional indices of its
    samples, and their largest distance, mm.  Samples are too far apart to interpolate to the accuracy of a seam."""
    face = model.faces[edge.sides[0].face]
    assert face.surface is not None
    curve, net = face.trim(edge.index).curve, model.surfaces[face.surface].net
    start, stop = curve.knots.domain
    share = 0.5 - 0.5 * np.cos(np.pi * np.clip((at + 0.5) / len(edge.points), 0.0, 1.0))
    for _ in range(NEWTON):
        uv, way = curve.evaluate(start + share * (stop - start), 1)
        s, su, sv = net.evaluate(uv, 1)
        along = face.turned((stop - start) * (su * way[:, :1] + sv * way[:, 1:]))
        step = ((points - face.placed(s)) * along).sum(axis=1) / np.maximum((along**2).sum(axis=1), 1e-300)
        last, share = share, np.clip(share + step, 0.0, 1.0)
        if np.abs(share - last).max() <= SETTLED:
            break
    uv = curve.evaluate(start + share * (stop - start))[0]
    off = across(points - face.placed(net.evaluate(uv)), unit(along))
    return Side(face.index, uv=uv), float(np.linalg.norm(off, axis=1).max())


def _baked(points: Array, other: Edge) -> Side:
    """The fixed side of ``other`` at ``points`` on it, with the normals of its nearest samples."""
    side = other.sides[0]
    assert side.points is not None and side.normals is not None
    nearest = np.linalg.norm(points[:, None] - other.points, axis=2).argmin(axis=1)
    curvatures = None if side.curvatures is None else side.curvatures[nearest]
    return Side(side.face, points=points, normals=side.normals[nearest], curvatures=curvatures)
