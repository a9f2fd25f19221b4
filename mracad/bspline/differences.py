"""Derivatives of splines as differences of their control points.

The control points of the derivative of a spline are differences of its own, divided by differences of Greville
abscissae, with a degree less each time.  They vanish for polynomials on any knots, also at clamped ends and multiple
knots, where divided differences on the Greville abscissae of the spline itself do not.
"""

from __future__ import annotations

from math import comb, factorial

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

from mracad.bspline.knots import KnotVector
from mracad.memo import kept

Array = np.ndarray

SAME = 1e-12
"""Share of the domain below which knots coincide."""


@kept(1024)
def differences(knots: KnotVector, order: int) -> tuple[Array, Array]:
    """Weights of control points in a derivative, and the indices of these control points.

    Parameters
    ----------
    knots : KnotVector
    order : int
        Order of the derivative; beyond the degree, order of the differences between its values.

    Returns
    -------
    weights : ndarray (rows, order + 1)
        On even knots, those of plain differences of neighbours; never larger in all.  Not finite where the derivative
        does not exist.
    index : ndarray of int (rows, order + 1)
        A periodic direction has a row for each control point, others ``order`` fewer.
    """
    n = knots.count
    rows = n if knots.periodic else n - order
    if rows <= 0 or n <= order:
        return np.zeros((0, order + 1)), np.zeros((0, order + 1), int)
    total = rows + order
    flat = knots.knots
    if knots.periodic:
        turns = np.arange(1 + (total + knots.degree) // n)
        flat = (flat[:n] + knots.period * turns[:, None]).ravel()
    weights = np.zeros((total, order + 1))
    weights[:, 0] = 1.0
    places = at = _means(flat, 0, knots.degree, total)
    for level in range(order):
        apart = np.diff(places)
        with np.errstate(divide="ignore", invalid="ignore"):
            weights = (np.roll(weights[1:], 1, axis=1) - weights[:-1]) / np.where(
                apart > SAME * knots.period, apart, np.nan
            )[:, None]
        left = knots.degree - level - 1
        places = _means(flat, level + 1, left, len(weights)) if left >= 0 else (places[1:] + places[:-1]) / 2
    steps = (at[order:] - at[:-order]) / order
    weights = weights * (steps**order)[:, None]
    with np.errstate(invalid="ignore"):
        size = np.linalg.norm(weights, axis=1) / comb(2 * order, order) ** 0.5
        weights = weights / np.maximum(size, 1.0)[:, None]
    return weights, (np.arange(rows)[:, None] + np.arange(order + 1)) % n


def _means(flat: Array, first: int, degree: int, count: int) -> Array:
    """Greville abscissae of basis functions from the first on; middles of spans for degree 0."""
    span = sliding_window_view(flat[first:] if degree == 0 else flat[first + 1 :], max(degree, 2 if degree == 0 else 1))
    return np.asarray(span.mean(axis=1)[:count])


def divided(knots: KnotVector, order: int) -> tuple[Array, Array]:
    """Divided differences on the Greville abscissae of the spline itself: for knots repeated by a raised degree,
    between which there are no derivatives."""
    x, n = knots.greville(), knots.count
    index = np.arange(n)
    if knots.periodic:
        x = np.unwrap(x, period=knots.period)
        x, index = np.concatenate([x, x[:order] + knots.period]), np.concatenate([index, index[:order]])
    if len(x) <= order:
        return np.zeros((0, order + 1)), np.zeros((0, order + 1), int)
    at, columns = (sliding_window_view(each, order + 1) for each in (x, index))
    apart = at[:, :, None] - at[:, None, :] + np.eye(order + 1)
    step = (at[:, -1] - at[:, 0]) / order
    with np.errstate(divide="ignore", invalid="ignore"):
        return factorial(order) * (step**order)[:, None] / apart.prod(axis=2), columns
