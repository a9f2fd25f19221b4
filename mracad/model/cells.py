"""A trimmed face in the knot grid of its surface: which parameters lie on it, and quadrature over it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from mracad.bspline.basis import legendre
from mracad.bspline.knots import KnotVector
from mracad.bspline.surface import Net
from mracad.memo import kept
from mracad.model.brep import Face
from mracad.model.outline import MARGIN, Outline, outline

Array = np.ndarray

PIECES = 4
"""Least number of pieces into which the extent of a trimmed face is divided in either direction."""

ENOUGH = 16
"""Least number of quadrature points on a face; pieces are halved up to ``HALVINGS`` times to reach it."""

HALVINGS = 5

NARROW = 8
"""Margins that a face is wide at least."""

ASIDE = 1e-3
"""Fraction of a piece by which points on its ends are moved inside, because boundaries run along ends."""


@dataclass(frozen=True, eq=False)
class Quadrature:
    """Gauss points over faces of one surface.

    The pieces are the knot spans that the faces touch, cut where boundaries run along them and where a face is much
    smaller than they are; each lies within one span.

    Attributes
    ----------
    u, v : ndarray (pieces, points)
        Parameters, ascending, in the domain.
    wu, wv : ndarray (pieces, points)
        Weights, in parameter units.
    mask : ndarray of bool (pieces_u · points_u, pieces_v · points_v)
        Whether a pair of them lies on one of the faces.
    """

    u: Array
    v: Array
    wu: Array
    wv: Array
    mask: Array

    @property
    def weights(self) -> Array:
        """Weights of all pairs of parameters, zero outside the faces, in the shape of ``mask``."""
        return np.asarray(self.wu.reshape(-1, 1) * self.wv.reshape(-1) * self.mask)


def inside_grid(face: Face, net: Net, u: Array, v: Array) -> Array:
    """Whether pairs of parameters lie on a face.

    Parameters
    ----------
    face : Face
        The face; without a boundary it is the whole surface.
    net : Net
        Its surface, or a refinement of it.
    u, v : ndarray (nu,), (nv,)
        Parameters in any order; in periodic directions those of any period.

    Returns
    -------
    ndarray of bool (nu, nv)
        A point on the box around the boundary, within 1e-7 of the domain, is on the face if a point beside it is.
    """
    u, v = np.asarray(u, dtype=float), np.asarray(v, dtype=float)
    shape = outline(face, net)
    if shape.natural:
        return np.asarray(_within(net.u, u)[:, None] & _within(net.v, v))
    if shape.around[1] and not shape.around[0]:
        return _covered(shape.chords[..., ::-1], shape.box[:, ::-1], (net.v, net.u), v, u).T
    return _covered(shape.chords, shape.box, (net.u, net.v), u, v)


def quadrature(
    net: Net, faces: Sequence[Face], points: int | None = None, fewest: int = 1, ends: bool = False
) -> Quadrature:
    """Gauss–Legendre or Gauss–Lobatto points over faces of one surface.

    Parameters
    ----------
    net : Net
        The surface, or a refinement of it.
    faces : sequence of Face
    points : int, optional
        Points per piece in each direction; by default degree + 1, which integrates products of two functions of the net
        exactly.
    fewest : int
        Least number of points along the faces in either direction.
    ends : bool
        Whether the ends of the pieces, seen from inside, are among the points (Gauss–Lobatto).

    Notes
    -----
    Exact over faces bounded by parameter lines; elsewhere points count as wholly inside or outside the boundary.  A
    face too narrow to contain a point counts as the box around it.
    """
    shapes = [outline(face, net) for face in faces]
    if len(shapes) == 1 and shapes[0].natural:
        return _whole(net.u, net.v, points, fewest, ends)
    for halvings in range(HALVINGS + 1):
        (u, wu), (v, wv) = (
            _gauss(_breaks(kv, axis, shapes, PIECES << halvings), points or kv.degree + 1, fewest, ends)
            for axis, kv in enumerate((net.u, net.v))
        )
        on = [inside_grid(face, net, _drawn_in(u), _drawn_in(v)) for face in faces]
        if all(shape.natural or mask.sum() >= ENOUGH for shape, mask in zip(shapes, on, strict=True)):
            break
    on = [mask if mask.any() else _boxed(shape, net, u, v) for shape, mask in zip(shapes, on, strict=True)]
    mask = np.logical_or.reduce(on)
    cells = mask.reshape(*u.shape, *v.shape).any(axis=(1, 3))
    keep_u, keep_v = cells.any(axis=1), cells.any(axis=0)
    mask = mask[np.repeat(keep_u, u.shape[1])][:, np.repeat(keep_v, v.shape[1])]
    return Quadrature(u[keep_u], v[keep_v], wu[keep_u], wv[keep_v], mask)


@kept(64)
def _whole(u: KnotVector, v: KnotVector, points: int | None, fewest: int, ends: bool) -> Quadrature:
    """Points over a whole surface."""
    pieces = (np.stack([kv.breaks[:-1], kv.breaks[1:]], axis=1) for kv in (u, v))
    found = [_gauss(each, points or kv.degree + 1, fewest, ends) for each, kv in zip(pieces, (u, v), strict=True)]
    (at_u, in_u), (at_v, in_v) = found
    return Quadrature(at_u, at_v, in_u, in_v, np.ones((at_u.size, at_v.size), bool))


def _boxed(shape: Outline, net: Net, u: Array, v: Array) -> Array:
    """Which products of the points of pieces lie in the box around a boundary."""
    on = []
    for axis, (kv, x) in enumerate(((net.u, u), (net.v, v))):
        low, high = limits = _limits(shape, kv, axis)
        copies = _copies(kv, x.ravel(), limits)
        on.append(((copies >= low) & (copies <= high)).any(axis=0))
    return np.asarray(on[0][:, None] & on[1])


def _limits(shape: Outline, kv: KnotVector, axis: int) -> Array:
    """First and last parameter of a boundary, ``(2,)``; some margins apart even if it has no width."""
    low, high = shape.box[:, axis]
    short = max(NARROW * MARGIN * kv.period - (high - low), 0.0) / 2
    return np.array([low - short, high + short])


def _within(kv: KnotVector, x: Array) -> Array:
    """Whether parameters lie in the domain."""
    if kv.periodic:
        return np.ones(len(x), dtype=bool)
    margin, (low, high) = MARGIN * kv.period, kv.domain
    return (x >= low - margin) & (x <= high + margin)


def _covered(chords: Array, box: Array, knots: tuple[KnotVector, KnotVector], u: Array, v: Array) -> Array:
    """Products of parameters within closed polygons, by parity along the lines ``u = const``."""
    lines = _copies(knots[0], _beside(knots[0], box[:, 0], u), box[:, 0])
    columns = _copies(knots[1], v, box[:, 1]).ravel()
    row, enter, leave = _intervals(*_crossings(chords, lines))
    order, margin = np.argsort(columns), MARGIN * knots[1].period
    first = np.searchsorted(columns, enter - margin, "left", order)
    last = np.searchsorted(columns, leave + margin, "right", order)
    width = len(columns) + 1
    changes = np.bincount(row * width + first, minlength=len(u) * width)
    changes = changes - np.bincount(row * width + last, minlength=len(u) * width)
    inside = np.empty((len(u), len(columns)), dtype=bool)
    inside[:, order] = changes.reshape(len(u), width)[:, :-1].cumsum(axis=1) > 0
    return np.asarray(inside.reshape(len(u), -1, len(v)).any(axis=1))


def _beside(kv: KnotVector, limits: Array, x: Array) -> Array:
    """Parameters; those on the limits of the face (in any period) are moved just inside."""
    margin, period = MARGIN * kv.period, kv.period if kv.periodic else np.inf
    for limit, step in zip(limits, (2 * margin, -2 * margin), strict=True):
        away = x - limit
        if kv.periodic:
            away = away - np.round(away / period) * period
        x = np.where(np.abs(away) <= margin, x - away + step, x)
    return x


def _copies(kv: KnotVector, x: Array, limits: Array) -> Array:
    """Parameters moved by all whole periods that may bring them between the limits, ``(copies, q)``."""
    if not kv.periodic or not len(x):
        return x[None]
    margin = 3 * MARGIN * kv.period
    low = np.floor((limits[0] - margin - x.max()) / kv.period)
    high = np.ceil((limits[1] + margin - x.min()) / kv.period)
    return x + np.arange(low, high + 1)[:, None] * kv.period


def _crossings(chords: Array, lines: Array) -> tuple[Array, Array]:
    """Where chords cross lines ``u = const``: the line's number (copies of one have the same) and ``v``."""
    count, (u0, v0), (u1, v1) = lines.shape[1], chords[:, 0].T, chords[:, 1].T
    order = np.argsort(lines.ravel())
    ascending = lines.ravel()[order]
    first = np.searchsorted(ascending, np.minimum(u0, u1))
    crossed = np.searchsorted(ascending, np.maximum(u0, u1)) - first
    chord = np.repeat(np.arange(len(chords)), crossed)
    line = np.arange(len(chord)) - np.repeat(crossed.cumsum() - crossed - first, crossed)
    share = (ascending[line] - u0[chord]) / (u1 - u0)[chord]
    return order[line] % count, v0[chord] + share * (v1 - v0)[chord]


