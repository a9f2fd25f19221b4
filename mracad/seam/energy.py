"""Mass and bending energy of displacements of a surface, over the part of it that its faces show.

On a surface X (the metric: a smoothed copy of the edited one) with first fundamental form g and Christoffel symbols Γ,

    M_ij = ∫ R_i R_j dA,    K_ij = ∫ Σ_ab H̃_ab(R_i) H̃_ab(R_j) dA,    H̃ = L⁻¹ (∂_ab − Γ^d_ab ∂_d) L⁻ᵀ,    g = L Lᵀ,

R_i the (rational) basis functions of the edited net, dA = √det g du dv inside the trims, by Gauss points on every knot
span.  The energy of second derivatives is covariant: it does not see the parameters.  On knot lines of multiplicity
≥ degree, where second derivatives say nothing of a kink, K gets 10³ ∫ [∂_n x]² / h, h the spans beside the line.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from mracad.bspline.basis import jet
from mracad.bspline.functions import ORDERS, functions, rational
from mracad.bspline.knots import KnotVector, Side
from mracad.bspline.net import Net
from mracad.inspect.cells import Quadrature
from mracad.inspect.jets import jets

Array = np.ndarray

KINK_WEIGHT = 1e3
"""Weight of squared kinks on knot lines against squared curvature."""

FLATTEST = 1e-4
"""Least ratio of the metric's singular values: beyond it (poles) the shorter direction counts as so long."""

_BLOCK = 1 << 21


@dataclass(frozen=True, eq=False)
class Sites:
    """Gauss points of one direction, and the basis functions there.

    Attributes
    ----------
    first : ndarray (s,) of int
        First basis function of each piece (a part of one span).
    at, weight : ndarray (s, g)
        Parameters, and weights in parameter units.
    table : ndarray (s, g, 3, d + 1)
        Values, first and second derivatives of the functions.
    """

    first: Array
    at: Array
    weight: Array
    table: Array


def _sites(knots: KnotVector, at: Array, weight: Array) -> Sites:
    """The Gauss points ``at`` ``(s, g)``, each row inside one span."""
    first, table = jet(knots, at.ravel(), range(3))
    return Sites(first.reshape(at.shape)[:, 0], at, weight, table.reshape(*at.shape, 3, knots.degree + 1))


@dataclass(frozen=True, eq=False)
class Forms:
    """Forms of one surface, ``scipy.sparse.csr_array`` over its control points in row-major order.

    Attributes
    ----------
    mass : csr_array (points, points)
        mm².
    bending : csr_array (points, points)
        Per mm², with the kinks on knot lines that are no crease.
    creases : csr_array (points, points)
        Kinks on creases.
    """

    mass: Any
    bending: Any
    creases: Any


