"""Points and derivatives up to the third of a surface over the points of a quadrature."""

from __future__ import annotations

from collections.abc import Iterator
from math import comb

import numpy as np

from mracad.bspline.basis import jet
from mracad.bspline.knots import KnotVector
from mracad.bspline.surface import Net

Array = np.ndarray

ORDERS = ((0, 0), (1, 0), (0, 1), (2, 0), (1, 1), (0, 2), (3, 0), (2, 1), (1, 2), (0, 3))
"""Orders of the derivatives along u and v, in the order of results."""


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
    return np.concatenate(list(blocks(net, u, v, mask, centre, most)), axis=2)


def blocks(net: Net, u: Array, v: Array, mask: Array, centre: Array, most: int = 3) -> Iterator[Array]:
    """The same as :func:`jets`, in blocks of points."""
    poles = net.poles - centre
    if net.weights is not None:
        poles = np.concatenate([poles * net.weights[..., None], net.weights[..., None]], axis=2)
    k = poles.shape[2]
    rows, in_u = _local(net.u, u, most)
    columns, in_v = _local(net.v, v, most)
    along = np.matmul(in_u.reshape(len(u), -1, in_u.shape[-1]), poles[rows].reshape(*rows.shape, -1))
    along = along.reshape(u.size, most + 1, net.v.count, k).transpose(1, 3, 2, 0)  # order, coordinate, column, u
    along, in_v = np.ascontiguousarray(along), np.ascontiguousarray(in_v.transpose(2, 0, 1, 3))
    orders = [order for order in ORDERS if sum(order) <= most]
    wide = v.shape[1]
    step = max(1, _BLOCK // max(wide * u.size, 1))
    for begin in range(0, max(len(v), 1), step):
        part = slice(begin, begin + step)
        found = np.empty((len(orders), k, len(v[part]), wide, u.size))
        for r in range(most + 1):
            windows = along[r][:, columns[part]]
            for s in range(most + 1 - r):
                np.matmul(in_v[s, part], windows, out=found[orders.index((r, s))])
        found = found.reshape(len(orders), k, -1)
        inside = mask[:, begin * wide : (begin + step) * wide].T
        if not inside.all():
            found = found[:, :, np.flatnonzero(inside)]
        yield found if net.weights is None else _quotient(found)


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
    top, w = stack[:, :-1].copy(), stack[:, -1]
    for place, (a, b) in enumerate(ORDERS[: len(stack)]):
        for i in range(a + 1):
            for j in range(b + 1):
                if i or j:
                    factor = comb(a, i) * comb(b, j)
                    top[place] -= factor * w[ORDERS.index((i, j))] * top[ORDERS.index((a - i, b - j))]
        top[place] /= w[0]
    return top
