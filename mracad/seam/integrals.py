"""Integrals of products of derivatives of tensor-product functions, one direction after the other.

    F_ij = Σ_αβ ∫ c_αβ D^α B_i D^β B_j du dv,        B_i(u, v) = N_a(u) N_b(v),

c_αβ = c_βα given at Gauss points.  Per knot span this takes about (p + 1) (q + 1)⁴ multiplications; adding up the
products of all functions would take (p + 1)³ (q + 1)³.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np

from mracad.bspline.basis import jet
from mracad.bspline.knots import KnotVector
from mracad.bspline.surface import Net
from mracad.memo import kept

Array = np.ndarray

Order = tuple[int, int]
"""Orders of a derivative along u and v."""

_BLOCK = 1 << 22


@dataclass(frozen=True, eq=False)
class Sites:
    """Gauss points of one direction, and the basis functions there.

    Attributes
    ----------
    knots : KnotVector
    first : ndarray (s,) of int
        First basis function of each piece (a part of one span).
    at, weight : ndarray (s, g)
        Parameters, and weights in parameter units.
    table : ndarray (s, g, 3, d + 1)
        Values, first and second derivatives of the functions.
    """

    knots: KnotVector
    first: Array
    at: Array
    weight: Array
    table: Array
    _products: dict[tuple[Any, ...], Array] = field(default_factory=dict)

    @cached_property
    def fresh(self) -> Array:
        """Whether each piece lies in another span than the one before, ``(s,)``."""
        return np.asarray(np.diff(self.first, prepend=self.first[0] - 1) != 0)

    @cached_property
    def straight(self) -> bool:
        """Whether the spans' functions begin one after the other, without wrapping around."""
        first, n = self.first[self.fresh], self.knots.count
        return bool((np.diff(first) == 1).all()) and first[-1] + self.knots.degree < n

    def products(self, orders: tuple[Order, ...], mirrored: bool = False) -> Array:
        """Products of derivatives of functions, ``(s, len(orders) g, (d + 1)²)``; with mirror images where asked."""
        if (orders, mirrored) not in self._products:
            tables = []
            for k, m in orders:
                product = self.table[:, :, k, :, None] * self.table[:, :, m, None]
                tables.append(product + product.swapaxes(2, 3) if mirrored and k != m else product)
            self._products[orders, mirrored] = np.concatenate(tables, axis=1).reshape(len(self.first), -1, self.width)
        return self._products[orders, mirrored]

    @property
    def width(self) -> int:
        """Number of pairs of functions on a span."""
        return (self.knots.degree + 1) ** 2


def sites(knots: KnotVector, at: Array, weight: Array) -> Sites:
    """The Gauss points ``at`` ``(s, g)``, each row inside one span."""
    return _sites(knots, at.tobytes(), weight.tobytes(), at.shape)


@kept(8)
def _sites(knots: KnotVector, at: bytes, weight: bytes, shape: tuple[int, int]) -> Sites:
    """Cached, because forms in different metrics are taken at the same points."""
    places = np.frombuffer(at)
    first, table = jet(knots, places, range(3))
    table = table.reshape(*shape, 3, knots.degree + 1)
    return Sites(knots, first.reshape(shape)[:, 0], places.reshape(shape), np.frombuffer(weight).reshape(shape), table)


