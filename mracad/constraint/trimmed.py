"""Seams that can move only to a tolerance: along trim curves, or where the parameters of the two sides have no law.

On such a seam no two spline spaces match.  Its conditions on a displacement δ are asked at points of the two curves in
the parameter planes that belong together:

    G0   δ_b = δ_a,        G1   D_c δ_b = D_c δ_a,

D_c the derivative in the direction of the conormal c of the input (the unit vector in the tangent plane of side a,
across the edge).  The coarse spaces meet them at about as many points as the coarser of the two has spans along the
seam; what is left between is taken away on the fine nets, as far as that is cheap.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from mracad.bspline.basis import basis
from mracad.bspline.knots import KnotVector
from mracad.bspline.net import Curve, Net
from mracad.constraint.frozen import CONTINUITY
from mracad.constraint.seam import CREASE, Wishes, between
from mracad.model import Edge, Face, Model, Side

Array = np.ndarray

_SHARES = 0.5 - 0.5 * np.cos(np.pi * (np.arange(65) + 0.5) / 65)


@dataclass(frozen=True, eq=False)
class Trace:
    """One side of a trimmed seam.

    Attributes
    ----------
    face, surface : int
    curve : Curve
        In the parameter plane, over the edge's range.
    """

    face: int
    surface: int
    curve: Curve

    def places(self, share: Array) -> Array:
        """Parameters ``(q, 2)`` at fractions of the edge."""
        start, stop = self.curve.knots.domain
        return self.curve.evaluate(start + share * (stop - start))[0]

    def way(self, share: Array) -> Array:
        """Derivative of :meth:`places`, ``(q, 2)``."""
        start, stop = self.curve.knots.domain
        return self.curve.evaluate(start + share * (stop - start), 1)[1] * (stop - start)


@dataclass(frozen=True, eq=False)
class TrimmedSeam:
    """Two traces that meet.

    Attributes
    ----------
    order : {0, 1}
        Cross derivatives that the seam keeps.
    gap, angle : float
        Of the input, as :func:`parted` measures them.
    """

    edge: int
    a: Trace
    b: Trace
    order: int
    gap: float
    angle: float


def trimmed(model: Model, edge: Edge, sides: Sequence[Side], wishes: Wishes) -> TrimmedSeam | str:
    """The seam of an edge between two NURBS faces, or why it cannot move."""
    faces = [model.faces[side.face] for side in sides]
    if not np.allclose(faces[0].frame[:3, :3], faces[1].frame[:3, :3], rtol=0, atol=1e-12):
        return "faces are placed differently"
    if sides[0].face == sides[1].face:
        return "a face that meets itself"
    a, b = (_trace(face, edge) for face in faces)
    gap, angle = parted(model, a, b)
    if not np.isfinite(angle):
        return "degenerate along the seam"
    order = CONTINUITY[wishes.keep] if angle <= CREASE else 0
    if order > 1:
        return "trimmed: no curvature is kept across it"
    return TrimmedSeam(edge.index, a, b, order, gap, angle)


def _trace(face: Face, edge: Edge) -> Trace:
    assert face.surface is not None
    return Trace(face.index, face.surface, next(trim.curve for trim in face.trims if trim.edge == edge.index))


def parted(model: Model, a: Trace, b: Trace) -> tuple[float, float]:
    """Largest distance (mm, differences along the seam left out) and angle between the outward normals."""
    points, normals = [], []
    for trace in (a, b):
        face, net = model.faces[trace.face], model.surfaces[trace.surface].net
        uv = trace.places(_SHARES)
        points.append(net.evaluate(uv) @ face.frame[:3, :3].T + face.frame[:3, 3])
        normals.append((-1 if face.reversed else 1) * net.normals(uv) @ face.frame[:3, :3].T)
    way = np.gradient(points[0], axis=0)
    way /= np.maximum(np.linalg.norm(way, axis=1, keepdims=True), 1e-300)
    apart = points[0] - points[1]
    apart -= (apart * way).sum(axis=1, keepdims=True) * way
    return float(np.linalg.norm(apart, axis=1).max()), float(between(*normals).max())


def sites(seam: TrimmedSeam, spaces: Mapping[int, tuple[KnotVector, KnotVector]], dense: bool) -> Array:
    """Fractions of the edge at which conditions are asked.

    As many as the coarser side has spans, and three; or, ``dense``, twice as many as the finer one has.
    """
    share = np.linspace(0.0, 1.0, 400)
    crossed = []
    for trace in (seam.a, seam.b):
        uv = trace.places(share)
        cells = [np.searchsorted(k.breaks, k.wrap(x)) for k, x in zip(spaces[trace.surface], uv.T, strict=True)]
        crossed.append(1 + sum(int(np.count_nonzero(np.diff(cell))) for cell in cells))
    return np.linspace(0.0, 1.0, 2 * max(crossed) + 5 if dense else min(crossed) + 3)


def collocation(
    nets: Mapping[int, Net], ground: Mapping[int, Net], seams: Sequence[TrimmedSeam], shares: Sequence[Array]
) -> tuple[Any, Array]:
    """The conditions of trimmed seams on the control points of nets, laid out one after another.

    Parameters
    ----------
    nets : mapping of int to Net
        Spaces of the displacement by surface.
    ground : mapping of int to Net
        The input's surfaces, from which the conormals are taken.
    seams, shares
        The seams and the fractions at which each is asked.

    Returns
    -------
    matrix : scipy.sparse.csr_array
    order : ndarray (conditions,)
        0 for G0, 1 for G1.
    """
    from scipy.sparse import csr_array

    sizes = [net.u.count * net.v.count for net in nets.values()]
    first = dict(zip(nets, np.cumsum([0, *sizes])[:-1].tolist(), strict=True))
    entries: list[tuple[Array, Array, Array]] = [(np.empty(0, int), np.empty(0, int), np.empty(0))]
    orders, count = [np.empty(0, int)], 0
    for seam, share in zip(seams, shares, strict=True):
        ways = _conormals(ground, seam, share)
        for order in range(seam.order + 1):
            row = count + np.arange(len(share))
            for trace, way, sign in zip((seam.b, seam.a), ways[::-1], (1.0, -1.0), strict=True):
                index, table = _jet(nets[trace.surface], trace.places(share), order)
                value = table[0] if order == 0 else way[:, :1] * table[1] + way[:, 1:] * table[2]
                where = np.repeat(row, index.shape[1])
                entries.append((where, first[trace.surface] + index.ravel(), sign * value.ravel()))
            orders.append(np.full(len(share), order))
            count += len(share)
    row, column, value = (np.concatenate(x) for x in zip(*entries, strict=True))
    return csr_array((value, (row, column)), shape=(count, sum(sizes))), np.concatenate(orders)


def _conormals(ground: Mapping[int, Net], seam: TrimmedSeam, share: Array) -> tuple[Array, Array]:
    """Directions ``(q, 2)`` in the parameter planes of a and b that are the conormal in space."""
    _, su, sv = ground[seam.a.surface].evaluate(seam.a.places(share), 1)
    way = seam.a.way(share)
    along = su * way[:, :1] + sv * way[:, 1:]
    conormal = np.cross(np.cross(su, sv), along)
    conormal /= np.maximum(np.linalg.norm(conormal, axis=1, keepdims=True), 1e-300)
    _, tu, tv = ground[seam.b.surface].evaluate(seam.b.places(share), 1)
    return _components(su, sv, conormal), _components(tu, tv, conormal)


def _components(su: Array, sv: Array, vector: Array) -> Array:
    """``(x, y)`` with x S_u + y S_v the part of ``vector`` in the tangent plane."""
    e, f, g, p, q = ((x * y).sum(axis=1) for x, y in ((su, su), (su, sv), (sv, sv), (su, vector), (sv, vector)))
    determinant = np.maximum(e * g - f * f, 1e-300)
    return np.stack([p * g - q * f, q * e - p * f], axis=1) / determinant[:, None]


def _jet(net: Net, uv: Array, order: int) -> tuple[Array, list[Array]]:
    """Control points ``(q, k)`` and the rational basis functions there with their first derivatives."""
    in_u = [basis(net.u, uv[:, 0], r) for r in range(order + 1)]
    in_v = [basis(net.v, uv[:, 1], r) for r in range(order + 1)]
    row = (in_u[0][0][:, None] + np.arange(net.u.degree + 1)) % net.u.count
    column = (in_v[0][0][:, None] + np.arange(net.v.degree + 1)) % net.v.count
    index = (row[:, :, None] * net.v.count + column[:, None, :]).reshape(len(uv), -1)
    table = [
        (in_u[i][1][:, :, None] * in_v[j][1][:, None, :]).reshape(len(uv), -1)
        for i, j in ((0, 0), (1, 0), (0, 1))[: 1 + 2 * order]
    ]
    if net.weights is None:
        return index, table
    top = [value * net.weights.ravel()[index] for value in table]
    w = [value.sum(axis=1, keepdims=True) for value in top]
    whole = top[0] / w[0]
    return index, [whole, *((t - x * whole) / w[0] for t, x in zip(top[1:], w[1:], strict=True))]
