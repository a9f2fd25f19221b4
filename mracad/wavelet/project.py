"""The L2 projection onto a coarser spline space: the smoothing operator."""

from __future__ import annotations

from collections.abc import Set as AbstractSet
from functools import cached_property
from itertools import pairwise

import numpy as np

from mracad.bspline.basis import gauss, local_values
from mracad.bspline.gram import Gram, assembled, checked_weights, gram
from mracad.bspline.knots import Array, KnotVector
from mracad.bspline.refine import refinement
from mracad.bspline.rows import Rows
from mracad.bspline.solve import BandSolver, folded
from mracad.bspline.surface import Net
from mracad.errors import UsageError
from mracad.memo import kept
from mracad.wavelet.ladder import arc_lengths, ladder_for_scale

_SMALL = 256  # control points up to which the dense operator is as fast, and avoids loading LAPACK's banded solvers
_TAME = 1e3
"""Ratio of the largest to the least pivot of the scaled normal equations up to which they lose few digits."""
_LOW_DEGREE = 10
"""Degree up to which they lose at most five digits."""


class Projection:
    """``c' = argmin ∫ (B c − B' c')² w dt``.  Get it from :func:`projection`, which caches its factors.

    Attributes
    ----------
    coarse_knots, fine_knots : KnotVector
    """

    def __init__(self, coarse: KnotVector, fine: KnotVector, weights: Array | None) -> None:
        self.coarse_knots, self.fine_knots = coarse, fine
        self._p = refinement(coarse, fine)
        # Some functions of an unclamped vector may be all but zero within the domain: take their whole support.
        self._coarse, self._extra = coarse.closed()
        self._fine, _ = fine.closed()
        self._own = slice(self._extra[0], self._extra[0] + coarse.count)
        if weights is not None:
            low, high = np.searchsorted(self._fine.breaks, fine.domain)
            weights = np.pad(weights, (low, self._fine.spans - high), "edge")
        self._weights = weights

    @cached_property
    def _normal(self) -> tuple[BandSolver, Array] | None:
        """Factored normal equations ``PᵀGP`` and their scaling, or None if they would lose too many digits."""
        if self._fine.degree > _LOW_DEGREE or self._fine.count <= _SMALL:
            return None
        span, values, weight = self._coarse_at_fine()
        begin = np.flatnonzero(np.diff(span, prepend=-1))
        local = np.add.reduceat(np.matmul((values * weight).transpose(1, 0, 2), values.transpose(1, 2, 0)), begin)
        g = assembled(span[begin] - self._coarse.degree, local, self._coarse.count, self._coarse.periodic)
        scale = 1.0 / np.sqrt(g.diagonal()[self._own])
        row, column, value = g.rows.coo()
        n, before = len(scale), self._extra[0]
        own = (row >= before) & (row < before + n) & (column >= before) & (column < before + n)
        row, column, value = row[own] - before, column[own] - before, value[own]
        order = folded(n) if self._coarse.periodic else np.arange(n)
        solver = BandSolver(row, column, scale[row] * value * scale[column], order, order)
        return (solver, scale) if solver.pivots.max() < _TAME * solver.pivots.min() else None

    @cached_property
    def _moments(self) -> tuple[Gram, Rows]:
        return gram(self._fine, weights=self._weights), refinement(self._coarse, self._fine)

    @cached_property
    def _operator(self) -> Array:
        """The whole ``(m, n)`` matrix."""
        found = self._by_normal_equations() if self._fine.degree <= _LOW_DEGREE else None
        return self._by_triangles() if found is None else found

    def _by_normal_equations(self) -> Array | None:
        """The whole matrix, or None if the normal equations ``PᵀGP`` would lose too many digits."""
        g, p = self._moments
        right = g.apply(p.toarray())
        own = slice(self._extra[0], self._extra[0] + self.fine_knots.count)
        whole, right = p.apply_transposed(right)[self._own, self._own], right[:, self._own]
        scale = 1.0 / np.sqrt(whole.diagonal())
        whole *= scale[:, None] * scale
        try:
            pivots = np.linalg.cholesky(whole).diagonal() ** 2
        except np.linalg.LinAlgError:
            return None
        if pivots.max() >= _TAME * pivots.min():
            return None
        return np.asarray(scale[:, None] * np.linalg.solve(whole, (right * scale)[own].T))

    def _by_triangles(self) -> Array:
        """The whole matrix, by orthogonal triangularisation of the weighted bases at the Gauss points."""
        span, values, weight = self._coarse_at_fine()
        root = np.sqrt(weight)
        fine_span, offset, _ = gauss(self._fine, self._fine.degree + 1)
        points = np.repeat(fine_span, offset.shape[1])
        fine_values = local_values(self._fine, points, offset.ravel()).reshape(-1, *offset.shape) * root
        first, fine_first = span - self._coarse.degree, fine_span - self._fine.degree
        if self._coarse.periodic or any(self._extra):
            own_fine = slice(self._extra[0], self._extra[0] + self.fine_knots.count)
            a = _collocation(first, values * root, self._coarse.count)[:, self._own]
            q, r = np.linalg.qr(a)
            return np.linalg.solve(r, q.T @ _collocation(fine_first, fine_values, self._fine.count)[:, own_fine])
        width = len(values)
        triangle: list[Array] = []
        done: list[Array] = []
        carried, image, column = np.zeros((0, width)), np.zeros((0, self._fine.count)), 0
        begin = np.flatnonzero(np.diff(first, prepend=-1)).tolist()
        for low, high in pairwise([*begin, len(first)]):
            shift, column = first[low] - column, first[low]
            triangle += _leading(carried[:shift])
            done.append(image[:shift])
            kept = np.pad(carried[shift:, shift:], ((0, 0), (0, shift)))
            block = (values[:, low:high] * root[low:high]).reshape(width, -1).T
            target = _collocation(fine_first[low:high], fine_values[:, low:high], self._fine.count)
            q, carried = np.linalg.qr(np.concatenate([kept, block]))
            image = q.T @ np.concatenate([image[shift:], target])
        return _back_substituted(np.array(triangle + _leading(carried)), np.concatenate([*done, image]))

    def _coarse_at_fine(self) -> tuple[Array, Array, Array]:
        """Coarse spans ``(s,)``, functions ``(d + 1, s, g)`` and weights ``(s, g)`` at the fine Gauss points."""
        _, offset, weight = gauss(self._fine, self._fine.degree + 1)
        if self._weights is not None:
            weight = weight * self._weights[:, None]
        span, begin = self._coarse.locate(self._fine.breaks[:-1])
        points = np.repeat(span, offset.shape[1])
        values = local_values(self._coarse, points, (begin[:, None] + offset).ravel())
        return span, values.reshape(-1, *offset.shape), weight

    def coarse(self, c: Array, axis: int = 0) -> Array:
        """Coarse control points of the projection of ``c`` along ``axis``; ``c`` itself if the spaces are the same."""
        c = np.asarray(c, dtype=float)
        if c.shape[axis] != self.fine_knots.count:
            raise UsageError(
                f"{c.shape[axis]} control points along axis {axis}, but the knots need {self.fine_knots.count}"
            )
        if self.coarse_knots == self.fine_knots:
            return c
        middle = c.mean(axis=axis, keepdims=True)
        return np.asarray(self._solved(c - middle, axis) + middle)

    def apply(self, c: Array, axis: int = 0) -> Array:
        """Control points, over the fine knots, of the projection of ``c`` along ``axis``."""
        if self.coarse_knots == self.fine_knots:
            return self.coarse(c, axis)
        return self._p.apply(self.coarse(c, axis), axis)

    def _solved(self, c: Array, axis: int) -> Array:
        moved = np.moveaxis(c, axis, 0)
        flat = moved.reshape(len(moved), -1)
        if self._normal is None:
            out = self._operator @ flat
        else:
            solver, scale = self._normal
            g, p = self._moments
            if any(self._extra):
                flat = np.pad(flat, (self._extra, (0, 0)))
            right = p.apply_transposed(g.apply(flat))[self._own]
            out = scale[:, None] * solver.solve(scale[:, None] * right)
        return np.moveaxis(out.reshape(-1, *moved.shape[1:]), 0, axis)


