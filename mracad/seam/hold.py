"""Separation: the control points of a surface that an edit must hold so that every joint stays as it is.

The edited surface is S + δ.  Along an edge that is an isoparametric curve u = c of the surface, δ and its cross
derivatives up to order k vanish if the coefficients of all basis functions with a non-zero derivative of order ≤ k at c
do: the outer k + 1 rows where c is a clamped end.  Along any other edge the coefficients of all functions whose open
support meets the curve are held, so that δ vanishes there with all its derivatives.  Edges, vertices and pcurves stay
exactly valid.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from mracad.bspline.basis import basis
from mracad.bspline.curve import Curve
from mracad.bspline.knots import KnotVector, Side
from mracad.bspline.surface import Net
from mracad.memo import kept
from mracad.model.brep import Face
from mracad.model.region import Region, covered, face_region, supported

Array = np.ndarray

CONTINUITY = {"g0": 0, "g1": 1, "g2": 2}
"""Cross derivatives kept by ``--keep``."""

ISO = 1e-7
"""Deviation, as a fraction of the local span, within which a pcurve counts as isoparametric: δ's gradient on it is
then below 1e-6 of δ per span, 1e-4° for a δ of a sixth of the span."""

NEAR = 1e-4
"""Distance, as a fraction of the longer span beside it, within which a pcurve counts as lying at a knot line."""


@dataclass(frozen=True, eq=False)
class Separation:
    """The control points of one surface, by role.

    Attributes
    ----------
    visible : ndarray of bool (nu, nv)
        Some part of an edited face depends on the point.
    frozen : ndarray of bool (nu, nv)
        The point must stay for the sake of an edge or of a face that is not edited.
    reach : dict of int to ndarray of bool (nu, nv)
        For each face by index, the points that some part of it depends on.
    """

    visible: Array
    frozen: Array
    reach: dict[int, Array]

    @property
    def free(self) -> Array:
        """Points that an edit may move: visible and not frozen."""
        return np.asarray(self.visible & ~self.frozen)


def reached(net: Net, faces: Sequence[Face]) -> dict[int, Array]:
    """For each face on a surface, the control points ``(nu, nv)`` that some part of it depends on."""
    return {face.index: supported(net, covered(net, face)) for face in faces}


def separate(
    net: Net,
    faces: Sequence[Face],
    edited: Collection[int],
    keep: str | Mapping[int, int] = "g1",
    moving: Collection[int] = (),
) -> Separation:
    """Separate the control points of a surface.

    Parameters
    ----------
    net : Net
        The surface (refined or not).
    faces : sequence of Face
        All faces that lie on it.
    edited : collection of int
        Indices of those that may move; the others' whole region is frozen.
    keep : {"g0", "g1", "g2"} or mapping of int to int
        The continuity that each edge keeps with its other side, or the number of derivatives by edge; edges that are
        not in the mapping only keep their position.
    moving : collection of int
        Edges that may move, because their other side moves with them.
    """
    visible = np.zeros(net.poles.shape[:2], bool)
    frozen = np.zeros_like(visible)
    reach = {}
    for face in faces:
        region = face_region(net, face)
        reach[face.index] = supported(net, region.inside)
        if face.index in edited:
            visible |= reach[face.index]
            held = [i for i, trim in enumerate(face.trims) if trim.edge not in moving]
            crossed = Region(region.inside, tuple(region.crossed[i] for i in held))
            orders = [CONTINUITY[keep] if isinstance(keep, str) else keep.get(face.trims[i].edge, 0) for i in held]
            frozen |= frozen_along(net, [face.trims[i].curve for i in held], crossed, orders)
        else:
            frozen |= reach[face.index]
    return Separation(visible, frozen, reach)


def frozen_along(net: Net, curves: Sequence[Curve], region: Region, orders: Sequence[int]) -> Array:
    """Control points ``(nu, nv)`` that must stay so that ``net`` keeps its derivatives along pcurves.

    Parameters
    ----------
    net : Net
    curves : sequence of Curve
    region : Region
        Region of the face that the curves bound; its ``crossed`` cells are those of the curves.
    orders : sequence of {0, 1, 2}
        Highest derivative across each curve that is kept.
    """
    frozen = np.zeros(net.poles.shape[:2], bool)
    trimmed = np.zeros_like(region.inside)
    for curve, crossed, order in zip(curves, region.crossed, orders, strict=True):
        for axis, knots in enumerate((net.u, net.v)):
            at = curve.poles[:, axis]
            position = float(at.mean())
            if np.ptp(at) <= 2 * ISO * local_span(knots, position):
                rows = jet_support(knots, position, order)
                across = curve.poles[:, 1 - axis]
                columns = meeting((net.u, net.v)[1 - axis], float(across.min()), float(across.max()))
                frozen |= rows[:, None] & columns if axis == 0 else columns[:, None] & rows
                break
        else:
            trimmed |= crossed
    return np.asarray(frozen | supported(net, trimmed))


@kept(4096)
def jet_support(knots: KnotVector, at: float, highest: int) -> Array:
    """Basis functions ``(n,)`` with a non-zero derivative of order ≤ ``highest`` at ``at``, from either side.

    Functions at a knot that is closer than can be seen count too: what is visible is the other side of that knot.
    """
    start, end = knots.domain
    if knots.periodic:
        at = start + (at - start) % (end - start)
    at = min(max(at, start), end)
    cell = int(np.argmin(np.abs(knots.breaks - at)))
    nearest = float(knots.breaks[cell])
    if abs(nearest - at) <= ISO * local_span(knots, at):
        return _jet_at(knots, nearest, highest)
    touched = _jet_at(knots, at, highest)
    if abs(nearest - at) <= NEAR * np.diff(knots.breaks)[max(cell - 1, 0) : cell + 1].max():
        touched |= _jet_at(knots, nearest, highest)
    return touched


def _jet_at(knots: KnotVector, at: float, highest: int) -> Array:
    start, end = knots.domain
    touched = np.zeros(knots.count, bool)
    if not knots.periodic:
        if at == start and knots.multiplicities[0] == knots.degree + 1:
            touched[: highest + 1] = True
            return touched
        if at == end and knots.multiplicities[-1] == knots.degree + 1:
            touched[-highest - 1 :] = True
            return touched
    places: set[tuple[float, Side]] = {(at, "left"), (at, "right")}
    if knots.periodic and at in (start, end):
        places = {(start, "right"), (end, "left")}
    for place, side in places:
        if not knots.periodic and (place, side) in {(start, "left"), (end, "right")}:
            continue
        for order in range(min(highest, knots.degree) + 1):
            first, values = basis(knots, np.array([place]), order, side)
            values = values[0]
            nonzero = np.abs(values) > 1e-12 * np.abs(values).max(initial=0.0)
            touched[(first[0] + np.flatnonzero(nonzero)) % knots.count] = True
    return touched


def local_span(knots: KnotVector, at: float) -> float:
    """Length of the span at a parameter, the smaller of two at a knot."""
    breaks = knots.breaks
    start, end = knots.domain
    if knots.periodic:
        at = start + (at - start) % (end - start)
    cell = min(max(int(breaks.searchsorted(at, side="right")) - 1, 0), len(breaks) - 2)
    near = breaks[max(cell - 1, 0) : cell + 3]
    return float((near[1:] - near[:-1]).min())


def meeting(knots: KnotVector, low: float, high: float) -> Array:
    """Basis functions ``(n,)`` whose open support meets [low, high]."""
    start, end = knots.domain
    first = knots.knots[: knots.count]
    last = knots.knots[knots.degree + 1 : knots.degree + 1 + knots.count]
    if not knots.periodic:
        low, high = min(low, end), max(high, start)
        touching = (first < high) & (last > low)
        touching[0] |= low <= start
        touching[-1] |= high >= end
        return touching
    period = end - start
    met = np.zeros(knots.count, bool)
    for turn in range(-3, 4):
        met |= (first + turn * period < high) & (last + turn * period > low)
    return met
