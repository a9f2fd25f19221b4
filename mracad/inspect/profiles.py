"""Profiles of a face: points at even arc lengths along parameter lines, inside the trims."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from mracad.bspline.surface import Net
from mracad.model.brep import Face
from mracad.model.cells import inside_grid
from mracad.wavelet.ladder import arc_lengths

Array = np.ndarray

LINES = 48
"""Number of profiles along each direction."""

SIZES = 64, 128, 256, 512, 1024
"""Numbers of points of profiles: the first that gives :data:`PER_SPAN` points per span, or the last."""

PER_SPAN, DENSE = 4, 8
"""Points per span of profiles, and of the curves from which they are interpolated."""

SHORTEST = 6
"""Least number of points of a curve that make a profile."""

CLOSED = 1e-6
"""Share of its length within which the ends of a closed profile meet."""


def profiles(net: Net, face: Face, axis: int) -> Iterator[tuple[Array, Array, float, bool]]:
    """Points and normals at even arc lengths along lines on a face, the length (mm), and whether the line closes."""
    along = (net.u, net.v)[axis]
    low, high = _extent(net, face, axis)
    inner = along.breaks[(along.breaks > low) & (along.breaks < high)]
    ends = np.concatenate([[low], inner, [high]])
    dense = max(DENSE, -(-SIZES[0] // (len(ends) - 1)))
    at = np.interp(np.arange((len(ends) - 1) * dense + 1) / dense, np.arange(len(ends)), ends)
    others, _ = lines(net, face, 1 - axis)
    us, vs = (at, others) if axis == 0 else (others, at)
    grid, mask = net.grid(us, vs), inside_grid(face, net, us, vs)
    for k, other in enumerate(others):
        line, on = (grid[:, k], mask[:, k]) if axis == 0 else (grid[k], mask[k])
        for first, last in _runs(on):
            steps = np.linalg.norm(np.diff(line[first : last + 1], axis=0), axis=1)
            length = float(steps.sum())
            if not length > 0.0:
                continue
            closed = last - first + 1 == len(at) and np.linalg.norm(line[0] - line[-1]) <= CLOSED * length
            spans = np.count_nonzero((inner > at[first]) & (inner < at[last])) + 1
            count = next((size for size in SIZES if size >= PER_SPAN * spans), SIZES[-1])
            share = np.arange(count) / (count if closed else count - 1)
            place = np.interp(share * length, np.append(0.0, np.cumsum(steps)), at[first : last + 1])
            uv = np.stack([place, np.full(count, other)][:: 1 if axis == 0 else -1], axis=1)
            points, su, sv = net.evaluate(uv, 1)
            yield points, np.nan_to_num(net.normals(uv, tangents=(su, sv))), length, bool(closed)


def _runs(on: Array) -> list[tuple[int, int]]:
    """First and last positions of runs of at least :data:`SHORTEST` points that are on the face."""
    change = np.flatnonzero(np.diff(np.concatenate([[0], on.astype(int), [0]])))
    pairs = zip(change[::2].tolist(), (change[1::2] - 1).tolist(), strict=True)
    return [(first, last) for first, last in pairs if last - first + 1 >= SHORTEST]


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
    step = (last - first) / LINES
    return np.interp(first + step * (np.arange(LINES) + 0.5), total, at), float(step)
