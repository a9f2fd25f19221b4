"""Profiles of a face: points at even arc lengths along parameter lines, inside the trims."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from mracad.bspline.surface import Net
from mracad.model.brep import Face
from mracad.model.cells import inside_grid
from mracad.wavelet.ladder import arc_lengths

Array = np.ndarray

LINES = 16, 48
"""Least and largest number of profiles along each direction: :data:`ACROSS` per span, within these limits."""

ACROSS = 2

SIZES = 64, 128, 256, 512, 1024
"""Numbers of points of profiles: the first that gives :data:`PER_SPAN` points per span, or the last."""

PER_SPAN, DENSE = 4, 8
"""Points per span of profiles, and of the curves from which they are interpolated."""

SHORTEST = 6
"""Least number of points of a curve that make a profile."""

CLOSED = 1e-6
"""Share of its length within which the ends of a closed profile meet."""


@dataclass(frozen=True, eq=False)
class Profiles:
    """Profiles with the same number of points.

    Attributes
    ----------
    points, normals : ndarray (p, n, 3)
        Points at even arc lengths, mm, and unit normals there (0 where there is none).
    lengths : ndarray (p,)
        mm.
    closed : bool
        Whether the lines close.
    """

    points: Array
    normals: Array
    lengths: Array
    closed: bool


def profiles(net: Net, face: Face, axis: int) -> list[Profiles]:
    """The profiles of a face along u (axis 0) or v, by their number of points and whether they close."""
    along = (net.u, net.v)[axis]
    low, high = _extent(net, face, axis)
    inner = along.breaks[(along.breaks > low) & (along.breaks < high)]
    ends = np.concatenate([[low], inner, [high]])
    dense = max(DENSE, -(-SIZES[0] // (len(ends) - 1)))
    at = np.interp(np.arange((len(ends) - 1) * dense + 1) / dense, np.arange(len(ends)), ends)
    others, _ = lines(net, face, 1 - axis)
    us, vs = (at, others) if axis == 0 else (others, at)
    grid, mask = net.grid(us, vs), inside_grid(face, net, us, vs)
    if axis == 0:
        grid, mask = grid.swapaxes(0, 1), mask.T
    steps = np.linalg.norm(np.diff(grid, axis=1), axis=2)
    groups: defaultdict[tuple[int, bool], list[tuple[Array, float]]] = defaultdict(list)
    for k, first, last in _runs(mask):
        far = np.append(0.0, np.cumsum(steps[k, first:last]))
        length = float(far[-1])
        if not length > 0.0:
            continue
        closed = last - first + 1 == len(at) and np.linalg.norm(grid[k, 0] - grid[k, -1]) <= CLOSED * length
        spans = np.count_nonzero((inner > at[first]) & (inner < at[last])) + 1
        count = next((size for size in SIZES if size >= PER_SPAN * spans), SIZES[-1])
        share = np.arange(count) / (count if closed else count - 1)
        place = np.interp(share * length, far, at[first : last + 1])
        uv = np.stack([place, np.full(count, others[k])][:: 1 if axis == 0 else -1], axis=1)
        groups[count, bool(closed)].append((uv, length))
    return [_evaluated(net, each, closed) for (_, closed), each in groups.items()]


def _evaluated(net: Net, each: Sequence[tuple[Array, float]], closed: bool) -> Profiles:
    uv = np.concatenate([at for at, _ in each])
    points, su, sv = net.evaluate(uv, 1)
    normals = np.nan_to_num(net.normals(uv, tangents=(su, sv)))
    shape = len(each), -1, 3
    return Profiles(points.reshape(shape), normals.reshape(shape), np.array([length for _, length in each]), closed)


def _runs(on: Array) -> list[tuple[int, int, int]]:
    """Lines (rows), first and last positions of runs of at least :data:`SHORTEST` points that are on the face."""
    change = np.diff(np.pad(on.astype(np.int8), ((0, 0), (1, 1))), axis=1)
    (line, first), (_, after) = np.nonzero(change > 0), np.nonzero(change < 0)
    long = after - first >= SHORTEST
    return list(zip(line[long].tolist(), first[long].tolist(), (after[long] - 1).tolist(), strict=True))


def _extent(net: Net, face: Face, axis: int) -> tuple[float, float]:
    """The smallest and largest parameter of a face along an axis."""
    knots = (net.u, net.v)[axis]
    if not face.trims:
        return knots.domain
    every = np.concatenate([trim.curve.poles[:, axis] for trim in face.trims])
    low, high = float(every.min()), float(every.max())
    if knots.periodic:
        return low, min(high, low + knots.period)
    return max(low, knots.domain[0]), min(high, knots.domain[1])


def lines(net: Net, face: Face, axis: int) -> tuple[Array, float]:
    """Parameters of lines at even lengths across a face, and their distance, mm."""
    knots, ends = (net.u, net.v)[axis], _extent(net, face, axis)
    lengths = np.append(0.0, np.cumsum(arc_lengths(net, axis)))
    turns = range(-1, 2) if knots.periodic else range(1)
    at = np.concatenate([knots.breaks + turn * knots.period for turn in turns])
    total = np.concatenate([lengths + turn * lengths[-1] for turn in turns])
    first, last = np.interp(ends, at, total)
    spans = np.count_nonzero((total > first) & (total < last)) + 1
    count = int(np.clip(ACROSS * spans, *LINES))
    step = (last - first) / count
    return np.interp(first + step * (np.arange(count) + 0.5), total, at), float(step)
