"""Mass and bending energy of displacements of a surface, over the part that its faces cover.

On a surface X (the metric: a smoothed copy of the edited one) with first fundamental form g and Christoffel symbols Γ,

    M_ij = ∫ R_i R_j dA,    K_ij = ∫ Σ_ab H̃_ab(R_i) H̃_ab(R_j) dA,    H̃ = L⁻¹ (∂_ab − Γ^d_ab ∂_d) L⁻ᵀ,    g = L Lᵀ,

R_i the (rational) basis functions of the edited net, dA = √det g du dv inside the trims, by Gauss points on every knot
span.  The energy of second derivatives is covariant: independent of the parameters.  On knot lines of multiplicity
≥ degree, where second derivatives do not measure a kink, K gets 10³ ∫ [∂_n x]² / h, h the spans beside the line.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from mracad.bspline.functions import ORDERS, functions
from mracad.bspline.jets import jets
from mracad.bspline.knots import KnotVector, Side
from mracad.bspline.surface import Net
from mracad.memo import kept
from mracad.model.cells import Quadrature
from mracad.seam.integrals import Order, Sites, integrals, nothing, sites
from mracad.seam.stretch import EVEN, Stretch, stretched

Array = np.ndarray

KINK_WEIGHT = 1e3
"""Weight of squared kinks on knot lines against squared curvature."""

FLATTEST = 1e-4
"""Least ratio of the metric's singular values: where it is smaller (at poles), the shorter direction is floored."""


_AT_ONCE = 100_000
"""Points of the quadrature handled at a time."""


@dataclass(frozen=True, eq=False)
class Forms:
    """Forms of one surface, ``scipy.sparse.csr_array`` over its control points in row-major order.

    Attributes
    ----------
    mass : csr_array (points, points)
        mm².
    bending : csr_array (points, points)
        1/mm², with the kinks on knot lines that are no crease.
    creases : csr_array (points, points)
        Kinks on creases.
    """

    mass: Any
    bending: Any
    creases: Any


def forms(
    net: Net,
    metric: Net,
    quadrature: Quadrature,
    creases: Sequence[Collection[float]] = ((), ()),
    stretch: Stretch = EVEN,
) -> Forms:
    """Mass and bending of displacements of ``net``.

    Parameters
    ----------
    net : Net
        Its knots, degrees and weights define the basis.
    metric : Net
        The surface whose metric is used, over the same parameters.
    quadrature : Quadrature
        Gauss points over the faces on it.
    creases : pair of collections of float
        Knots in u and v on which the surface has a crease: only a displacement's own kink counts there.
    stretch : Stretch
        Lengths by direction in the bending.
    """
    mass, bending = nothing(net.u, net.v), nothing(net.u, net.v)
    blocks = list(_blocks(net, quadrature))
    usual = _usual(metric, [along for along, _ in _blocks(net, quadrature, False)]) if len(blocks) > 1 else None
    for along, mask in blocks:
        frame, area = _frames(metric, along, stretch, usual)
        density, bend = _squared(net, along, np.where(mask, area, 0.0), frame)
        integrals(along, {(ORDERS[0], ORDERS[0]): density}, mass)
        integrals(along, bend, bending)
    periodic, scale = (net.u.periodic, net.v.periodic), net.weights
    smooth, sharp = _kinks(net, metric, quadrature, creases, stretch)
    area, whole = _sparse(mass, periodic, scale), _sparse(bending, periodic, scale)
    return Forms(area, whole + smooth if smooth.nnz else on_pattern(whole, area), sharp)


def masses(net: Net, quadrature: Quadrature) -> Forms:
    """Mass alone of displacements of a net in its own metric; parameters as for :func:`forms`."""
    from scipy.sparse import csr_array

    form = nothing(net.u, net.v)
    for along, mask in _blocks(net, quadrature):
        xu, xv = _jets(net, along, 1)[1:]
        e, f, g = _dot(xu, xu), _dot(xu, xv), _dot(xv, xv)
        area = np.sqrt(np.maximum(e * g - f * f, 0.0)) * (along[0].weight.reshape(-1, 1) * along[1].weight.ravel())
        if net.weights is not None:
            area = area / _jets(Net(net.u, net.v, net.weights[..., None]), along)[0, 0] ** 2
        integrals(along, {(ORDERS[0], ORDERS[0]): np.where(mask, area, 0.0)}, form)
    none = csr_array((net.u.count * net.v.count,) * 2)
    return Forms(_sparse(form, (net.u.periodic, net.v.periodic), net.weights), none, none)


