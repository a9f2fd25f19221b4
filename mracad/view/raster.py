"""Triangles onto a grid of samples with a depth buffer: spans of rows, all at once, with numpy."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from mracad.view.runs import groups, runs

Array = np.ndarray

AT_ONCE = 1 << 18
"""Number of samples that are processed together."""

_FLAT = 1e-9  # area of a triangle, in samples, below which it is seen edge-on


@dataclass(frozen=True, eq=False)
class Triangles:
    """Triangles in the plane of a picture, x to the right and y down, in samples.

    Attributes
    ----------
    corners : ndarray (m, 3, 2)
    origin : ndarray (2, m)
        The first corner.
    planes : ndarray (3, 3, m)
        Depth, u and v: each at the first corner, and its slopes along x and y.
    front : ndarray of bool (m,)
        Whether their outer side is seen.
    """

    corners: Array
    origin: Array
    planes: Array
    front: Array

    @classmethod
    def of(cls, corners: Array, values: Array) -> Triangles:
        """From corners ``(m, 3, 2)`` and depth, u and v there ``(m, 3, 3)``."""
        (bx, by), (cx, cy) = (corners[:, 1] - corners[:, 0]).T, (corners[:, 2] - corners[:, 0]).T
        area = bx * cy - by * cx
        share = 1.0 / np.where(np.abs(area) > _FLAT, area, np.inf)
        first, second, third = values.transpose(1, 2, 0)
        second, third = (second - first) * share, (third - first) * share
        planes = np.stack([first, second * cy - third * by, third * bx - second * cx], axis=1)
        return cls(corners, np.ascontiguousarray(corners[:, 0].T), planes, area < 0)

    def some(self, which: Array) -> Triangles:
        """Some of the triangles."""
        return Triangles(self.corners[which], self.origin[:, which], self.planes[..., which], self.front[which])

    def at(self, plane: int, which: Array, x: Array, y: Array) -> Array:
        """One of the planes of triangles at places."""
        base, along, down = (each[which] for each in self.planes[plane])
        left, top = self.origin
        return np.asarray(base + along * (x - left[which]) + down * (y - top[which]))


def rasterised(
    triangles: Triangles, rows: tuple[int, int], width: int, behind: Array | None = None
) -> tuple[Array, Array]:
    """The nearest triangle at every sample of some rows, and its depth.

    Parameters
    ----------
    triangles : Triangles
    rows : (int, int)
        The first row, and the one after the last.
    width : int
    behind : ndarray (rows, width), optional
        Depth of what hides triangles.

    Returns
    -------
    nearest : ndarray of int (rows, width)
        -1 where there is none.
    depth : ndarray (rows, width)
        Infinite there.
    """
    count = (rows[1] - rows[0]) * width
    depth = np.full(count, np.inf, np.float32) if behind is None else behind.ravel().copy()
    nearest = np.full(count, -1, np.int32)
    for which, place, z in _samples(triangles, rows, width):
        np.minimum.at(depth, place, z)
        won = z == depth[place]
        nearest[place[won]] = which[won]
    shape = rows[1] - rows[0], width
    return nearest.reshape(shape), depth.reshape(shape)


def _samples(triangles: Triangles, rows: tuple[int, int], width: int) -> Iterator[tuple[Array, Array, Array]]:
    """The samples inside triangles, many at a time: triangle, place in the grid, and depth."""
    low, high = triangles.corners[..., 1].min(axis=1), triangles.corners[..., 1].max(axis=1)
    first = np.clip(np.ceil(low - 0.5), *rows).astype(np.int32)
    last = np.clip(np.ceil(high - 0.5), *rows).astype(np.int32)
    seen = np.flatnonzero(last > first)
    sides = _sides(triangles.corners)
    along = triangles.planes[0, 1].astype(np.float32)
    for part in _parts((last - first)[seen]):
        which, row = runs(seen[part], first[seen[part]], last[seen[part]])
        left, right = _span(sides, which, row + 0.5)
        start = np.clip(np.ceil(left - 0.5), 0, width).astype(np.int32)
        end = np.clip(np.ceil(right - 0.5), 0, width).astype(np.int32)
        keep = np.flatnonzero(end > start)
        which, row, start, end = which[keep], row[keep], start[keep], end[keep]
        deep = triangles.at(0, which, start + 0.5, row + 0.5).astype(np.float32)
        begin = (row - rows[0]).astype(np.intp) * width + start
        for spans in _parts(end - start):
            some = np.arange(spans.start, spans.stop)
            span, step = runs(some, np.zeros(len(some), np.int32), (end - start)[spans])
            owner = which[span]
            yield owner, begin[span] + step, deep[span] + along[owner] * step.astype(np.float32)


def _parts(counts: Array) -> Iterator[slice]:
    """Slices of a list whose counts add up to about ``AT_ONCE``."""
    return groups(np.cumsum(counts) // AT_ONCE)


def _sides(corners: Array) -> tuple[Array, ...]:
    """The sides of triangles from their upper ends down: x, y and slope of the longest, then of the two others."""
    order = np.argsort(corners[..., 1], axis=1, kind="stable")
    (ax, ay), (bx, by), (cx, cy) = np.take_along_axis(corners, order[:, :, None], axis=1).transpose(1, 2, 0)
    tall, upper, lower = (np.where(y > 0.0, y, np.inf) for y in (cy - ay, by - ay, cy - by))
    return ax, ay, (cx - ax) / tall, (bx - ax) / upper, bx, by, (cx - bx) / lower


def _span(sides: tuple[Array, ...], which: Array, y: Array) -> tuple[Array, Array]:
    """Where rows enter and leave triangles; the same for both triangles at a side, so that no sample is missed."""
    ax, ay, long, upper, bx, by, lower = (each[which] for each in sides)
    below = y - ay
    one = ax + below * long
    other = np.where(y < by, ax + below * upper, bx + (y - by) * lower)
    return np.minimum(one, other), np.maximum(one, other)
