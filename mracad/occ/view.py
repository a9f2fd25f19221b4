"""A document as a kernel-free Model."""

from __future__ import annotations

from collections.abc import Container, Iterable, Iterator
from dataclasses import dataclass, field, replace

import numpy as np
from OCP.BRep import BRep_Tool
from OCP.BRepAdaptor import BRepAdaptor_Curve, BRepAdaptor_Surface
from OCP.Geom import Geom_Surface
from OCP.Geom2d import Geom2d_Curve, Geom2d_Line
from OCP.GeomAbs import GeomAbs_Line, GeomAbs_Plane, GeomAbs_SurfaceType
from OCP.gp import gp_Ax3, gp_Pnt, gp_Vec
from OCP.ShapeFix import ShapeFix_Edge
from OCP.TopAbs import TopAbs_FORWARD, TopAbs_REVERSED
from OCP.TopLoc import TopLoc_Location
from OCP.TopoDS import TopoDS, TopoDS_Edge, TopoDS_Face

from mracad.bspline.surface import Net, curvature
from mracad.bspline.vectors import cross, unit
from mracad.errors import FileError, UsageError
from mracad.model.brep import Edge, Face, Model, Side, Surface, Trim
from mracad.model.sampling import SAMPLES, shares
from mracad.occ.boxes import diagonal
from mracad.occ.convert import conversion
from mracad.occ.document import Document
from mracad.occ.geometry import basis, curves, is_nurbs, nets
from mracad.occ.settings import quiet
from mracad.occ.topology import box, edge_uses, matrix

Array = np.ndarray

_KINDS = {
    "Geom_BSplineSurface": "bspline",
    "Geom_BezierSurface": "bezier",
    "Geom_Plane": "plane",
    "Geom_CylindricalSurface": "cylinder",
    "Geom_ConicalSurface": "cone",
    "Geom_SphericalSurface": "sphere",
    "Geom_ToroidalSurface": "torus",
    "Geom_SurfaceOfLinearExtrusion": "extrusion",
    "Geom_SurfaceOfRevolution": "revolution",
    "Geom_OffsetSurface": "offset",
}
_ABSURD = 1e12  # mm: the distance of a planet
_SPREAD = shares(SAMPLES)
_NONE = np.empty((0, 3))


@dataclass(eq=False)
class _Use:
    """An edge as one face has it: the curve in the parameter plane, over ``[first, last]``."""

    face: int
    edge: int
    pcurve: Geom2d_Curve
    first: float
    last: float


@dataclass(eq=False)
class _Found:
    """What a walk over the document finds, in order."""

    faces: list[TopoDS_Face]
    grounds: list[Geom_Surface] = field(default_factory=list)  # the untrimmed surface of each face
    frames: list[Array] = field(default_factory=list)
    surface_of: list[int | None] = field(default_factory=list)
    surfaces: dict[Geom_Surface, list[int]] = field(default_factory=dict)  # each NURBS surface and its faces
    uses: list[_Use] = field(default_factory=list)


