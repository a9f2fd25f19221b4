"""B-spline basis functions, their derivatives and blossoms, by the Cox–de Boor recursion."""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from mracad.bspline.knots import Array, KnotVector, Side

SHORT = 64
"""Most parameters for which values are kept."""


def basis(kv: KnotVector, x: Array, derivative: int = 0, side: Side = "right") -> tuple[Array, Array]:
    """The functions that are not zero at ``x``, or their derivatives.

    Parameters
    ----------
    kv : KnotVector
    x : array_like (q,)
        Parameters; wrapped where the vector is periodic, otherwise the end polynomials serve beyond the domain.
    derivative : int
        Order of the derivative, with respect to the parameter.
    side : {"right", "left"}
        Which limit is taken at a knot.

    Returns
    -------
    first : ndarray (q,) of int
    values : ndarray (q, d + 1)
        ``values[:, k]`` belongs to pole ``(first + k) mod count``.

    Notes
    -----
    de Boor, *A Practical Guide to Splines*, ch. X: every term of the recursion is non-negative, hence stable at any
    degree.
    """
    at = np.atleast_1d(np.asarray(x, dtype=float))
    if at.ndim == 1 and len(at) <= SHORT:
        return _remembered(kv, at.tobytes(), derivative, side)
    return _computed(kv, at, derivative, side)


@lru_cache(maxsize=4096)
def _remembered(kv: KnotVector, at: bytes, derivative: int, side: Side) -> tuple[Array, Array]:
    """Few places are often asked for again: the samples of a seam before and after an edit."""
    first, values = _computed(kv, np.frombuffer(at), derivative, side)
    for array in (first, values):
        array.setflags(write=False)
    return first, values


def _computed(kv: KnotVector, at: Array, derivative: int, side: Side) -> tuple[Array, Array]:
    span, offset = kv.locate(at, side)
    return span - kv.degree, local_values(kv, span, offset, derivative).T


def local_values(kv: KnotVector, span: Array, offset: Array, derivative: int = 0) -> Array:
    """Values of functions ``span - d … span`` at ``t_span + offset``, ``(d + 1, q)``.

    ``offset`` has shape ``(q,)``, or ``(d - derivative, q)`` for the polar form (blossom) of the functions' polynomial
    pieces on the span, one argument a row.
    """
    d = kv.degree
    if derivative > d:
        return np.zeros((d + 1, len(span)))
    around = kv.knots[span + np.arange(1 - d, d + 1)[:, None]] - kv.knots[span]
    left, right = around[:d], around[d:]
    arguments = np.broadcast_to(offset, (d - derivative, len(span)))
    values = np.ones((1, len(span)))
    for k in range(1, d + 1):
        low, high, old = left[d - k :], right[:k], values
        values = np.zeros((k + 1, len(span)))
        if k <= d - derivative:
            x = arguments[k - 1]
            values[:-1] = (high - x) / (high - low) * old
            values[1:] += (x - low) / (high - low) * old
        else:
            slope = k / (high - low) * old
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
    nodes, weights = _legendre(points)
    lengths = np.diff(kv.breaks)[:, None]
    return kv.span_index, 0.5 * lengths * (nodes + 1), 0.5 * lengths * weights


@lru_cache(maxsize=32)
def _legendre(points: int) -> tuple[Array, Array]:
    """Nodes and weights of the Gauss–Legendre rule on [-1, 1]."""
    return np.polynomial.legendre.leggauss(points)
