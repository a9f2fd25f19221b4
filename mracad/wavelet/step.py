"""One exact step between two nested spaces: control points to coarse ones and details, and back."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property
from itertools import pairwise

import numpy as np

from mracad.bspline.knots import Array, KnotVector
from mracad.bspline.refine import refinement
from mracad.bspline.rows import LARGE, Rows
from mracad.bspline.solve import BandSolver, folded
from mracad.errors import UsageError
from mracad.memo import kept
from mracad.wavelet.filters import wavelets
from mracad.wavelet.project import projection

EXACT = 1e-13
"""Allowed rounding loss, as a share of the whole signal."""


class TwoScale:
    """One analysis and synthesis step between two nested spaces: ``c = P c' + Q d``.  Get it from :func:`step`.

    Attributes
    ----------
    coarse, fine : KnotVector
    pinned : int
        Number of derivatives, the value included, that the coarse spline shares with the fine one at each end.
    exact : bool
        Whether solving for control points and details reproduces a signal to rounding.  If not, the coarse ones come
        from the projection, which is better conditioned, details that would make it worse are left out, and
        :func:`mracad.wavelet.transform.decompose` keeps a residual.
    """

    def __init__(self, coarse: KnotVector, fine: KnotVector, pinned: int = 0) -> None:
        self.coarse, self.fine, self.pinned = coarse, fine, pinned
        self._m, n = coarse.count, fine.count
        # Some functions of an unclamped vector may be all but zero within the domain: take their whole support.
        closed, vanish = fine.closed()
        self._wavelets = wavelets(coarse.closed()[0], closed, (pinned, pinned) if pinned else vanish)
        p, q = refinement(coarse, fine).coo(), self._wavelets.coo()
        row, column, value = (np.concatenate(pair) for pair in zip(p, q, strict=True))
        row[len(p[0]) :] += pinned
        column[len(p[0]) :] += self._m
        row_order, column_order = _orders(row, column, n, fine.periodic)
        self._row_order, self._column_order = row_order, column_order
        self._entries = row, column, value

    @cached_property
    def _solver(self) -> BandSolver:
        return BandSolver(*self._entries, self._row_order, self._column_order)

    @cached_property
    def _parts(self) -> tuple[tuple[Rows, Array], tuple[Rows, Array]]:
        """P and Q with rows and columns in band order, and the orders of their columns."""
        row, column, value = self._entries
        row, n, m = _inverse(self._row_order)[row], len(self._row_order), self._m
        found = []
        for those, first, count in ((column < m, 0, m), (column >= m, m, n - m)):
            order = self._column_order[(self._column_order >= first) & (self._column_order < first + count)] - first
            entries = row[those], _inverse(order)[column[those] - first], value[those]
            found.append((Rows.from_coo(*entries, (n, count)), order))
        return found[0], found[1]

    @cached_property
    def exact(self) -> bool:
        probe = np.cos(np.arange(len(self._row_order)) ** 2.0)
        both = self._solver.solve(probe)
        return bool(np.abs(probe - self.synthesise(both[: self._m], both[self._m :])).max() < 0.1 * EXACT)

    @cached_property
    def places(self) -> Array:
        """Where each wavelet is, ``(n − m,)``: the mean Greville abscissa of its control points by their squares (round
        the loop if it is periodic)."""
        kv = self.fine
        index = self._wavelets.start[:, None] + np.arange(self._wavelets.values.shape[1]) + self.pinned
        at, weight = kv.greville()[index % kv.count], self._wavelets.values**2
        if not kv.periodic:
            return np.asarray((weight * at).sum(axis=1) / weight.sum(axis=1))
        turn = np.angle((weight * np.exp(2j * np.pi * (at - kv.breaks[0]) / kv.period)).sum(axis=1)) / (2 * np.pi)
        return kv.wrap(kv.breaks[0] + turn * kv.period)

    @cached_property
    def heights(self) -> Array:
        """The largest control point of each wavelet, ``(n − m,)``."""
        return np.asarray(np.abs(self._wavelets.values).max(axis=1, initial=0.0))

    def analyse(self, c: Array, axis: int = 0, overwrite: bool = False, compiled: bool = False) -> tuple[Array, Array]:
        """Coarse control points and details of ``c`` along ``axis``; with ``overwrite`` they may take its place.

        ``compiled`` code is used even for few of them, if wanted: parts of large nets, which have loaded it.
        """
        c = np.asarray(c, dtype=float)
        if c.shape[axis] != self.fine.count:
            raise UsageError(f"{c.shape[axis]} control points along axis {axis}, but the knots need {self.fine.count}")
        coarse, detail = slice(None, self._m), slice(self._m, None)
        if self.exact or self.pinned:
            both = self._solver.solve(c, axis, overwrite, compiled)
            return _part(both, axis, coarse), _part(both, axis, detail)
        best = projection(self.coarse, self.fine).coarse(c, axis)
        rest = c - refinement(self.coarse, self.fine).apply(best, axis)
        found = _part(self._solver.solve(rest, axis), axis, detail)
        left = rest - self.synthesise(np.zeros_like(best), found, axis)
        helps = np.abs(left).max(initial=0) < 0.1 * np.abs(rest).max(initial=0)
        return best, found if helps else np.zeros_like(found)

    def synthesise(
        self, coarse: Array, detail: Array, axis: int = 0, out: Array | None = None, compiled: bool = False
    ) -> Array:
        """The control points with the given coarse control points and details along ``axis``.

        They are written to ``out`` if given; both inputs may be parts of that array.  For ``compiled`` see
        :meth:`analyse`.
        """
        if (coarse.shape[axis], detail.shape[axis]) != (self._m, self.fine.count - self._m):
            raise UsageError(
                f"{coarse.shape[axis]} coarse control points and {detail.shape[axis]} details along axis {axis}, but "
                f"the knots need {self._m} and {self.fine.count - self._m}"
            )
        axis %= coarse.ndim
        if out is None:
            out = np.empty((*coarse.shape[:axis], self.fine.count, *coarse.shape[axis + 1 :]))
        if compiled or out.size >= LARGE:
            from mracad.bspline import sweeps

            (p, first), (q, second) = self._parts
            sweeps.add(((p, coarse), (q, detail)), (first, second, self._row_order), axis, out)
        else:
            both = zip(self._parts, (coarse, detail), strict=True)
            low, high = (matrix.apply(np.take(c, order, axis=axis), axis) for (matrix, order), c in both)
            np.take(low + high, _inverse(self._row_order), axis=axis, out=out)
        return out


class Chain:
    """Several steps in a row, used as one: the details of the steps follow each other, the finest first."""

    def __init__(self, steps: Sequence[TwoScale]) -> None:
        self.steps = tuple(steps)
        self.fine, self.coarse = self.steps[0].fine, self.steps[-1].coarse

    @property
    def exact(self) -> bool:
        return all(each.exact for each in self.steps)

    @property
    def places(self) -> Array:
        """Where each wavelet is, see :attr:`TwoScale.places`."""
        return np.concatenate([each.places for each in self.steps])

    @property
    def heights(self) -> Array:
        """The largest control point of each wavelet, over the knots of its own step."""
        return np.concatenate([each.heights for each in self.steps])

    def analyse(self, c: Array, axis: int = 0, overwrite: bool = False, compiled: bool = False) -> tuple[Array, Array]:
        """See :meth:`TwoScale.analyse`."""
        details = []
        for each in self.steps:
            c, detail = each.analyse(c, axis, overwrite, compiled)
            details.append(detail)
        return c, np.concatenate(details, axis=axis)

    def synthesise(
        self, coarse: Array, detail: Array, axis: int = 0, out: Array | None = None, compiled: bool = False
    ) -> Array:
        """See :meth:`TwoScale.synthesise`."""
        end = detail.shape[axis]
        for each in reversed(self.steps):
            begin = end - (each.fine.count - each.coarse.count)
            here = out if each is self.steps[0] else None
            coarse = each.synthesise(coarse, _part(detail, axis, slice(begin, end)), axis, here, compiled)
            end = begin
        return coarse


@kept(128)
def step(coarse: KnotVector, fine: KnotVector, pinned: int = 0) -> TwoScale | Chain:
    """The step between two nested spaces, factored once and cached.

    If neighbouring knots are removed, or several copies of one, the step is a chain of steps that each remove
    alternate ones: a single step would be badly conditioned.

    Parameters
    ----------
    coarse, fine : KnotVector
        Clamped, if ``pinned``.
    pinned : int
        Number of derivatives, the value included, that coarse splines share with fine ones at each end: wavelets vanish
        there, and are orthogonal to the coarse splines that do.
    """
    between = _between(coarse, fine)
    if len(between) == 2:
        return TwoScale(coarse, fine, pinned)
    return Chain([TwoScale(b, a, pinned) for a, b in pairwise(between)])


def _between(coarse: KnotVector, fine: KnotVector) -> list[KnotVector]:
    """Knot vectors from fine to coarse, each without alternate ones of the knots still to be removed."""
    refinement(coarse, fine)  # raises where not nested
    wanted = np.zeros(len(fine.breaks), dtype=int)
    wanted[np.searchsorted(fine.breaks, coarse.breaks)] = coarse.multiplicities
    chain = [fine]
    left = fine.multiplicities.copy()
    last = len(left) - 1
    while True:
        owner = np.repeat(np.arange(last if fine.periodic else last - 1), left[:-1] if fine.periodic else left[1:-1])
        owner += 0 if fine.periodic else 1
        copy = np.arange(len(owner)) - np.searchsorted(owner, owner)
        doomed = copy >= wanted[owner]
        if not doomed.any():
            return chain if len(chain) > 1 else [fine, coarse]
        count = np.cumsum(doomed)
        before = np.maximum.accumulate(np.where(doomed, 0, count))
        gone = doomed & ((count - before) % 2 == 1)
        left -= np.bincount(owner[gone], minlength=last + 1)
        if fine.periodic:
            left[-1] = left[0]
        chain.append(fine.with_multiplicities(left))


def _orders(row: Array, column: Array, n: int, periodic: bool) -> tuple[Array, Array]:
    """Orders of rows and columns that give the matrix a narrow band: columns by the middle of their supports."""
    if not periodic:
        first, last = np.full(n, n), np.zeros(n, dtype=int)
        np.minimum.at(first, column, row)
        np.maximum.at(last, column, row)
        return np.arange(n), np.lexsort((np.arange(n), first + last))
    angle = np.exp(2j * np.pi * row / n)
    middle = np.zeros(n, dtype=complex)
    np.add.at(middle, column, angle)
    around = np.argsort(np.round(np.angle(middle) % (2 * np.pi), 9), kind="stable")
    return folded(n), around[folded(n)]


def _inverse(order: Array) -> Array:
    inverse = np.empty_like(order)
    inverse[order] = np.arange(len(order))
    return inverse


def _part(c: Array, axis: int, part: slice) -> Array:
    return np.moveaxis(np.moveaxis(c, axis, 0)[part], 0, axis)