def forms(net: Net, metric: Net, quadrature: Quadrature, creases: Sequence[Collection[float]] = ((), ())) -> Forms:
    """Mass and bending of displacements of ``net``.

    Parameters
    ----------
    net : Net
        Its knots, degrees and weights define the basis.
    metric : Net
        The surface in whose metric is measured, over the same parameters.
    quadrature : Quadrature
        Gauss points over the faces on it.
    creases : pair of collections of float
        Knots in u and v on which the surface has a crease: there only a displacement's own kink counts.
    """
    along = _sites(net.u, quadrature.u, quadrature.wu), _sites(net.v, quadrature.v, quadrature.wv)
    frame, area = _frames(metric, along)
    area = np.where(quadrature.mask, area, 0.0)
    (su, gu), (sv, gv) = along[0].at.shape, along[1].at.shape
    p, q = net.u.degree, net.v.degree
    shape = net.u.count, net.v.count, 2 * p + 1, 2 * q + 1
    mass, bending = np.zeros(shape), np.zeros(shape)
    area = area.reshape(su, gu, sv, gv).transpose(0, 2, 1, 3).reshape(su, sv, gu * gv)
    frame = frame.reshape(3, 5, su, gu, sv, gv).transpose(2, 4, 3, 5, 0, 1).reshape(su, sv, gu * gv, 3, 5)
    local = (p + 1) * (q + 1)
    rows = max(1, _BLOCK // (sv * gu * gv * local * 5))
    for begin in range(0, su, rows):
        part = slice(begin, begin + rows)
        root = np.sqrt(area[part])[..., None]
        table = _tables(net, along, part)
        values = (table[:, :, :, 0] * root).reshape(-1, gu * gv, local)
        _scatter(mass, values, along, part, net)
        bend = np.matmul(frame[part] * root[..., None], table[:, :, :, 1:])
        _scatter(bending, bend.reshape(-1, gu * gv * 3, local), along, part, net)
    periodic = net.u.periodic, net.v.periodic
    smooth, sharp = _kinks(net, metric, quadrature, creases)
    return Forms(_sparse(mass, periodic), _sparse(bending, periodic) + smooth, sharp)


def _kinks(net: Net, metric: Net, quadrature: Quadrature, creases: Sequence[Collection[float]]) -> tuple[Any, Any]:
    """Energies of kinks on knot lines of full multiplicity, those of creases apart."""
    from scipy.sparse import csr_array

    n = net.u.count * net.v.count
    found = [csr_array((n, n)), csr_array((n, n))]
    for axis in (0, 1):
        knots = (net.u, net.v)[axis]
        inner = knots.breaks[1:-1][knots.multiplicities[1:-1] >= knots.degree]
        for sharp in (False, True):
            lines = [t for t in inner if (t in creases[axis]) == sharp]
            if lines:
                found[sharp] = found[sharp] + _kink(net, metric, quadrature, axis, np.array(lines))
    return found[0], found[1]


def _kink(net: Net, metric: Net, quadrature: Quadrature, axis: int, lines: Array) -> Any:
    """``10³ ∫ [∂_n x]² / h`` on some knot lines of one direction."""
    from scipy.sparse import csr_array

    knots, total = (net.u, net.v)[axis], net.u.count * net.v.count
    uv, weight = _on_lines(quadrature, axis, knots, lines)
    sides: tuple[Side, Side] = ("left", "right")
    (index, low), (_, high) = halves = [_sloped(net, metric, uv, axis, side) for side in sides]
    row = np.repeat(np.arange(len(uv)), index.shape[1])
    place = np.concatenate([row, row]), np.concatenate([where.ravel() for where, _ in halves])
    jump = csr_array((np.concatenate([-low.slope.ravel(), high.slope.ravel()]), place), shape=(len(uv), total))
    near = np.searchsorted(knots.breaks, uv[:, axis])
    before, after = (knots.breaks[near + k + 1] - knots.breaks[near + k] for k in (-1, 0))
    step = 0.5 * (before * low.height + after * high.height)
    scaled = jump.multiply(np.sqrt(KINK_WEIGHT * high.length * weight / step)[:, None]).tocsr()
    return scaled.T @ scaled


def _on_lines(quadrature: Quadrature, axis: int, knots: KnotVector, lines: Array) -> tuple[Array, Array]:
    """Gauss points ``(q, 2)`` on knot lines and their weights: those on both sides of which a face lies."""
    across, along = (quadrature.u, quadrature.v)[:: 1 - 2 * axis]
    weight = (quadrature.wv, quadrature.wu)[axis]
    mask = quadrature.mask if axis == 0 else quadrature.mask.T
    points = np.concatenate([[-np.inf], across.ravel(), [np.inf]])
    above, near = np.searchsorted(points, lines), np.searchsorted(knots.breaks, lines)
    beside = (points[above - 1] > knots.breaks[near - 1]) & (points[above] < knots.breaks[near + 1])
    mask = np.pad(mask, ((1, 1), (0, 0)))
    seen = mask[above - 1] & mask[above] & beside[:, None]
    at, t = np.meshgrid(lines, along.ravel(), indexing="ij")
    uv = np.stack([at[seen], t[seen]][:: 1 - 2 * axis], axis=1)
    return uv, np.broadcast_to(weight.ravel(), at.shape)[seen]


@dataclass(frozen=True, eq=False)
class _Side:
    """One side of a line: the derivatives of the functions across it ``(q, k)``, by length; lengths ``(q,)`` by
    parameter across and along it."""

    slope: Array
    height: Array
    length: Array


def _sloped(net: Net, metric: Net, uv: Array, axis: int, side: Side) -> tuple[Array, _Side]:
    """Control points ``(q, k)`` and what their functions do on one side of lines."""
    limits: tuple[Side, Side] = (side, "right") if axis == 0 else ("right", side)
    xn, xt = metric.evaluate(uv, 1, limits)[1:][:: 1 - 2 * axis]
    e, f, g = ((a * b).sum(axis=1) for a, b in ((xn, xn), (xn, xt), (xt, xt)))
    g = np.maximum(g, 1e-300)
    height = np.sqrt(np.maximum(e - f * f / g, FLATTEST * e + 1e-300))
    index, table = functions(net, uv, 1, limits)
    dn, dt = table[1:][:: 1 - 2 * axis]
    return index, _Side((dn - (f / g)[:, None] * dt) / height[:, None], height, np.sqrt(g))


def _tables(net: Net, along: tuple[Sites, Sites], part: slice) -> Array:
    """Values and derivatives ``(s, sv, g, 6, local)`` of the rational basis on cells, by ``ORDERS``."""
    u, v = along[0].table[part], along[1].table
    shape = len(u), len(v), u.shape[1] * v.shape[1], -1
    table = [(u[:, None, :, None, a, :, None] * v[None, :, None, :, b, None, :]).reshape(shape) for a, b in ORDERS]
    if net.weights is not None:
        weights = net.weights.reshape(-1)[_index(net, along, part)][:, :, None]
        table = rational(table, np.broadcast_to(weights, table[0].shape))
    return np.stack(table, axis=3)


def _index(net: Net, along: tuple[Sites, Sites], part: slice) -> Array:
    """Control points ``(s, sv, local)`` of cells, row-major."""
    row = (along[0].first[part, None] + np.arange(net.u.degree + 1)) % net.u.count
    column = (along[1].first[:, None] + np.arange(net.v.degree + 1)) % net.v.count
    index = row[:, None, :, None] * net.v.count + column[None, :, None, :]
    return index.reshape(len(row), len(column), -1)


def _scatter(form: Array, values: Array, along: tuple[Sites, Sites], part: slice, net: Net) -> None:
    """Add ``valuesᵀ values`` of each cell to a form."""
    p, q = net.u.degree, net.v.degree
    square = np.matmul(values.swapaxes(1, 2), values)
    rows, columns = along[0].first[part], along[1].first
    square = square.reshape(len(rows), len(columns), p + 1, q + 1, p + 1, q + 1)
    for a in range(p + 1):
        row = ((rows + a) % net.u.count)[:, None]
        for b in range(q + 1):
            column = ((columns + b) % net.v.count)[None]
            stencil = form[:, :, p - a : 2 * p + 1 - a, q - b : 2 * q + 1 - b]
            if len(np.unique(row)) < len(row) or len(np.unique(column)) < column.size:
                np.add.at(stencil, (row, column), square[:, :, a, b])
            else:
                stencil[row, column] += square[:, :, a, b]


def _frames(metric: Net, along: tuple[Sites, Sites]) -> tuple[Array, Array]:
    """Coefficients ``(3, 5, qu, qv)`` of H̃_11, √2 H̃_12, H̃_22 on ∂_u, ∂_v, ∂_uu, ∂_uv, ∂_vv, and areas ``(qu, qv)``."""
    shape = along[0].at.size, along[1].at.size
    found = jets(metric, along[0].at, along[1].at, np.ones(shape, bool), np.zeros(3))
    xu, xv, xuu, xuv, xvv = found[1:6].reshape(5, 3, *shape[::-1]).transpose(0, 3, 2, 1)
    e, f, g = ((a * b).sum(axis=-1) for a, b in ((xu, xu), (xu, xv), (xv, xv)))
    root = np.sqrt(np.maximum(e * g - f * f, 0.0))
    # floors where the metric degenerates, so that nothing is divided by zero there
    mean_u, mean_v = (np.sqrt(np.median(x)) for x in (e, g))
    e, g = np.maximum(e, (FLATTEST**0.5 * mean_u) ** 2), np.maximum(g, (FLATTEST**0.5 * mean_v) ** 2)
    f = np.clip(f, -0.999 * np.sqrt(e * g), 0.999 * np.sqrt(e * g))
    det = e * g - f * f
    christoffel = []
    for second in (xuu, xuv, xvv):
        a, b = (second * xu).sum(axis=-1), (second * xv).sum(axis=-1)
        christoffel.append(((g * a - f * b) / det, (e * b - f * a) / det))
    p = 1 / np.sqrt(e)
    r = np.sqrt(e / det)
    q = -f / e * r
    zero, two = np.zeros_like(p), np.sqrt(2.0)
    rows = (
        (p * p, zero, zero),
        (two * p * q, two * p * r, zero),
        (q * q, 2 * q * r, r * r),
    )
    frame = np.empty((3, 5, *p.shape))
    for i, row in enumerate(rows):
        frame[i, 2:] = row
        for d in (0, 1):
            frame[i, d] = -sum(c * gamma[d] for c, gamma in zip(row, christoffel, strict=True))
    weight = along[0].weight.ravel()[:, None] * along[1].weight.ravel()
    return frame, root * weight


def _sparse(form: Array, periodic: tuple[bool, bool]) -> Any:
    """A stencil as ``scipy.sparse.csr_array`` on the control points in row-major order."""
    from scipy.sparse import csr_array

    nu, nv, wu, wv = form.shape
    i, j, down, right = np.nonzero(form)
    row, column = i + down - wu // 2, j + right - wv // 2
    if periodic[0]:
        row %= nu
    if periodic[1]:
        column %= nv
    return csr_array((form[i, j, down, right], (i * nv + j, row * nv + column)), shape=(nu * nv, nu * nv))