def projection(coarse: KnotVector, fine: KnotVector, weights: Array | None = None) -> Projection:
    """The L2 projection of splines over ``fine`` onto those over ``coarse``, factored once and cached.

    ``S = P (PᵀGP)⁻¹ PᵀG``: idempotent, reproduces coarse splines, and its rows sum to 1.

    Parameters
    ----------
    coarse, fine : KnotVector
        Nested.
    weights : array_like (spans,), optional
        Positive factor in the inner product on each span of ``fine`` (``|S_u|``, if the parameter is uneven).

    Returns
    -------
    Projection

    Raises
    ------
    UsageError
        Knots not nested, or weights that do not fit.

    Notes
    -----
    Normal equations are used up to degree 10 on moderately uneven knots.  Beyond that, where they would square a large
    condition number, ``√W B'`` is triangularised orthogonally (QR) block by block, with ``B'`` the coarse basis at the
    Gauss points.

    Examples
    --------
    >>> import numpy as np
    >>> from mracad.bspline.knots import KnotVector
    >>> from mracad.wavelet import projection
    >>> smooth = projection(KnotVector.clamped([0, 2], 1), KnotVector.clamped([0, 1, 2], 1))
    >>> smooth.apply(np.array([[0.0], [1.0], [0.0]])).ravel().round(12)
    array([0.5, 0.5, 0.5])
    """
    key = None if weights is None else tuple(checked_weights(fine, weights).tolist())
    return _cached(coarse, fine, key)


