"""Strips along the joints of surfaces, by which displacements are made to meet the conditions of the joints.

The effect of a joint on a surface fades within the length ℓ of the filter, or within a few knot spans, so a strip along
it holds all of the least displacement that meets its conditions.  Strips that share points or conditions take turns.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np

from mracad.seam.constrained import LEAST, MOST, lengths, scaled, taken
from mracad.seam.factor import Definite
from mracad.seam.strips import Division, Layout, coloured

Array = np.ndarray

MET = 1e-13
"""Share of the motion to which conditions are met: less is rounding, of which thousands of conditions leave more."""

PENALTY = 1e7
"""Weight of conditions against a form whose diagonal is one; each pass divides their error by about as much."""


@dataclass(frozen=True, eq=False)
class _Strip:
    """One strip.

    Attributes
    ----------
    points : ndarray (q,) of int
    outside : csr_array (q, all points)
        Rows of the form and of the penalties of conditions that couple its points to points outside of it.
    rows : csr_array (q, conditions)
        Conditions on its points.
    factor : Definite
    """

    points: Array
    outside: Any
    rows: Any
    factor: Definite


@dataclass(frozen=True, eq=False)
class _Colour:
    """Strips without common points or conditions, solved at once.

    Attributes
    ----------
    points : ndarray (q,) of int
        Points of one strip after another, as positions among the points about strips.
    outside : csc_array (points about strips, q)
        Columns of the form and of the penalties of conditions that couple them to points outside of their strips.
    rows : csc_array (conditions, q)
    ends : ndarray of int
        Positions at which strips begin.
    factors : list of Definite
        The factor of each strip.
    """

    points: Array
    outside: Any
    rows: Any
    ends: Array
    factors: Sequence[Definite]

    @classmethod
    def of(cls, strips: Sequence[_Strip], place: Array, about: int) -> _Colour:
        """Combine strips without common points; ``place`` maps points to their numbers among those about strips."""
        from scipy.sparse import csr_array, vstack

        outside = vstack([strip.outside for strip in strips], format="csr")
        outside = csr_array((outside.data, place[outside.indices], outside.indptr), shape=(outside.shape[0], about))
        return cls(
            place[np.concatenate([strip.points for strip in strips])],
            outside.T,
            vstack([strip.rows for strip in strips], format="csr").T,
            np.cumsum([0, *(len(strip.points) for strip in strips)]),
            [strip.factor for strip in strips],
        )

    def __call__(self, right: Array) -> Array:
        """The displacements of a right-hand side, both ``(q, k)``."""
        parts = np.split(right, self.ends[1:-1])
        return np.concatenate([factor(part) for factor, part in zip(self.factors, parts, strict=True)])


class Along:
    """Strips along joints of surfaces, with the conditions on their points.

    Parameters
    ----------
    form : callable
        A of the surface of a number, ``scipy.sparse.csr_array`` (n, n); everything else is over the points of all
        surfaces.
    diagonal : ndarray (points,)
        The diagonal of A.
    soft : scipy.sparse matrix (points, points), optional
        A further term of A.
    rows : scipy.sparse matrix (conditions, points)
    free : ndarray of bool (points,)
    division : Division
    """

    def __init__(
        self, form: Callable[[int], Any], diagonal: Array, soft: Any, rows: Any, free: Array, division: Division
    ) -> None:
        from scipy.sparse import diags_array

        layout, strips = division.layout, division.strips
        self.size = len(free)
        diagonal = diagonal if soft is None else diagonal + soft.diagonal()
        self.scale = free / np.sqrt(diagonal + LEAST * diagonal[free].max(initial=0.0) + 1e-300)
        rows = (rows @ diags_array(self.scale)).tocsr()
        length = lengths(rows)
        self.there = np.flatnonzero(length > 0)
        self.length = length[self.there]
        self.rows = (diags_array(1.0 / self.length) @ rows[self.there]).tocsr()
        self.rows.eliminate_zeros()
        tied, near = np.zeros(self.size, bool), np.zeros(self.size, bool)
        for marked, sets in ((tied, division.joined.values()), (near, strips)):
            for points in sets:
                marked[points] = True
        apart = None if soft is None else diags_array(self.scale) @ _apart(soft, layout) @ diags_array(self.scale)
        self.tied = np.flatnonzero(tied)
        making = _Strips(strips, layout, self.rows, self.tied)
        for surface, (begin, end) in enumerate(pairwise(layout.ends.tolist())):
            own = slice(begin, end)
            if not (free[own].any() and self._asked(making, surface)):
                continue
            part = form(surface)
            part = scaled((part if soft is None else part + soft[own, own]).tocsr(), self.scale[own])
            bound, other = (np.flatnonzero(each) for each in (tied[own], near[own] & ~tied[own]))
            firm = _widened(part[bound], own, self.size)
            firm = firm if apart is None else (firm + apart[begin + bound]).tocsr()
            making.add(surface, begin + other, _widened(part[other], own, self.size), begin + bound, firm)
            self._take(begin, part, np.flatnonzero(free[own] & ~tied[own]), firm)
        self.about, self.colours = making.done()
        self.conditions = self.rows.tocsc()[:, self.about].tocsr()

    def _asked(self, making: _Strips, surface: int) -> bool:
        """Whether the form of a surface is needed."""
        return bool(making.needed[surface] >= 0)

    def _take(self, begin: int, form: Any, inside: Array, firm: Any) -> None:
        """Take what else is needed of the form of a surface whose points begin somewhere: on its points without joints,
        and its rows, over all points, for those with joints."""

    def settled(self, x: Array, goal: Array | None = None) -> Array:
        """A point near x, ``(n, k)``, with L x = r; r is zero by default."""
        if not len(self.there):
            return x
        scaled = self._scaled(x)
        owed = self._wanted(goal, x.shape[1]) - self.rows @ scaled
        return np.asarray(x + self.scale[:, None] * self.met(owed, float(np.abs(scaled).max(initial=0.0))))

    def _wanted(self, goal: Array | None, width: int) -> Array:
        """r for scaled conditions."""
        return np.zeros((len(self.there), width)) if goal is None else goal[self.there] / self.length[:, None]

    def _scaled(self, x: Array) -> Array:
        return x / np.where(self.scale > 0, self.scale, np.inf)[:, None]

    def met(self, owed: Array, size: float, right: Array | None = None) -> Array:
        """The correction of a displacement of some ``size`` that still misses conditions by ``owed``; the form times it
        is subtracted from ``right``."""
        found = np.zeros((self.size, owed.shape[1]))
        for _ in range(MOST):
            if np.abs(owed).max(initial=0.0) <= MET * max(size, np.abs(found).max(initial=0.0)):
                break
            for colour in self.colours:
                pull = PENALTY * (colour.rows.T @ owed)
                moved = colour(pull)
                met = colour.rows @ moved
                owed = owed - met
                found[self.about[colour.points]] += moved
                if right is not None:
                    right[self.about[colour.points]] -= pull
                    right[self.about] -= colour.outside @ moved - PENALTY * (self.conditions.T @ met)
        return found


class _Strips:
    """Builds each strip as soon as the rows of the form for all of its points are known, because they take most memory.

    Parameters
    ----------
    strips : sequence of ndarray of int
    layout : Layout
    rows : scipy.sparse.csr_array (conditions, points)
    tied : ndarray of int
        The points that they join.
    """

    def __init__(self, strips: Sequence[Array], layout: Layout, rows: Any, tied: Array) -> None:
        self.strips, self.owner, self.tied, self.pull = strips, layout.owner, tied, rows.T.tocsr()
        self.rows = rows.tocsc()[:, tied].tocsr()
        surfaces = [np.unique(self.owner[points]) for points in strips]
        self.last = np.array([each[-1] for each in surfaces], int)
        self.needed = np.full(len(layout.reach), -1)
        for last, each in zip(self.last, surfaces, strict=True):
            self.needed[each] = np.maximum(self.needed[each], last)
        self.forms: dict[int, Any] = {}
        self.row, self.place = np.zeros(len(self.owner), np.int32), np.full(len(self.owner), -1, np.int32)
        self.reached = np.zeros(len(self.owner), bool)
        self.made: dict[int, _Strip] = {}

    def add(self, surface: int, points: Array, form: Any, tied: Array, tied_form: Any) -> None:
        """Add the form on the strip points of the next surface, and separately on those that joints tie."""
        from scipy.sparse import csr_array, vstack

        pull = self.pull[tied]
        own, there = np.unique(pull.indices, return_inverse=True)
        rows = self.rows[own]
        points_of, place = np.unique(rows.indices, return_inverse=True)  # few columns: products take memory for each
        pull = csr_array((pull.data, there, pull.indptr), shape=(len(tied), len(own)))
        rows = csr_array((rows.data, place, rows.indptr), shape=(len(own), len(points_of)))
        penalty = PENALTY * (pull @ rows)
        penalty.sort_indices()
        joined = self.tied[points_of][penalty.indices]
        penalty = csr_array((penalty.data, joined, penalty.indptr), shape=tied_form.shape)
        self.forms[surface] = vstack([form, tied_form + penalty], format="csr")
        self.reached[self.forms[surface].indices] = True
        self.row[np.concatenate([points, tied])] = np.arange(len(points) + len(tied))
        for i in np.flatnonzero(self.last == surface).tolist():
            self.made[i] = self._strip(self.strips[i])
        for i in np.flatnonzero(self.needed[: surface + 1] == surface).tolist():
            del self.forms[i]

    def _strip(self, points: Array) -> _Strip:
        from scipy.sparse import vstack

        owner = self.owner[points]
        order = np.argsort(owner, kind="stable")
        ends = np.searchsorted(owner[order], np.arange(owner.max() + 2))
        every = [
            self.forms[i][self.row[points[order[begin:end]]]]
            for i, (begin, end) in enumerate(pairwise(ends))
            if end > begin
        ]
        form = vstack(every, format="csr")[np.argsort(order)]
        self.place[points] = np.arange(len(points))
        column = self.place[form.indices]
        self.place[points] = -1
        own = taken(form, column >= 0, column, len(points))
        return _Strip(points, taken(form, column < 0), self.pull[points], Definite(own))

    def done(self) -> tuple[Array, list[_Colour]]:
        """The points about strips, and the strips by colour."""
        about = np.flatnonzero(self.reached)
        self.place[about] = np.arange(len(about))
        conditions = [np.unique(self.made[i].rows.indices) for i in range(len(self.strips))]
        colours = coloured(self.strips, conditions, len(self.owner))
        return about, [_Colour.of([self.made.pop(i) for i in those], self.place, len(about)) for those in colours]


def _widened(form: Any, own: slice, size: int) -> Any:
    """Rows over the points of one surface, widened to those of all."""
    from scipy.sparse import csr_array

    return csr_array((form.data, form.indices + np.int32(own.start), form.indptr), shape=(form.shape[0], size))


def _apart(form: Any, layout: Layout) -> Any:
    """The part of a form that joins points of different surfaces."""
    from scipy.sparse import csr_array

    form, owner = form.tocoo(), layout.owner
    apart = owner[form.row] != owner[form.col]
    return csr_array((form.data[apart], (form.row[apart], form.col[apart])), shape=form.shape)
