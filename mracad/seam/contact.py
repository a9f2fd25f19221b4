"""Contacts along trim curves: seams whose two sides have no common spline space, and rims beside faces that stay.

They cannot be kept exactly without freezing everything that meets the curve.  Instead, a displacement δ has conditions
at Gauss points of every piece between knot lines of either side,

    G0   δ_b = δ_a,      G1   D_c δ_b = D_c δ_a,      G2   D_c² δ_b + D_z δ_b = D_c² δ_a

(δ_b = 0 at a rim, and with G1 also D_t δ_a = 0, t along it: even a tiny error tilts a surface where its knots are
close; directions as in :mod:`mracad.seam.trimmed`), weighted with the inverse square of the allowed error: the net
meets them where it can, and misses them by a little elsewhere.  Two noisy sides are already apart by their noise:
conditions pull them together, more gently where they were further apart.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from mracad.bspline.functions import functions
from mracad.bspline.surface import Net
from mracad.compiled import pointer
from mracad.seam.conditions import laid_out
from mracad.seam.room import ROOM
from mracad.seam.trace import Trace, derived, directions, pieces

Array = np.ndarray

MORE = 2
"""Conditions in each piece of a contact between knot lines, beyond the highest degree of its sides."""


@dataclass(frozen=True, eq=False)
class Contact:
    """A trace of a surface that moves, and that of the surface that moves with it; None at a rim.

    Attributes
    ----------
    a : Trace
    b : Trace or None
    order : {0, 1, 2}
        Derivatives across the trace that are kept.
    close, fit : bool
        Whether the gap and the angle of the input are mended.
    since : {0, 1, 2}
        The lowest order of the conditions.
    edge : int
        The edge to which it belongs.
    """

    a: Trace
    b: Trace | None
    order: int
    close: bool = False
    fit: bool = False
    since: int = 0
    edge: int = -1

    @property
    def surfaces(self) -> set[int]:
        """The one or two surfaces that move."""
        return {trace.surface for trace in (self.a, self.b) if trace is not None}


@dataclass(frozen=True, eq=False)
class Rows:
    """Conditions of contacts on the control points of nets laid out one after another.

    Attributes
    ----------
    matrix : scipy.sparse.csr_array (conditions, points)
        C.
    order : ndarray (conditions,) of int
        0 position (mm), 1 slope, 2 curvature (1/mm).
    width : ndarray (conditions,)
        Length of the contact that each condition represents, mm.
    owner : ndarray (conditions,) of int
        Index of the contact of each condition.
    """

    matrix: Any
    order: Array
    width: Array
    owner: Array

    def limits(self, opened: Array, tolerances: Array) -> Array:
        """Allowed errors of contacts, ``(conditions,)``.

        Parameters
        ----------
        opened : ndarray (conditions, 3)
            Errors before the edit: positions are limited place by place, slopes and curvatures by the worst of a
            contact.
        tolerances : ndarray (contacts, 3)
            Allowed growth, for each order.
        """
        old, worst = np.linalg.norm(opened, axis=1), np.zeros(3 * (int(self.owner.max(initial=-1)) + 1))
        place = 3 * self.owner + self.order
        np.maximum.at(worst, place, old)
        most = np.where(self.order == 0, old, worst[place])
        return np.asarray(most + tolerances.ravel()[place])

    def form(self, limits: Array) -> Any:
        """``Cᵀ W C``, ``(points, points)``, W the widths over the squared limits ``(conditions,)``."""
        return _squared(self.matrix, np.sqrt(self.width) / limits)

    def pull(self, wanted: Array, limits: Array) -> Array:
        """``Cᵀ W wanted``, ``(points, 3)``: the pull of the contacts towards values ``(conditions, 3)``."""
        return np.asarray(self.matrix.T @ ((self.width / limits**2)[:, None] * wanted))

    def room(self, delta: Array, opened: Array, limits: Array) -> Array:
        """The share of a displacement ``(points, 3)`` that each contact allows, 0 to 1."""
        room = np.ones(int(self.owner.max(initial=-1)) + 1)
        if ROOM.pays(self.matrix.nnz):
            delta, opened, limits = (np.ascontiguousarray(each) for each in (delta, opened, limits))
            given = map(pointer, (delta, opened, limits, self.owner, room))
            ROOM(*map(pointer, self._entries), len(limits), *given)
            return room
        old, new = (np.linalg.norm(each, axis=1) for each in (opened, opened + self.matrix @ delta))
        share = np.where(new > limits, (limits - old) / np.maximum(new - old, 1e-300), 1.0)
        np.minimum.at(room, self.owner, share)
        return room

    @cached_property
    def _entries(self) -> tuple[Array, Array, Array]:
        """The matrix as compiled code wants it."""
        begins, columns = (np.ascontiguousarray(each, np.int32) for each in (self.matrix.indptr, self.matrix.indices))
        return begins, columns, np.ascontiguousarray(self.matrix.data)


def rows(nets: Mapping[int, Net], contacts: Sequence[Contact]) -> Rows:
    """The conditions of contacts on displacements of surfaces.

    Parameters
    ----------
    nets : mapping of int to Net
        The surfaces undisplaced, in the spaces of their displacements, by index; their control points are laid out one
        after another.
    contacts : sequence of Contact
    """
    from scipy.sparse import csr_array

    first, total = laid_out(nets)
    parts = [_part(nets, first, contact) for contact in contacts]
    places = np.array([len(part.width) * len(part.orders) for part in parts], int)
    ends = np.cumsum(np.append(0, np.repeat([part.index.shape[1] for part in parts], places)), dtype=np.int32)
    index = _joined([np.broadcast_to(part.index, part.values.shape).ravel() for part in parts], np.int32)
    values = _joined([part.values.ravel() for part in parts], float)
    order = _joined([np.repeat(part.orders, len(part.width)) for part in parts], int)
    width = _joined([np.tile(part.width, len(part.orders)) for part in parts], float)
    matrix = csr_array((values, index, ends), shape=(len(order), total))
    return Rows(matrix, order, width, np.repeat(np.arange(len(parts)), places))


def _joined(parts: Sequence[Array], kind: type) -> Array:
    return np.concatenate([*parts, np.empty(0, kind)])


@dataclass(frozen=True, eq=False)
class _Part:
    """The conditions on one contact: each of some orders at the same places.

    Attributes
    ----------
    index : ndarray (q, k) of int
        Control points on which those at a place depend.
    values : ndarray (n, q, k)
    orders : list of int
        Of length n.
    width : ndarray (q,)
        Length that each place represents, mm.
    """

    index: Array
    values: Array
    orders: list[int]
    width: Array


def _part(nets: Mapping[int, Net], first: Mapping[int, int], contact: Contact) -> _Part:
    sides = [contact.a] + ([contact.b] if contact.b else [])
    highest = max(knots.degree for side in sides for knots in (nets[side.surface].u, nets[side.surface].v))
    share, part = pieces(sides, nets, highest + MORE)
    found = [functions(nets[side.surface], side.places(share), contact.order, side.limits) for side in sides]
    ways = [(share, share, share)] * len(sides)
    if contact.order:
        jets = [_jets(nets[side.surface], *each) for side, each in zip(sides, found, strict=True)]
        ways = directions(jets, contact.a.way(share))
    index = np.concatenate([first[side.surface] + i for side, (i, _) in zip(sides, found, strict=True)], axis=1)
    asked = _asked(contact)
    values = np.empty((len(asked), *index.shape))
    for (order, along), value in zip(asked, np.split(values, len(asked)), strict=True):
        each = [
            derived(table, tangent if along else way, bend, order)
            for (_, table), (way, bend, tangent) in zip(found, ways, strict=True)
        ]
        value[0, :, : each[0].shape[1]] = each[0]
        value[0, :, each[0].shape[1] :] = -each[1] if len(each) > 1 else 0.0
    width = contact.a.length(nets[contact.a.surface]) * part
    return _Part(index.astype(np.int32), values, [order for order, _ in asked], width)


def _jets(net: Net, index: Array, table: Sequence[Array]) -> Array:
    """A surface and its derivatives, ``(len(table), q, 3)``, from its functions at places."""
    return np.asarray(np.matmul(np.stack(table, axis=1), net.poles.reshape(-1, 3)[index]).swapaxes(0, 1))


def _squared(matrix: Any, factors: Array) -> Any:
    """The square Aᵀ A of a matrix times factors ``(rows,)``, ``scipy.sparse.csr_array``.

    Rows with the same columns, as of the places in one span, are multiplied at once.
    """
    from scipy.sparse import csr_array

    n, lengths = matrix.shape[1], np.diff(matrix.indptr)
    total = csr_array((n, n))
    for length in np.unique(lengths[lengths > 0]).tolist():
        those = np.flatnonzero(lengths == length)
        at = matrix.indptr[those, None] + np.arange(length)
        columns = matrix.indices[at]
        marks = columns @ np.random.default_rng(0).integers(1 << 62, size=length)
        _, first, group = np.unique(marks, return_index=True, return_inverse=True)
        order = np.argsort(group, kind="stable")
        values, columns = matrix.data[at[order]] * factors[those[order], None], columns[first]
        blocks = np.empty((len(first), length, length))
        for block, rows in zip(blocks, np.split(values, np.cumsum(np.bincount(group))[:-1]), strict=True):
            np.matmul(rows.T, rows, out=block)
        entries = blocks.ravel(), np.repeat(columns, length, axis=0).ravel(), np.arange(columns.size + 1) * length
        every = csr_array(entries, shape=(columns.size, n))
        ends = np.append(0, np.cumsum(np.bincount(columns.ravel(), minlength=n)))
        where = np.ones(columns.size), np.argsort(columns, axis=None, kind="stable"), ends
        total = total + csr_array(where, shape=every.shape[::-1]) @ every
    return total


def _asked(contact: Contact) -> list[tuple[int, bool]]:
    """The orders of the conditions on a contact, across it and along it."""
    orders = range(contact.since, contact.order + 1)
    return [*((order, False) for order in orders), *((order, True) for order in orders if order == 1 and not contact.b)]
