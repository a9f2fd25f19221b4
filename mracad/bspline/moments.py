"""Areas, volumes and their first moments of trimmed NURBS faces.

Volumes are exact to rounding where nothing is rational.  The density of area is a root, so areas have relative errors
of some 1e-8, and of 1e-5 where a surface tapers to a tip.

By Green's theorem, with F(u, v) = ∫ f(s, v) ds from the beginning of the domain to u,

    ∬ f du dv = ∮ F dv   along the boundary.

Within a cell of the knot grid everything is smooth, so the boundary is cut where it crosses knot lines, and every piece
gets a Gauss rule.  The surface is evaluated only at the Gauss points of cells: they give the integrals over whole
spans, and the polynomials through them are integrated from the last knot line to the boundary.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import pairwise

import numpy as np
from numpy.polynomial.legendre import legvander

from mracad.bspline.basis import gauss_pieces, legendre
from mracad.bspline.curve import Curve, bezier_pieces
from mracad.bspline.knots import KnotVector
from mracad.bspline.surface import Net
from mracad.bspline.vectors import cross
from mracad.memo import kept

Array = np.ndarray

_BLOCK = 1 << 18  # points of the surface evaluated at once
_PARTS = 8  # into which a curved piece is divided to look for knot lines
_STEPS, _CLOSE = 50, 1e-13
_FLAT = 1e-12  # share of the domain within which a piece runs along a line v = const
_ORDER, _FEW = 8, 64  # least number of Gauss points; cells of nets that get as many as polynomials need
_WIDTH = 8  # of the integrands


def moments(net: Net, boundary: Sequence[tuple[Curve, int]]) -> Array:
    """Integrals over a face, S_u × S_v pointing outward.

    Parameters
    ----------
    net : Net
    boundary : sequence of (Curve, {1, -1})
        The curves of closed loops in ``u, v``, and whether each runs with the face on its left; none for the whole
        surface.

    Returns
    -------
    ndarray (8,)
        ∫ dA, ∫ x dA, ∫ x · n dA / 3, ∫ x (x · n) dA / 4: area, its first moment; volume towards the origin, its first
        moment.
    """
    points = _ORDER if net.u.spans * net.v.spans > _FEW else max(4 * max(net.u.degree, net.v.degree), 2 * _ORDER)
    uv, dv = _gauss(_pieces(net, boundary or _border(net)), points)
    total = np.zeros(_WIDTH)
    column, x, turns = _located(net.u, uv[..., 0])
    row, y, _ = _located(net.v, uv[..., 1])
    order = np.lexsort((column, row))
    order = order[np.abs(dv[order]).max(axis=1) > 0]
    column, row, turns = column[order], row[order], turns[order]
    across = _interpolating(y[order], points) * dv[order][..., None]
    whole = across.sum(axis=1)
    shares = (
        np.matmul(_integrating(x[order], points).swapaxes(1, 2), across) * np.diff(net.u.breaks)[column, None, None]
    )
    for rows in _blocks(net, points):
        here = slice(*np.searchsorted(row, [rows[0], rows[-1] + 1]))
        if len(row[here]):
            cells, before = _columns(net, rows, points)
            place = column[here], row[here] - rows[0]
            first = np.flatnonzero(np.diff(place[0] * len(rows) + place[1], prepend=-1))
            own = np.add.reduceat(shares[here], first, axis=0)
            total += np.einsum("qhg,qhgc->c", own, cells[place[0][first], place[1][first]])
            total += np.einsum(
                "qg,qgc->c", np.add.reduceat(whole[here], first, axis=0), before[place[0][first], place[1][first]]
            )
            if turns.any():
                total += np.einsum("qg,qgc->c", turns[here, None] * whole[here], before[-1, place[1]])
    return total


def _border(net: Net) -> list[tuple[Curve, int]]:
    """The boundary of the domain, without the lines along u, which add nothing."""
    low, high = net.v.domain
    knots = KnotVector([low, low, high, high], 1)
    return [(Curve(knots, np.array([[u, low], [u, high]])), way) for u, way in zip(net.u.domain, (-1, 1), strict=True)]


def _pieces(net: Net, boundary: Sequence[tuple[Curve, int]]) -> Iterator[tuple[Array, Array]]:
    """Homogeneous Bézier points ``(q, d + 1, 3)`` of pieces within cells, and the range ``(q, 2)`` of each in its own,
    with the face on the left."""
    ways = np.array([way for _, way in boundary])
    for points, owners in bezier_pieces([curve for curve, _ in boundary]):
        flat = np.ptp(points[..., 1] / points[..., 2], axis=1) <= _FLAT * net.v.period
        points, way = points[~flat], ways[owners[~flat]]
        count = 1 if points.shape[1] == 2 else _PARTS
        at = np.linspace(0.0, 1.0, count + 1)
        which, cuts = [np.repeat(np.arange(len(points)), 2)], [np.tile([0.0, 1.0], len(points))]
        for axis, kv in enumerate((net.u, net.v)):
            piece, cut = _crossings(points, at, axis, kv)
            which.append(piece)
            cuts.append(cut)
        owner, t = np.concatenate(which), np.concatenate(cuts)
        order = np.lexsort((t, owner))
        owner, t = owner[order], t[order]
        inside = (owner[1:] == owner[:-1]) & (t[1:] > t[:-1])
        ends = np.stack([t[:-1], t[1:]], axis=1)[inside]
        owner = owner[:-1][inside]
        yield points[owner], np.where(way[owner, None] > 0, ends, ends[:, ::-1])


def _crossings(points: Array, at: Array, axis: int, kv: KnotVector) -> tuple[Array, Array]:
    """Where Bézier pieces cross knot lines between given parameters: the piece, and its parameter."""
    values = _evaluated(points[:, None], np.broadcast_to(at, (len(points), len(at))))[0][..., axis]
    low, high = np.minimum(values[:, :-1], values[:, 1:]), np.maximum(values[:, :-1], values[:, 1:])
    knots = kv.breaks
    if kv.periodic and len(points):
        turns = np.arange(np.floor((low.min() - knots[0]) / kv.period), np.ceil((high.max() - knots[0]) / kv.period))
        knots = np.append((knots[:-1] + turns[:, None] * kv.period).ravel(), knots[0] + (turns[-1] + 1) * kv.period)
    first, last = np.searchsorted(knots, low, "right"), np.searchsorted(knots, high, "left")
    counts = np.maximum(last - first, 0)
    piece, part = (np.repeat(each.ravel(), counts.ravel()) for each in np.indices(counts.shape))
    number = np.arange(len(piece)) - np.repeat(np.cumsum(counts) - counts.ravel(), counts.ravel())
    wanted = knots[first[piece, part] + number]
    start, end = at[part], at[part + 1]
    if points.shape[1] == 2 and (points[..., 2] == 1.0).all():
        a, b = values[piece, part], values[piece, part + 1]
        return piece, start + (wanted - a) / (b - a) * (end - start)
    return piece, _found(points[piece], axis, wanted, start, end) if len(piece) else start


def _found(points: Array, axis: int, wanted: Array, start: Array, end: Array) -> Array:
    """Where Bézier pieces take values that they take once between two parameters: Newton's method within brackets."""
    rises = _evaluated(points, end)[0][..., axis] > wanted
    t = 0.5 * (start + end)
    for _ in range(_STEPS):
        value, slope = (each[..., axis] for each in _evaluated(points, t))
        below = (value < wanted) == rises
        start, end = np.where(below, t, start), np.where(below, end, t)
        with np.errstate(divide="ignore", invalid="ignore"):
            tried = t + (wanted - value) / slope
        new = np.where((tried > start) & (tried < end), tried, 0.5 * (start + end))
        t, old = new, t
        if np.abs(t - old).max() < _CLOSE:
            break
    return np.asarray(t)


