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

_BLOCK, _MANY = 256, 1_000_000  # pairs of edges, and of edges and boxes, that are looked at at once

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
    for edge, other, laid in _carried(free, _candidates(model, free, gap, lambda i, j: space[j] == space[i])):
        if (other.index, edge.index) in found:
            continue
        side = _laid(model, edge, other, gap * reach(model, edge, other), *laid)
        if side:
            found[edge.index, other.index] = (edge, other, (edge.sides[0], side))
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
    apart = _candidates(model, placed, GAP, lambda i, j: (stands[j] != stands[i]).any(axis=1), alike=True)
    for one, other, (off, _) in _carried(placed, apart):
        if np.linalg.norm(off, axis=1).max() <= reach(model, one, other):
            found |= {one.index, other.index}
    return frozenset(found)


def _placed(edge: Edge, frame: Array) -> Edge:
    """An edge in the place of an instance of its part."""
    turn = frame[:3, :3].T
    return replace(edge, points=edge.points @ turn + frame[:3, 3], tangents=edge.tangents @ turn)


def _candidates(
    model: Model, free: list[Edge], gap: float, eligible: Callable[[Array, Array], Array], alike: bool = False
) -> Array:
    """Pairs ``(k, 2)`` of edges, in order, where the second is ``eligible`` for the first, of different faces (or
    ``alike``), and ends and middle of the first are near points of the second."""
    if len(free) < 2:
        return np.empty((0, 2), int)
    sizes = np.array([len(e.points) for e in free])
    lines = np.empty((len(free), 8 * (sizes.max() - 1) + 1, 3))
    for size in np.unique(sizes):
        own = np.flatnonzero(sizes == size)
        points, tangents = (np.stack([getattr(free[i], name) for i in own]) for name in ("points", "tangents"))
        fine = hermite(points, slopes(points, tangents), *between(size))
        lines[own, : fine.shape[1]], lines[own, fine.shape[1] :] = fine, fine[:, -1:]
    share = [max(OF_MODEL * model.diagonal, 2 * e.tolerance, PRECISION * model.diagonal) * gap for e in free]
    steps = np.linalg.norm(np.diff(lines, axis=1), axis=2).max(axis=1) + np.max(share)
    face = np.array([e.sides[0].face for e in free])
    probes = lines[np.arange(len(free))[:, None], np.stack([0 * sizes, 4 * (sizes - 1), 8 * (sizes - 1)], axis=1)]
    found = [np.empty((0, 2), int)]
    for i, j in _around(probes, lines.min(axis=1) - steps[:, None], lines.max(axis=1) + steps[:, None]):
        meant = eligible(i, j) & (alike | (face[i] != face[j]))
        i, j = i[meant], j[meant]
        for first in range(0, len(i), _BLOCK):
            a, b = i[first : first + _BLOCK], j[first : first + _BLOCK]
            off = np.linalg.norm(probes[a][:, :, None] - lines[b][:, None], axis=3).min(axis=2)
            found.append(np.stack([a, b], axis=1)[(off <= steps[b, None]).all(axis=1)])
    pairs = np.concatenate(found)
    return np.asarray(pairs[np.lexsort(pairs.T[::-1])])