def integrals(
    along: tuple[Sites, Sites], coefficients: Mapping[tuple[Order, Order], Array], form: Array | None = None
) -> Array:
    """The form of given coefficients.

    Parameters
    ----------
    along : pair of Sites
    coefficients : mapping of pairs of orders to ndarray (points_u, points_v)
        c_αβ times the weights of the points, for one of (α, β) and (β, α).
    form : ndarray (nu, nv, 2p + 1, 2q + 1), optional
        A form of these functions, to which the result is added.

    Returns
    -------
    ndarray (nu, nv, 2p + 1, 2q + 1)
        ``[i, j, p + k, q + l]`` belongs to the functions (i, j) and (i + k, j + l).
    """
    u, v = along
    (su, gu), p, q = u.at.shape, u.knots.degree, v.knots.degree
    pairs: dict[Order, list[tuple[int, int, Array]]] = {}
    for both, values in coefficients.items():
        low, high = sorted(both)
        pairs.setdefault((low[0], high[0]), []).append((low[1], high[1], values))
    if form is None:
        form = nothing(u.knots, v.knots)
    stencil = form.swapaxes(1, 2).reshape(u.knots.count, 2 * p + 1, v.knots.count * (2 * q + 1))
    rows = max(1, _BLOCK // (len(pairs) * gu * stencil.shape[2] * 2))
    for begin in range(0, su, rows):
        part = slice(begin, begin + rows)
        lines = slice(begin * gu, min(begin + rows, su) * gu)
        orders, found = [], []
        for (i, j), each in pairs.items():
            across = inner(v, [(k, m, c[lines]) for k, m, c in each], mirrored=i == j)
            orders += [(i, j)] if i == j else [(i, j), (j, i)]
            found += [across] if i == j else [across, _transposed(across)]
        outer = u.products(tuple(orders))[part].swapaxes(1, 2)
        count = len(outer)
        along_v = np.concatenate([each.reshape(count, gu, -1) for each in found], axis=1)
        _added(stencil, u, part, np.matmul(outer, along_v).reshape(count, p + 1, p + 1, -1))
    return form


def nothing(u: KnotVector, v: KnotVector) -> Array:
    """The form that is zero, ``(nu, nv, 2p + 1, 2q + 1)``."""
    return np.zeros((u.count, 2 * u.degree + 1, v.count, 2 * v.degree + 1)).swapaxes(1, 2)


def inner(v: Sites, parts: list[tuple[int, int, Array]], mirrored: bool) -> Array:
    """``Σ ∫ c D^k N_b D^m N_b' dv`` on lines u = const, ``(lines, nv, 2q + 1)``; with its mirror image where asked."""
    (sv, gv), q = v.at.shape, v.knots.degree
    table = v.products(tuple((k, m) for k, m, _ in parts), mirrored)
    values = np.concatenate([c.reshape(-1, sv, gv).swapaxes(0, 1) for _, _, c in parts], axis=2)
    cells = np.matmul(values, table).reshape(sv, len(values[0]), q + 1, q + 1)
    found = np.zeros((v.knots.count, 2 * q + 1, cells.shape[1]))
    _added(found, v, slice(None), cells.transpose(0, 2, 3, 1))
    return np.ascontiguousarray(found.transpose(2, 0, 1))


def _added(form: Array, along: Sites, part: slice, cells: Array) -> None:
    """Add the parts ``(s, d + 1, d + 1, …)`` that pieces give to pairs of functions to a stencil ``(n, 2d + 1, …)``."""
    n, d = along.knots.count, along.knots.degree
    first, fresh = along.first[part], along.fresh[part]
    if not fresh[1:].all():  # pieces of one span
        new = np.append(0, 1 + np.flatnonzero(fresh[1:]))
        first, cells = first[new], np.add.reduceat(cells, new, axis=0)
    for a in range(d + 1):
        place = slice(first[0] + a, first[-1] + a + 1) if along.straight else (first + a) % n
        form[place, d - a : 2 * d + 1 - a] += cells[:, a]


def _transposed(stencil: Array) -> Array:
    """A stencil ``(lines, n, 2d + 1)`` with its two functions exchanged."""
    n, width = stencil.shape[1:]
    place, offset = np.arange(n)[:, None], np.arange(width) - width // 2
    return np.asarray(stencil[:, (place + offset) % n, width // 2 - offset])


def sparse(form: Array, net: Net, rows: tuple[Array, Array] | None = None) -> Any:
    """A stencil as ``scipy.sparse.csr_array`` on the control points in row-major order, scaled from both sides by the
    weights.

    Parameters
    ----------
    form : ndarray (ku, kv, 2p + 1, 2q + 1)
    net : Net
    rows : (ndarray (ku,), ndarray (kv,)), optional
        Rows and columns of control points that have entries, ascending; by default all.
    """
    from scipy.sparse import csr_array

    nu, nv = net.u.count, net.v.count
    own = rows or (np.arange(nu), np.arange(nv))
    row, column = (
        ((at[:, None] + np.arange(w) - w // 2) % n).astype(np.int32)
        for at, n, w in zip(own, (nu, nv), form.shape[2:], strict=True)
    )
    at = row[:, None, :, None] * np.int32(nv) + column[:, None]
    if net.weights is not None:
        form = form * net.weights[np.ix_(*own)][:, :, None, None] * net.weights.ravel()[at]
    there = form != 0
    counts = np.zeros((nu, nv), np.int32)
    counts[np.ix_(*own)] = np.count_nonzero(there.reshape(*there.shape[:2], -1), axis=2)
    ends = np.append(np.int32(0), counts.cumsum(dtype=np.int32))
    found = csr_array((form[there], at[there], ends), shape=(nu * nv, nu * nv))
    if net.u.periodic or net.v.periodic:
        found.sum_duplicates()
    return found