def _evaluated(points: Array, t: Array) -> tuple[Array, Array]:
    """Points ``(…, 2)`` and derivatives of homogeneous Bézier pieces ``(…, d + 1, 3)`` at parameters."""
    degree = points.shape[-2] - 1
    t = t[..., None]
    rows = [points[..., k, :] for k in range(degree + 1)]
    while len(rows) > 2:
        rows = [a + t * (b - a) for a, b in pairwise(rows)]
    slope = degree * (rows[1] - rows[0])
    value = rows[0] + t * (rows[1] - rows[0])
    plane = value[..., :2] / value[..., 2:]
    return plane, (slope[..., :2] - plane * slope[..., 2:]) / value[..., 2:]


def _gauss(pieces: Iterator[tuple[Array, Array]], points: int) -> tuple[Array, Array]:
    """Gauss points ``(q, points, 2)`` along pieces, and weights times dv, ``(q, points)``."""
    nodes, weights = legendre(points)
    uv, dv = [np.empty((0, points, 2))], [np.empty((0, points))]
    for controls, ends in pieces:
        half = 0.5 * (ends[:, 1:] - ends[:, :1])
        plane, slope = _evaluated(controls[:, None], ends[:, :1] + half * (nodes + 1))
        uv.append(plane)
        dv.append(slope[..., 1] * half * weights)
    return np.concatenate(uv), np.concatenate(dv)


