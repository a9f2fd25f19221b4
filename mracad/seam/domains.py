"""Problems of more surfaces than are solved at once: overlapping domains, so that memory does not grow with the number.

What lies w away from a control point counts for its displacement, by a filter of length ℓ and gain 1 / (1 + xⁿ), only
like e^(−w sin(π / 4n) / ℓ), the slowest of the waves ω⁴ⁿ = −ℓ⁻⁴ⁿ.  So surfaces are divided into domains, and each is
solved together with the surfaces around it, whose displacements are then left to their own domains.  Conditions within
a domain are met; those between domains are missed by what was left out, and are met by the least correction in strips
along these joints.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from mracad.seam.along import Along
from mracad.seam.constrained import missed, part, taken
from mracad.seam.guided import Guides
from mracad.seam.solve import Effort, Problem, Soft, Space
from mracad.seam.strips import WIDTH, Division, Layout, about, joints, strips

Array = np.ndarray

LEFT_OUT = 3e-3
"""Share with which displacements of the surfaces beyond those around a domain would still count."""

MOST = 3.0
"""Control points of all domains with the surfaces around them, over all: above this they are solved at once."""


def problem(
    spaces: Mapping[int, Space],
    rows: Any = None,
    goal: Array | None = None,
    soft: Soft | None = None,
    effort: Effort | None = None,
    guides: Guides | None = None,
) -> Problem:
    """The problem of surfaces; domain by domain if they are more than two domains.  Edges that slide need it whole."""
    effort = effort or Effort()
    large = sum(int(space.free.sum()) for space in spaces.values()) > 2 * effort.domain
    return (Partitioned if large and guides is None else Problem)(spaces, rows, goal, soft, effort, guides)


@dataclass(frozen=True, eq=False)
class Domain:
    """Some surfaces of a problem, and those around them.

    Attributes
    ----------
    points : ndarray (n,) of int
        Their control points.
    own : ndarray of bool (n,)
        Those of the domain itself.
    problem : Problem
        Over all of them.
    """

    points: Array
    own: Array
    problem: Problem

    def of(self, values: Array | None) -> Any:
        """Values of its points."""
        return None if values is None else values[self.points]


class Partitioned(Problem):
    """A problem that is solved domain by domain; see :class:`mracad.seam.solve.Problem`."""

    def filtered(self, stiffness: float, free: Array | None = None, of: Array | None = None, order: int = 2) -> Array:
        """See :meth:`Problem.filtered`."""

        def solve(at: Domain) -> Array:
            return at.problem.filtered(stiffness, at.of(free), at.of(of), order)

        found = self._solved(solve, stiffness, free, order, self.goal)
        return super().filtered(stiffness, free, of, order) if found is None else found

    def faired(self, stiffness: float, free: Array | None = None, of: Array | None = None) -> Array:
        """See :meth:`Problem.faired`."""

        def solve(at: Domain) -> Array:
            return at.problem.faired(stiffness, at.of(free), at.of(of))

        found = self._solved(solve, stiffness, free)
        return super().faired(stiffness, free, of) if found is None else found

    def _nearest(self, wanted: Array, stiffness: float, beyond: bool) -> Array:
        def solve(at: Domain) -> Array:
            return at.problem.nearest(at.of(wanted), stiffness, beyond)

        found = self._solved(solve, stiffness, goal=self.goal)
        return super()._nearest(wanted, stiffness, beyond) if found is None else found

    def settled(self, delta: Array, stiffness: float = 0.0, free: Array | None = None) -> Array:
        """See :meth:`Problem.settled`."""

        def solve(at: Domain) -> Array:
            return at.problem.settled(at.of(delta), stiffness, at.of(free))

        found = self._solved(solve, stiffness, free, goal=self.goal)
        return super().settled(delta, stiffness, free) if found is None else found

    def _solved(
        self,
        solve: Callable[[Domain], Array],
        stiffness: float,
        free: Array | None = None,
        order: int = 1,
        goal: Array | None = None,
    ) -> Array | None:
        """The displacements of all domains, which meet the conditions between them; None if domains save nothing."""
        layout = self._layout(stiffness)
        around = self._around(layout, order)
        if around is None:
            return None
        found: Array | None = None
        for number, surfaces in enumerate(around):
            at = self._domain(layout, number, surfaces)
            x = solve(at)
            found = np.zeros((len(self.free), x.shape[1])) if found is None else found
            found[at.points[at.own]] = x[at.own]
        assert found is not None
        return self._joined_up(found, layout, stiffness, free, goal)

    @cached_property
    def _number(self) -> Array:
        """The domain of each surface: halves of halves of them, along the direction in which they extend most."""
        sizes = np.array([space.free.size for space in self.spaces.values()])
        places = np.array([space.net.poles.mean(axis=(0, 1)) for space in self.spaces.values()])
        number, waiting, count = np.zeros(len(sizes), int), [np.arange(len(sizes))], 0
        while waiting:
            those = waiting.pop()
            if len(those) < 2 or sizes[those].sum() <= self.effort.domain:
                number[those], count = count, count + 1
                continue
            axis = int(np.argmax(np.ptp(places[those], axis=0)))
            order = those[np.argsort(places[those, axis], kind="stable")]
            half = np.searchsorted(np.cumsum(sizes[order]), sizes[order].sum() / 2) + 1
            half = min(max(int(half), 1), len(order) - 1)
            waiting += [order[half:], order[:half]]
        return number

    @cached_property
    def _joints(self) -> dict[tuple[int, int], Array]:
        """The points that conditions or contacts join, by the pair of surfaces."""
        return joints(self._layout(0.0), self.rows, self.soft, np.ones(len(self.free), bool))

    def _around(self, layout: Layout, order: int) -> list[Array] | None:
        """The surfaces of each domain and those around it, all sorted; None if they are too many in all."""
        reach = -np.log(LEFT_OUT) / np.sin(np.pi / (4 * order)) / WIDTH * layout.reach
        sizes, found = np.diff(layout.ends), []
        for number in range(self._number.max() + 1):
            own = self._number == number
            outer = [points for (a, b), points in self._joints.items() if own[a] != own[b]]
            found.append(self._surrounding(layout, own, np.unique(np.concatenate(outer)) if outer else None, reach))
        total = sum(sizes[each].sum() for each in found)
        return found if total <= MOST * sizes.sum() else None

    def _surrounding(self, layout: Layout, own: Array, outer: Array | None, reach: Array) -> Array:
        """Surfaces of a domain, and those joined to them, directly or through others, that come near to its joints."""
        if outer is None:
            return np.flatnonzero(own)
        near = own | np.logical_or.reduceat(about(layout, outer, reach), layout.ends[:-1])
        return _connected(own, near, self._joints)

    def _domain(self, layout: Layout, number: int, surfaces: Array) -> Domain:
        """The surfaces of a domain and those around them, with the conditions among them."""
        ends, spaces = layout.ends, list(self.spaces.items())
        points = np.concatenate([np.arange(ends[i], ends[i + 1]) for i in surfaces])
        own = np.repeat(self._number[surfaces] == number, np.diff(ends)[surfaces])
        place = np.full(len(self.free), -1, np.int32)
        place[points] = np.arange(len(points))
        within = np.flatnonzero(~_any(self.rows, place < 0))
        rows = self.rows[within]
        rows = taken(rows, np.ones(rows.nnz, bool), place[rows.indices], len(points))
        form, between = (None if each is None else part(each, points) for each in (self.soft, self.between))
        pull = None if self.pull is None else self.pull[points]
        goal = None if self.goal is None else self.goal[within]
        soft = None if form is None else Soft(form, pull, between)
        return Domain(points, own, Problem(dict(spaces[i] for i in surfaces), rows, goal, soft, self.effort))

    def _joined_up(
        self, found: Array, layout: Layout, stiffness: float, free: Array | None, goal: Array | None
    ) -> Array:
        """Displacements of domains, corrected to meet the conditions between them."""
        soft, free = (self.soft, self.free) if free is None or free is self.free else (self.between, free)
        lacking = np.zeros(len(free), bool)
        lacking[self.rows[missed(self.rows, found, goal)].indices] = True
        joined = joints(layout, self.rows, soft, free)
        apart = [(a, b) for (a, b), own in joined.items() if self._number[a] != self._number[b] and lacking[own].any()]
        along = strips(layout, joined, free, those=apart)
        if not along:
            return found
        near = np.zeros(len(free), bool)
        near[np.concatenate(along)] = True
        touched = np.flatnonzero(_any(self.rows, near))
        rows = self.rows[touched]
        division = Division(layout, joints(layout, rows, soft, free), along)
        strips_along = Along(*self._form(stiffness), soft, rows, free, division)
        return strips_along.settled(found, None if goal is None else goal[touched])


def _any(rows: Any, marked: Array) -> Array:
    """Which rows of a ``csr_array`` have entries in marked columns."""
    line = np.repeat(np.arange(rows.shape[0]), np.diff(rows.indptr))
    return np.bincount(line[marked[rows.indices]], minlength=rows.shape[0]) > 0


def _connected(own: Array, near: Array, pairs: Iterable[tuple[int, int]]) -> Array:
    """Near surfaces that are joined to own ones, directly or through other near ones, and the own ones, sorted."""
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    both = np.array([pair for pair in pairs if near[list(pair)].all()]).reshape(-1, 2).T
    label = connected_components(coo_array((np.ones(both.shape[1]), both), shape=(len(own),) * 2), directed=False)[1]
    return np.flatnonzero(near & np.isin(label, label[own]))
