"""Exact copies: where a target's net is the source's shifted by whole spans, its offsets are the source's, shifted."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mracad.bspline.knots import KnotVector
from mracad.edit.feature.detail import Origin
from mracad.edit.feature.ideal import Copies
from mracad.edit.feature.patch import Patch

Array = np.ndarray
_Box = tuple[tuple[int, int], tuple[int, int]]

EXACT, CONGRUENT = 1e-6, 1e-3
"""Nets match when knots agree to the first share of a span, and control points to the second of the feature's
height."""

TURNED = 0.05
"""Largest entry by which a rotation between nets may differ from that between the frames of the two places."""


@dataclass(frozen=True, eq=False)
class Shifts:
    """Copies that are exact shifts.

    Attributes
    ----------
    matched : ndarray of bool (copies,)
    offsets : dict of int to ndarray (nu, nv, 3)
        Their sums by surface, over the surface's own net and in its frame, mm.
    """

    matched: Array
    offsets: dict[int, Array]


def shifted(copies: Copies) -> Shifts:
    """The copies that are exact shifts of control points."""
    matched, source = np.zeros(len(copies.places), bool), _source(copies)
    offsets: dict[int, Array] = {}
    if source is None:
        return Shifts(matched, offsets)
    origin, patch, delta = source
    rows, columns = (np.flatnonzero(delta.any(axis=(1 - axis, 2))) for axis in (0, 1))
    box = (int(rows[0]), int(rows[-1]) + 1), (int(columns[0]), int(columns[-1]) + 1)
    own = delta[slice(*box[0]), slice(*box[1])]
    plain = (copies.sizes == 1) & (np.abs(np.sin(copies.turns)) < 1e-12) & (np.cos(copies.turns) > 0)
    for i in np.flatnonzero(plain & (copies.touched.sum(axis=1) == 1)):
        target = copies.ground.patches.get(int(copies.feet.surface[i]))
        steps = _steps(patch, target, box, copies.feet.uv[i] - origin.feet.uv[0]) if target else None
        if steps is None or target is None:
            continue
        turn = _congruent(patch, target, box, steps, CONGRUENT * copies.height)
        if turn is None or np.abs(turn - copies.charts.axes[i].T @ origin.axes).max() > TURNED:
            continue
        sums = offsets.setdefault(target.index, np.zeros(target.net.poles.shape))
        sums[_there(target, box, steps)] += own @ (target.turn.T @ turn @ patch.turn).T * copies.heights[i]
        matched[i] = True
    return Shifts(matched, offsets)


def _source(copies: Copies) -> tuple[Origin, Patch, Array] | None:
    """The source of the feature and its offsets, if it lies on one patch and copies of it can be exact."""
    origin = copies.feature.origin
    if origin is None or copies.overlap != "add" or copies.mirror or len(origin.offsets) != 1:
        return None
    ((index, delta),) = origin.offsets.items()
    if int(origin.feet.surface[0]) != index or index not in copies.ground.patches:
        return None
    return origin, copies.ground.patches[index], delta


def _there(target: Patch, box: _Box, steps: tuple[int, int]) -> tuple[Array, ...]:
    """Control points of the target that correspond to those of a box of the source."""
    return np.ix_(*((np.arange(a, b) + k) % kv.count for (a, b), k, kv in zip(box, steps, target.knots, strict=True)))


def _congruent(source: Patch, target: Patch, box: _Box, steps: tuple[int, int], limit: float) -> Array | None:
    """The rotation that takes the source's net to the target's, if they are congruent to a distance, mm."""
    here, there = np.ix_(*(np.arange(a, b) for a, b in box)), _there(target, box, steps)
    one, two = source.net.poles[here].reshape(-1, 3), target.net.poles[there].reshape(-1, 3)
    weights = [
        np.ones(len(one)) if s.net.weights is None else s.net.weights[w].ravel()
        for s, w in ((source, here), (target, there))
    ]
    if np.abs(weights[0] / weights[0][0] - weights[1] / weights[1][0]).max() > 1e-9:
        return None
    a, b = one - one.mean(axis=0), two - two.mean(axis=0)
    turn = np.eye(3)
    if np.abs(a - b).max() > limit:
        u, _, vt = np.linalg.svd(b.T @ a)
        turn = u @ np.diag([1, 1, np.sign(np.linalg.det(u @ vt))]) @ vt
    return None if np.abs(a @ turn.T - b).max() > limit else turn


def _steps(source: Patch, target: Patch, box: _Box, way: Array) -> tuple[int, int] | None:
    """Number of control points by which a target's knots are the source's shifted by ``way``; None if they are not."""
    u, v = (_moved(source.knots[axis], target.knots[axis], box[axis], float(way[axis])) for axis in (0, 1))
    return None if u is None or v is None else (u, v)


def _moved(one: KnotVector, two: KnotVector, box: tuple[int, int], way: float) -> int | None:
    """Number of control points by which knots are shifted in one direction; None if they are not."""
    d = one.degree
    if d != two.degree:
        return None
    own = one.knots[box[0] : box[1] + d + 1]
    span = np.diff(own)[np.diff(own) > 0].min()
    flat, turn = two.knots, 0.0
    wanted = own[0] + way
    if two.periodic:
        low, high = two.domain
        turn = np.floor((wanted - low) / (high - low)) * (high - low)
        flat = np.concatenate([two.breaks[:-1].repeat(two.multiplicities[:-1]) + k * two.period for k in range(3)])
    start = int(np.abs(flat - (wanted - turn)).argmin())
    # of equal knots the one from which the others follow
    for first in range(max(start - d, 0), min(start + d + 1, len(flat) - len(own) + 1)):
        if np.abs(flat[first : first + len(own)] + turn - own - way).max() <= EXACT * span:
            return first - box[0] + (_first_index(two) if two.periodic else 0)
    return None


def _first_index(kv: KnotVector) -> int:
    """Index of the function whose support begins with the first knot of a periodic domain."""
    return int(np.searchsorted(kv.knots, kv.domain[0], side="left")) % kv.count
