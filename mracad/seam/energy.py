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
from mracad.compiled import pointer
from mracad.model.cells import Quadrature
from mracad.seam.integrals import Order, Sites, integrals, nothing, on_pattern, sites, sparse
from mracad.seam.kinks import FLATTEST, kinks
from mracad.seam.points import FRAME, SQUARE, bending, framed, limited, over_weights, product, root, squared
from mracad.seam.stretch import EVEN, Stretch

Array = np.ndarray

_AT_ONCE = 100_000
"""Points of the quadrature handled at a time."""

_VALUE, _REST = ORDERS[0], ORDERS[1:]
_MASS = ((_VALUE, _VALUE),)
_PAIRS: tuple[tuple[Order, Order], ...] = (
    *((a, b) for i, a in enumerate(_REST) for b in _REST[: i + 1]),
    *((a, _VALUE) for a in (*_REST, _VALUE)),
)
"""Orders of the products in a bending; those with values only if the surface is rational."""


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

    def sum(self, stiffness: float) -> Any:
        """M + stiffness · K."""
        from scipy.sparse import csr_array

        mass, bending = self.mass, self.bending
        if not stiffness:
            return mass
        if np.may_share_memory(bending.indices, mass.indices) and not self.creases.nnz:
            return csr_array((mass.data + stiffness * bending.data, mass.indices, mass.indptr), shape=mass.shape)
        return mass + stiffness * (bending + self.creases)


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
        density, bend = _densities(net, metric, along, mask, stretch, usual)
        integrals(along, _MASS, density[None], mass)
        integrals(along, _PAIRS[: len(bend)], bend, bending)
    smooth, sharp = kinks(net, metric, quadrature, creases, stretch)
    area, whole = sparse([mass, bending], net)
    return Forms(area, on_pattern(whole + smooth, area) if smooth.nnz else whole, sharp)


def masses(net: Net, quadrature: Quadrature) -> Forms:
    """Mass alone of displacements of a net in its own metric; parameters as for :func:`forms`."""
    from scipy.sparse import csr_array

    form = nothing(net.u, net.v)
    for along, mask in _blocks(net, quadrature):
        xu, xv = _jets(net, along, 1)[1:]
        e, f, g = product(xu, xu), product(xu, xv), product(xv, xv)
        area = np.sqrt(np.maximum(e * g - f * f, 0.0)) * _weights(along)
        if net.weights is not None:
            area = area / _jets(Net(net.u, net.v, net.weights[..., None]), along, 1)[0, 0] ** 2
        integrals(along, _MASS, np.where(mask, area, 0.0)[None], form)
    none = csr_array((net.u.count * net.v.count,) * 2)
    return Forms(sparse([form], net)[0], none, none)


def slopes(net: Net, metric: Net, quadrature: Quadrature) -> Any:
    """∫ |∇δ|² dA of displacements, ``scipy.sparse.csr_array``; parameters as for :func:`forms`."""
    along = sites(net.u, quadrature.u, quadrature.wu), sites(net.v, quadrature.v, quadrature.wv)
    xu, xv = _jets(metric, along)[1:3]
    area, _, _, _, p, q, r = framed(xu, xv, _least(np.median(product(xu, xu)), np.median(product(xv, xv))))
    none = np.zeros_like(area)
    nothing = none, none, none
    rows = (p, q, none), (none, r, none), nothing, nothing, nothing
    _, slope = _products(net, along, rows, np.where(quadrature.mask.T, area * _weights(along), 0.0))
    return sparse([integrals(along, _PAIRS[: len(slope)], slope)], net)[0]


