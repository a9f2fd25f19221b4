"""Knot ladders: which knots a coarser level keeps, by level or by scale."""

from __future__ import annotations

from collections.abc import Sequence
from collections.abc import Set as AbstractSet

import numpy as np

from mracad.bspline.basis import legendre
from mracad.bspline.knots import Array, KnotVector
from mracad.bspline.surface import Net
from mracad.errors import UsageError
from mracad.memo import kept

_RESOLUTION = 1_000_000
_POSITIONS = 16
_GAUSS_POINTS = 4


def rungs_by_level(
    kv: KnotVector,
    keep: AbstractSet[float] | Array = frozenset(),
    lengths: Array | None = None,
    tolerance: float = 1e-4,
    odd: Sequence[bool] = (),
) -> list[KnotVector]:
    """Nested knot vectors from ``kv`` to the coarsest, each without every second interior knot of the one before.

    Parameters
    ----------
    kv : KnotVector
    keep : set of float, or boolean mask (spans + 1,)
        Breaks that stay on every rung with all their multiplicity.
    lengths : array_like (spans,), optional
        Arc length of each span, mm; if not given, parameters are used and ``tolerance`` does not apply.
    tolerance : float
        Breaks closer than this (mm), or than 1e-6 of the whole, count as one knot.
    odd : sequence of bool
        For the first rungs, whether the other knots of each run are dropped: the second, the fourth, and so on.

    Returns
    -------
    list of KnotVector
        ``kv`` first.  If there are multiple knots or clusters, the second rung makes all of them simple.
        The last has no free interior knots; a periodic one keeps its end knot and at least ``max(d + 1, 3)`` spans.

    Examples
    --------
    >>> from mracad.bspline.knots import KnotVector
    >>> from mracad.wavelet import rungs_by_level
    >>> [rung.breaks.tolist() for rung in rungs_by_level(KnotVector.clamped([0, 1, 2, 4, 5, 9], 3))]
    [[0.0, 1.0, 2.0, 4.0, 5.0, 9.0], [0.0, 2.0, 4.0, 9.0], [0.0, 2.0, 9.0], [0.0, 9.0]]
    """
    if lengths is None:
        lengths, tolerance = np.diff(kv.breaks), 0.0
    ladder = _Ladder(kv, keep, lengths, tolerance, float(np.sum(lengths)) / _RESOLUTION)
    rungs = [kv]
    if ladder.sensible(len(ladder.alive)):
        simple = ladder.thinned(np.ones(len(ladder.alive), dtype=int))
        if simple != kv:
            rungs.append(simple)
    others = iter(odd)
    while ladder.drop(ladder.inner(next(others, False))):
        rungs.append(ladder.thinned(np.ones(len(ladder.alive), dtype=int)))
    return rungs