def at_scale(
    net: Net,
    scale: float | tuple[float, float],
    keep: tuple[AbstractSet[float], AbstractSet[float]] = (frozenset(),) * 2,
    finer: tuple[Array, Array] | None = None,
) -> Net:
    """A net over its own knots without detail finer than a scale.

    Parameters
    ----------
    net : Net
    scale : float or (float, float)
        mm; the same, or one along u and one along v.
    keep : (set of float, set of float)
        Breaks in u and v that stay.
    finer : (ndarray (spans,), ndarray (spans,)), optional
        By how much the scale is divided in each span, along u and along v.
    """
    poles = net.poles
    scales = scale if isinstance(scale, tuple) else (scale, scale)
    for axis, knots in enumerate((net.u, net.v)):
        if knots.spans == 1 and not knots.periodic:
            continue
        lengths = arc_lengths(net, axis) * (1.0 if finer is None else finer[axis])
        coarse = ladder_for_scale(knots, lengths, scales[axis], keep=keep[axis])
        if coarse != knots:
            poles = projection(coarse, knots).apply(poles, axis=axis)
    return net.with_poles(poles)


def band(net: Net, low: float, high: float) -> tuple[Net, Net]:
    """A net without detail finer than ``high``, and the offsets of its detail between ``low`` and ``high``; in mm."""
    coarse = at_scale(net, high)
    fine = at_scale(net, low) if low else net
    return coarse, net.with_poles(fine.poles - coarse.poles)


@kept(128)
def _cached(coarse: KnotVector, fine: KnotVector, weights: tuple[float, ...] | None) -> Projection:
    return Projection(coarse, fine, None if weights is None else np.array(weights))


def _collocation(first: Array, values: Array, count: int) -> Array:
    """Dense ``(s g, count)`` matrix of local values ``(d + 1, s, g)``."""
    width, spans, points = values.shape
    dense = np.zeros((spans, points, count))
    for k in range(width):
        dense[np.arange(spans), :, (first + k) % count] += values[k]
    return dense.reshape(-1, count)


def _leading(triangle: Array) -> list[Array]:
    """Rows of an upper triangle moved left to begin with their diagonal."""
    return [np.append(row[i:], np.zeros(i)) for i, row in enumerate(triangle)]


def _back_substituted(r: Array, x: Array) -> Array:
    """Solution of ``R y = x`` for a banded upper triangle, ``r[i, k]`` at row ``i``, column ``i + k``."""
    y = np.empty_like(x)
    width = r.shape[1]
    for i in range(len(r) - 1, -1, -1):
        reach = min(width, len(r) - i)
        y[i] = (x[i] - r[i, 1:reach] @ y[i + 1 : i + reach]) / r[i, 0]
    return y
