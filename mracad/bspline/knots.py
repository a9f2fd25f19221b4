"""Knot vectors of any multiplicity: clamped, unclamped and periodic."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property
from typing import Any, Literal

import numpy as np

from mracad.compiled import pointer
from mracad.errors import UsageError

Array = np.ndarray
Side = Literal["left", "right"]


class KnotVector:
    """An immutable knot vector together with its degree: a space of splines.

    Two knot vectors are equal when degree, knots and periodicity are, so they serve as cache keys.

    Parameters
    ----------
    knots : array_like
        Flat and non-decreasing, with knots repeated by their multiplicity.  The domain is ``[t_d, t_n]`` with
        ``n = len(knots) - d - 1``; knots beyond it only shape the first and last functions (unclamped ends).
        A periodic vector is laid out as by OCCT's ``BSplCLib::KnotSequence``: with ``m`` the multiplicity of the
        end knot it holds ``count + (d + 1 - m) + d + 1`` knots, and extended function ``i`` belongs to control point
        ``i mod count``.
    degree : int
        At least 1.
    periodic : bool

    Attributes
    ----------
    knots : ndarray
        The flat vector, read-only.
    degree : int
    periodic : bool
    breaks : ndarray (s + 1,)
        Distinct knots within the domain, ends included.
    multiplicities : ndarray (s + 1,) of int
        Multiplicity of each break.  For a periodic vector the last entry repeats the first.
    count : int
        Dimension of the space, the number of control points.

    Raises
    ------
    UsageError
        Knots that are not finite, decrease, are too few, or are repeated more than ``degree + 1`` times.
    """

    knots: Array
    degree: int
    periodic: bool
    breaks: Array
    multiplicities: Array
    count: int

    def __init__(self, knots: Array | Sequence[float], degree: int, periodic: bool = False) -> None:
        flat = np.array(knots, dtype=float)
        d = int(degree)
        if d < 1:
            raise UsageError(f"degree {degree} of a knot vector is below 1")
        if flat.ndim != 1 or len(flat) < 2 * d + 2:
            raise UsageError(f"a knot vector of degree {d} needs at least {2 * d + 2} knots")
        if not np.isfinite(flat).all():
            raise UsageError("a knot is not a finite number")
        if (flat[1:] < flat[:-1]).any():
            raise UsageError("knots decrease")
        low, high = flat[d], flat[-d - 1]
        if not low < high:
            raise UsageError("a knot vector has an empty domain")
        if periodic:
            breaks, mults = np.unique(flat[(flat >= low) & (flat < high)], return_counts=True)
            given, flat = flat, _periodic_layout(np.append(breaks, high), np.append(mults, mults[0]), d)
            if len(given) != len(flat) or np.abs(given - flat).max() > 1e-9 * (high - low):
                raise UsageError("knots of a periodic vector do not repeat with its period")
        first = np.append(0, np.flatnonzero(flat[1:] > flat[:-1]) + 1)
        breaks, mults = flat[first], np.diff(first, append=len(flat))
        inside = (breaks >= low) & (breaks <= high)
        if mults.max() > d + 1:
            raise UsageError(f"a knot of multiplicity {mults.max()} exceeds degree {d} + 1")
        self._set(knots=flat, degree=d, periodic=bool(periodic), breaks=breaks[inside], multiplicities=mults[inside])
        self._set(count=int(mults[inside][:-1].sum()) if periodic else len(flat) - d - 1)
        for array in (self.knots, self.breaks, self.multiplicities):
            array.setflags(write=False)
        self._set(_key=(d, self.periodic, flat.tobytes()))
        self._set(_hash=hash(self._key))

    _key: tuple[int, bool, bytes]
    _hash: int

    def _set(self, **values: object) -> None:
        self.__dict__.update(values)

    def __setattr__(self, name: str, value: object) -> None:
        raise AttributeError(f"a KnotVector is immutable: {name} cannot be set")

    def __hash__(self) -> int:
        return self._hash

    def __eq__(self, other: object) -> bool:
        return isinstance(other, KnotVector) and self._key == other._key

    def __reduce__(self) -> tuple[Any, ...]:
        return KnotVector, (self.knots, self.degree, self.periodic)

    def __repr__(self) -> str:
        kind = ", periodic" if self.periodic else ""
        low, high = self.domain
        what = f"degree {self.degree}, {self.count} control points, {self.spans} spans"
        return f"KnotVector({what} on [{low:g}, {high:g}]{kind})"

    @classmethod
    def from_multiplicities(
        cls, breaks: Array | Sequence[float], mults: Array | Sequence[int], degree: int, periodic: bool = False
    ) -> KnotVector:
        """The knot vector with distinct knots ``breaks`` of the given multiplicities (OCCT's way of storing them).

        For a periodic vector the breaks span one period, both ends included and of equal multiplicity; otherwise
        all knots are given, those beyond the domain of an unclamped vector too.
        """
        values, counts = np.asarray(breaks, dtype=float), np.asarray(mults, dtype=int)
        if values.ndim != 1 or values.shape != counts.shape or len(values) < 2:
            raise UsageError("knots and multiplicities must be two lists of one length, at least 2")
        if (counts < 1).any():
            raise UsageError("a knot has a multiplicity below 1")
        if not periodic:
            return cls(np.repeat(values, counts), degree)
        if counts[0] != counts[-1]:
            raise UsageError("the end knots of a periodic vector differ in multiplicity")
        if counts[0] > degree + 1:
            raise UsageError(f"a knot of multiplicity {counts[0]} exceeds degree {degree} + 1")
        return cls(_periodic_layout(values, counts, degree), degree, periodic=True)

    @classmethod
    def clamped(cls, breaks: Array | Sequence[float], degree: int) -> KnotVector:
        """The clamped knot vector with simple interior knots: ends of multiplicity ``degree + 1``."""
        mults = np.ones(len(breaks), dtype=int)
        mults[[0, -1]] = degree + 1
        return cls.from_multiplicities(breaks, mults, degree)

    @property
    def domain(self) -> tuple[float, float]:
        """First and last parameter."""
        return float(self.breaks[0]), float(self.breaks[-1])

    @property
    def period(self) -> float:
        """Length of the domain."""
        return float(self.breaks[-1] - self.breaks[0])

    @property
    def full(self) -> Array:
        """Knots of multiplicity ``degree`` or more inside the domain, and at the end of a period."""
        stop = None if self.periodic else -1
        return self.breaks[1:stop][self.multiplicities[1:stop] >= self.degree]

    @property
    def spans(self) -> int:
        """Number of non-empty knot spans within the domain."""
        return len(self.breaks) - 1

    @cached_property
    def span_index(self) -> Array:
        """Index ``k`` in ``knots`` of each non-empty span ``[t_k, t_{k+1})`` of the domain, ``(spans,)``."""
        return np.searchsorted(self.knots, self.breaks[:-1], "right") - 1

    @cached_property
    def pointers(self) -> tuple[int, int, int]:
        """Where knots, breaks and the spans between them are in memory."""
        return pointer(self.knots), pointer(self.breaks), pointer(self.span_index)

    def greville(self) -> Array:
        """Greville abscissae ``(t_{i+1} + … + t_{i+d}) / d``, ``(count,)``, within a periodic domain; read-only."""
        return self._greville

    @cached_property
    def _greville(self) -> Array:
        means = np.lib.stride_tricks.sliding_window_view(self.knots[1:-1], self.degree).mean(axis=1)[: self.count]
        places = self.wrap(means) if self.periodic else means
        places.setflags(write=False)
        return places

    def wrap(self, x: Array, side: Side = "right") -> Array:
        """Parameters moved by whole periods into the domain; unchanged where the vector is not periodic.

        The result lies in ``[a, b)`` for ``side="right"`` and in ``(a, b]`` for ``side="left"``.
        """
        x = np.asarray(x, dtype=float)
        if not self.periodic:
            return x
        low, high = self.domain
        inside = (x >= low) & (x < high) if side == "right" else (x > low) & (x <= high)
        turned = low + np.mod(x - low, self.period) if side == "right" else high - np.mod(high - x, self.period)
        return np.where(inside, x, np.clip(turned, low, high))

    def locate(self, x: Array, side: Side = "right") -> tuple[Array, Array]:
        """Span of each parameter.

        Returns
        -------
        span : ndarray of int
            Index ``k`` in ``knots`` of the non-empty span that holds ``x``: ``t_k ≤ x < t_{k+1}``, or
            ``t_k < x ≤ t_{k+1}`` for ``side="left"``; the end spans also cover what lies beyond them.
        offset : ndarray
            ``x - t_k``, after wrapping.
        """
        x = self.wrap(x, side)
        place = np.searchsorted(self.breaks, x, "right" if side == "right" else "left") - 1
        span = self.span_index[np.minimum(np.maximum(place, 0), self.spans - 1)]
        return span, x - self.knots[span]

    def refined(self, extra_knots: Array | Sequence[float]) -> KnotVector:
        """This vector with more knots (repeated by the number of times that they are inserted).

        Raises
        ------
        UsageError
            A knot outside the open domain (a periodic one may take knots at its seam), or one too many there.
        """
        extra = np.asarray(extra_knots, dtype=float)
        if not extra.size:
            return self
        low, high = self.domain
        if self.periodic:
            extra = self.wrap(extra)
            values, counts = np.unique(
                np.concatenate([np.repeat(self.breaks[:-1], self.multiplicities[:-1]), extra]), return_counts=True
            )
            return KnotVector.from_multiplicities(
                np.append(values, high), np.append(counts, counts[0]), self.degree, periodic=True
            )
        if not ((extra > low) & (extra < high)).all():
            raise UsageError(f"a knot to be inserted lies outside ({low:g}, {high:g})")
        return KnotVector(np.sort(np.concatenate([self.knots, extra])), self.degree)

    def beyond(self, coarse: KnotVector) -> Array:
        """Knots to insert, repeated as necessary, that refine ``coarse`` of the same degree to this."""
        place = np.minimum(np.searchsorted(coarse.breaks, self.breaks), len(coarse.breaks) - 1)
        there = np.where(coarse.breaks[place] == self.breaks, coarse.multiplicities[place], 0)
        return np.repeat(self.breaks[1:-1], (self.multiplicities - there)[1:-1])

    def elevated(self, degree: int) -> KnotVector:
        """The smallest vector of that degree whose splines include all of this one's; itself if its degree suffices.

        The multiplicity of every knot grows by as much as the degree; unclamped ends become clamped.
        """
        more = degree - self.degree
        if more <= 0:
            return self
        mults = self.multiplicities + more
        if not self.periodic:
            mults[[0, -1]] = degree + 1
        return KnotVector.from_multiplicities(self.breaks, mults, degree, self.periodic)

    def with_multiplicities(self, mults: Array) -> KnotVector:
        """This vector with the multiplicities of its breaks replaced; 0 removes a break.

        The ends of a non-periodic vector do not change, whatever ``mults`` contains.
        """
        counts = np.array(mults, dtype=int)
        if counts.shape != self.multiplicities.shape:
            raise UsageError(f"{len(counts)} multiplicities for {len(self.breaks)} breaks")
        keep = counts > 0
        if self.periodic:
            return KnotVector.from_multiplicities(self.breaks[keep], counts[keep], self.degree, periodic=True)
        low, high = self.domain
        inner = np.repeat(self.breaks[1:-1], counts[1:-1])
        before, after = self.knots[self.knots <= low], self.knots[self.knots >= high]
        return KnotVector(np.concatenate([before, inner, after]), self.degree)

    def without(self, breaks: Array | Sequence[float]) -> KnotVector:
        """This vector with the given interior breaks removed completely."""
        gone = np.isin(self.breaks, np.asarray(breaks, dtype=float))
        gone[[0, -1]] = False
        return self.with_multiplicities(np.where(gone, 0, self.multiplicities))

    def closed(self) -> tuple[KnotVector, tuple[int, int]]:
        """The clamped vector over the whole support of the functions, and the number of its extra functions.

        Returns
        -------
        KnotVector
            Itself if it is clamped or periodic.
        (int, int)
            How many first and last functions of that vector this one lacks: this one's functions vanish to these orders
            at the ends.
        """
        if self.periodic:
            return self, (0, 0)
        before, after = (self.degree + 1 - int(np.count_nonzero(self.knots == end)) for end in self.knots[[0, -1]])
        if not before and not after:
            return self, (0, 0)
        return KnotVector(np.pad(self.knots, (before, after), "edge"), self.degree), (before, after)

    def repeated(self) -> tuple[Array, Array]:
        """Breaks and their multiplicities; of a periodic vector over five periods, the domain being the third."""
        if not self.periodic:
            return self.breaks, self.multiplicities
        turns = self.period * np.arange(-2, 3)
        return (self.breaks[:-1] + turns[:, None]).ravel(), np.tile(self.multiplicities[:-1], len(turns))

    def unrolled(self) -> KnotVector:
        """The same flat knots as a non-periodic vector: function ``i`` is control point ``i mod count`` of this one."""
        return KnotVector(self.knots, self.degree) if self.periodic else self


def _periodic_layout(breaks: Array, mults: Array, degree: int) -> Array:
    """Flat periodic knots: the base period repeated so that the last copy of the start knot has index ``degree``."""
    base = np.repeat(breaks[:-1], mults[:-1])
    m, count, period = int(mults[0]), int(mults[:-1].sum()), breaks[-1] - breaks[0]
    turn, place = np.divmod(np.arange(count + 2 * (degree + 1) - m) - (degree + 1 - m), count)
    flat = base[place] + turn * period
    flat[(turn == 1) & (place < m)] = breaks[-1]
    return np.asarray(flat)