def ladder_for_scale(
    kv: KnotVector,
    lengths: Array,
    scale: float,
    keep: AbstractSet[float] | Array = frozenset(),
    tolerance: float = 1e-4,
) -> KnotVector:
    """The coarse knot vector for a scale, which is a wavelength: ripples up to half of it are removed, those of three
    times it stay.

    Alternate knots are dropped, sweep by sweep, wherever the merged span stays shorter than ``scale``, so that
    knots end up ``scale / 2`` to ``scale`` apart: the projection onto spacing H removes wavelengths below 1.5 H and
    keeps those above 2.5 H.  A knot of multiplicity r is as fine as r knots: if the spans beside it average below
    ``scale`` it becomes simple, otherwise it keeps at most three copies per ``scale``.

    Parameters
    ----------
    kv : KnotVector
    lengths : array_like (spans,)
        Arc length of each span, mm.
    scale : float
        mm.
    keep : set of float, or boolean mask (spans + 1,)
        Breaks that stay with all their multiplicity.
    tolerance : float
        Breaks closer than this (mm), or than 1e-6 of the whole, count as one knot.

    Returns
    -------
    KnotVector
        ``kv`` itself if nothing in it is finer than the scale.

    Examples
    --------
    >>> import numpy as np
    >>> from mracad.bspline.knots import KnotVector
    >>> from mracad.wavelet import ladder_for_scale
    >>> ladder_for_scale(KnotVector.clamped(np.arange(17.0), 3), np.ones(16), scale=4.0).breaks
    array([ 0.,  2.,  4.,  6.,  8., 10., 12., 14., 16.])

    Notes
    -----
    Lengths are compared in whole millionths of the scale, and ties are broken by the position from both ends, so that
    rotating, scaling or reversing the model selects the same knots.
    """
    if not scale > 0:
        raise UsageError(f"scale {scale} is not positive")
    lengths = np.asarray(lengths, dtype=float)
    if isinstance(keep, AbstractSet) and not keep and _short(kv, lengths, scale, tolerance):
        return _bare(kv)
    ladder = _Ladder(kv, keep, lengths, tolerance, scale)
    while ladder.drop(ladder.beside() < _RESOLUTION):
        pass
    if not ladder.sensible(len(ladder.alive)):
        return kv
    beside = ladder.beside()
    return ladder.thinned(np.where(beside < 2 * _RESOLUTION, 1, 3 * beside // (2 * _RESOLUTION)))


@kept(128)
def arc_lengths(net: Net, direction: int) -> Array:
    """Mean length of the iso-curves on each knot span.

    Parameters
    ----------
    net : Net
    direction : {0, 1}
        0 for the spans of ``net.u``, 1 for those of ``net.v``.

    Returns
    -------
    ndarray (spans,)
        ``∫ |S_u| du`` over each span (mm), by four Gauss points a span, averaged over 16 places across.
    """
    breaks = (net.u, net.v)[direction].breaks
    return piece_lengths(net, direction, np.stack([breaks[:-1], breaks[1:]], axis=1))


def piece_lengths(net: Net, direction: int, pieces: Array) -> Array:
    """The same as :func:`arc_lengths` on pieces of knot spans, from and to parameters ``(pieces, 2)``."""
    across = (net.v, net.u)[direction]
    nodes, weights = legendre(_GAUSS_POINTS)
    half = 0.5 * (pieces[:, 1] - pieces[:, 0])[:, None]
    places, weight = (pieces[:, :1] + half * (nodes + 1)).ravel(), half * weights
    low, _ = across.domain
    others = low + across.period * (np.arange(_POSITIONS) + 0.5) / _POSITIONS
    us, vs = (places, others) if direction == 0 else (others, places)
    speed = np.linalg.norm(net.tangents(us, vs, direction), axis=2).mean(axis=1 - direction)
    return np.asarray((speed.reshape(weight.shape) * weight).sum(axis=1))


class _Ladder:
    """The remaining clusters of breaks.

    Attributes
    ----------
    first, last : ndarray (clusters,)
        Range of breaks of each cluster; the first and the last hold the ends of the domain.
    alive : ndarray of int
        Clusters still there.
    spans : ndarray (len(alive) - 1,) of int
        Length from each cluster to the next, in millionths of ``unit``.
    """

    def __init__(
        self, kv: KnotVector, keep: AbstractSet[float] | Array, lengths: Array, tolerance: float, unit: float
    ) -> None:
        lengths = np.asarray(lengths, dtype=float)
        if lengths.shape != (kv.spans,):
            raise UsageError(f"{lengths.size} lengths for {kv.spans} spans")
        if not (np.isfinite(lengths).all() and (lengths >= 0).all()):
            raise UsageError("a span has no length")
        self.kv = kv
        marks = np.isin(kv.breaks, list(keep)) if isinstance(keep, AbstractSet) and keep else keep
        self.kept = np.array(np.zeros(len(kv.breaks)) if isinstance(marks, AbstractSet) else marks, dtype=bool)
        if self.kept.shape != kv.breaks.shape:
            raise UsageError(f"{self.kept.size} marks of kept knots for {len(kv.breaks)} breaks")
        if kv.periodic:
            self.kept[0] = self.kept[-1] = self.kept[0] or self.kept[-1]
        apart = lengths >= max(tolerance, 1e-6 * lengths.sum())
        self.last = np.append(np.flatnonzero(apart), kv.spans)
        self.first = np.append(0, self.last[:-1] + 1)
        self.alive = np.arange(len(self.first))
        self.fixed = np.logical_or.reduceat(self.kept, self.first)
        self.fixed[0] = self.fixed[-1] = True
        ratio = np.minimum(lengths[apart] / (unit or 1.0), 1e6)
        self.spans = np.rint(ratio * _RESOLUTION).astype(np.int64)

    def sensible(self, clusters: int) -> bool:
        """Whether a space with this number of clusters is useful: a loop needs some spans."""
        return not self.kv.periodic or clusters > max(self.kv.degree + 1, 3)

    def beside(self) -> Array:
        """Sum of the spans before and after each cluster; twice the only span at an end (a loop continues)."""
        before, after = np.append(self.spans[0], self.spans), np.append(self.spans, self.spans[-1])
        if self.kv.periodic:
            before[0], after[-1] = self.spans[-1], self.spans[0]
        return np.asarray(before + after)

    def inner(self, odd: bool) -> Array:
        """All clusters; if ``odd``, without the ends of each run between fixed ones, unless nothing else remains."""
        free = ~self.fixed[self.alive]
        within = np.pad(free, 1)
        within = free & within[:-2] & within[2:]
        return within if odd and within.any() else free

    def drop(self, candidate: Array) -> bool:
        """Remove alternate clusters of each run of candidates; return whether any was removed."""
        candidate = candidate & ~self.fixed[self.alive]
        if len(self.alive) < 2 or not candidate.any():
            return False
        gone = _alternate(candidate, np.append(0, np.cumsum(self.spans)))
        if not self.sensible(int(np.count_nonzero(~gone))):
            return False
        self.spans = np.add.reduceat(self.spans, np.flatnonzero(~gone)[:-1])
        self.alive = self.alive[~gone]
        return True

    def thinned(self, copies: Array) -> KnotVector:
        """The knot vector with the remaining clusters, of at most ``copies`` knots each; its own if those are all."""
        own = self.kv.multiplicities
        here = np.zeros(len(self.first), dtype=bool)
        here[self.alive] = True
        mults = np.where(np.repeat(here, self.last - self.first + 1), own, 0)
        first, single = self.first[self.alive], (self.last == self.first)[self.alive]
        crowded = np.add.reduceat(mults, self.first)[self.alive] > copies
        free = crowded & single & ~self._lasting[first]
        mults[first[free]] = np.minimum(own[first[free]], copies[free])
        crowded &= ~single
        for cluster, limit in zip(self.alive[crowded].tolist(), copies[crowded].tolist(), strict=True):
            inside = slice(self.first[cluster], self.last[cluster] + 1)
            mults[inside] = self._cut(inside, limit)
        return self.kv if (mults == own).all() else _with_multiplicities(self.kv, mults.tobytes())

    @property
    def _lasting(self) -> Array:
        """Breaks that stay with all their multiplicity."""
        kept = self.kept.copy()
        if not self.kv.periodic:
            kept[[0, -1]] = True
        return kept

    def _cut(self, inside: slice, limit: int) -> Array:
        mults, kept = self.kv.multiplicities[inside].copy(), self._lasting[inside]
        ends = np.arange(inside.start, inside.stop) % self.kv.spans == 0
        chief = ends if ends.any() else kept
        if not chief.any():
            middle = np.abs(2 * np.arange(len(mults)) - (len(mults) - 1))
            chief = np.arange(len(mults)) == np.lexsort((middle, -mults))[0]
        mults[~kept] = np.where(chief, np.minimum(mults, limit), 0)[~kept]
        return mults


def _short(kv: KnotVector, lengths: Array, scale: float, tolerance: float) -> bool:
    """Whether a clamped direction is certainly shorter than a scale, and no two of its breaks count as one."""
    if kv.periodic or lengths.shape != (kv.spans,):
        return False
    whole = float(lengths.sum())
    return whole < 0.999 * scale and float(lengths.min()) >= max(tolerance, 1e-6 * whole)


@kept(128)
def _bare(kv: KnotVector) -> KnotVector:
    """The knot vector without the breaks inside."""
    return kv if kv.spans == 1 else kv.with_multiplicities(np.append(1, np.zeros(kv.spans)))


@kept(512)
def _with_multiplicities(kv: KnotVector, mults: bytes) -> KnotVector:
    return kv.with_multiplicities(np.frombuffer(mults, dtype=int))


def _alternate(candidate: Array, place: Array) -> Array:
    """Every second candidate of each run of them, never two neighbours.

    Counted from both ends of the run towards its middle; where two would meet there, the one nearer to the middle of
    the whole (``place`` in the domain) is taken.
    """
    index = candidate.nonzero()[0]
    first = np.ones(len(index), dtype=bool)
    first[1:] = index[1:] != index[:-1] + 1
    start = first.nonzero()[0]
    lengths = np.append(start[1:], len(index)) - start
    after = np.arange(len(index)) - np.repeat(start, lengths)
    gone = np.zeros(len(candidate), dtype=bool)
    gone[index[np.minimum(after, np.repeat(lengths - 1, lengths) - after) % 2 == 0]] = True
    left = (gone[:-1] & gone[1:]).nonzero()[0]
    if len(left):
        offset = np.abs(2 * place - place[-1])
        gone[np.where(offset[left + 1] < offset[left], left, left + 1)] = False
    return gone