def slopes(net: Net, metric: Net, quadrature: Quadrature) -> Any:
    """∫ |∇δ|² dA of displacements, ``scipy.sparse.csr_array``; parameters as for :func:`forms`."""
    along = sites(net.u, quadrature.u, quadrature.wu), sites(net.v, quadrature.v, quadrature.wv)
    xu, xv = _jets(metric, along)[1:3]
    e, f, g = _dot(xu, xu), _dot(xu, xv), _dot(xv, xv)
    area = np.sqrt(np.maximum(e * g - f * f, 0.0)) * (along[0].weight.reshape(-1, 1) * along[1].weight.ravel())
    e, f, g = _floored(e, f, g, (np.median(e), np.median(g)))
    frame = np.zeros((5, 3, *e.shape))
    frame[0, 0], frame[1, 1] = 1 / np.sqrt(e), np.sqrt(e / (e * g - f * f))
    frame[0, 1] = -f / e * frame[1, 1]
    _, slope = _squared(net, along, np.where(quadrature.mask, area, 0.0), frame)
    return _sparse(integrals(along, slope), (net.u.periodic, net.v.periodic), net.weights)


def _blocks(net: Net, quadrature: Quadrature, inside: bool = True) -> Iterator[tuple[tuple[Sites, Sites], Array]]:
    """Pieces along u with some points on the faces (or all), for as many points as are handled at a time, and masks."""
    (pieces, points), across = quadrature.u.shape, sites(net.v, quadrature.v, quadrature.wv)
    step = max(1, _AT_ONCE // max(points * quadrature.v.size, 1))
    for begin in range(0, pieces, step):
        mask, part = quadrature.mask[begin * points : (begin + step) * points], slice(begin, begin + step)
        if not inside or mask.any():
            yield (sites(net.u, quadrature.u[part], quadrature.wu[part]), across), mask


def _squared(
    net: Net, along: tuple[Sites, Sites], area: Array, frame: Array
) -> tuple[Array, dict[tuple[Order, Order], Array]]:
    """Densities of the mass, and of the square of a form with coefficients ``(5, 3, qu, qv)`` of derivatives, by their
    orders."""
    orders: tuple[Order, ...] = ORDERS[1:]
    mass = area
    if net.weights is not None:
        orders = ORDERS
        mass, frame = _over_weights(net, net.weights, along, area, frame)
    frame = frame * np.sqrt(area)
    return mass, {(a, b): _dot(frame[i], frame[j]) for i, a in enumerate(orders) for j, b in enumerate(orders[: i + 1])}


def _kinks(
    net: Net, metric: Net, quadrature: Quadrature, creases: Sequence[Collection[float]], stretch: Stretch
) -> tuple[Any, Any]:
    """Energies of kinks on knot lines of full multiplicity; those of creases separately."""
    found = [_nothing(net.u.count * net.v.count)] * 2
    for axis in (0, 1):
        full = (net.u, net.v)[axis].full
        for sharp in (False, True):
            lines = [t for t in full if (t in creases[axis]) == sharp]
            if lines:
                kink = _kink(net, metric, quadrature, axis, np.array(lines))
                found[sharp] = found[sharp] + stretch.lengths[axis] ** 4 * kink
    return found[0], found[1]


@kept(16)
def _nothing(n: int) -> Any:
    from scipy.sparse import csr_array

    return csr_array((n, n))


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
    breaks = _onwards(knots)
    near = np.searchsorted(breaks, uv[:, axis])
    before, after = (breaks[near + k + 1] - breaks[near + k] for k in (-1, 0))
    step = 0.5 * (before * low.height + after * high.height)
    scaled = jump.multiply(np.sqrt(KINK_WEIGHT * high.length * weight / step)[:, None]).tocsr()
    return scaled.T @ scaled


def _onwards(knots: KnotVector) -> Array:
    """The breaks; in a periodic direction also the first one of the next turn."""
    return np.append(knots.breaks, knots.breaks[1] + knots.period) if knots.periodic else knots.breaks


def _on_lines(quadrature: Quadrature, axis: int, knots: KnotVector, lines: Array) -> tuple[Array, Array]:
    """Gauss points ``(q, 2)`` on knot lines with a face on both sides, and their weights."""
    across, along = (quadrature.u, quadrature.v)[:: 1 - 2 * axis]
    weight = (quadrature.wv, quadrature.wu)[axis]
    mask = quadrature.mask if axis == 0 else quadrature.mask.T
    breaks, after = _onwards(knots), across.ravel()[0] + knots.period if knots.periodic else np.inf
    points = np.concatenate([[-np.inf], across.ravel(), [after]])
    above, near = np.searchsorted(points, lines), np.searchsorted(breaks, lines)
    beside = (points[above - 1] > breaks[near - 1]) & (points[above] < breaks[near + 1])
    mask = np.concatenate([np.zeros_like(mask[:1]), mask, mask[:1] if knots.periodic else np.zeros_like(mask[:1])])
    seen = mask[above - 1] & mask[above] & beside[:, None]
    at, t = np.meshgrid(lines, along.ravel(), indexing="ij")
    uv = np.stack([at[seen], t[seen]][:: 1 - 2 * axis], axis=1)
    return uv, np.broadcast_to(weight.ravel(), at.shape)[seen]


@dataclass(frozen=True, eq=False)
class _Side:
    """One side of a line: derivatives of the functions across it by length ``(q, k)``, and lengths per parameter across
    and along it ``(q,)``."""

    slope: Array
    height: Array
    length: Array


def _sloped(net: Net, metric: Net, uv: Array, axis: int, side: Side) -> tuple[Array, _Side]:
    """Control points ``(q, k)``, and their functions on one side of lines."""
    limits: tuple[Side, Side] = (side, "right") if axis == 0 else ("right", side)
    xn, xt = metric.evaluate(uv, 1, limits)[1:][:: 1 - 2 * axis]
    e, f, g = ((a * b).sum(axis=1) for a, b in ((xn, xn), (xn, xt), (xt, xt)))
    g = np.maximum(g, 1e-300)
    height = np.sqrt(np.maximum(e - f * f / g, FLATTEST * e + 1e-300))
    index, table = functions(net, uv, 1, limits)
    dn, dt = table[1:][:: 1 - 2 * axis]
    return index, _Side((dn - (f / g)[:, None] * dt) / height[:, None], height, np.sqrt(g))


def _usual(metric: Net, blocks: Iterable[tuple[Sites, Sites]]) -> tuple[Any, Any]:
    """Medians of |X_u|² and |X_v|² over all points."""
    found = [[_dot(x, x).ravel() for x in _jets(metric, along, 1)[1:]] for along in blocks]
    e, g = (np.concatenate(each) for each in zip(*found, strict=True))
    return np.median(e, overwrite_input=True), np.median(g, overwrite_input=True)


def _frames(
    metric: Net, along: tuple[Sites, Sites], stretch: Stretch, usual: tuple[Any, Any] | None = None
) -> tuple[Array, Array]:
    """Coefficients in H̃_11, √2 H̃_12, H̃_22 of ∂_u, ∂_v, ∂_uu, ∂_uv, ∂_vv, ``(5, 3, qu, qv)``; areas ``(qu, qv)``."""
    xu, xv, xuu, xuv, xvv = _jets(metric, along)[1:]
    e, f, g = _dot(xu, xu), _dot(xu, xv), _dot(xv, xv)
    root = np.sqrt(np.maximum(e * g - f * f, 0.0))
    e, f, g = _floored(e, f, g, usual or (np.median(e), np.median(g)))
    det = e * g - f * f
    christoffel = []
    for second in (xuu, xuv, xvv):
        a, b = _dot(second, xu), _dot(second, xv)
        christoffel.append(((g * a - f * b) / det, (e * b - f * a) / det))
    p = 1 / np.sqrt(e)
    r = np.sqrt(e / det)
    q = -f / e * r
    two = np.sqrt(2.0)
    rows = (p * p,), (two * p * q, two * p * r), (q * q, 2 * q * r, r * r)
    frame = np.zeros((5, 3, *p.shape))
    for i, row in enumerate(rows):
        for k, value in enumerate(row):
            frame[2 + k, i] = value
            for d in (0, 1):
                frame[d, i] -= value * christoffel[k][d]
    if not stretch.plain:
        frame = stretched(frame, stretch.root(along[0].at, along[1].at, (e, f, g), (p, q, r)))
    return frame, root * (along[0].weight.reshape(-1, 1) * along[1].weight.ravel())


def _floored(e: Array, f: Array, g: Array, usual: tuple[Any, Any]) -> tuple[Array, Array, Array]:
    """A first fundamental form, with floors against division by zero where it is far below its usual e and g."""
    mean_u, mean_v = np.sqrt(usual)
    e, g = np.maximum(e, (FLATTEST**0.5 * mean_u) ** 2), np.maximum(g, (FLATTEST**0.5 * mean_v) ** 2)
    return e, np.clip(f, -0.999 * np.sqrt(e * g), 0.999 * np.sqrt(e * g)), g


def _over_weights(
    net: Net, weights: Array, along: tuple[Sites, Sites], area: Array, frame: Array
) -> tuple[Array, Array]:
    """Coefficients of mass and frames for w_i B_i / w, in terms of w_i B_i and its derivatives, ``(6, 3, qu, qv)``."""
    w, wu, wv, wuu, wuv, wvv = _jets(Net(net.u, net.v, weights[..., None]), along)[:, 0]
    fu, fv, fuu, fuv, fvv = frame / w
    lu, lv = wu / w, wv / w
    slope_u, slope_v = fu - 2 * fuu * lu - fuv * lv, fv - fuv * lu - 2 * fvv * lv
    value = -(slope_u * lu + slope_v * lv) - (fuu * wuu + fuv * wuv + fvv * wvv) / w
    return area / w**2, np.stack([value, slope_u, slope_v, fuu, fuv, fvv])


def _jets(net: Net, along: tuple[Sites, Sites], most: int = 2) -> Array:
    """Points and derivatives ``(6, k, qu, qv)`` by ``ORDERS``, up to an order."""
    shape = along[0].at.size, along[1].at.size
    found = jets(net, along[0].at, along[1].at, np.ones(shape, bool), np.zeros(net.poles.shape[2]), most)
    return np.ascontiguousarray(found.reshape(*found.shape[:2], *shape[::-1]).swapaxes(2, 3))


def _dot(a: Array, b: Array) -> Array:
    return np.asarray(a[0] * b[0] + a[1] * b[1] + a[2] * b[2])


def on_pattern(form: Any, like: Any) -> Any:
    """The matrix, sharing the index arrays of another one if the patterns are equal."""
    from scipy.sparse import csr_array

    same = np.array_equal(form.indptr, like.indptr) and np.array_equal(form.indices, like.indices)
    return csr_array((form.data, like.indices, like.indptr), shape=form.shape) if same else form


def _sparse(form: Array, periodic: tuple[bool, bool], scale: Array | None) -> Any:
    """A stencil as ``scipy.sparse.csr_array`` on the control points in row-major order, scaled from both sides."""
    from scipy.sparse import csr_array

    nu, nv, wu, wv = form.shape
    row, column = (
        ((np.arange(n)[:, None] + np.arange(w) - w // 2) % n).astype(np.int32) for n, w in ((nu, wu), (nv, wv))
    )
    at = row[:, None, :, None] * np.int32(nv) + column[:, None]
    if scale is not None:
        form = form * scale[:, :, None, None] * scale.ravel()[at]
    there = form != 0
    ends = np.append(0, np.count_nonzero(there.reshape(nu * nv, -1), axis=1).cumsum()).astype(np.int32)
    found = csr_array((form[there], at[there], ends), shape=(nu * nv, nu * nv))
    if any(periodic):
        found.sum_duplicates()
    return found