def _around(points: Array, low: Array, high: Array) -> Iterator[tuple[Array, Array]]:
    """Numbers of groups of points ``(n, p, 3)``, and of boxes with all points of a group inside; boxes of a size are
    looked for together, sorted by their lower ends."""
    axis = int(np.ptp(low, axis=0).argmax())
    size = (high - low)[:, axis]
    kind = np.ceil(np.log2(np.maximum(size / size.max(initial=1e-300), 1e-9)))
    first, last = points.min(axis=1), points.max(axis=1)
    for each in np.unique(kind):
        of = np.flatnonzero(kind == each)
        of = of[np.argsort(low[of, axis], kind="stable")]
        least, most = low[of, axis], float(size[of].max()) * (1 + 1e-9)
        begin = np.searchsorted(least, last[:, axis] - most - 1e-9 * np.abs(last[:, axis]))
        counts = np.maximum(np.searchsorted(least, first[:, axis], side="right") - begin, 0)
        for part in np.split(np.arange(len(points)), np.flatnonzero(np.diff(np.cumsum(counts) // _MANY)) + 1):
            i = np.repeat(part, counts[part])
            step = np.arange(len(i)) - np.repeat(np.cumsum(counts[part]) - counts[part], counts[part])
            j = of[begin[i] + step]
            for k in range(3):
                inside = (low[j, k] <= first[i, k]) & (last[i, k] <= high[j, k])
                i, j = i[inside], j[inside]
            yield i, j


def length(edge: Edge) -> float:
    """Length of an edge, mm, as the polygon of its samples."""
    return polygon(edge.points)


@kept(4096)
def apart(model: Model, edge: Edge, other: Edge) -> float:
    """Largest distance of an edge's samples from another edge, mm."""
    ((_, _, (off, at)),) = _carried([edge, other], np.array([[0, 1]]))
    far = float(np.linalg.norm(off, axis=1).max())
    return _sided(model, _seen(model, edge), other, at)[1] if _close(other, far) else far


def _laid(model: Model, edge: Edge, other: Edge, gap: float, off: Array, at: Array) -> Side | None:
    """The side of another edge at the samples of an edge, given their offsets and places among its samples; None if
    they are farther away than a gap."""
    far = float(np.linalg.norm(off, axis=1).max())
    if _close(other, far):
        side, far = _sided(model, _seen(model, edge), other, at)
        return side if far <= gap else None
    if far > gap:
        return None
    return _baked(edge.points - off, other) if other.sides[0].uv is None else other.sides[0]


def _close(edge: Edge, far: float) -> bool:
    """Whether samples of another edge are so close that the surface of this one's face tells how far they are."""
    if edge.sides[0].uv is None:
        return False
    return bool(far <= COARSE * np.linalg.norm(np.diff(edge.points, axis=0), axis=1).max())


def _carried(edges: list[Edge], pairs: Array) -> Iterator[tuple[Edge, Edge, tuple[Array, Array]]]:
    """For pairs of edges, in order: both, the offsets of the samples of the first from the second, ``(k, 3)``, and
    where they lie among its samples, as fractional indices."""
    for block in np.split(pairs, np.arange(_BLOCK, len(pairs), _BLOCK)):
        members = [(edges[i], edges[j]) for i, j in block.tolist()]
        laid: list[tuple[Array, Array]] = [(np.empty(0), np.empty(0))] * len(members)
        sizes = np.array([(len(one.points), len(other.points)) for one, other in members]).reshape(-1, 2)
        for size in np.unique(sizes, axis=0):
            own = np.flatnonzero((sizes == size).all(axis=1)).tolist()
            points = np.stack([members[k][0].points for k in own])
            onto = (np.stack([getattr(members[k][1], name) for k in own]) for name in ("points", "tangents"))
            for k, *found in zip(own, *_offsets(points, *onto), strict=True):
                laid[k] = found[0], found[1]
        yield from ((one, other, found) for (one, other), found in zip(members, laid, strict=True))


def _offsets(points: Array, lines: Array, tangents: Array) -> tuple[Array, Array]:
    """Offsets ``(p, k, 3)`` of points from sampled curves ``(p, m, 3)``, and where they lie among their samples."""
    start, chord = lines[:, :-1], np.diff(lines, axis=1)
    square = np.maximum((chord**2).sum(axis=2), np.finfo(float).tiny)
    low, high = np.zeros(square.shape), np.ones(square.shape)
    away = np.moveaxis(points, 2, 0)[..., None] - np.moveaxis(start, 2, 0)[:, :, None]
    steps = np.moveaxis(chord, 2, 0)[:, :, None]
    along = (away * steps).sum(axis=0) / square[:, None]
    middle = along[:, points.shape[1] // 2]
    open_ones = (middle[:, 0] > 0) & (middle[:, -1] < 1)
    low[open_ones, 0], high[open_ones, -1] = -BEYOND, 1.0 + BEYOND
    along = np.clip(along, low[:, None], high[:, None])
    segment = ((away - along * steps) ** 2).sum(axis=0).argmin(axis=2)
    row = np.arange(len(points))[:, None]
    s = np.take_along_axis(along, segment[..., None], axis=2)
    flat = (segment + row * lines.shape[1]).ravel()
    on = hermite(lines.reshape(-1, 3), slopes(lines, tangents).reshape(-1, 3), flat, s.reshape(-1, 1))
    off = points - on.reshape(points.shape)
    tangent = chord[row, segment] / np.sqrt(square[row, segment])[..., None]
    shift = (off * tangent).sum(axis=2, keepdims=True)
    inner = ((s > low[row, segment][..., None]) & (s < high[row, segment][..., None])).astype(float)
    return off - inner * shift * tangent, segment + s[..., 0]


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