def view(document: Document, convert: Iterable[int] = (), edges: Container[int] | None = None) -> Model:
    """The geometry of a document as plain arrays, in mm.

    Parameters
    ----------
    document : Document
    convert : iterable of int
        Faces on analytic, swept or offset surfaces to show as NURBS faces too.  ``apply`` puts the NURBS surfaces on
        those that move.
    edges : container of int, optional
        Edges to sample, whose faces get trims; by default all.  With only some edges, the diagonal is that of the boxes
        of the parts' control points.

    Raises
    ------
    UsageError
        For a face that does not exist.
    EditError
        For a face that the kernel cannot convert.
    FileError
        For a face with absurd coordinates or weights.
    """
    chosen = frozenset(convert)
    for face in sorted(chosen):
        if not 0 <= face < len(document.faces):
            raise UsageError(f"there is no face #{face + 1}", f"the faces are #1 to #{len(document.faces)}")
    with quiet(), np.errstate(invalid="ignore", over="ignore"):
        found = _walk(document, chosen)
        kinds = [_KINDS.get(type(surface).__name__, "other") for surface in found.grounds]
        control = nets(list(found.surfaces))
        boxes = [box(face) for face in found.faces]
        _refuse_absurd(document.name, _stored(boxes, zip(found.surfaces.values(), control, strict=True)))
        trims = _trims(found, edges)
        faces = tuple(
            Face(
                index, kinds[index], found.surface_of[index], trims.get(index, ()),
                found.faces[index].Orientation() == TopAbs_REVERSED, found.frames[index], boxes[index],
                part.face_names.get(index - part.first, ""), part.product,
                part.face_colour(index - part.first) or part.tint, len(part.placements),
            )
            for part in document.parts
            for index in part.numbers
        )  # fmt: skip
        surfaces = tuple(
            Surface(index, net, tuple(members), kinds[members[0]])
            for index, (net, members) in enumerate(zip(control, found.surfaces.values(), strict=True))
        )
        lines = tuple(_edges(document, found, edges))
        _refuse_absurd(document.name, _seen(lines, found))
        products = tuple(part.product for part in document.parts)
        places = tuple(tuple(matrix(place) for place in part.placements) for part in document.parts)
        model = Model(document.name, surfaces, faces, lines, 0.0, document.unit, document.schema, products, places)
        size = diagonal(document, model) if edges is None else _boxed(boxes)
        _refuse_absurd(document.name, [(0, size)])
    return replace(model, diagonal=size)


def _boxed(boxes: list[Array]) -> float:
    """The diagonal of all boxes together, each in its part's frame."""
    low, high = np.min(boxes, axis=0)[0], np.max(boxes, axis=0)[1]
    return float(np.linalg.norm(high - low))


def _refuse_absurd(name: str, numbers: Iterable[tuple[int, Array | float]]) -> None:
    """Raise FileError if numbers of a face are infinite, undefined or astronomical."""
    for face, values in numbers:
        if not (np.abs(values) < _ABSURD).all():
            raise FileError(
                f"'{name}' is damaged: #{face + 1} has coordinates or weights beyond {_ABSURD:.0e}", "export it again"
            )


def _stored(boxes: list[Array], surfaces: Iterable[tuple[list[int], Net]]) -> Iterator[tuple[int, Array]]:
    """The numbers of each face that the file states."""
    yield from enumerate(boxes)
    for members, net in surfaces:
        yield members[0], net.poles
        if net.weights is not None:
            yield members[0], net.weights


def _seen(edges: tuple[Edge, ...], found: _Found) -> Iterator[tuple[int, Array | float]]:
    """The evaluated numbers of each face, and its placement."""
    yield from enumerate(found.frames)
    for edge in edges:
        for side in edge.sides:
            yield side.face, edge.points
            for values in (side.uv, side.points, side.normals):
                if values is not None:
                    yield side.face, values


def _walk(document: Document, chosen: frozenset[int]) -> _Found:
    """Collect all faces and their edges."""
    found = _Found(document.faces)
    for part in document.parts:
        for index in part.numbers:
            face = TopoDS.Face_s(found.faces[index].Oriented(TopAbs_FORWARD))
            location = TopLoc_Location()
            ground = basis(BRep_Tool.Surface_s(face, location))
            replaced = conversion(document, index) if index in chosen and not is_nurbs(ground) else None
            handle = replaced.surface if replaced else ground
            members = found.surfaces.setdefault(handle, []) if is_nurbs(handle) else []
            members.append(index)
            found.grounds.append(ground)
            found.frames.append(matrix(location))
            found.surface_of.append(list(found.surfaces).index(handle) if handle in found.surfaces else None)
            for position, edge in enumerate(edge_uses(face)):
                place = part.edge_number(edge)
                curve = replaced.pcurves[position] if replaced else pcurve(edge, face)
                found.uses.append(_Use(index, place, curve, *BRep_Tool.Range_s(edge, face)))
    return found


def pcurve(edge: TopoDS_Edge, face: TopoDS_Face) -> Geom2d_Curve:
    """The edge's curve in the parameter plane of a face, made by projection if the file lacks it."""
    curve = BRep_Tool.CurveOnSurface_s(edge, face, 0.0, 0.0)
    if curve is None:
        ShapeFix_Edge().FixAddPCurve(edge, face, False)
        curve = BRep_Tool.CurveOnSurface_s(edge, face, 0.0, 0.0)
    return curve


