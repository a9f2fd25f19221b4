"""Places where a mesh crosses itself, and triangle sides without a partner."""

from __future__ import annotations

import numpy as np

from mracad.bspline.vectors import cross

Array = np.ndarray
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


def crossings(spots: Array, pairs: Array) -> tuple[Array, Array]:
    """Those of some pairs ``(k, 2)`` of triangles that cross, and a point of each crossing; not those that only touch.

    Parameters
    ----------
    spots : ndarray (m, 3, 3)
        The corners of all triangles.
    pairs : ndarray of int (k, 2)

    Returns
    -------
    pairs : ndarray of int (k, 2)
    where : ndarray (k, 3)
    """
    found, where = [np.empty((0, 2), int)], [np.empty((0, 3))]
    planes = _Planes(spots)
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
    determinant = np.einsum("ki,ki->k", u, p)
    size = np.linalg.norm(along, axis=1) * np.linalg.norm(cross(u, v), axis=1)
    with np.errstate(divide="ignore", invalid="ignore"):
        off = start - triangle[:, 0]
        q = cross(off, u)
        a, b, t = (np.einsum("ki,ki->k", x, y) / determinant for x, y in ((off, p), (along, q), (v, q)))
        inside = (np.abs(determinant) > 1e-9 * size) & (a > 1e-6) & (b > 1e-6) & (a + b < 1 - 1e-6)
        return np.where(inside & (t > 1e-6) & (t < 1 - 1e-6), t, np.nan)


def near(low: Array, high: Array) -> Array:
    """Pairs ``(k, 2)`` of boxes, with lowest and highest corners ``(m, d)``, that meet.

    Boxes are taken along a curve that fills space, and each two of them, four, eight … have one around all.
    """
    if len(low) < 2:
        return np.empty((0, 2), int)
    order = np.argsort(_along_curve((low + high) / 2), kind="stable")
    levels = [(low[order], high[order])]
    while len(levels[-1][0]) > 1:
        least, most = levels[-1]
        starts = np.arange(0, len(least), 2)
        levels.append((np.minimum.reduceat(least, starts), np.maximum.reduceat(most, starts)))
    a = b = np.zeros(1, int)
    for least, most in reversed(levels[:-1]):
        one, other = (np.asfortranarray(each).T for each in (least, most))
        a, b = (
            np.concatenate([2 * a, 2 * a + 1, 2 * a, 2 * a + 1]),
            np.concatenate([2 * b, 2 * b + 1, 2 * b + 1, 2 * b]),
        )
        once = (a <= b) & (b < len(least))
        a, b = a[once], b[once]
        for begin, end in zip(one, other, strict=True):
            meet = (begin[a] <= end[b]) & (begin[b] <= end[a])
            a, b = a[meet], b[meet]
    return np.sort(order[np.column_stack([a, b])[a != b]], axis=1)


def _along_curve(points: Array) -> Array:
    """The place of points along a curve that fills space (Morton's)."""
    span = np.maximum(np.ptp(points, axis=0), 1e-300)
    bits = 60 // points.shape[1]
    cells = ((points - points.min(axis=0)) / span * (2**bits - 1)).astype(np.int64)
    place = np.zeros(len(points), np.int64)
    for bit in range(bits):
        for axis, cell in enumerate(cells.T):
            place |= (cell >> bit & 1) << (bit * points.shape[1] + axis)
    return place
