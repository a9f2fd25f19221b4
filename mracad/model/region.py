"""Where a trimmed face lies in the knot grid of its surface, and which control points each cell depends on."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from weakref import WeakKeyDictionary

import numpy as np

from mracad.bspline.curve import Curve
from mracad.bspline.knots import KnotVector
from mracad.bspline.surface import Net
from mracad.model.brep import Face

Array = np.ndarray

MARGIN = 1e-9
"""Fraction of the domain within which a curve counts as lying on a knot line."""

DEPTH = 24
"""Most halvings of one Bézier piece on the walk over the knot grid."""

_REGIONS: WeakKeyDictionary[Face, dict[tuple[KnotVector, KnotVector], Region]] = WeakKeyDictionary()


@dataclass(frozen=True, eq=False)
class Region:
    """The knot cells that a face touches.

    Attributes
    ----------
    inside : ndarray of bool (cells_u, cells_v)
        Cells of which some part belongs to the face, those that its boundary crosses among them.
    crossed : tuple of ndarray of bool (cells_u, cells_v)
        Per boundary curve, the cells that it may pass through, never too few; both sides of a knot line it lies on.
    """

    inside: Array
    crossed: tuple[Array, ...]


def region(net: Net, curves: Sequence[Curve]) -> Region:
    """Cells of the knot grid that a face bounded by ``curves`` crosses and covers.

    Parameters
    ----------
    net : Net
        The surface.
    curves : sequence of Curve
        The pcurves of all its edges, closed loops in the parameter plane.  None: the whole surface.
    """
    if not curves:
        return Region(np.ones((net.u.spans, net.v.spans), bool), ())
    boxes, chords, owners = _pieces(net, curves)
    crossed = tuple(meeting(net, boxes[owners == i]) for i in range(len(curves)))
    return Region(np.logical_or.reduce(crossed) | _covered(net, chords), crossed)


def supported(net: Net, cells: Array) -> Array:
    """Control points ``(nu, nv)`` whose basis function does not vanish on some of ``cells``."""
    first_u, last_u = _supports(net.u)
    first_v, last_v = _supports(net.v)
    wide = np.tile(cells, (2 if net.u.periodic else 1, 2 if net.v.periodic else 1))
    total = np.zeros((wide.shape[0] + 1, wide.shape[1] + 1), dtype=np.int64)
    total[1:, 1:] = wide.cumsum(0).cumsum(1)
    rows = total[last_u] - total[first_u]
    return (rows[:, last_v] - rows[:, first_v]) > 0


def _supports(knots: KnotVector) -> tuple[Array, Array]:
    """First and one-past-last cell of each basis function's support (beyond the end when periodic)."""
    breaks = knots.breaks
    low = knots.knots[: knots.count]
    high = knots.knots[knots.degree + 1 : knots.degree + 1 + knots.count]
    if not knots.periodic:
        return (
            np.maximum(np.searchsorted(breaks, low, side="right") - 1, 0),
            np.minimum(np.searchsorted(breaks, high, side="left"), len(breaks) - 1),
        )
    period = breaks[-1] - breaks[0]
    middles = (breaks[:-1] + breaks[1:]) / 2
    around = np.concatenate([middles + k * period for k in range(-3, 4)])
    first = np.searchsorted(around, low)
    count = np.minimum(np.searchsorted(around, high) - first, len(middles))
    first = (first - 3 * len(middles)) % len(middles)
    return first, first + count


def _pieces(net: Net, curves: Sequence[Curve]) -> tuple[Array, Array, Array]:
    """Bounding boxes ``(q, 2, 2)`` and chords ``(q, 2, 2)`` of short pieces of the curves, and whose they are ``(q,)``.

    A Bézier piece lies in the hull of its control points (weights are positive); it is halved until its box
    meets at most two cells or is a negligible part of one.
    """
    by_degree: dict[int, list[tuple[Array, Array]]] = defaultdict(list)
    for i, curve in enumerate(curves):
        points = bezier_points(curve)
        by_degree[curve.knots.degree].append((points, np.full(len(points), i)))
    found = []
    for parts in by_degree.values():
        points, owners = (np.concatenate(column) for column in zip(*parts, strict=True))
        found += list(_short(net, points, owners))
    boxes, chords, owners = (np.concatenate(column) for column in zip(*found, strict=True))
    return boxes, chords, owners


def bezier_points(curve: Curve) -> Array:
    """Homogeneous Bézier points ``(q, p + 1, 3)`` of a curve."""
    if curve.knots.spans == 1 and curve.knots.multiplicities[0] == curve.knots.degree + 1:
        poles, weights = curve.poles[None], None if curve.weights is None else curve.weights[None]
    else:
        _, poles, weights = curve.bezier()
    if weights is None:
        return np.concatenate([poles, np.ones((*poles.shape[:2], 1))], axis=-1)
    return np.concatenate([poles * weights[..., None], weights[..., None]], axis=-1)


