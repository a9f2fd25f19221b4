"""Integrals of products of derivatives of tensor-product functions, one direction after the other.

    F_ij = Σ_αβ ∫ c_αβ D^α B_i D^β B_j du dv,        B_i(u, v) = N_a(u) N_b(v),

c_αβ = c_βα given at Gauss points.  Per knot span this takes about (p + 1) (q + 1)⁴ multiplications; adding up the
products of all functions would take (p + 1)³ (q + 1)³.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from mracad.bspline.basis import jet
from mracad.bspline.knots import KnotVector
from mracad.bspline.surface import Net
from mracad.compiled import pointer
from mracad.memo import kept
from mracad.seam.stencil import MIRROR, PLACE

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

    def products(self, orders: tuple[Order, ...], factors: Sequence[float], mirrored: bool = False) -> Array:
        """Products of derivatives of functions, times factors, ``(s, len(orders) g, (d + 1)²)``; with mirror images
        where asked."""
        key = orders, tuple(factors), mirrored
        if key not in self._products:
            tables = []
            for (k, m), factor in zip(orders, factors, strict=True):
                product = factor * self.table[:, :, k, :, None] * self.table[:, :, m, None]
                tables.append(product + product.swapaxes(2, 3) if mirrored and k != m else product)
            self._products[key] = np.concatenate(tables, axis=1).reshape(len(self.first), -1, self.width)
        return self._products[key]

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
    return Sites(
        knots,
        np.ascontiguousarray(first.reshape(shape)[:, 0]),
        places.reshape(shape),
        np.frombuffer(weight).reshape(shape),
        table,
    )


def integrals(
    along: tuple[Sites, Sites], orders: Sequence[tuple[Order, Order]], coefficients: Array, form: Array | None = None
) -> Array:
    """The form of given coefficients.

    Parameters
    ----------
    along : pair of Sites
    orders : sequence of pairs of orders
        α and β.
    coefficients : ndarray (pairs, points_v, points_u)
        c_αβ times the weights of the points, for one of (α, β) and (β, α).
    form : ndarray (nu, nv, 2p + 1, 2q + 1), optional
        A form of these functions, to which the result is added.

    Returns
    -------
    ndarray (nu, nv, 2p + 1, 2q + 1)
        ``[i, j, p + k, q + l]`` belongs to the functions (i, j) and (i + k, j + l).
    """
    u, v = along
    su, gu = u.at.shape
    pairs: dict[Order, list[tuple[int, int, Array]]] = {}
    for both, values in zip(orders, coefficients, strict=True):
        low, high = sorted(both)
        pairs.setdefault((low[0], high[0]), []).append((low[1], high[1], values))
    form = nothing(u.knots, v.knots) if form is None else form
    half = np.zeros((u.knots.count, 2 * u.knots.degree + 1, v.knots.count, 2 * v.knots.degree + 1))
    width = half.shape[2] * half.shape[3]
    outer = u.products(tuple(pairs), [0.5 if i == j else 1.0 for i, j in pairs]).swapaxes(1, 2)
    rows = max(1, _BLOCK // (len(pairs) * gu * width * 2))
    for begin in range(0, su, rows):
        part = slice(begin, begin + rows)
        lines = slice(begin * gu, min(begin + rows, su) * gu)
        groups = [[(k, m, c[:, lines]) for k, m, c in each] for each in pairs.values()]
        along_v = inner(v, groups, [i == j for i, j in pairs], gu)
        cells = np.matmul(outer[part], along_v)
        _added(half, u, u.first[part], cells.reshape(len(cells), 1, 1, 1, -1))
    if MIRROR.pays(half.size):
        MIRROR(pointer(half), *half.shape, pointer(form))
    else:
        half = half.swapaxes(1, 2)
        form += half + _mirrored(half)
    return form


def nothing(u: KnotVector, v: KnotVector) -> Array:
    """The form that is zero, ``(nu, nv, 2p + 1, 2q + 1)``."""
    return np.zeros((u.count, v.count, 2 * u.degree + 1, 2 * v.degree + 1))


def inner(
    v: Sites, groups: Sequence[Sequence[tuple[int, int, Array]]], mirrored: Sequence[bool], points: int = 1
) -> Array:
    """``Σ ∫ c D^k N_b D^m N_b' dv`` on lines u = const, for groups of k, m and c ``(points, lines)``.

    Returns
    -------
    ndarray (lines / points, groups · points, nv (2q + 1))
        With their mirror images where asked; lines in bundles of a number of points.
    """
    (sv, gv), lines = v.at.shape, groups[0][0][2].shape[1]
    cells = np.empty((sv, len(groups), lines, v.width))
    for number, (group, both) in enumerate(zip(groups, mirrored, strict=True)):
        table = v.products(tuple((k, m) for k, m, _ in group), [1.0] * len(group), both)
        values = np.empty((sv, len(group), gv, lines))
        for place, (_, _, c) in enumerate(group):
            values[:, place] = c.reshape(sv, gv, lines)
        np.matmul(values.reshape(sv, -1, lines).swapaxes(1, 2), table, out=cells[:, number])
    found = np.zeros((lines // points, len(groups) * points, v.knots.count * (2 * v.knots.degree + 1)))
    _added(found, v, v.first, cells.reshape(sv, len(groups), -1, points, v.width))
    return found


def _added(found: Array, along: Sites, first: Array, cells: Array) -> None:
    """Add what pieces give to pairs of functions, ``(pieces, groups, lines, points, (d + 1)² k)``, piece by piece to
    stencils, ``(lines, groups, points, n, 2d + 1, k)``."""
    n, d = along.knots.count, along.knots.degree
    pieces, groups, lines, points, width = cells.shape
    width //= along.width
    if PLACE.pays(cells.size):
        PLACE(pointer(cells), pieces, groups, lines, points, width, pointer(first), n, d, pointer(found))
        return
    stencils = found.reshape(lines, groups, points, n, 2 * d + 1, width).swapaxes(0, 1)
    for cell, start in zip(cells.reshape(pieces, groups, lines, points, d + 1, d + 1, width), first, strict=True):
        for a in range(d + 1):
            stencils[:, :, :, (start + a) % n, d - a : 2 * d + 1 - a] += cell[:, :, :, a]


def _mirrored(form: Array) -> Array:
    """A form ``(nu, nv, 2p + 1, 2q + 1)`` with its two functions exchanged."""
    rows, columns = (
        ((np.arange(n)[:, None] + np.arange(w) - w // 2) % n * w + np.arange(w)[::-1]).ravel()
        for n, w in zip(form.shape[:2], form.shape[2:], strict=True)
    )
    flat = form.swapaxes(1, 2).reshape(len(rows), len(columns))
    nu, nv, wu, wv = form.shape
    return np.asarray(flat[rows].take(columns, axis=1).reshape(nu, wu, nv, wv).swapaxes(1, 2))


@dataclass(frozen=True, eq=False)
class _Pattern:
    """The entries of a matrix over the control points of a net that a stencil can have.

    Attributes
    ----------
    there : ndarray (entries,) of int, optional
        Their places in the stencil; None if all are.
    row, indices : ndarray (entries,) of int32
        Their rows and columns.
    indptr : ndarray (points + 1,) of int32
        Where the entries of each row begin.
    """

    there: Array | None
    row: Array
    indices: Array
    indptr: Array


@kept(16)
def _pattern(size: tuple[int, int], width: tuple[int, int], periodic: tuple[bool, bool], rows: Any) -> _Pattern:
    own = [np.frombuffer(rows[k], int) if rows else np.arange(n) for k, n in enumerate(size)]
    at = [each[:, None] + np.arange(w) - w // 2 for each, w in zip(own, width, strict=True)]
    inside = [(each >= 0) & (each < n) | closed for each, n, closed in zip(at, size, periodic, strict=True)]
    row, column = ((each % n).astype(np.int32) for each, n in zip(at, size, strict=True))
    every = row[:, None, :, None] * np.int32(size[1]) + column[:, None]
    there = inside[0][:, None, :, None] & inside[1][:, None]
    counts = np.zeros(size, np.int32)
    counts[np.ix_(*own)] = np.count_nonzero(there, axis=(2, 3))
    first = np.repeat(np.arange(counts.size, dtype=np.int32), counts.ravel())
    ends = np.append(np.int32(0), counts.cumsum(dtype=np.int32))
    return _Pattern(None if there.all() else np.flatnonzero(there), first, every[there], ends)


def sparse(forms: Sequence[Array], net: Net, rows: tuple[Array, Array] | None = None) -> list[Any]:
    """Stencils as ``scipy.sparse.csr_array`` on the control points in row-major order, scaled from both sides by the
    weights; with the same entries, those in which one of them is not zero.

    Parameters
    ----------
    forms : sequence of ndarray (ku, kv, 2p + 1, 2q + 1)
    net : Net
    rows : (ndarray (ku,), ndarray (kv,)), optional
        Rows and columns of control points that have entries, ascending; by default all.
    """
    from scipy.sparse import csr_array

    n, closed = net.u.count * net.v.count, (net.u.periodic, net.v.periodic)
    marks = rows and tuple(np.asarray(each, int).tobytes() for each in rows)
    pattern = _pattern((net.u.count, net.v.count), forms[0].shape[2:], closed, marks)
    values = [each.ravel() if pattern.there is None else each.ravel()[pattern.there] for each in forms]
    row, indices, ends = pattern.row, pattern.indices, pattern.indptr
    some = np.logical_or.reduce([each != 0 for each in values])
    if not some.all():
        values, row, indices = [each[some] for each in values], row[some], indices[some]
        ends = np.append(np.int32(0), np.bincount(row, minlength=n).cumsum(dtype=np.int32))
    if net.weights is not None:
        weights = net.weights.ravel()
        scale = weights[row] * weights[indices]
        values = [each * scale for each in values]
    if not any(closed):
        return [csr_array((each, indices, ends), shape=(n, n)) for each in values]
    found = [csr_array((each, indices.copy(), ends.copy()), shape=(n, n)) for each in values]
    for each in found:
        each.sum_duplicates()
    return [found[0], *(on_pattern(each, found[0]) for each in found[1:])]


def on_pattern(form: Any, like: Any) -> Any:
    """The matrix, sharing the index arrays of another one if the patterns are equal."""
    from scipy.sparse import csr_array

    same = np.array_equal(form.indptr, like.indptr) and np.array_equal(form.indices, like.indices)
    return csr_array((form.data, like.indices, like.indptr), shape=form.shape) if same else form
