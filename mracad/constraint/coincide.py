"""Free edges that coincide: the seams of a model whose faces were never sewn.

Each edge is known at samples with unit tangents; between two samples it is taken as the cubic Hermite arc, which is
off by the fourth power of the step.  An edge belongs to another when all of its samples lie on the other's arcs.
"""

from __future__ import annotations

import numpy as np

from mracad.model import Edge, Model, Side

Array = np.ndarray

GAP = 1e-2
"""Distance, mm, within which free edges of different faces are taken for a seam (or 1e-6 of the diagonal)."""


def coinciding(model: Model) -> list[tuple[Edge, Side, Side]]:
    """Seams of coinciding free edges: an edge, its own side, and the other face's side at the same places.

    Where one edge is a part of the other (a T-junction) the shorter one is the seam.
    """
    free = [e for e in model.edges if e.free and len(e.points) > 1]
    if len({e.sides[0].face for e in free}) < 2:
        return []
    from scipy.spatial import cKDTree

    tolerance = max(GAP, 1e-6 * model.diagonal)
    lines = [_hermite(e.points, _slopes(e), *_between(len(e.points))) for e in free]
    points = np.concatenate(lines)
    owners = np.repeat(np.arange(len(free)), [len(line) for line in lines])
    steps = np.array([np.linalg.norm(np.diff(line, axis=0), axis=1).max() for line in lines])
    reach = steps[owners] + tolerance
    tree = cKDTree(points)
    found: dict[tuple[int, int], tuple[Edge, Side, Side]] = {}
    for i, edge in enumerate(free):
        probes = edge.points[[0, len(edge.points) // 2, -1]]
        near = [np.array(tree.query_ball_point(probe, reach.max()), dtype=int) for probe in probes]
        hit = [
            np.unique(owners[k[np.linalg.norm(points[k] - p, axis=1) <= reach[k]]])
            for k, p in zip(near, probes, strict=True)
        ]
        for j in map(int, np.intersect1d(np.intersect1d(hit[0], hit[1]), hit[2])):
            other = free[j]
            if other.part != edge.part or other.sides[0].face == edge.sides[0].face or (j, i) in found:
                continue
            distance, uv = _carried(edge.points, other)
            if distance.max() <= tolerance:
                side = Side(other.sides[0].face, uv=uv) if uv is not None else _baked(edge, other)
                found[i, j] = (edge, edge.sides[0], side)
    return list(found.values())


def _carried(points: Array, edge: Edge) -> tuple[Array, Array | None]:
    """Distance of ``points`` (k, 3) from an edge, and the parameters there on its face (None for a fixed side)."""
    start, chord = edge.points[:-1], np.diff(edge.points, axis=0)
    square = np.maximum((chord**2).sum(axis=1), np.finfo(float).tiny)
    along = np.clip(((points[:, None] - start) * chord).sum(axis=2) / square, 0.0, 1.0)
    off = ((points[:, None] - start - along[..., None] * chord) ** 2).sum(axis=2)
    segment = off.argmin(axis=1)
    s = along[np.arange(len(points)), segment][:, None]
    on = _hermite(edge.points, _slopes(edge), segment, s)
    apart = points - on
    tangent = chord[segment] / np.sqrt(square[segment])[:, None]
    shift = (apart * tangent).sum(axis=1, keepdims=True)
    inner = ((s > 0) & (s < 1)).astype(float)
    distance = np.linalg.norm(apart - inner * shift * tangent, axis=1)
    uv = edge.sides[0].uv
    return distance, None if uv is None else _hermite(uv, np.gradient(uv, axis=0), segment, s)


def _slopes(edge: Edge) -> Array:
    """Derivatives of the edge's curve per sample step, ``(k, 3)``."""
    return edge.tangents * np.linalg.norm(np.gradient(edge.points, axis=0), axis=1, keepdims=True)


def _between(samples: int) -> tuple[Array, Array]:
    """Segments and fractions that put eight points on each segment of a sampled curve, both ends included."""
    at = np.linspace(0, samples - 1, 8 * (samples - 1) + 1)
    segment = np.minimum(at.astype(int), samples - 2)
    return segment, (at - segment)[:, None]


def _hermite(values: Array, slopes: Array, segment: Array, s: Array) -> Array:
    """Cubic Hermite interpolation of samples at fraction ``s`` (k, 1) of ``segment`` (k,); slopes are per step."""
    p, q, m, n = values[segment], values[segment + 1], slopes[segment], slopes[segment + 1]
    return (1 + 2 * s) * (1 - s) ** 2 * p + s * (1 - s) ** 2 * m + s * s * (3 - 2 * s) * q + s * s * (s - 1) * n


def _baked(edge: Edge, other: Edge) -> Side:
    """The fixed side of ``other`` at the sample of it nearest to each sample of ``edge``."""
    side = other.sides[0]
    assert side.points is not None and side.normals is not None
    nearest = np.linalg.norm(edge.points[:, None] - other.points, axis=2).argmin(axis=1)
    return Side(side.face, points=edge.points, normals=side.normals[nearest])