def _trims(found: _Found, edges: Container[int] | None) -> dict[int, tuple[Trim, ...]]:
    """The boundaries of the NURBS faces, by face."""
    meant = {use.face for use in found.uses if edges is None or use.edge in edges}
    uses = [use for use in found.uses if found.surface_of[use.face] is not None and use.face in meant]
    trims: dict[int, tuple[Trim, ...]] = {}
    for use, curve in zip(uses, curves([(u.pcurve, u.first, u.last) for u in uses]), strict=True):
        trims[use.face] = (*trims.get(use.face, ()), Trim(use.edge, curve))
    return trims


def _edges(document: Document, found: _Found, edges: Container[int] | None) -> Iterator[Edge]:
    """All edges, the chosen ones with samples."""
    part_of = np.repeat(np.arange(len(document.parts)), [part.edges.Extent() for part in document.parts]).tolist()
    by_edge: list[list[_Use]] = [[] for _ in document.edges]
    for use in found.uses:
        by_edge[use.edge].append(use)
    seen = [edges is None or index in edges for index in range(len(by_edge))]
    lost = [BRep_Tool.Degenerated_s(edge) for edge in document.edges]
    along = [
        _along(edge) if shown and not gone else (_NONE, _NONE)
        for edge, shown, gone in zip(document.edges, seen, lost, strict=True)
    ]
    fixed = [use for use in found.uses if found.surface_of[use.face] is None and seen[use.edge] and not lost[use.edge]]
    beside = _beside(found, fixed, along)
    for index, (edge, uses) in enumerate(zip(document.edges, by_edge, strict=True)):
        points, tangents = along[index]
        sides = []
        for use in uses:
            if not seen[index] or (lost[index] and found.surface_of[use.face] is None):
                sides.append(Side(use.face, points=_NONE, normals=_NONE))
            elif found.surface_of[use.face] is None:
                feet, normals, bends = beside[use]
                sides.append(Side(use.face, points=feet, normals=normals, curvatures=bends))
            else:
                sides.append(Side(use.face, uv=_parameters(use)))
        yield Edge(
            index, points, tangents, tuple(sides), BRep_Tool.Tolerance_s(edge), lost[index] or not seen[index],
            part_of[index],
        )  # fmt: skip


def _along(edge: TopoDS_Edge) -> tuple[Array, Array]:
    """Points and unit tangents along an edge."""
    curve = BRepAdaptor_Curve(edge)
    first, last = curve.FirstParameter(), curve.LastParameter()
    place = first + (last - first) * _SPREAD
    if curve.GetType() == GeomAbs_Line:
        line = curve.Line()
        direction = np.array(line.Direction().Coord())
        return np.array(line.Location().Coord()) + place[:, None] * direction, np.tile(direction, (SAMPLES, 1))
    point, tangent = gp_Pnt(), gp_Vec()
    rows = []
    for t in place.tolist():
        curve.D1(t, point, tangent)
        rows.append(point.Coord() + tangent.Coord())
    table = np.array(rows)
    return table[:, :3], unit(table[:, 3:])


def _beside(
    found: _Found, uses: list[_Use], along: list[tuple[Array, Array]]
) -> dict[_Use, tuple[Array, Array, Array]]:
    """Points, outward normals and curvatures across an edge of faces that do not move, by their uses."""
    sides: dict[_Use, tuple[Array, Array, Array]] = {}
    grounds = {face: BRepAdaptor_Surface(found.faces[face], False) for face in {use.face for use in uses}}
    signs = {face: -1.0 if found.faces[face].Orientation() == TopAbs_REVERSED else 1.0 for face in grounds}
    bent, jets = [], []
    for use in uses:
        surface = grounds[use.face]
        if surface.GetType() == GeomAbs_Plane:
            plane, points = surface.Plane(), along[use.edge][0]
            origin = np.array(plane.Location().Coord())
            normal = np.array(plane.Axis().Direction().Coord()) * signs[use.face] * (1.0 if plane.Direct() else -1.0)
            feet = points - ((points - origin) @ normal)[:, None] * normal
            sides[use] = feet, np.tile(normal, (SAMPLES, 1)), np.zeros(SAMPLES)
        else:
            bent.append(use)
            jets.append(_jets(surface, _parameters(use)))
    if bent:
        feet, su, sv, *second = np.concatenate(jets).swapaxes(0, 1)
        sign = np.repeat([signs[use.face] for use in bent], SAMPLES)
        normals = unit(cross(su, sv))
        tangents = np.concatenate([along[use.edge][1] for use in bent])
        bends = sign * curvature((su, sv, *second), cross(normals, tangents))
        split = (np.split(values, len(bent)) for values in (feet, sign[:, None] * normals, bends))
        sides |= dict(zip(bent, zip(*split, strict=True), strict=True))
    return sides


