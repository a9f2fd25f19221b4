"""Places where a mesh crosses itself, and triangle sides without a partner."""

from __future__ import annotations

from collections.abc import Iterable
from itertools import pairwise, product

import numpy as np

from mracad.bspline.vectors import cross

Array = np.ndarray
_BLOCK = 200_000  # pairs of triangles tested at once
_ROUNDING = 1e-11  # of a volume; beyond, its sign is certain, and so is that of every test that follows


def unpaired(sides: Array) -> Array:
    """The sides ``(k, 2)`` of triangles that do not occur exactly once in each direction."""
    most = int(sides.max(initial=0)) + 1
    keys, counts = np.unique(sides[:, 0].astype(np.int64) * most + sides[:, 1], return_counts=True)
    there, back = np.divmod(keys, most)
    partners = back * most + there
    place = np.minimum(np.searchsorted(keys, partners), max(len(keys) - 1, 0))
    bad = (counts != 1) | (keys[place] != partners) | (counts[place] != 1)
    return np.column_stack([there[bad], back[bad]])


def crossings(points: Array, corners: Array, parts: Array) -> tuple[Array, Array]:
    """Pairs of triangles of one part that cross, and a point of each crossing.

    Triangles that share a corner, and triangles that only touch, are left out.

    Returns
    -------
    pairs : ndarray of int (k, 2)
    where : ndarray (k, 3)
    """
    found, where = [np.empty((0, 2), int)], [np.empty((0, 3))]
    spots, corners = points[corners], np.asfortranarray(corners)
    planes = _Planes(spots)
    for pairs in _near(spots, parts):
        shared = np.zeros(len(pairs), bool)
        for one, other in product(corners.T, repeat=2):
            shared |= one[pairs[:, 0]] == other[pairs[:, 1]]
        pairs = pairs[~shared]
        for one, other in ((0, 1), (1, 0)):
            across = pairs[planes.across(spots, pairs[:, one], pairs[:, other])]
            for side in range(3):
                start, end = spots[across[:, one], side], spots[across[:, one], (side + 1) % 3]
                share = _pierced(start, end, spots[across[:, other]])
                hit = ~np.isnan(share)
                found.append(across[hit])
                where.append(start[hit] + share[hit, None] * (end - start)[hit])
    pairs, first = np.unique(np.concatenate(found), axis=0, return_index=True)
    return pairs, np.concatenate(where)[first]


class _Planes:
    """The planes of triangles."""

    def __init__(self, spots: Array) -> None:
        self._origins, u, v = spots[:, 0], spots[:, 1] - spots[:, 0], spots[:, 2] - spots[:, 0]
        self._normals = cross(u, v)
        self._sizes = np.linalg.norm(u, axis=1) * np.linalg.norm(v, axis=1)

    def across(self, spots: Array, ones: Array, others: Array) -> Array:
        """Whether a triangle is not wholly on one side of the plane of another, by more than rounding."""
        off = spots[ones] - self._origins[others][:, None]
        height = np.einsum("kij,kj->ki", off, self._normals[others])
        room = _ROUNDING * self._sizes[others] * np.abs(off).max(axis=(1, 2))
        return np.asarray((height.min(axis=1) <= room) & (height.max(axis=1) >= -room))


def _pierced(start: Array, end: Array, triangle: Array) -> Array:
    """The fraction of each segment at which it passes through the inside of its triangle, or NaN."""
    along = end - start
    u, v = triangle[:, 1] - triangle[:, 0], triangle[:, 2] - triangle[:, 0]
    p = cross(along, v)
    determinant = (u * p).sum(1)
    size = np.linalg.norm(along, axis=1) * np.linalg.norm(cross(u, v), axis=1)
    with np.errstate(divide="ignore", invalid="ignore"):
        off = start - triangle[:, 0]
        q = cross(off, u)
        a, b, t = ((x * y).sum(1) / determinant for x, y in ((off, p), (along, q), (v, q)))
        inside = (np.abs(determinant) > 1e-9 * size) & (a > 1e-6) & (b > 1e-6) & (a + b < 1 - 1e-6)
        return np.where(inside & (t > 1e-6) & (t < 1 - 1e-6), t, np.nan)


def _near(spots: Array, parts: Array) -> Iterable[Array]:
    """Pairs of triangles of one part whose boxes meet, in blocks, found by a grid of cells."""
    low, high = (np.asfortranarray(found(axis=1)) for found in (spots.min, spots.max))
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
    grid = (first + span).max(axis=0)

    def numbered(at: Array, part: Array) -> Array:
        """One number for each cell of a part."""
        return np.asarray(((part * grid[0] + at[..., 0]) * grid[1] + at[..., 1]) * grid[2] + at[..., 2])

    place = numbered(first[which] + np.stack([i, j, k], axis=1), parts[which].astype(np.int64))
    order = np.argsort(place, kind="stable")
    place, which = place[order], which[order]
    breaks = np.flatnonzero(np.diff(place)) + 1
    starts, ends = np.concatenate([[0], breaks]), np.concatenate([breaks, [len(which)]])
    position = np.arange(len(which))
    partners = np.repeat(ends, ends - starts) - position - 1  # members of the cell after this one
    limits = np.searchsorted(np.cumsum(partners), np.arange(0, partners.sum(), _BLOCK))
    for begin, end in pairwise([*limits.tolist(), len(which)]):
        count = partners[begin:end]
        a = np.repeat(position[begin:end], count)
        b = a + 1 + np.arange(count.sum()) - np.repeat(np.cumsum(count) - count, count)
        cells, a, b = place[a], which[a], which[b]
        for least, most in zip(low.T, high.T, strict=True):
            meet = (least[a] <= most[b]) & (least[b] <= most[a])
            cells, a, b = cells[meet], a[meet], b[meet]
        once = cells == numbered(np.maximum(first[a], first[b]), parts[a].astype(np.int64))  # of several shared cells
        yield np.column_stack([np.minimum(a, b), np.maximum(a, b)])[once]
