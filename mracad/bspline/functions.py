"""The rational basis functions of a net at scattered parameters."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from mracad.bspline.basis import jet
from mracad.bspline.knots import Side
from mracad.bspline.surface import Net, surface_quotient

Array = np.ndarray

ORDERS = ((0, 0), (1, 0), (0, 1), (2, 0), (1, 1), (0, 2))
"""Orders of the derivatives along u and v, in the order of results."""


def functions(
    net: Net, uv: Array, derivatives: int = 0, side: tuple[Side, Side] = ("right", "right")
) -> tuple[Array, list[Array]]:
    """The basis functions of a net that do not vanish at parameters, with their derivatives.

    Parameters
    ----------
    net : Net
        A surface; its control points do not matter.
    uv : ndarray (q, 2)
    derivatives : {0, 1, 2}
    side : pair of {"right", "left"}
        Which limit is taken at a knot of u and of v.

    Returns
    -------
    index : ndarray (q, k) of int
        Indices of their control points in row-major order.
    table : list of ndarray (q, k)
        Values; values, ∂u and ∂v; or those and ∂uu, ∂uv, ∂vv.
    """
    first_u, in_u = jet(net.u, uv[:, 0], range(derivatives + 1), side[0])
    first_v, in_v = jet(net.v, uv[:, 1], range(derivatives + 1), side[1])
    row = (first_u[:, None] + np.arange(net.u.degree + 1)) % net.u.count
    column = (first_v[:, None] + np.arange(net.v.degree + 1)) % net.v.count
    shape = len(uv), row.shape[1] * column.shape[1]
    index = (row[:, :, None] * net.v.count + column[:, None, :]).reshape(shape)
    orders = [(i, j) for i, j in ORDERS if i + j <= derivatives]
    table = [(in_u[:, i, :, None] * in_v[:, j, None, :]).reshape(shape) for i, j in orders]
    return index, table if net.weights is None else rational(table, net.weights.ravel()[index])


def rational(table: Sequence[Array], weights: Array) -> list[Array]:
    """Values and derivatives of rational functions from those of the polynomial ones.

    Parameters
    ----------
    table : sequence of ndarray (…, k)
        The first 1, 3 or 6 of ``ORDERS``.
    weights : ndarray (…, k)
    """
    top = [part * weights for part in table]
    return list(surface_quotient(tuple(np.concatenate([t, t.sum(axis=-1, keepdims=True)], axis=-1) for t in top)))