def _intervals(row: Array, at: Array) -> tuple[Array, Array, Array]:
    """Crossings of each line in pairs: the line, where it enters and where it leaves."""
    order = np.lexsort((at, row))
    row, at = row[order], at[order]
    place = np.arange(len(row)) - np.searchsorted(row, row)
    enters = np.flatnonzero((place[:-1] % 2 == 0) & (row[1:] == row[:-1]))
    return row[enters], at[enters], at[enters + 1]


def _breaks(kv: KnotVector, axis: int, shapes: Sequence[Outline], pieces: int) -> Array:
    """First and last parameter of each piece, ``(pieces, 2)``."""
    trimmed = [shape for shape in shapes if not shape.natural]
    if not trimmed:
        return np.stack([kv.breaks[:-1], kv.breaks[1:]], axis=1)
    limits = np.array([_limits(shape, kv, axis) for shape in trimmed])
    low, high = kv.domain
    extra = kv.wrap(np.concatenate([limits.ravel(), *(shape.lines(axis) for shape in trimmed)]))
    extra = np.unique(extra[(extra > low) & (extra < high)])
    beside = np.searchsorted(kv.breaks, extra)
    apart = np.minimum(extra - kv.breaks[beside - 1], kv.breaks[beside] - extra)
    extra = extra[(apart > MARGIN * kv.period) & (np.diff(extra, prepend=-np.inf) > MARGIN * kv.period)]
    breaks = np.sort(np.append(kv.breaks, extra))
    if len(trimmed) == len(shapes):
        return _divided(kv, breaks, limits, pieces)
    return np.stack([breaks[:-1], breaks[1:]], axis=1)


