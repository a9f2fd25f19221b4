"""The boundary of a trimmed face as closed polygons in the parameter plane of its surface."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import comb

import numpy as np

from mracad.bspline.curve import Curve, bezier_pieces
from mracad.bspline.knots import KnotVector
from mracad.bspline.surface import Net
from mracad.memo import kept
from mracad.model.brep import Face

Array = np.ndarray

MARGIN = 1e-7
"""Fraction of the domain within which a curve counts as lying on a line, a point as lying on the boundary."""

FLAT = 2e-4
"""Largest distance between a curve and its polygon, as a fraction of a mean knot span and of the face's extent."""

LONGEST = 4096
"""Largest number of chords for one polynomial piece of a curve."""


@dataclass(frozen=True, eq=False)
class Outline:
    """The boundary of a face.

    Attributes
    ----------
    chords : ndarray (q, 2, 2)
        First and last point of each side of closed polygons, in ``u, v``.  In periodic directions the loops are
        continuous; they may lie outside the domain, and a loop that goes round the surface ends a period away from its
        start.
    natural : bool
        Whether the face is the whole surface; then ``chords`` is empty.
    around : (bool, bool)
        Whether a loop goes round the surface along u, along v.
    """

    chords: Array
    natural: bool = False
    around: tuple[bool, bool] = (False, False)

    @property
    def box(self) -> Array:
        """Lowest and highest ``u, v``, ``(2, 2)``."""
        points = self.chords.reshape(-1, 2)
        return np.array([points.min(axis=0), points.max(axis=0)])

    def lines(self, axis: int) -> Array:
        """Parameters at which a large part of the boundary is a line ``u = const`` (axis 0) or ``v = const`` (axis
        1)."""
        low, high = self.box
        steps = np.abs(self.chords[:, 1] - self.chords[:, 0])
        straight = steps[:, axis] <= MARGIN * (high - low)[axis]
        places, of = np.unique(self.chords[straight, 0, axis], return_inverse=True)
        lengths = np.bincount(of, steps[straight, 1 - axis], minlength=len(places))
        return np.asarray(places[lengths >= (high - low)[1 - axis] / 8])


def outline(face: Face, net: Net) -> Outline:
    """The boundary of a face on its surface ``net``."""
    return _outline(net.u, net.v, tuple(trim.curve for trim in face.trims))


@kept(2048)
def _outline(u: KnotVector, v: KnotVector, curves: tuple[Curve, ...]) -> Outline:
    if not curves or _natural(u, v, curves):
        return Outline(np.empty((0, 2, 2)), natural=True)
    lengths = np.array([u.period, v.period])
    chords, owners = _flattened(curves, lengths / [u.spans, v.spans])
    ends = np.array([(curve.poles[0], curve.poles[-1]) for curve in curves])
    periods = np.array([kv.period if kv.periodic else np.inf for kv in (u, v)])
    loops = _loops(ends, lengths, periods)
    shifts, closing, around = _closed(ends, loops, periods)
    chords = np.concatenate([chords + shifts[owners][:, None], closing])
    if np.isfinite(periods).any():
        chords = _gathered(chords, np.append(owners, np.arange(len(curves))), loops, periods)
    return Outline(chords[(chords[:, 0] != chords[:, 1]).any(axis=1)], around=around)


def _natural(u: KnotVector, v: KnotVector, curves: Sequence[Curve]) -> bool:
    """Whether all curves lie on the border of the domain (of any one period where periodic)."""
    boxes = np.array([(curve.poles.min(axis=0), curve.poles.max(axis=0)) for curve in curves])
    low, high = boxes[:, 0].min(axis=0), boxes[:, 1].max(axis=0)
    margin = MARGIN * np.array([u.period, v.period])
    for axis, kv in enumerate((u, v)):
        wanted = (low[axis], low[axis] + kv.period) if kv.periodic else kv.domain
        if max(abs(low[axis] - wanted[0]), abs(high[axis] - wanted[1])) > margin[axis]:
            return False
    on_side = (boxes[:, 1] <= low + margin) | (boxes[:, 0] >= high - margin)
    return bool(on_side.any(axis=1).all())


def _flattened(curves: Sequence[Curve], spans: Array) -> tuple[Array, Array]:
    """Chords ``(q, 2, 2)`` of the curves, in any order, and the index of each one's curve ``(q,)``."""
    boxes = np.array([(curve.poles.min(axis=0), curve.poles.max(axis=0)) for curve in curves])
    extent = boxes[:, 1].max(axis=0) - boxes[:, 0].min(axis=0)
    tolerance = FLAT * np.minimum(spans, np.where(extent > 0, extent, spans))
    chords, owners = [], []
    for points, whose in bezier_pieces(curves):
        polygons, piece = _polygons(points, _chord_counts(points, tolerance))
        same = piece[1:] == piece[:-1]
        chords.append(np.stack([polygons[:-1][same], polygons[1:][same]], axis=1))
        owners.append(whose[piece[1:][same]])
    return np.concatenate(chords), np.concatenate(owners)


