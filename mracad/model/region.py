"""The cells of a surface's knot grid that a trimmed face covers, and the control points on which cells depend."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from mracad.bspline.curve import Curve, bezier_pieces
from mracad.bspline.knots import KnotVector
from mracad.bspline.surface import Net
from mracad.memo import kept
from mracad.model.brep import Face
from mracad.model.cells import inside_grid
from mracad.model.outline import outline

Array = np.ndarray

MARGIN = 1e-9
"""Fraction of the domain within which a curve counts as lying on a knot line."""

DEPTH = 24
"""Largest number of halvings of one Bézier piece in the walk over the knot grid."""


@dataclass(frozen=True, eq=False)
class Region:
    """The knot cells that a face touches.

    Attributes
    ----------
    inside : ndarray of bool (cells_u, cells_v)
        Cells that overlap the face, including those that its boundary crosses.
    crossed : tuple of ndarray of bool (cells_u, cells_v)
        For each boundary curve, all cells that it may pass through, on both sides of a knot line on which it lies.
    """

    inside: Array
    crossed: tuple[Array, ...]


def face_region(net: Net, face: Face) -> Region:
    """The cells of the knot grid of its surface ``net`` that a face covers, and those that its trims cross."""
    if not face.trims:
        return Region(np.ones((net.u.spans, net.v.spans), bool), ())
    crossed = _crossed(net.u, net.v, tuple(trim.curve for trim in face.trims))
    middles = ((kv.breaks[:-1] + kv.breaks[1:]) / 2 for kv in (net.u, net.v))
    return Region(np.logical_or.reduce(crossed) | inside_grid(face, net, *middles), crossed)


def covered(net: Net, face: Face) -> Array:
    """The cells ``(cells_u, cells_v)`` of the knot grid of its surface ``net`` that overlap a face."""
    if outline(face, net).natural:
        return np.ones((net.u.spans, net.v.spans), bool)
    return face_region(net, face).inside


def supported(net: Net, cells: Array) -> Array:
    """Control points ``(nu, nv)`` whose basis function does not vanish on some of ``cells``."""
    first_u, last_u = _supports(net.u)
    first_v, last_v = _supports(net.v)
    wide = np.tile(cells, (2 if net.u.periodic else 1, 2 if net.v.periodic else 1))
    total = np.zeros((wide.shape[0] + 1, wide.shape[1] + 1), dtype=np.int64)
    total[1:, 1:] = wide.cumsum(0).cumsum(1)
    rows = total[last_u] - total[first_u]
    return np.asarray((rows[:, last_v] - rows[:, first_v]) > 0)


def grown(near: Array, knots: tuple[KnotVector, KnotVector], steps: int = 1) -> Array:
    """Mask ``(nu, nv)`` of control points at most some ``steps`` from those of a mask."""
    for axis, kv in enumerate(knots):
        for _ in range(steps):
            before, after = np.roll(near, 1, axis), np.roll(near, -1, axis)
            if not kv.periodic:
                np.moveaxis(before, axis, 0)[0] = False
                np.moveaxis(after, axis, 0)[-1] = False
            near = near | before | after
    return near


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


@kept(2048)
def _crossed(u: KnotVector, v: KnotVector, curves: tuple[Curve, ...]) -> tuple[Array, ...]:
    """For each curve the cells that it may pass through."""
    boxes, owners = Course(curves).boxes(u, v)
    return tuple(meeting(u, v, boxes[owners == i]) for i in range(len(curves)))


class Course:
    """Where curves run in a knot grid, which may get finer from one call to the next.

    A Bézier piece lies in the hull of its control points (weights are positive); it is halved until its box
    meets at most two cells or is a negligible part of one.
    """

    def __init__(self, curves: Sequence[Curve]) -> None:
        self._pieces = [(*found, np.zeros(len(found[0]), int)) for found in bezier_pieces(curves)]

    def boxes(self, u: KnotVector, v: KnotVector) -> tuple[Array, Array]:
        """Boxes ``(q, 2, 2)`` (low, high corner) that cover the curves, and the index of each one's curve."""
        self._pieces = [_short((u, v), *each) for each in self._pieces]
        plane = [_box(points) for points, _, _ in self._pieces]
        return np.concatenate(plane), np.concatenate([owners for _, owners, _ in self._pieces])


