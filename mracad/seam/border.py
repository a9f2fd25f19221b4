"""Borders: isoparametric curves by which faces meet edges, and how two of them meet."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from mracad.bspline.knots import Side as Limit
from mracad.bspline.scattered import scattered
from mracad.bspline.vectors import cross
from mracad.model.brep import Edge, Model, Side
from mracad.model.sampling import shares
from mracad.seam.hold import ISO, local_span
from mracad.seam.sides import inner_side

Array = np.ndarray
Jet = tuple[Array, ...]
"""``S, S_n, S_t`` and for order 2 ``S_nn`` along borders, ``(borders, q, 3)`` each, from :func:`jets`."""

AFFINE = 1e-7
"""Largest deviation, as a fraction of the seam, from an affine map between the parameters along it."""

SHARES = shares(33)
"""Fractions of an edge at which two borders are compared."""


@dataclass(frozen=True, eq=False)
class Border:
    """One side of a seam: an isoparametric curve of a surface.

    Attributes
    ----------
    face, surface : int
    axis : {0, 1}
        The direction across the seam: 0 where it lies on a line u = const.
    at : float
        Parameter of the line.
    limit : {"right", "left"}
        The side of the line on which the face lies.
    start, stop : float
        Parameters along the line where the edge begins and ends.
    """

    face: int
    surface: int
    axis: int
    at: float
    limit: Limit
    start: float
    stop: float

    def places(self, share: Array) -> Array:
        """Parameters ``(q, 2)`` at fractions of the edge."""
        along = (1.0 - share) * self.start + share * self.stop
        return np.stack([np.full_like(along, self.at), along][:: 1 - 2 * self.axis], axis=-1)

    def limits(self, along: Limit) -> tuple[Limit, Limit]:
        """Limits in u and in v."""
        return (self.limit, along) if self.axis == 0 else (along, self.limit)

    def part(self, low: float, high: float) -> Border:
        """The part between two fractions."""
        start, stop = ((1.0 - share) * self.start + share * self.stop for share in (low, high))
        return replace(self, start=start, stop=stop)


def border(model: Model, edge: Edge, side: Side, use: int) -> Border | None:
    """The isoparametric curve by which a face meets an edge, if the edge's parameter is affine in it; else None."""
    face = model.faces[side.face]
    assert face.surface is not None and side.uv is not None
    net = model.surfaces[face.surface].net
    trims = [trim for trim in face.trims if trim.edge == edge.index]
    trim = trims[use if len(trims) > 1 else 0]
    ends = trim.curve.evaluate(np.array(trim.curve.knots.domain))[0]
    for axis, knots in enumerate((net.u, net.v)):
        at = trim.curve.poles[:, axis]
        place = float(at.mean())
        if np.ptp(at) > 2 * ISO * local_span(knots, place):
            continue
        low, high = knots.domain
        nearest = float(knots.breaks[np.argmin(np.abs(knots.breaks - place))])
        place = nearest if abs(nearest - place) <= ISO * local_span(knots, place) else place
        along = (net.u, net.v)[1 - axis]
        start, stop = (_snapped(along.breaks, float(x)) for x in ends[:, 1 - axis])
        share = (side.uv[:, 1 - axis] - ends[0, 1 - axis]) / (ends[1, 1 - axis] - ends[0, 1 - axis])
        if abs(share - shares(len(share))).max() > AFFINE:
            return None
        limit: Limit = "right" if place <= low else "left"
        if low < place < high:
            limit = inner_side(face, trim.edge, axis, place)
        return Border(face.index, face.surface, axis, place, limit, start, stop)
    return None


def _snapped(breaks: Array, x: float) -> float:
    nearest = float(breaks[np.argmin(np.abs(breaks - x))])
    return nearest if abs(nearest - x) <= 1e-9 * (breaks[-1] - breaks[0]) else x


def jets(model: Model, borders: Sequence[Border], share: Array, order: int) -> Jet:
    """Derivatives at fractions of edges in the part's frame; t is the fraction."""
    faces = [model.faces[border.face] for border in borders]
    nets = [model.surfaces[border.surface].net for border in borders]
    places = [(net, each.places(share), each.limits("right")) for net, each in zip(nets, borders, strict=True)]
    s, su, sv, *second = (each.reshape(len(borders), len(share), 3) for each in scattered(places, order))
    turned = np.array([face.frame[:3, :3].T for face in faces])
    moved = np.array([face.frame[:3, 3] for face in faces])[:, None]
    pace = np.array([border.stop - border.start for border in borders])[:, None, None]
    in_u = np.array([border.axis == 0 for border in borders])[:, None, None]
    across, along = np.where(in_u, su, sv) @ turned, (np.where(in_u, sv, su) * pace) @ turned
    return (s @ turned + moved, across, along, *(np.where(in_u, second[0], each) @ turned for each in second[2:]))


def outward(model: Model, borders: Sequence[Border], across: Array, along: Array) -> Array:
    """Outward normals, not of unit length, from the derivatives across and along borders."""
    turned = [model.faces[each.face].reversed != (each.stop < each.start) for each in borders]
    sign = [-1 if turn != (border.axis == 1) else 1 for turn, border in zip(turned, borders, strict=True)]
    return np.asarray(np.array(sign)[:, None, None] * cross(across, along))
