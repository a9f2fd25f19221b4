"""Edges at their samples: points, the parameters of faces there, and what faces that do not move are beside them.

Lines, planes and surfaces of revolution are evaluated all at once, by their formulas; others by the kernel.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from typing import TypeVar

import numpy as np
from OCP.BRepAdaptor import BRepAdaptor_Curve, BRepAdaptor_Surface
from OCP.Geom2d import Geom2d_Curve, Geom2d_Line
from OCP.GeomAbs import GeomAbs_Line, GeomAbs_Plane, GeomAbs_SurfaceType
from OCP.gp import gp_Pnt, gp_Vec
from OCP.TopAbs import TopAbs_REVERSED
from OCP.TopoDS import TopoDS_Edge, TopoDS_Face

from mracad.bspline.surface import curvature
from mracad.bspline.vectors import cross, unit
from mracad.model.sampling import SAMPLES, shares

Array = np.ndarray
T = TypeVar("T")

NONE = np.empty((0, 3))
"""The points of an edge without samples."""

_REVOLVED = {
    GeomAbs_SurfaceType.GeomAbs_Cylinder, GeomAbs_SurfaceType.GeomAbs_Cone, GeomAbs_SurfaceType.GeomAbs_Sphere,
    GeomAbs_SurfaceType.GeomAbs_Torus,
}  # fmt: skip
_SPREAD = shares(SAMPLES)


@dataclass(eq=False)
class Use:
    """An edge as one face has it: the curve in the parameter plane, over ``[first, last]``."""

    face: int
    edge: int
    pcurve: Geom2d_Curve
    first: float
    last: float


def along(edges: list[TopoDS_Edge | None]) -> list[tuple[Array, Array]]:
    """Points and unit tangents along edges; none for None."""
    found = [(NONE, NONE)] * len(edges)
    lines: dict[int, tuple[float, ...]] = {}
    point, tangent = gp_Pnt(), gp_Vec()
    for index, edge in enumerate(edges):
        if edge is None:
            continue
        curve = BRepAdaptor_Curve(edge)
        first, last = curve.FirstParameter(), curve.LastParameter()
        if curve.GetType() == GeomAbs_Line:
            line = curve.Line()
            lines[index] = *line.Location().Coord(), *line.Direction().Coord(), first, last
            continue
        rows = []
        for t in (first + (last - first) * _SPREAD).tolist():
            curve.D1(t, point, tangent)
            rows.append(point.Coord() + tangent.Coord())
        table = np.array(rows)
        found[index] = table[:, :3], unit(table[:, 3:])
    table = np.array(list(lines.values())).reshape(-1, 8, 1)
    place = table[:, 6] + (table[:, 7] - table[:, 6]) * _SPREAD
    start, direction = table[:, :3].swapaxes(1, 2), table[:, 3:6].swapaxes(1, 2)
    straight = start + place[..., None] * direction
    return _filled(found, lines, zip(straight, np.tile(direction, (1, SAMPLES, 1)), strict=True))


def parameters(uses: list[Use]) -> list[Array]:
    """Surface parameters at the edge's samples of each use, ``(k, 2)``."""
    found = [NONE] * len(uses)
    lines: dict[int, tuple[float, ...]] = {}
    for index, use in enumerate(uses):
        if isinstance(use.pcurve, Geom2d_Line):
            line = use.pcurve.Lin2d()
            lines[index] = *line.Location().Coord(), *line.Direction().Coord(), use.first, use.last
        else:
            place = use.first + (use.last - use.first) * _SPREAD
            found[index] = np.array([point.Coord() for point in map(use.pcurve.Value, place.tolist())])
    table = np.array(list(lines.values())).reshape(-1, 6, 1)
    place = table[:, 4] + (table[:, 5] - table[:, 4]) * _SPREAD
    straight = table[:, :2].swapaxes(1, 2) + place[..., None] * table[:, 2:4].swapaxes(1, 2)
    return _filled(found, lines, straight)


def _filled(found: list[T], at: Iterable[int], values: Iterable[T]) -> list[T]:
    """A list with other values at some places."""
    for index, value in zip(at, values, strict=True):
        found[index] = value
    return found


def beside(
    faces: list[TopoDS_Face], uses: dict[Use, Array], along: list[tuple[Array, Array]]
) -> dict[Use, tuple[Array, Array, Array]]:
    """Points, outward normals and curvatures across an edge of faces that do not move, by their uses.

    Parameters
    ----------
    faces : list of TopoDS_Face
        All faces of the document.
    uses : dict
        The surface parameters at the samples of each use, ``(k, 2)``.
    along : list of (ndarray, ndarray)
        The points and tangents of all edges.
    """
    grounds = {face: BRepAdaptor_Surface(faces[face], False) for face in {use.face for use in uses}}
    signs = {face: -1.0 if faces[face].Orientation() == TopAbs_REVERSED else 1.0 for face in grounds}
    kinds = {face: surface.GetType() for face, surface in grounds.items()}
    flat = [use for use in uses if kinds[use.face] == GeomAbs_Plane]
    sides = dict(zip(flat, _on_planes(flat, grounds, signs, along), strict=True))
    round_about: dict[GeomAbs_SurfaceType, list[Use]] = {}
    others: list[Use] = []
    for use in uses:
        kind = kinds[use.face]
        if kind != GeomAbs_Plane:
            (round_about.setdefault(kind, []) if kind in _REVOLVED else others).append(use)
    bent = [*others, *(use for members in round_about.values() for use in members)]
    if bent:
        jets = [_jets(grounds[use.face], uses[use]) for use in others]
        for kind, members in round_about.items():
            revolved = {face: _revolved(grounds[face]) for face in {use.face for use in members}}
            table = np.array([revolved[use.face] for use in members])
            jets.append(_turned(kind, table, np.array([uses[use] for use in members])).reshape(-1, 6, 3))
        feet, su, sv, *second = np.concatenate(jets).swapaxes(0, 1)
        sign = np.repeat([signs[use.face] for use in bent], SAMPLES)
        normals = unit(cross(su, sv))
        tangents = np.concatenate([along[use.edge][1] for use in bent])
        bends = sign * curvature((su, sv, *second), cross(normals, tangents))
        split = (
            values.reshape(len(bent), SAMPLES, *values.shape[1:]) for values in (feet, sign[:, None] * normals, bends)
        )
        sides |= dict(zip(bent, zip(*split, strict=True), strict=True))
    return sides