def _blocks(net: Net, quadrature: Quadrature, inside: bool = True) -> Iterator[tuple[tuple[Sites, Sites], Array]]:
    """Pieces along u with some points on the faces (or all), for as many points as are handled at a time, and masks."""
    (pieces, points), across = quadrature.u.shape, sites(net.v, quadrature.v, quadrature.wv)
    step = max(1, _AT_ONCE // max(points * quadrature.v.size, 1))
    for begin in range(0, pieces, step):
        mask, part = quadrature.mask[begin * points : (begin + step) * points], slice(begin, begin + step)
        if not inside or mask.any():
            yield (sites(net.u, quadrature.u[part], quadrature.wu[part]), across), np.ascontiguousarray(mask.T)


def _usual(metric: Net, blocks: Iterable[tuple[Sites, Sites]]) -> tuple[Any, Any]:
    """Medians of |X_u|² and |X_v|² over all points."""
    found = [[product(x, x).ravel() for x in _jets(metric, along, 1)[1:]] for along in blocks]
    e, g = (np.concatenate(each) for each in zip(*found, strict=True))
    return np.median(e, overwrite_input=True), np.median(g, overwrite_input=True)


def _least(*usual: Any) -> tuple[float, float]:
    """Floors for |X_u|² and |X_v|² by what is usual."""
    one, other = (float((FLATTEST**0.5 * np.sqrt(each)) ** 2) for each in usual)
    return one, other


def _densities(
    net: Net,
    metric: Net,
    along: tuple[Sites, Sites],
    mask: Array,
    stretch: Stretch,
    usual: tuple[Any, Any] | None,
) -> tuple[Array, Array]:
    """Densities of the mass ``(qv, qu)``, and of the bending for the first of ``_PAIRS``, ``(pairs, qv, qu)``."""
    jet = _jets(metric, along)
    least = _least(*(usual or [np.median(product(x, x)) for x in jet[1:3]]))
    frame, points = np.empty((7, *mask.shape)), mask.size
    if FRAME.pays(points):
        FRAME(pointer(jet), points, *least, pointer(frame))
    else:
        frame[:] = framed(jet[1], jet[2], least)
    limit = stretch.limit
    bent = frame if limit is None else limit.shape(along[0].at, along[1].at, frame[4:])
    scale, least_sum = 0.0 if limit is None else limit.scale, max(stretch.lengths) ** -4.0
    lengths, lead = stretch.lengths[:: 1 - 2 * stretch.lead], float(stretch.lead)
    if SQUARE.pays(points):
        wv, wu = (np.ascontiguousarray(each.weight) for each in along[::-1])
        weights = jet if net.weights is None else _weighted(net, along)
        mass, found = np.zeros(mask.shape), np.zeros((15 if net.weights is None else 21, *mask.shape))
        SQUARE(
            pointer(jet), pointer(frame), pointer(mask), *lengths, lead, pointer(bent), scale, least_sum,
            limit is not None, pointer(wv), pointer(wu), pointer(weights), net.weights is not None, *mask.shape,
            pointer(mass), pointer(found),
        )  # fmt: skip
        return mass, found
    own = root(frame[1:4], lengths, lead)
    if limit is not None:
        own = limited(own, bent, scale, least_sum)
    rows = bending(jet[1:], frame[1:4], frame[4:], own)
    return _products(net, along, rows, np.where(mask, frame[0] * _weights(along), 0.0))


def _products(net: Net, along: tuple[Sites, Sites], rows: Any, area: Array) -> tuple[Array, Array]:
    """Densities of the mass, and of the square of a form with coefficients of five derivatives."""
    if net.weights is None:
        return area, np.stack(squared(rows, area))
    jet = _weighted(net, along)
    rows, value = over_weights(rows, jet)
    more = [product(each, value) * area for each in (*rows, value)]
    return area / (jet[0] * jet[0]), np.stack([*squared(rows, area), *more])


def _weighted(net: Net, along: tuple[Sites, Sites]) -> Array:
    """The weight of a net and its derivatives, ``(6, qv, qu)``."""
    assert net.weights is not None
    return _jets(Net(net.u, net.v, net.weights[..., None]), along)[:, 0]


def _jets(net: Net, along: tuple[Sites, Sites], most: int = 2) -> Array:
    """Points and derivatives ``(6, k, qv, qu)`` by ``ORDERS``, up to an order."""
    shape = along[0].at.size, along[1].at.size
    found = jets(net, along[0].at, along[1].at, np.ones(shape, bool), np.zeros(net.poles.shape[2]), most)
    return np.ascontiguousarray(found).reshape(*found.shape[:2], *shape[::-1])


def _weights(along: tuple[Sites, Sites]) -> Array:
    """Weights of pairs of parameters, ``(qv, qu)``."""
    return np.asarray(along[1].weight.reshape(-1, 1) * along[0].weight.ravel())