def _jets(surface: BRepAdaptor_Surface, uv: Array) -> Array:
    """Points and derivatives u, v, uu, uv, vv of a surface that is not a plane, ``(k, 6, 3)``."""
    round_about = _profile(surface, uv[:, 1])
    if round_about is not None:
        position, rho, zeta = round_about
        x, y, z = (np.array(d.Coord()) for d in (position.XDirection(), position.YDirection(), position.Direction()))
        cos, sin = np.cos(uv[:, 0])[:, None], np.sin(uv[:, 0])[:, None]
        out, on = cos * x + sin * y, cos * y - sin * x
        (r, dr, ddr), (h, dh, ddh) = (each[..., None] for each in rho), (each[..., None] for each in zeta)
        origin = np.array(position.Location().Coord())
        jet = origin + r * out + h * z, r * on, dr * out + dh * z, -r * out, dr * on, ddr * out + ddh * z
        return np.stack(jet, axis=1)
    point, *derivatives = gp_Pnt(), *(gp_Vec() for _ in range(5))
    du, dv, duu, dvv, duv = derivatives
    rows = []
    for u, v in uv.tolist():
        surface.D2(u, v, point, du, dv, duu, dvv, duv)
        rows.append(point.Coord() + du.Coord() + dv.Coord() + duu.Coord() + duv.Coord() + dvv.Coord())
    return np.array(rows).reshape(-1, 6, 3)


def _profile(surface: BRepAdaptor_Surface, v: Array) -> tuple[gp_Ax3, Array, Array] | None:
    """The frame of a surface of revolution of a line or circle, and the profile's distance from the axis and height,
    with two derivatives each, ``(3, k)``; None for other surfaces."""
    zero, one = np.zeros_like(v), np.ones_like(v)
    cos, sin = np.cos(v), np.sin(v)
    match surface.GetType():
        case GeomAbs_SurfaceType.GeomAbs_Cylinder:
            kind = surface.Cylinder()
            rho, zeta = (kind.Radius() * one, zero, zero), (v, one, zero)
        case GeomAbs_SurfaceType.GeomAbs_Cone:
            kind = surface.Cone()
            slope, rise = np.sin(kind.SemiAngle()), np.cos(kind.SemiAngle())
            rho, zeta = (kind.RefRadius() + slope * v, slope * one, zero), (rise * v, rise * one, zero)
        case GeomAbs_SurfaceType.GeomAbs_Sphere:
            kind = surface.Sphere()
            r = kind.Radius()
            rho, zeta = (r * cos, -r * sin, -r * cos), (r * sin, r * cos, -r * sin)
        case GeomAbs_SurfaceType.GeomAbs_Torus:
            kind = surface.Torus()
            r = kind.MinorRadius()
            rho, zeta = (kind.MajorRadius() + r * cos, -r * sin, -r * cos), (r * sin, r * cos, -r * sin)
        case _:
            return None
    return kind.Position(), np.array(rho), np.array(zeta)


def _parameters(use: _Use) -> Array:
    """Surface parameters at the edge's samples, ``(k, 2)``."""
    place = use.first + (use.last - use.first) * _SPREAD
    if isinstance(use.pcurve, Geom2d_Line):
        line = use.pcurve.Lin2d()
        return np.array(line.Location().Coord()) + place[:, None] * np.array(line.Direction().Coord())
    return np.array([point.Coord() for point in map(use.pcurve.Value, place.tolist())])