def _chord_counts(points: Array, tolerance: Array) -> Array:
    """Number of chords that keep homogeneous Bézier pieces ``(q, p + 1, 3)`` within the tolerance.

    Wang's bound ``max |Δ²P| p (p − 1) / 8 n²``; for rational pieces, around the middle of their control points, that of
    Zheng and Sederberg.
    """
    degree = points.shape[1] - 1
    if degree < 2:
        return np.ones(len(points), dtype=int)
    weights = points[..., 2]
    plane = points[..., :2] / weights[..., None] / tolerance
    plane = plane - 0.5 * (plane.min(axis=1) + plane.max(axis=1))[:, None]
    bend = np.linalg.norm(np.diff(plane * weights[..., None], 2, axis=1), axis=2).max(axis=1)
    pull = np.linalg.norm(plane, axis=2).max(axis=1) * np.abs(np.diff(weights, 2, axis=1)).max(axis=1)
    bound = degree * (degree - 1) / 8 * (bend + pull) / weights.min(axis=1)
    return np.asarray(np.clip(np.ceil(np.sqrt(bound)), 1, LONGEST).astype(int))


def _polygons(points: Array, counts: Array) -> tuple[Array, Array]:
    """Points of polygons with ``counts`` sides inscribed in Bézier pieces, and the piece of each."""
    degree = points.shape[1] - 1
    piece = np.repeat(np.arange(len(points)), counts + 1)
    place = np.arange(len(piece)) - np.repeat(np.cumsum(counts + 1) - counts - 1, counts + 1)
    t = (place / counts[piece])[:, None]
    k = np.arange(degree + 1)
    found = np.einsum("qa,qak->qk", _binomials(degree) * t**k * (1 - t) ** (degree - k), points[piece])
    return found[:, :2] / found[:, 2:], piece


@kept(32)
def _binomials(degree: int) -> Array:
    return np.array([comb(degree, k) for k in range(degree + 1)], dtype=float)


def _loops(ends: Array, lengths: Array, periods: Array) -> list[list[int]]:
    """Loops of curves joined at their nearest ends.

    Parameters
    ----------
    ends : ndarray (n, 2, 2)
        First and last point of each curve.
    lengths, periods : ndarray (2,)
        Length of the domain, and the period (infinite where there is none).

    Returns
    -------
    list of list of int
        Each loop as the ends at which its curves begin: ``2 i`` for curve ``i`` run forwards, ``2 i + 1`` backwards.
    """
    partner = _partners(ends.reshape(-1, 2) / lengths, np.isfinite(periods))
    loops, left = [], set(range(len(ends)))
    while left:
        loop, begin = [], 2 * min(left)
        while begin // 2 in left:
            left.remove(begin // 2)
            loop.append(begin)
            begin = int(partner[begin ^ 1])
        loops.append(loop)
    return loops


def _partners(points: Array, periodic: Array) -> Array:
    """The end that follows each end: rounds of mutual nearest neighbours, by whole periods only if necessary."""
    apart = points[:, None] - points
    distance = np.linalg.norm(apart, axis=2)
    if periodic.any():
        wrapped = apart - np.where(periodic, np.round(apart), 0.0)
        distance = np.minimum(distance, 1e-3 + np.linalg.norm(wrapped, axis=2))
    np.fill_diagonal(distance, np.inf)
    partner = np.full(len(points), -1)
    while (partner < 0).any():
        nearest = distance.argmin(axis=1)
        one = np.flatnonzero((partner < 0) & (nearest[nearest] == np.arange(len(points))))
        partner[one] = nearest[one]
        distance[one], distance[:, one] = np.inf, np.inf
    return partner


def _closed(ends: Array, loops: list[list[int]], periods: Array) -> tuple[Array, Array, tuple[bool, bool]]:
    """Shifts and chords that make loops continuous.

    Returns
    -------
    shifts : ndarray (n, 2)
        Whole periods to move each curve by.
    closing : ndarray (n, 2, 2)
        Chord from the end of each curve of each loop to the beginning of the next.
    around : (bool, bool)
        Whether a loop ends a period away from its start, along u and along v.
    """
    shifts, closing, around = np.zeros((len(ends), 2)), np.empty((len(ends), 2, 2)), np.zeros(2, bool)
    finite = np.isfinite(periods)
    flat = ends.reshape(-1, 2)
    for loop in loops:
        for begin, following in zip(loop, [*loop[1:], loop[0]], strict=True):
            here = flat[begin ^ 1] + shifts[begin // 2]
            turn = np.zeros(2)
            turn[finite] = np.round(((here - flat[following]) / periods)[finite]) * periods[finite]
            if following != loop[0]:
                shifts[following // 2] = turn
            else:
                around |= np.abs(turn - shifts[following // 2]) > 0
            closing[begin // 2] = here, flat[following] + turn
    return shifts, closing, (bool(around[0]), bool(around[1]))


def _gathered(chords: Array, owners: Array, loops: list[list[int]], periods: Array) -> Array:
    """The chords with every loop moved by whole periods to lie around the widest one."""
    loop_of = np.empty(owners.max() + 1, dtype=int)
    for number, loop in enumerate(loops):
        loop_of[np.array(loop) // 2] = number
    of = loop_of[owners]
    low, high = np.full((len(loops), 2), np.inf), np.full((len(loops), 2), -np.inf)
    np.minimum.at(low, of, chords.min(axis=1))
    np.maximum.at(high, of, chords.max(axis=1))
    widest, finite = (high - low).prod(axis=1).argmax(), np.isfinite(periods)
    moves, middle = np.zeros_like(low), 0.5 * (low + high)
    moves[:, finite] = (np.round((middle[widest] - middle) / periods) * np.where(finite, periods, 0.0))[:, finite]
    return np.asarray(chords + moves[of][:, None])