def _divided(kv: KnotVector, breaks: Array, limits: Array, pieces: int) -> Array:
    """Pieces between ``breaks`` that the faces' limits overlap, none longer than a share of the limits."""
    starts, lengths = breaks[:-1], np.diff(breaks)
    away = starts + 0.5 * lengths - limits[:, :1]
    if kv.periodic:
        away = np.mod(away, kv.period)
    extent = limits[:, 1:] - limits[:, :1]
    overlaps = (away >= 0) & (away <= extent)
    kept = overlaps.any(axis=0)
    least = np.where(overlaps, extent, np.inf).min(axis=0)[kept] / pieces
    starts, lengths = starts[kept], lengths[kept]
    parts = np.maximum(np.ceil(lengths / least * (1 - 1e-9)), 1).astype(int)
    of = np.repeat(np.arange(len(starts)), parts)
    place = np.arange(len(of)) - np.repeat(parts.cumsum() - parts, parts)
    size = (lengths / parts)[of]
    return np.stack([starts[of] + place * size, starts[of] + (place + 1) * size], axis=1)


def _gauss(pieces: Array, points: int, fewest: int, ends: bool) -> tuple[Array, Array]:
    """Gauss points and weights on intervals ``(s, 2)``, both ``(s, q)``; at least ``fewest`` in all."""
    count = max(points, -(-fewest // len(pieces)))
    nodes, weights = lobatto(count) if ends else legendre(count)
    half = 0.5 * (pieces[:, 1] - pieces[:, 0])[:, None]
    x = pieces[:, :1] + half * (nodes + 1)
    if ends:
        x[:, [0, -1]] = pieces
    return x, half * weights


@kept(32)
def lobatto(points: int) -> tuple[Array, Array]:
    """Nodes and weights of the Gauss–Lobatto rule on [-1, 1]."""
    last = np.polynomial.Legendre.basis(points - 1)
    nodes = np.concatenate([[-1.0], np.sort(last.deriv().roots().real), [1.0]])
    return nodes, 2 / (points * (points - 1) * last(nodes) ** 2)


def _drawn_in(x: Array) -> Array:
    """Points of pieces, in one row, moved off the pieces' ends for inside tests."""
    middle = x.mean(axis=1, keepdims=True)
    return np.asarray((middle + (1 - ASIDE) * (x - middle)).ravel())
