"""B-spline basis functions, their derivatives and blossoms, by the Cox–de Boor recursion."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from mracad.bspline.boor import EVALUATE
from mracad.bspline.knots import Array, KnotVector, Side
from mracad.compiled import pointer
from mracad.memo import kept

SHORT = 64
"""Largest number of parameters for which values are cached."""


def basis(kv: KnotVector, x: Array, derivative: int = 0, side: Side = "right") -> tuple[Array, Array]:
    """Values of the functions that do not vanish at ``x``, or of their derivatives.

    Parameters
    ----------
    kv : KnotVector
    x : array_like (q,)
        Parameters; wrapped if the vector is periodic, otherwise the end polynomials continue beyond the domain.
    derivative : int
        Order of the derivative, with respect to the parameter.
    side : {"right", "left"}
        Which limit is taken at a knot.

    Returns
    -------
    first : ndarray (q,) of int
    values : ndarray (q, d + 1)
        ``values[:, k]`` belongs to control point ``(first + k) mod count``.

    Notes
    -----
    de Boor, *A Practical Guide to Splines*, ch. X: every term of the recursion is non-negative, hence stable at any
    degree.
    """
    first, values = jet(kv, x, (derivative,), side)
    return first, values[:, 0]


def jet(kv: KnotVector, x: Array, orders: Sequence[int], side: Side = "right") -> tuple[Array, Array]:
    """The same as :func:`basis` for several orders of derivatives at once; values ``(q, len(orders), d + 1)``."""
    at = np.atleast_1d(np.asarray(x, dtype=float))
    if at.ndim == 1 and len(at) <= SHORT:
        return _remembered(kv, at.tobytes(), tuple(orders), side)
    return _computed(kv, at, orders, side)


@kept(4096)
def _remembered(kv: KnotVector, at: bytes, orders: tuple[int, ...], side: Side) -> tuple[Array, Array]:
    """Cached values at few parameters, which are often needed again: at the samples of seams before and after an
    edit."""
    return _computed(kv, np.frombuffer(at), orders, side)


def _computed(kv: KnotVector, at: Array, orders: Sequence[int], side: Side) -> tuple[Array, Array]:
    if EVALUATE.pays(len(at)):
        return _compiled(kv, np.ascontiguousarray(kv.wrap(at, side)), orders, side)
    span, offset = kv.locate(at, side)
    values = np.stack([values.T for values in _local(kv, span, offset, orders)], axis=1)
    return span - kv.degree, np.ascontiguousarray(values)


def _compiled(kv: KnotVector, at: Array, orders: Sequence[int], side: Side) -> tuple[Array, Array]:
    wanted, size = np.array(orders), kv.degree + 1
    first, values, table = np.empty(len(at), int), np.empty((len(at), len(wanted), size)), np.empty(size * size)
    EVALUATE(
        *kv.pointers, kv.spans, kv.degree, pointer(at), len(at), side == "right",
        pointer(wanted), len(wanted), min(orders), pointer(first), pointer(values), pointer(table),
    )  # fmt: skip
    return first, values


def local_values(kv: KnotVector, span: Array, offset: Array, derivative: int = 0) -> Array:
    """Values of functions ``span - d … span`` at ``t_span + offset``, ``(d + 1, q)``.

    ``offset`` has shape ``(q,)``, or ``(d - derivative, q)`` for the polar form (blossom) of the functions' polynomial
    pieces on the span, with one argument per row.
    """
    return _local(kv, span, offset, (derivative,))[0]


def _local(kv: KnotVector, span: Array, offset: Array, orders: Sequence[int]) -> list[Array]:
    """The values of :func:`local_values` for derivatives of several orders: they share the first steps."""
    d = kv.degree
    around = kv.knots[span + np.arange(1 - d, d + 1)[:, None]] - kv.knots[span]
    left, right = around[:d], around[d:]
    values = [np.ones((1, len(span)))]
    for k in range(1, d - min(orders) + 1):
        low, high, x = left[d - k :], right[:k], offset if offset.ndim == 1 else offset[k - 1]
        width = high - low
        values.append(np.zeros((k + 1, len(span))))
        values[k][:-1] = (high - x) / width * values[k - 1]
        values[k][1:] += (x - low) / width * values[k - 1]
    return [_differentiated(left, right, values[d - r], r) if r <= d else np.zeros((d + 1, len(span))) for r in orders]


def _differentiated(left: Array, right: Array, values: Array, order: int) -> Array:
    """Derivatives of the functions of full degree from values of those of a degree lower by ``order``."""
    d = len(left)
    for k in range(d - order + 1, d + 1):
        slope = k / (right[:k] - left[d - k :]) * values
        values = np.zeros((k + 1, slope.shape[1]))
        values[:-1] = -slope
        values[1:] += slope
    return values


def gauss(kv: KnotVector, points: int) -> tuple[Array, Array, Array]:
    """Gauss–Legendre points on every span of the domain.

    Returns
    -------
    span : ndarray (s,) of int
        Index of each span in ``kv.knots``.
    offset, weight : ndarray (s, points)
        Parameters relative to the span's first knot, and quadrature weights in parameter units.
    """
    return kv.span_index, *gauss_pieces(kv.breaks, points)


def gauss_pieces(breaks: Array, points: int) -> tuple[Array, Array]:
    """Gauss–Legendre points on pieces between breaks, from their beginnings, and weights, ``(s, points)`` both."""
    nodes, weights = legendre(points)
    lengths = np.diff(breaks)[:, None]
    return 0.5 * lengths * (nodes + 1), 0.5 * lengths * weights


@kept(32)
def legendre(points: int) -> tuple[Array, Array]:
    """Nodes and weights of the Gauss–Legendre rule on [-1, 1]."""
    return np.polynomial.legendre.leggauss(points)
