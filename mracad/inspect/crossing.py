"""Places where a mesh crosses itself, and triangle sides without a partner."""

from __future__ import annotations

from collections.abc import Iterable
from itertools import pairwise

import numpy as np

Array = np.ndarray
_BLOCK = 200_000  # pairs of triangles tested at once


def unpaired(sides: Array) -> Array:
    """The sides ``(k, 2)`` of triangles that do not occur exactly once in each direction."""
    unique, counts = np.unique(sides, axis=0, return_counts=True)
    known = {tuple(side): count for side, count in zip(unique.tolist(), counts.tolist(), strict=True)}
    bad = [(a, b) for (a, b), count in known.items() if count != 1 or known.get((b, a)) != 1]
    return np.array(bad, int).reshape(-1, 2)


def crossings(points: Array, corners: Array, parts: Array) -> tuple[Array, Array]:
    """Pairs of triangles of one part that cross, and a point of each crossing.

    Triangles that share a corner, and triangles that only touch, are left out.

    Returns
    -------
    pairs : ndarray of int (k, 2)
    where : ndarray (k, 3)
    """
    found, where = [np.empty((0, 2), int)], [np.empty((0, 3))]
    spots = points[corners]
    for pairs in _near(spots, parts):
        shared = (corners[pairs[:, 0]][:, :, None] == corners[pairs[:, 1]][:, None, :]).any(axis=(1, 2))
        pairs = pairs[~shared]
        for one, other in ((0, 1), (1, 0)):
            for side in range(3):
                start, end = spots[pairs[:, one], side], spots[pairs[:, one], (side + 1) % 3]
                share = _pierced(start, end, spots[pairs[:, other]])
                hit = ~np.isnan(share)
                found.append(pairs[hit])
                where.append(start[hit] + share[hit, None] * (end - start)[hit])
    pairs, first = np.unique(np.concatenate(found), axis=0, return_index=True)
    return pairs, np.concatenate(where)[first]


def _pierced(start: Array, end: Array, triangle: Array) -> Array:
    """The fraction of each segment at which it passes through the inside of its triangle, or NaN."""
    along = end - start
    u, v = triangle[:, 1] - triangle[:, 0], triangle[:, 2] - triangle[:, 0]
    p = np.cross(along, v)
    determinant = (u * p).sum(1)
    size = np.linalg.norm(along, axis=1) * np.linalg.norm(np.cross(u, v), axis=1)
    with np.errstate(divide="ignore", invalid="ignore"):
        off = start - triangle[:, 0]
        q = np.cross(off, u)
        a, b, t = ((x * y).sum(1) / determinant for x, y in ((off, p), (along, q), (v, q)))
        inside = (np.abs(determinant) > 1e-9 * size) & (a > 1e-6) & (b > 1e-6) & (a + b < 1 - 1e-6)
        return np.where(inside & (t > 1e-6) & (t < 1 - 1e-6), t, np.nan)


def _near(spots: Array, parts: Array) -> Iterable[Array]:
    """Pairs of triangles of one part whose boxes meet, in blocks, found by a grid of cells."""
    low, high = spots.min(axis=1), spots.max(axis=1)
    if not len(spots):
        return
    cell = max(float(np.median((high - low).max(axis=1))), 1e-12)
    origin = low.min(axis=0)
    while True:
        first, last = ((x - origin) // cell for x in (low, high))
        cells = (last - first + 1).prod(axis=1)
        if cells.sum() <= 20 * len(spots) + 1000:
            break
        cell *= 1.5
    first, span, cells = first.astype(int), (last - first + 1).astype(int), cells.astype(int)
    which = np.repeat(np.arange(len(spots)), cells)
    step = np.arange(cells.sum()) - np.repeat(np.cumsum(cells) - cells, cells)
    i, rest = np.divmod(step, (span[:, 1] * span[:, 2])[which])
    j, k = np.divmod(rest, span[which, 2])
    place = np.column_stack([first[which] + np.stack([i, j, k], axis=1), parts[which]])
    order = np.lexsort(place.T)
    place, which = place[order], which[order]
    breaks = np.flatnonzero((np.diff(place, axis=0) != 0).any(axis=1)) + 1
    starts, ends = np.concatenate([[0], breaks]), np.concatenate([breaks, [len(which)]])
    position = np.arange(len(which))
    partners = np.repeat(ends, ends - starts) - position - 1  # members of the cell after this one
    limits = np.searchsorted(np.cumsum(partners), np.arange(0, partners.sum(), _BLOCK))
    for begin, end in pairwise([*limits.tolist(), len(which)]):
        count = partners[begin:end]
        a = np.repeat(position[begin:end], count)
        b = a + 1 + np.arange(count.sum()) - np.repeat(np.cumsum(count) - count, count)
        pairs = np.sort(np.column_stack([which[a], which[b]]), axis=1)
        meet = (low[pairs[:, 0]] <= high[pairs[:, 1]]).all(axis=1) & (low[pairs[:, 1]] <= high[pairs[:, 0]]).all(axis=1)
        yield np.unique(pairs[meet], axis=0)
