"""Splines with given values at the Greville points, and spans divided until they also fit between them."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from mracad.bspline.basis import basis
from mracad.bspline.curve import Curve
from mracad.bspline.knots import Array, KnotVector
from mracad.bspline.solve import BandSolver, folded
from mracad.bspline.surface import Net, pairs
from mracad.memo import kept

Knots = tuple[KnotVector, KnotVector]
"""Knots in u and v."""

Sites = Sequence[tuple[Array, Array]]
"""For each direction: parameters, and the spans that contain them."""

SPARE = 1.5
"""Factor on the necessary width up to which spans are not divided."""

ROUNDS, PIECES = 5, 6
"""How often spans are divided, and the largest number of pieces each time."""


def interpolated(u: KnotVector, v: KnotVector, values: Array) -> Array:
    """Control points ``(nu, nv, k)`` of the polynomial surface with ``values`` at the Greville points of both."""
    return np.asarray(_solver(v).solve(_solver(u).solve(values, 0), 1))


def curve_through(knots: KnotVector, values: Array) -> Curve:
    """The curve with values ``(n, k)`` at the Greville points of its knots."""
    return Curve(knots, np.asarray(_solver(knots).solve(values, 0)))


def through(net: Net, values: Array) -> Array:
    """Control points ``(nu, nv, k)`` over the knots, and with the weights, of a net that give values at its Greville
    points."""
    if net.weights is None:
        return interpolated(net.u, net.v, values)
    weights = net.weights[..., None]
    values = values * np.asarray(Net(net.u, net.v, weights).grid(net.u.greville(), net.v.greville()))
    return np.asarray(interpolated(net.u, net.v, values) / weights)


def divided(
    knots: tuple[KnotVector, KnotVector], more: Callable[..., Sequence[Array]]
) -> tuple[KnotVector, KnotVector]:
    """Knots with those that ``more`` adds, repeated a few times."""
    for _ in range(ROUNDS):
        extra = more(knots)
        if not any(map(len, extra)):
            break
        knots = knots[0].refined(extra[0]), knots[1].refined(extra[1])
    return knots


def offsets_over(net: Net, knots: Knots, poles: Array) -> Net:
    """The surface of offsets with given control points over finer knots of a surface."""
    return Net(*knots, poles, net.over(*knots).weights)


def middles(u: KnotVector, v: KnotVector) -> Array:
    """Parameters ``(q, 2)`` half-way between neighbouring Greville points of both directions."""
    return pairs(*((x[1:] + x[:-1]) / 2 for x in (np.sort(k.greville()) for k in (u, v))))


def missing(
    net: Net, delta: Net, sites: Sites, ideal: Callable[[Array], Array], limit: float, least: Sequence[float]
) -> list[Array]:
    """Knots that divide the spans in which offsets miss the ideal.

    Parameters
    ----------
    net, delta : Net
        The surface, and offsets over it.
    sites : Sites
        Places at which they are compared.
    ideal : callable
        The displacement ``(q, 3)`` at parameters.
    limit : float
        Allowed error, mm.
    least : pair of float
        Least width of spans in u and v, mm.
    """
    more = []
    for axis, (kv, (uv, span)) in enumerate(zip((delta.u, delta.v), sites, strict=True)):
        missed = np.linalg.norm(np.asarray(delta.evaluate(uv)) - ideal(uv), axis=1)
        speed = np.linalg.norm(net.evaluate(uv, 1)[1 + axis], axis=1)
        more.append(split(kv, span, missed / limit, speed, least[axis]))
    return more


def spans(kv: KnotVector, x: Array) -> Array:
    """Indices of the spans in which parameters lie."""
    return np.clip(np.searchsorted(kv.breaks, x, side="right") - 1, 0, kv.spans - 1)


def split(kv: KnotVector, span: Array, missed: Array, speed: Array, least: float) -> Array:
    """Knots that divide spans until their errors are allowed, none narrower than necessary.

    Parameters
    ----------
    kv : KnotVector
    span : ndarray (q,) of int
        Spans of the points.
    missed : ndarray (q,)
        Errors of the points, over the allowed error.
    speed : ndarray (q,)
        Length by parameter there.
    least : float
        Least width of a span, mm.
    """
    worst, fastest = np.zeros(kv.spans), np.zeros(kv.spans)
    np.maximum.at(worst, span, missed)
    np.maximum.at(fastest, span, speed)
    width = fastest * np.diff(kv.breaks)
    most = np.where(width > SPARE * least, np.ceil(width / least), 1.0)
    pieces = np.clip(np.ceil(worst ** (1 / (kv.degree + 1))), 1, PIECES)
    return evenly(kv, np.minimum(pieces, most).astype(int))


def evenly(kv: KnotVector, pieces: Array) -> Array:
    """Knots that divide each span into equal pieces."""
    found = [
        low + (high - low) * np.arange(1, k) / k
        for low, high, k in zip(kv.breaks[:-1], kv.breaks[1:], pieces, strict=True)
        if k > 1
    ]
    return np.concatenate(found) if found else np.empty(0)


@kept(64)
def _solver(kv: KnotVector) -> BandSolver:
    first, values = basis(kv, kv.greville())
    n, width = values.shape
    row = np.repeat(np.arange(n), width)
    column = (first[:, None] + np.arange(width)).ravel() % n
    order = folded(n) if kv.periodic else np.arange(n)
    if kv.periodic and width > n:
        dense = np.zeros((n, n))
        np.add.at(dense, (row, column), values.ravel())
        row, column = np.nonzero(dense)
        return BandSolver(row, column, dense[row, column], order, order)
    return BandSolver(row, column, values.ravel(), order, order)
