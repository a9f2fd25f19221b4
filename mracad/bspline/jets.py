"""Points and derivatives up to the third of a surface over the points of a quadrature."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from math import comb

import numpy as np

from mracad.bspline.basis import jet
from mracad.bspline.knots import KnotVector
from mracad.bspline.surface import Net
from mracad.bspline.tensor import COMBINE
from mracad.compiled import pointer

Array = np.ndarray

ORDERS = ((0, 0), (1, 0), (0, 1), (2, 0), (1, 1), (0, 2), (3, 0), (2, 1), (1, 2), (0, 3))
"""Orders of the derivatives along u and v, in the order of results."""

_BY_AXIS = np.ascontiguousarray(np.transpose(ORDERS))
_POINTERS = pointer(_BY_AXIS), pointer(_BY_AXIS[1])

_BLOCK = 8192
"""Points that are processed at once: their figures fit the processor's cache."""


def jets(net: Net, u: Array, v: Array, mask: Array, centre: Array, most: int = 3) -> Array:
    """Points and derivatives at the pairs of parameters that a mask selects.

    Parameters
    ----------
    net : Net
    u, v : ndarray (pieces, points)
        Parameters; each piece lies in one knot span.
    mask : ndarray of bool (u.size, v.size)
    centre : ndarray (3,)
        Origin of the results: numbers near 0 keep more digits.
    most : {1, 2, 3}
        Highest order.

    Returns
    -------
    ndarray (10, 3, q)
        By ``ORDERS`` up to the highest order, coordinate and point, v slowest.
    """
    sites = Sites.of(net.u, net.v, u, v, mask, most)
    found = list(sites.blocks(sites.along(net, centre), net.weights is not None))
    return found[0] if len(found) == 1 else np.concatenate(found, axis=2)


@dataclass(frozen=True, eq=False)
class Sites:
    """The functions of two knot vectors at the points of a quadrature, for surfaces over these knots.

    Attributes
    ----------
    orders : list of (int, int)
        Those of ``ORDERS`` up to the highest.
    rows : ndarray of int (pieces, d + 1)
        Control points along u of each piece.
    in_u : ndarray (pieces, points, most + 1, d + 1)
        The functions of these control points, and their derivatives.
    columns : ndarray of int (nv, d + 1)
        Control points along v of each of the parameters v.
    in_v : ndarray (most + 1, nv, d + 1)
        The functions of these, and their derivatives.
    mask : ndarray of bool (nv, nu)
        Pairs of parameters that are points.
    """

    orders: Sequence[tuple[int, int]]
    rows: Array
    in_u: Array
    columns: Array
    in_v: Array
    mask: Array

    @classmethod
    def of(cls, ku: KnotVector, kv: KnotVector, u: Array, v: Array, mask: Array, most: int = 3) -> Sites:
        """Arguments as for :func:`jets`."""
        rows, in_u = _local(ku, u, most)
        columns, in_v = _local(kv, v, most)
        across = np.ascontiguousarray(in_v.reshape(v.size, most + 1, -1).swapaxes(0, 1))
        orders = [order for order in ORDERS if sum(order) <= most]
        return cls(orders, rows, in_u, np.repeat(columns, v.shape[1], axis=0), across, np.ascontiguousarray(mask.T))

    def along(self, net: Net, centre: Array, most: int | None = None) -> Array:
        """Derivatives along u of the curves of control points, up to an order, ``(most + 1, 3, columns, nu)``; of
        homogeneous coordinates if the surface is rational."""
        poles, in_u = net.poles - centre, self.in_u if most is None else self.in_u[:, :, : most + 1]
        if net.weights is not None:
            poles = np.concatenate([poles * net.weights[..., None], net.weights[..., None]], axis=2)
        pieces, points, orders, width = in_u.shape
        local = poles[self.rows].reshape(pieces, width, -1)
        found = np.matmul(in_u.reshape(pieces, points * orders, width), local)
        found = found.reshape(pieces * points, orders, *poles.shape[1:])
        return np.ascontiguousarray(found.transpose(1, 3, 2, 0))

    def blocks(self, along: Array, rational: bool) -> Iterator[Array]:
        """The results of :func:`jets` from derivatives along u, in blocks of points; products are added up in the order
        of control points, as compiled code does."""
        orders = [order for order in self.orders if sum(order) < len(along)]
        step = max(1, _BLOCK // max(self.mask.shape[1], 1))
        for begin in range(0, max(len(self.mask), 1), step):
            part = slice(begin, begin + step)
            shape = len(orders), along.shape[1], *self.mask[part].shape
            if COMBINE.pays(shape[2] * shape[3]):
                found = np.empty(shape)
                across = *self._pointers, *self.columns.shape, begin, begin + shape[2]
                COMBINE(pointer(along), *along.shape[1:], *across, *_POINTERS, len(orders), pointer(found))
            else:
                found = np.zeros(shape)
                for k, columns in enumerate(self.columns[part].T):
                    curves = along[:, :, columns]
                    for one, (r, s) in zip(found, orders, strict=True):
                        one += self.in_v[s, part, k, None] * curves[r]
            yield self.chosen(found, part, rational)

    @cached_property
    def _pointers(self) -> tuple[int, int]:
        return pointer(self.columns), pointer(self.in_v)

    def chosen(self, stack: Array, rows: slice, rational: bool) -> Array:
        """Derivatives at points, from those of homogeneous coordinates at all pairs of parameters of some rows."""
        stack, inside = stack.reshape(*stack.shape[:2], -1), self.mask[rows]
        if not inside.all():
            stack = stack[:, :, np.flatnonzero(inside)]
        return _quotient(stack) if rational else stack


def _local(kv: KnotVector, x: Array, most: int) -> tuple[Array, Array]:
    """Control points ``(pieces, d + 1)`` and derivatives of their functions, ``(pieces, points, most + 1, d + 1)``."""
    first, values = jet(kv, x.ravel(), range(most + 1))
    start, local = first.reshape(x.shape), values.reshape(*x.shape, most + 1, -1)
    if (start[:, -1] != start[:, 0]).any():  # pieces that end on a knot
        local = local.copy()
        local[:, -1] = jet(kv, np.ascontiguousarray(x[:, -1]), range(most + 1), "left")[1]
    return (start[:, :1] + np.arange(kv.degree + 1)) % kv.count, local


def _quotient(stack: Array) -> Array:
    """Derivatives of ``A / w`` from those of ``(A, w)``, by Leibniz' rule."""
    top, w = stack[:, :-1], stack[:, -1]
    inverse = 1.0 / w[0]
    for place, (a, b) in enumerate(ORDERS[: len(stack)]):
        for i in range(a + 1):
            for j in range(b + 1):
                if i or j:
                    factor = comb(a, i) * comb(b, j)
                    top[place] -= factor * w[ORDERS.index((i, j))] * top[ORDERS.index((a - i, b - j))]
        top[place] *= inverse
    return top
