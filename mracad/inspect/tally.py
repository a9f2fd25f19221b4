"""Curvature figures of surfaces at the points of faces, summed up place by place.

Few points are processed by array operations, many by compiled code, with the same bits: both add up point by point.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from threading import local

import numpy as np

from mracad.bspline.jets import ORDERS, Sites
from mracad.bspline.knots import KnotVector
from mracad.bspline.surface import Net
from mracad.compiled import pointer
from mracad.inspect.curvature import BENT, FORMS, Forms, dot, figures, shapes
from mracad.inspect.sweep import SCRATCH, SUMS, SWEEP, TOPS, told
from mracad.model.cells import Quadrature

Array = np.ndarray


@dataclass(frozen=True, eq=False)
class Tally:
    """Figures of places.

    Attributes
    ----------
    sums : ndarray (7, places)
        Area; area of the points that count; over these the integrals of bending κ₁² + κ₂², of variation |∇H|², and of
        both without the base; and how many more of them turn by more than :data:`mracad.inspect.sweep.NOISY` than by
        less.
    tops : ndarray (3, places)
        Largest curvature of the points that count, the same less rounding, and distance between normals before and
        after, as a chord.
    """

    sums: Array
    tops: Array


@dataclass(frozen=True, eq=False)
class Marks:
    """What is known of points before an edit.

    Attributes
    ----------
    counts : ndarray of uint8 (q,)
        1 where curvature counts.
    rounding : ndarray of float32 (q,)
        Curvature that rounding can cause, 1/mm.
    base : ndarray (5, q)
        :meth:`Sight.bent` of the base.
    normals : ndarray of float32 (3, q)
    strips : (ndarray of int64 (nu,), ndarray of int64 (nv,))
        Numbers whose sum is the place of each pair of parameters.
    places : int
        Number of places.
    """

    counts: Array
    rounding: Array
    base: Array
    normals: Array
    strips: tuple[Array, Array]
    places: int

    @cached_property
    def pointers(self) -> tuple[int, ...]:
        """Where the arrays are in memory."""
        return tuple(map(pointer, (self.counts, self.rounding, self.base, self.normals, *self.strips)))


@dataclass(frozen=True, eq=False)
class Sight:
    """The points of a rule on surfaces over two knot vectors.

    Attributes
    ----------
    knots : (KnotVector, KnotVector)
    sites : Sites
    runs : ndarray of int64 (k, 3)
        Row, first column and length of points that lie side by side in a row.
    weights : (ndarray (nu,), ndarray (nv,))
        Those of the rule along u and v.
    centre : ndarray (3,)
        Origin of the points.
    """

    knots: tuple[KnotVector, KnotVector]
    sites: Sites
    runs: Array
    weights: tuple[Array, Array]
    centre: Array

    @classmethod
    def of(cls, net: Net, rule: Quadrature) -> Sight:
        """Those on a net."""
        sites = Sites.of(net.u, net.v, rule.u, rule.v, rule.mask)
        edges = np.diff(sites.mask, axis=1, prepend=False, append=False)
        row, column = np.nonzero(edges)
        runs = np.stack([row[::2], column[::2], column[1::2] - column[::2]], axis=1)
        weights = np.ascontiguousarray(rule.wu.ravel()), np.ascontiguousarray(rule.wv.ravel())
        return cls((net.u, net.v), sites, np.ascontiguousarray(runs), weights, np.asarray(net.poles.mean(axis=(0, 1))))

    def over(self, net: Net, rule: Quadrature) -> Sight:
        """The same points of the rule on another net, with the same origin if its knots are the same."""
        return self if (net.u, net.v) == self.knots else Sight.of(net, rule)

    @cached_property
    def points(self) -> int:
        """Number of points."""
        return int(self.runs[:, 2].sum())

    def pairs(self, along_u: Array, along_v: Array, how: np.ufunc) -> Array:
        """A function of numbers along u and along v at the points, ``(q,)``."""
        return np.asarray(how(along_u, along_v[:, None])[self.sites.mask])

    def along(self, net: Net) -> Array:
        """Derivatives along u of the curves of control points of a surface over the same knots."""
        return self.sites.along(net, self.centre)

    def forms(self, along: Array) -> Forms:
        """The forms of a surface, from its derivatives along u."""
        return Forms(self._figures(along, FORMS))

    def bent(self, net: Net) -> Array:
        """Shape operator and gradient of the mean curvature of a surface over the same knots, ``(5, q)``."""
        return self._figures(self.along(net), BENT)

    def _figures(self, along: Array, rows: slice) -> Array:
        if not SWEEP.pays(self.points):
            return shapes(self.sites.blocks(along, along.shape[1] > 3), rows)
        found = np.empty((rows.stop - rows.start, self.points))
        self._sweep(along, None, (found, found), (rows, found))
        return found

    def tally(self, along: Array, marks: Marks) -> Tally:
        """The figures of the places of a surface, from its derivatives along u."""
        every = np.zeros((SUMS + TOPS, marks.places))
        found = Tally(every[:SUMS], every[SUMS:])
        if SWEEP.pays(self.points):
            self._sweep(along, marks, (found.sums, found.tops), (slice(0, 0), every))
            return found
        weights, places = self.pairs(*self.weights, np.multiply), self.pairs(*marks.strips, np.add)
        end = 0
        for block in self.sites.blocks(along, along.shape[1] > 3):
            begin, end = end, end + block.shape[2]
            part = slice(begin, end)
            seen = weights[part], 1.0 * marks.counts[part], marks.rounding[part]
            rows = figures(block[1], block[2], block[3:6], block[6:])
            added = told(seen, marks.base[:, part], marks.normals[:, part], rows)
            for total, each in zip(found.sums, added[:SUMS], strict=True):
                np.add.at(total, places[part], each)
            for top, each in zip(found.tops, added[SUMS:], strict=True):
                np.maximum.at(top, places[part], each.astype(float))
        return found

    def added(self, net: Net, marks: Marks) -> tuple[Array, float, float]:
        """What a net of offsets adds to derivatives along u, and how far points of another surface move by it: the
        largest motion along normals, and in any direction."""
        along, most = self.sites.along(net, np.zeros(3)), np.zeros(2)
        if SWEEP.pays(self.points // len(ORDERS)):
            self._sweep(along[:1], marks, (most, most), (slice(0, 0), most))
        else:
            end = 0
            for (part,) in self.sites.blocks(along[:1], net.weights is not None):
                begin, end = end, end + part.shape[1]
                normal, square = np.abs(dot(part, marks.normals[:, begin:end])), dot(part, part)
                most = np.maximum(most, [normal.max(initial=0.0), square.max(initial=0.0)])
        along[:, 3:] = 0.0  # weights stay
        return along, float(most[0]), float(np.sqrt(most[1]))

    def _sweep(
        self, along: Array, marks: Marks | None, added: tuple[Array, Array], stored: tuple[slice, Array]
    ) -> None:
        (sums, tops), (rows, found) = added, stored
        SWEEP(
            pointer(along), *along.shape, *self._pointers, len(self.runs),
            marks is not None, self.points, *(marks.pointers if marks else (0,) * 6),
            sums.shape[-1], pointer(sums), pointer(tops), rows.start, rows.stop, pointer(found), _OWN.pointer,
        )  # fmt: skip

    @cached_property
    def _pointers(self) -> tuple[int, ...]:
        return (*self._taps[0].shape, *map(pointer, (*self._taps, *self.weights, self.runs)))

    @cached_property
    def _taps(self) -> tuple[Array, Array]:
        """Control points along v of each row, a multiple of four, and their functions."""
        columns, in_v = self.sites.columns.astype(np.int32), self.sites.in_v
        spare = -columns.shape[1] % 4
        return np.pad(columns, [(0, 0), (0, spare)]), np.pad(in_v, [(0, 0), (0, 0), (0, spare)])


class _Own(local):
    """The scratch memory of a thread."""

    def __init__(self) -> None:
        self.memory = np.zeros(SCRATCH)
        self.pointer = pointer(self.memory)


_OWN = _Own()