def _located(kv: KnotVector, at: Array) -> tuple[Array, Array, Array]:
    """The span in which each row of parameters lies by its middle, places within it from -1 to 1, and the periods by
    which periodic ones were moved to get there."""
    middle = at.mean(axis=1)
    turns = np.floor((middle - kv.breaks[0]) / kv.period) if kv.periodic else np.zeros(len(at))
    middle, at = middle - turns * kv.period, at - turns[:, None] * kv.period
    span = np.clip(np.searchsorted(kv.breaks, middle, "right") - 1, 0, kv.spans - 1)
    low, high = kv.breaks[span, None], kv.breaks[span + 1, None]
    return span, (2 * at - low - high) / (high - low), turns


def _blocks(net: Net, points: int) -> Iterator[Array]:
    """Rows of cells, as many together as are evaluated at once."""
    size = max(_BLOCK // (net.u.spans * points**2), 1)
    return (np.arange(first, min(first + size, net.v.spans)) for first in range(0, net.v.spans, size))


def _columns(net: Net, rows: Array, points: int) -> tuple[Array, Array]:
    """The integrands at the Gauss points of rows of cells, ``(spans, rows, points_u, points_v, 8)``, and F at the knots
    of u, ``(spans + 1, rows, points_v, 8)``."""
    offset_u, weights = gauss_pieces(net.u.breaks, points)
    offset_v, _ = gauss_pieces(net.v.breaks[rows[0] : rows[-1] + 2], points)
    us, vs = (net.u.breaks[:-1, None] + offset_u).ravel(), (net.v.breaks[rows, None] + offset_v).ravel()
    found = _integrands(*net.grid(us, vs, 1)).reshape(-1, points, len(rows), points, _WIDTH)
    spans = np.einsum("sg,sgrvc->srvc", weights, found)
    return found.swapaxes(1, 2), np.concatenate([np.zeros((1, *spans.shape[1:])), np.cumsum(spans, axis=0)])


def _integrands(s: Array, su: Array, sv: Array) -> Array:
    """What is integrated, at points ``(…, 3)``."""
    normal = cross(su, sv)
    size = np.sqrt((normal * normal).sum(axis=-1, keepdims=True))
    flux = (s * normal).sum(axis=-1, keepdims=True)
    return np.concatenate([size, size * s, flux / 3, flux / 4 * s], axis=-1)


def _interpolating(x: Array, points: int) -> Array:
    """Weights of values at Gauss points for the polynomial through them, at places ``(q, b)``, ``(q, b, points)``."""
    return np.asarray(legvander(x, points - 1) @ _series(points))


def _integrating(x: Array, points: int) -> Array:
    """Weights for half its integral from -1 to places: for spans of length 1."""
    values = legvander(x, points)
    order = np.arange(points)
    below = np.concatenate([-np.ones_like(values[..., :1]), values[..., : points - 1]], axis=-1)
    return np.asarray(0.5 * ((values[..., 1:] - below) / (2 * order + 1)) @ _series(points))


@kept(32)
def _series(points: int) -> Array:
    """Legendre coefficients of the polynomials that are 1 at one Gauss point, ``(order, points)``."""
    nodes, weights = legendre(points)
    return np.asarray(legvander(nodes, points - 1).T * weights * (np.arange(points)[:, None] + 0.5))