def _on_planes(
    uses: list[Use],
    grounds: dict[int, BRepAdaptor_Surface],
    signs: dict[int, float],
    along: list[tuple[Array, Array]],
) -> Iterator[tuple[Array, Array, Array]]:
    """Points, outward normals and curvatures of planes along edges."""
    planes: dict[int, tuple[Array, Array]] = {}
    for face in dict.fromkeys(use.face for use in uses):
        plane = grounds[face].Plane()
        sign = signs[face] * (1.0 if plane.Direct() else -1.0)
        planes[face] = np.array(plane.Location().Coord()), np.array(plane.Axis().Direction().Coord()) * sign
    if uses:
        origins, normals = (np.array([planes[use.face][k] for use in uses])[:, None] for k in (0, 1))
        points = np.array([along[use.edge][0] for use in uses])
        feet = points - (points - origins) @ normals.swapaxes(1, 2) * normals
        yield from zip(feet, np.tile(normals, (1, SAMPLES, 1)), np.zeros((len(uses), SAMPLES)), strict=True)


def _jets(surface: BRepAdaptor_Surface, uv: Array) -> Array:
    """Points and derivatives u, v, uu, uv, vv of a surface, ``(k, 6, 3)``."""
    point, *derivatives = gp_Pnt(), *(gp_Vec() for _ in range(5))
    du, dv, duu, dvv, duv = derivatives
    rows = []
    for u, v in uv.tolist():
        surface.D2(u, v, point, du, dv, duu, dvv, duv)
        rows.append(point.Coord() + du.Coord() + dv.Coord() + duu.Coord() + duv.Coord() + dvv.Coord())
    return np.array(rows).reshape(-1, 6, 3)


def _revolved(surface: BRepAdaptor_Surface) -> tuple[float, ...]:
    """The frame of a surface of revolution of a line or circle (origin, x, y, z), and its two sizes."""
    match surface.GetType():
        case GeomAbs_SurfaceType.GeomAbs_Cylinder:
            kind = surface.Cylinder()
            sizes = kind.Radius(), 0.0
        case GeomAbs_SurfaceType.GeomAbs_Cone:
            kind = surface.Cone()
            sizes = kind.RefRadius(), kind.SemiAngle()
        case GeomAbs_SurfaceType.GeomAbs_Sphere:
            kind = surface.Sphere()
            sizes = kind.Radius(), 0.0
        case _:
            kind = surface.Torus()
            sizes = kind.MinorRadius(), kind.MajorRadius()
    position = kind.Position()
    axes = position.Location(), position.XDirection(), position.YDirection(), position.Direction()
    return (*(x for axis in axes for x in axis.Coord()), *sizes)


def _turned(kind: GeomAbs_SurfaceType, surfaces: Array, uv: Array) -> Array:
    """Points and derivatives u, v, uu, uv, vv of surfaces of revolution, ``(n, k, 6, 3)``.

    Parameters
    ----------
    kind : GeomAbs_SurfaceType
    surfaces : ndarray (n, 14)
        See :func:`_revolved`.
    uv : ndarray (n, k, 2)
    """
    v = uv[..., 1]
    one, size = np.ones_like(v), surfaces[:, 12, None]
    zero = np.zeros_like(v)
    rho: tuple[Array, ...]
    zeta: tuple[Array, ...]
    if kind == GeomAbs_SurfaceType.GeomAbs_Cylinder:
        rho, zeta = (size * one, zero, zero), (v, one, zero)
    elif kind == GeomAbs_SurfaceType.GeomAbs_Cone:
        slope, rise = np.sin(surfaces[:, 13, None]), np.cos(surfaces[:, 13, None])
        rho, zeta = (size + slope * v, slope * one, zero), (rise * v, rise * one, zero)
    else:  # the profile is a circle, that of a sphere around its centre
        cos, sin = np.cos(v), np.sin(v)
        far = surfaces[:, 13, None]
        rho, zeta = (far + size * cos, -size * sin, -size * cos), (size * sin, size * cos, -size * sin)
    origin, x, y, z = (surfaces[:, None, 3 * k : 3 * k + 3] for k in range(4))
    cos, sin = np.cos(uv[..., 0])[..., None], np.sin(uv[..., 0])[..., None]
    out, on = cos * x + sin * y, cos * y - sin * x
    (r, dr, ddr), (h, dh, ddh) = ([each[..., None] for each in profile] for profile in (rho, zeta))
    jet = origin + r * out + h * z, r * on, dr * out + dh * z, -r * out, dr * on, ddr * out + ddh * z
    return np.stack(jet, axis=2)