def _short(net: Net, points: Array, owners: Array) -> Iterator[tuple[Array, Array, Array]]:
    """Boxes, chords and owners of Bézier pieces, halved as :func:`_pieces` says."""
    smallest = np.array([np.diff(k.breaks).min() for k in (net.u, net.v)]) / 64
    for depth in range(DEPTH):
        plane = points[..., :2] / points[..., 2:]
        low, high = plane.min(axis=1), plane.max(axis=1)
        size = high - low
        crossings = np.zeros(len(points), dtype=np.int64)
        for i, knots in enumerate((net.u, net.v)):
            start = _wrapped(knots, low[:, i])[0]
            crossings += np.searchsorted(knots.breaks, start + size[:, i]) - np.searchsorted(knots.breaks, start)
        done = (crossings <= 1) | (size <= smallest).all(axis=1) | (size.min(axis=1) == 0) | (depth == DEPTH - 1)
        if done.any():
            yield np.stack([low[done], high[done]], axis=1), plane[done][:, [0, -1]], owners[done]
        if done.all():
            return
        points, owners = _halved(points[~done]), np.tile(owners[~done], 2)


def _halved(points: Array) -> Array:
    """Both halves of Bézier pieces ``(q, p+1, k)`` by de Casteljau: ``(2q, p+1, k)``."""
    left, right, work = [points[:, 0]], [points[:, -1]], points
    for _ in range(points.shape[1] - 1):
        work = (work[:, :-1] + work[:, 1:]) / 2
        left.append(work[:, 0])
        right.append(work[:, -1])
    return np.concatenate([np.stack(left, axis=1), np.stack(right[::-1], axis=1)])


def _wrapped(knots: KnotVector, x: Array) -> tuple[Array, Array]:
    """Parameters moved into the period of a periodic direction, and by how much they were moved."""
    if not knots.periodic:
        return x, np.zeros_like(x)
    start, end = knots.domain
    shift = np.floor((x - start) / (end - start)) * (end - start)
    return x - shift, shift


def _cell_ranges(knots: KnotVector, low: Array, high: Array) -> tuple[Array, Array]:
    """First and last cell that the interval [low, high], widened by the margin, meets (unwrapped when periodic)."""
    start, end = knots.domain
    margin = MARGIN * (end - start)
    breaks, cells = knots.breaks, len(knots.breaks) - 1
    if not knots.periodic:
        first = np.searchsorted(breaks, low - margin, side="right") - 1
        last = np.searchsorted(breaks, high + margin, side="left") - 1
        return np.clip(first, 0, cells - 1), np.clip(last, 0, cells - 1)
    inside, shift = _wrapped(knots, low - margin)
    first = np.searchsorted(breaks, inside, side="right") - 1
    around = np.concatenate([breaks[:-1] + k * (end - start) for k in range(3)])
    last = np.searchsorted(around, high + margin - shift, side="left") - 1
    return first, np.minimum(last, first + cells - 1)


def meeting(net: Net, boxes: Array) -> Array:
    """Cells ``(cells_u, cells_v)`` met by boxes ``(q, 2, 2)`` (low, high corner)."""
    cells = (len(net.u.breaks) - 1, len(net.v.breaks) - 1)
    first_u, last_u = _cell_ranges(net.u, boxes[:, 0, 0], boxes[:, 1, 0])
    first_v, last_v = _cell_ranges(net.v, boxes[:, 0, 1], boxes[:, 1, 1])
    wide = np.zeros((2 * cells[0] + 1, 2 * cells[1] + 1), dtype=np.int64)
    np.add.at(wide, (first_u, first_v), 1)
    np.add.at(wide, (last_u + 1, last_v + 1), 1)
    np.add.at(wide, (first_u, last_v + 1), -1)
    np.add.at(wide, (last_u + 1, first_v), -1)
    met = wide.cumsum(0).cumsum(1)[: 2 * cells[0], : 2 * cells[1]] > 0
    return np.asarray(met.reshape(2, cells[0], 2, cells[1]).any(axis=(0, 2)))


def _covered(net: Net, chords: Array) -> Array:
    """Cells whose middle lies inside the polygon made of ``chords`` (q, 2, 2), by parity along lines v = const."""
    middles, copies = [], []
    for knots in (net.u, net.v):
        start, end = knots.domain
        turns = np.arange(-2, 3) if knots.periodic else np.array([0])
        middle = (knots.breaks[:-1] + knots.breaks[1:]) / 2
        middles.append((middle + turns[:, None] * (end - start)).ravel())
        copies.append(len(turns))
    columns, lines = middles
    (u0, v0), (u1, v1) = chords[:, 0].T, chords[:, 1].T
    first = np.searchsorted(lines, np.minimum(v0, v1))
    last = np.searchsorted(lines, np.maximum(v0, v1))
    crossings = last - first
    chord = np.repeat(np.arange(len(chords)), crossings)
    line = (
        np.arange(crossings.sum()) - np.repeat(crossings.cumsum() - crossings, crossings) + np.repeat(first, crossings)
    )
    at = u0[chord] + (u1 - u0)[chord] * (lines[line] - v0[chord]) / (v1 - v0)[chord]
    toggles = np.zeros((len(columns) + 1, len(lines)), dtype=np.int64)
    np.add.at(toggles, (np.searchsorted(columns, at), line), 1)
    odd = toggles[:-1].cumsum(axis=0) % 2 == 1
    return np.asarray(odd.reshape(copies[0], -1, copies[1], len(net.v.breaks) - 1).any(axis=(0, 2)))


def face_region(net: Net, face: Face) -> Region:
    """The :class:`Region` of a face on its surface ``net``; its crossed cells are in the order of the trims."""
    known = _REGIONS.setdefault(face, {})
    if (net.u, net.v) not in known:
        known[net.u, net.v] = region(net, [trim.curve for trim in face.trims])
    return known[net.u, net.v]
