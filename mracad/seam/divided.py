"""Minima over many joined surfaces, by subspaces: the insides of surfaces in turn with strips along what joins them.

What a joint does to a surface fades within the length ℓ of the filter, or within a few knot spans.  So one takes the
minimum over the control points that nothing joins, surface by surface, then over a strip along every joint and under
its conditions, and then what the strips leave to the insides, until nothing is left: a multiplicative Schwarz method,
whose error falls by e^(−√2 w / ℓ) or so in every sweep, w the width of the strips.  Every step lowers the objective.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from mracad.seam.constrained import LEAST, MET, MOST
from mracad.seam.factor import Definite
from mracad.seam.strips import Layout, coloured

Array = np.ndarray

LEFT = 1e-4
"""Share of what the first strips had to make good that may be left to them."""

SWEEPS = 20
"""Most sweeps; one or two serve."""

PENALTY = 1e7
"""Weight of conditions against a form whose diagonal is one; each pass divides what they lack by about as much."""


@dataclass(frozen=True, eq=False)
class _Colour:
    """Strips that have nothing in common.

    Attributes
    ----------
    points : ndarray (q,) of int
        One strip after another, in the points about strips.
    outside : csr_array (q, points about strips)
        What the form and the penalties of conditions make of them outside of their strips.
    rows : csr_array (conditions, q)
    ends : ndarray of int
        Where strips begin.
    factors : list of Definite
        Of each strip.
    """

    points: Array
    outside: Any
    rows: Any
    ends: Array
    factors: Sequence[Definite]

    def __call__(self, right: Array) -> Array:
        """The displacements of a right-hand side, both ``(q, k)``."""
        parts = np.split(right, self.ends[1:-1])
        return np.concatenate([factor(part) for factor, part in zip(self.factors, parts, strict=True)])


class Divided:
    """As :class:`mracad.seam.constrained.Constrained`, of many surfaces.

    Parameters
    ----------
    forms : iterable of scipy.sparse.csr_array (n, n)
        A, of each surface; what follows is of all of their points.
    diagonal : ndarray (points,)
        Its diagonal.
    soft : scipy.sparse matrix (points, points), optional
        More of A.
    rows : scipy.sparse matrix (conditions, points)
    free : ndarray of bool (points,)
    layout : Layout
    joined : mapping
        See :func:`mracad.seam.strips.joints`.
    strips : sequence of ndarray of int
        See :func:`mracad.seam.strips.strips`.
    """

    def __init__(
        self,
        forms: Iterable[Any],
        diagonal: Array,
        soft: Any,
        rows: Any,
        free: Array,
        layout: Layout,
        joined: dict[tuple[int, int], Array],
        strips: Sequence[Array],
    ) -> None:
        from scipy.sparse import csr_array, diags_array

        self.size = len(free)
        diagonal = diagonal if soft is None else diagonal + soft.diagonal()
        self.scale = free / np.sqrt(diagonal + LEAST * diagonal[free].max(initial=0.0) + 1e-300)
        rows = (rows @ diags_array(self.scale)).tocsr()
        length = np.sqrt(np.asarray(rows.multiply(rows).sum(axis=1)).ravel())
        self.there = np.flatnonzero(length > 0)
        self.length = length[self.there]
        self.rows = (diags_array(1.0 / self.length) @ rows[self.there]).tocsr()
        self.rows.eliminate_zeros()
        tied, near = np.zeros(self.size, bool), np.zeros(self.size, bool)
        for marked, sets in ((tied, joined.values()), (near, strips)):
            for points in sets:
                marked[points] = True
        self.tied, near_by = np.flatnonzero(tied), []
        self.insides: list[tuple[Array, Definite]] = []
        for form, begin, end in zip(forms, layout.ends[:-1], layout.ends[1:], strict=True):
            own = slice(begin, end)
            scale = self.scale[own]
            form = (form if soft is None else form + soft[own, own]).tocsr()
            row = np.repeat(np.arange(end - begin), np.diff(form.indptr))
            data = form.data * scale[row] * scale[form.indices] + LEAST * (row == form.indices)
            form = csr_array((data, form.indices, form.indptr), shape=form.shape)
            inside = np.flatnonzero(free[own] & ~tied[own])
            self.insides.append((begin + inside, Definite(_part(form, inside))))
            near_by.append(_widened(form[np.flatnonzero(near[own])], own, self.size))
        apart = None if soft is None else diags_array(self.scale) @ _apart(soft, layout) @ diags_array(self.scale)
        self._divide(np.flatnonzero(near), near_by, apart, strips)

    def _divide(self, near: Array, parts: list[Any], apart: Any, strips: Sequence[Array]) -> None:
        """Factors of strips, of the rows of the form in them."""
        from scipy.sparse import csr_array, vstack

        form = vstack(parts, format="csr")
        parts.clear()
        if apart is not None:
            form = (form + apart.tocsr()[near]).tocsr()
        reached = np.zeros(self.size, bool)
        reached[form.indices] = True
        self.about = np.flatnonzero(reached)
        place, row = np.empty(self.size, np.int32), np.empty(self.size, int)
        place[self.about], row[near] = np.arange(len(self.about)), np.arange(len(near))
        self.at = place[self.tied]
        self.inner = np.flatnonzero(~np.isin(self.about, self.tied))
        self.tied_form = form[row[self.tied]]
        form = csr_array((form.data, place[form.indices], form.indptr), shape=(len(near), len(self.about)))
        columns = self.rows.tocsc()
        self.conditions = columns[:, self.about].tocsr()
        conditions = [np.unique(columns[:, points].indices) for points in strips]
        self.colours = []
        for members in coloured(strips, conditions, self.size):
            points = np.concatenate([strips[i] for i in members])
            own = columns[:, points].tocsr()
            part = (form[row[points]] + PENALTY * (own.T @ self.conditions)).tocsr()
            ends = np.cumsum([0, *(len(strips[i]) for i in members)])
            factors = [
                Definite(_part(part[begin:end], place[strips[i]], slice(None)))
                for i, begin, end in zip(members, ends[:-1], ends[1:], strict=True)
            ]
            strip = np.full(len(self.about), -1, np.int32)
            strip[place[points]] = whose = np.repeat(np.arange(len(members), dtype=np.int32), np.diff(ends))
            outside = _taken(part, strip[part.indices] != np.repeat(whose, np.diff(part.indptr)))
            self.colours.append(_Colour(place[points], outside, own, ends, factors))

    def __call__(
        self, right: Array, start: Array | None = None, goal: Array | None = None, exactly: bool = True
    ) -> Array:
        """x − start, of which b is the right-hand side; see :class:`mracad.seam.constrained.Constrained`."""
        b, owed = self.scale[:, None] * right, np.zeros((len(self.there), right.shape[1]))
        if goal is not None:
            owed += goal[self.there] / self.length[:, None]
        if start is not None:
            owed -= self.rows @ self._scaled(start)
        found = np.zeros_like(b)
        if owed.any():
            found = self._met(owed, 0.0, b)
        found += self._within(b)
        if exactly and len(owed):
            found += self._met(owed - self.rows @ found, float(np.abs(found).max(initial=0.0)))
        return self.scale[:, None] * found

    def settled(self, x: Array) -> Array:
        """What is near to x, ``(n, k)``, with L x = 0."""
        if not len(self.there):
            return x
        scaled = self._scaled(x)
        return x + self.scale[:, None] * self._met(-(self.rows @ scaled), float(np.abs(scaled).max(initial=0.0)))

    def _scaled(self, x: Array) -> Array:
        return x / np.where(self.scale > 0, self.scale, np.inf)[:, None]

    def _within(self, right: Array) -> Array:
        """The minimum under L x = 0, but for what one pass leaves of it."""
        found = self._inside(right)
        left = np.zeros((len(self.about), right.shape[1]))
        left[self.at] = right[self.tied] - self.tied_form @ found
        first = np.linalg.norm(left)
        for sweep in range(SWEEPS):
            step = np.zeros_like(left)
            for colour in self.colours[:: 1 - 2 * (sweep % 2)]:
                moved = colour(left[colour.points])
                left[colour.points] = 0.0
                left -= colour.outside.T @ moved
                step[colour.points] += moved
            found[self.about] += step
            rest = np.zeros_like(found)
            rest[self.about[self.inner]] = left[self.inner]
            rest = self._inside(rest)
            found += rest
            left[self.inner] = 0.0
            left[self.at] -= self.tied_form @ rest
            if np.linalg.norm(left) <= LEFT * first:
                break
        return found

    def _inside(self, right: Array) -> Array:
        """The minimum over the points that nothing joins."""
        found = np.zeros_like(right)
        for points, factor in self.insides:
            found[points] = factor(right[points])
        return found

    def _met(self, owed: Array, size: float, right: Array | None = None) -> Array:
        """What meets conditions beside a displacement of a size; what the form makes of it is taken from ``right``."""
        found = np.zeros((self.size, owed.shape[1]))
        for _ in range(MOST):
            for colour in self.colours:
                pull = PENALTY * (colour.rows.T @ owed)
                moved = colour(pull)
                met = colour.rows @ moved
                owed = owed - met
                found[self.about[colour.points]] += moved
                if right is not None:
                    right[self.about[colour.points]] -= pull
                    right[self.about] -= colour.outside.T @ moved - PENALTY * (self.conditions.T @ met)
            if np.abs(owed).max(initial=0.0) <= MET * max(size, np.abs(found).max(initial=0.0)):
                break
        return found


def _part(form: Any, columns: Array, rows: Array | slice | None = None) -> Any:
    """Some rows and columns of a matrix, the same by default."""
    from scipy.sparse import csr_array

    form = form[columns if rows is None else rows]
    place = np.full(form.shape[1], -1, np.int32)
    place[columns] = np.arange(len(columns))
    form = csr_array((form.data, place[form.indices], form.indptr), shape=(form.shape[0], len(columns)))
    return _taken(form, form.indices >= 0)


def _taken(form: Any, which: Array) -> Any:
    """Some of the entries of a matrix."""
    from scipy.sparse import csr_array

    ends = np.append(0, np.cumsum(which))[form.indptr].astype(np.int32)
    return csr_array((form.data[which], form.indices[which], ends), shape=form.shape)


def _widened(form: Any, own: slice, size: int) -> Any:
    """Rows over the points of one surface as rows over those of all."""
    from scipy.sparse import csr_array

    return csr_array((form.data, form.indices + np.int32(own.start), form.indptr), shape=(form.shape[0], size))


def _apart(form: Any, layout: Layout) -> Any:
    """What of a form joins points of different surfaces."""
    from scipy.sparse import csr_array

    form, owner = form.tocoo(), layout.owner
    apart = owner[form.row] != owner[form.col]
    return csr_array((form.data[apart], (form.row[apart], form.col[apart])), shape=form.shape)