def _box(points: Array) -> Array:
    """Boxes ``(q, 2, 2)`` of homogeneous Bézier pieces."""
    plane = points[..., :2] / points[..., 2:]
    return np.stack([plane.min(axis=1), plane.max(axis=1)], axis=1)


def _short(
    grid: tuple[KnotVector, KnotVector], points: Array, owners: Array, depth: Array
) -> tuple[Array, Array, Array]:
    """Bézier pieces, their owners and how often they were halved, halved as in :class:`Course`."""
    smallest = np.array([np.diff(knots.breaks).min() for knots in grid]) / 64
    found = []
    while True:
        low, high = _box(points).swapaxes(0, 1)
        size = high - low
        crossings = np.zeros(len(points), dtype=np.int64)
        for i, knots in enumerate(grid):
            start = _wrapped(knots, low[:, i])[0]
            crossings += np.searchsorted(knots.breaks, start + size[:, i]) - np.searchsorted(knots.breaks, start)
        done = (crossings <= 1) | (size <= smallest).all(axis=1) | (size.min(axis=1) == 0) | (depth == DEPTH - 1)
        found.append((points[done], owners[done], depth[done]))
        if done.all():
            break
        points, owners, depth = _halved(points[~done]), np.tile(owners[~done], 2), np.tile(depth[~done] + 1, 2)
    points, owners, depth = (np.concatenate(each) for each in zip(*found, strict=True))
    return points, owners, depth


def _halved(points: Array) -> Array:
    """Both halves of Bézier pieces ``(q, p+1, k)`` by de Casteljau: ``(2q, p+1, k)``."""
    left, right, work = [points[:, 0]], [points[:, -1]], points
    for _ in range(points.shape[1] - 1):
        work = (work[:, :-1] + work[:, 1:]) / 2
        left.append(work[:, 0])
        right.append(work[:, -1])
    return np.concatenate([np.stack(left, axis=1), np.stack(right[::-1], axis=1)])


def _wrapped(knots: KnotVector, x: Array) -> tuple[Array, Array]:
    """Parameters moved into the period of a periodic direction, and the shifts."""
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


def spanned(knots: KnotVector, limits: Array) -> Array:
    """Spans ``(spans,)`` met by intervals ``(q, 2)``."""
    first, last = _cell_ranges(knots, limits[:, 0], limits[:, 1])
    count = knots.spans
    change = np.bincount(first, minlength=2 * count + 1) - np.bincount(last + 1, minlength=2 * count + 1)
    return np.asarray((change.cumsum()[:-1] > 0).reshape(2, count).any(axis=0))


def meeting(u: KnotVector, v: KnotVector, boxes: Array) -> Array:
    """Cells ``(cells_u, cells_v)`` met by boxes ``(q, 2, 2)`` (low, high corner)."""
    cells = u.spans, v.spans
    first_u, last_u = _cell_ranges(u, boxes[:, 0, 0], boxes[:, 1, 0])
    first_v, last_v = _cell_ranges(v, boxes[:, 0, 1], boxes[:, 1, 1])
    wide = np.zeros((2 * cells[0] + 1, 2 * cells[1] + 1), dtype=np.int64)
    np.add.at(wide, (first_u, first_v), 1)
    np.add.at(wide, (last_u + 1, last_v + 1), 1)
    np.add.at(wide, (first_u, last_v + 1), -1)
    np.add.at(wide, (last_u + 1, first_v), -1)
    met = wide.cumsum(0).cumsum(1)[: 2 * cells[0], : 2 * cells[1]] > 0
    return np.asarray(met.reshape(2, cells[0], 2, cells[1]).any(axis=(0, 2)))
