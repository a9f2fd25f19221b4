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

from mracad.bspline.functions import ORDERS
from mracad.bspline.jets import jets
from mracad.bspline.surface import Net
from mracad.model.cells import Quadrature
from mracad.seam.integrals import Order, Sites, integrals, nothing, on_pattern, sites, sparse
from mracad.seam.kinks import FLATTEST, kinks
from mracad.seam.stretch import EVEN, Stretch

Array = np.ndarray

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
    smooth, sharp = kinks(net, metric, quadrature, creases, stretch)
    area, whole = sparse([mass, bending], net)
    return Forms(area, on_pattern(whole + smooth, area) if smooth.nnz else whole, sharp)


def masses(net: Net, quadrature: Quadrature) -> Forms:
    """Mass alone of displacements of a net in its own metric; parameters as for :func:`forms`."""
    from scipy.sparse import csr_array

    form = nothing(net.u, net.v)
    for along, mask in _blocks(net, quadrature):
        xu, xv = _jets(net, along, 1)[1:]
        e, f, g = _dot(xu, xu), _dot(xu, xv), _dot(xv, xv)
        area = np.sqrt(np.maximum(e * g - f * f, 0.0)) * _weights(along)
        if net.weights is not None:
            area = area / _jets(Net(net.u, net.v, net.weights[..., None]), along)[0, 0] ** 2
        integrals(along, {(ORDERS[0], ORDERS[0]): np.where(mask, area, 0.0)}, form)
    none = csr_array((net.u.count * net.v.count,) * 2)
    return Forms(sparse([form], net)[0], none, none)


def slopes(net: Net, metric: Net, quadrature: Quadrature) -> Any:
    """∫ |∇δ|² dA of displacements, ``scipy.sparse.csr_array``; parameters as for :func:`forms`."""
    along = sites(net.u, quadrature.u, quadrature.wu), sites(net.v, quadrature.v, quadrature.wv)
    xu, xv = _jets(metric, along)[1:3]
    e, f, g = _dot(xu, xu), _dot(xu, xv), _dot(xv, xv)
    area = np.sqrt(np.maximum(e * g - f * f, 0.0)) * _weights(along)
    e, f, g = _floored(e, f, g, (np.median(e), np.median(g)))
    frame = np.zeros((5, 3, *e.shape))
    frame[0, 0], frame[1, 1] = 1 / np.sqrt(e), np.sqrt(e / (e * g - f * f))
    frame[0, 1] = -f / e * frame[1, 1]
    _, slope = _squared(net, along, np.where(quadrature.mask, area, 0.0), frame)
    return sparse([integrals(along, slope)], net)[0]


def _blocks(net: Net, quadrature: Quadrature, inside: bool = True) -> Iterator[tuple[tuple[Sites, Sites], Array]]:
    """Pieces along u with some points on the faces (or all), for as many points as are handled at a time, and masks."""
    (pieces, points), across = quadrature.u.shape, sites(net.v, quadrature.v, quadrature.wv)
    step = max(1, _AT_ONCE // max(points * quadrature.v.size, 1))
    for begin in range(0, pieces, step):
        mask, part = quadrature.mask[begin * points : (begin + step) * points], slice(begin, begin + step)
        if not inside or mask.any():
            yield (sites(net.u, quadrature.u[part], quadrature.wu[part]), across), np.ascontiguousarray(mask.T).T


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
    squares: dict[tuple[Order, Order], Array] = {}
    for i, a in enumerate(orders):
        products = (frame[i] * frame[: i + 1]).sum(axis=1)
        squares |= {(a, b): product for b, product in zip(orders, products, strict=False)}
    return mass, squares


def _usual(metric: Net, blocks: Iterable[tuple[Sites, Sites]]) -> tuple[Any, Any]:
    """Medians of |X_u|² and |X_v|² over all points."""
    found = [[_dot(x, x).ravel() for x in _jets(metric, along, 1)[1:]] for along in blocks]
    e, g = (np.concatenate(each) for each in zip(*found, strict=True))
    return np.median(e, overwrite_input=True), np.median(g, overwrite_input=True)


def _frames(
    metric: Net, along: tuple[Sites, Sites], stretch: Stretch, usual: tuple[Any, Any] | None = None
) -> tuple[Array, Array]:
    """Coefficients in H̃_11, √2 H̃_12, H̃_22 of ∂_u, ∂_v, ∂_uu, ∂_uv, ∂_vv, ``(5, 3, qu, qv)``; areas ``(qu, qv)``."""
    _, xu, xv, *seconds = _jets(metric, along)
    e, f, g = _dot(xu, xu), _dot(xu, xv), _dot(xv, xv)
    area = np.sqrt(np.maximum(e * g - f * f, 0.0)) * _weights(along)
    e, f, g = _floored(e, f, g, usual or (np.median(e), np.median(g)))
    det = e * g - f * f
    p, r = 1 / np.sqrt(e), np.sqrt(e / det)
    x, y, skew = (p, -f / e * r), (0.0, r), 2.0**0.5
    if not stretch.plain:
        a, b, c = stretch.root(along[0].at, along[1].at, (e, f, g), (p, x[1], r))
        x, y = (x[0] * a + x[1] * b, x[0] * b + x[1] * c), (r * b, r * c)  # the frame, times R
    frame = np.empty((5, 3, *p.shape[::-1])).swapaxes(2, 3)
    for row, (i, j, factor) in enumerate(((0, 0, 1.0), (0, 1, skew), (1, 1, 1.0))):
        frame[2, row] = factor * x[i] * x[j]
        frame[3, row] = factor * (x[i] * y[j] + x[j] * y[i])
        frame[4, row] = factor * y[i] * y[j]
    dots = [(_dot(second, xu) / det, _dot(second, xv) / det) for second in seconds]
    for slope, christoffel in zip(
        frame, ([g * a - f * b for a, b in dots], [e * b - f * a for a, b in dots]), strict=False
    ):
        np.multiply(frame[2], -christoffel[0], out=slope)
        slope -= frame[3] * christoffel[1]
        slope -= frame[4] * christoffel[2]
    return frame, area


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
    """Points and derivatives ``(6, k, qu, qv)`` by ``ORDERS``, up to an order; in memory u is fastest, as integrals
    want it."""
    shape = along[0].at.size, along[1].at.size
    found = jets(net, along[0].at, along[1].at, np.ones(shape, bool), np.zeros(net.poles.shape[2]), most)
    return found.reshape(*found.shape[:2], *shape[::-1]).swapaxes(2, 3)


def _weights(along: tuple[Sites, Sites]) -> Array:
    """Weights of pairs of parameters, ``(qu, qv)``."""
    return np.asarray((along[1].weight.reshape(-1, 1) * along[0].weight.ravel()).T)


def _dot(a: Array, b: Array) -> Array:
    return np.asarray(a[0] * b[0] + a[1] * b[1] + a[2] * b[2])
