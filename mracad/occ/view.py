"""A document as a kernel-free Model."""

from __future__ import annotations

from collections.abc import Callable, Container, Iterable, Iterator
from dataclasses import dataclass, field, replace

import numpy as np
from OCP.BRep import BRep_Tool
from OCP.BRepAdaptor import BRepAdaptor_Curve, BRepAdaptor_Surface
from OCP.Geom import Geom_Plane, Geom_Surface
from OCP.Geom2d import Geom2d_Curve, Geom2d_Line
from OCP.GeomAbs import GeomAbs_Line
from OCP.gp import gp_Pnt, gp_Vec
from OCP.ShapeFix import ShapeFix_Edge
from OCP.TopAbs import TopAbs_FORWARD, TopAbs_REVERSED
from OCP.TopLoc import TopLoc_Location
from OCP.TopoDS import TopoDS, TopoDS_Edge, TopoDS_Face

from mracad.bspline.net import Net, cross, curvature
from mracad.errors import FileError, UsageError
from mracad.model import Edge, Face, Model, Side, Surface, Trim
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
_SAMPLES = 25
# fractions of an edge's range: Chebyshev points, close to the ends but never on them
_SPREAD = 0.5 - 0.5 * np.cos(np.pi * (np.arange(_SAMPLES) + 0.5) / _SAMPLES)
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
        Faces on analytic, swept or offset surfaces that are to be seen as NURBS faces as well.  Their surfaces are
        put on them only by ``apply``, where they move.
    edges : container of int, optional
        Edges that are sampled, and whose faces have trims; by default all.  With some alone the diagonal is that of the
        boxes of the parts' control points.

    Raises
    ------
    UsageError
        For a face that does not exist.
    EditError
        For a face that the kernel cannot convert.
    FileError
        For a face whose numbers no model can have.
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
                face.Orientation() == TopAbs_REVERSED, found.frames[index], boxes[index],
                part.face_names.get(index - part.first, ""), part.product,
                part.face_colour(index - part.first) or part.tint, len(part.placements),
            )
            for part in document.parts
            for index, face in enumerate(found.faces[part.first : part.first + part.faces.Extent()], part.first)
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
    """The diagonal of boxes, as if every part stood in its own frame."""
    low, high = np.min(boxes, axis=0)[0], np.max(boxes, axis=0)[1]
    return float(np.linalg.norm(high - low))


def _refuse_absurd(name: str, numbers: Iterable[tuple[int, Array | float]]) -> None:
    """Raise FileError where numbers of a face are infinite, undefined or astronomic: nothing comes of them."""
    for face, values in numbers:
        if not (np.abs(values) < _ABSURD).all():
            raise FileError(
                f"'{name}' is damaged: #{face + 1} has coordinates or weights beyond {_ABSURD:.0e}", "export it again"
            )


def _stored(boxes: list[Array], surfaces: Iterable[tuple[list[int], Net]]) -> Iterator[tuple[int, Array]]:
    """What the file says of each face."""
    yield from enumerate(boxes)
    for members, net in surfaces:
        yield members[0], net.poles
        if net.weights is not None:
            yield members[0], net.weights


def _seen(edges: tuple[Edge, ...], found: _Found) -> Iterator[tuple[int, Array | float]]:
    """What was evaluated of each face, and where it stands."""
    yield from enumerate(found.frames)
    for edge in edges:
        for side in edge.sides:
            yield side.face, edge.points
            for values in (side.uv, side.points, side.normals):
                if values is not None:
                    yield side.face, values


def _walk(document: Document, chosen: frozenset[int]) -> _Found:
    """Go through all faces and their edges."""
    found = _Found(document.faces)
    for part in document.parts:
        for index in range(part.first, part.first + part.faces.Extent()):
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
                place = part.first_edge + part.edges.FindIndex(edge) - 1
                curve = replaced.pcurves[position] if replaced else pcurve(edge, face)
                found.uses.append(_Use(index, place, curve, *BRep_Tool.Range_s(edge, face)))
    return found


def pcurve(edge: TopoDS_Edge, face: TopoDS_Face) -> Geom2d_Curve:
    """The edge's curve in the parameter plane of a face; made by projection where the file lacks it."""
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
    """All edges, those that are meant with their samples."""
    part_of = np.repeat(np.arange(len(document.parts)), [part.edges.Extent() for part in document.parts]).tolist()
    by_edge: list[list[_Use]] = [[] for _ in document.edges]
    for use in found.uses:
        by_edge[use.edge].append(use)
    walls = {use.face: _wall(found, use.face) for use in found.uses if found.surface_of[use.face] is None}
    for index, (edge, uses) in enumerate(zip(document.edges, by_edge, strict=True)):
        if edges is not None and index not in edges:
            unseen = tuple(Side(use.face, points=_NONE, normals=_NONE) for use in uses)
            yield Edge(index, _NONE, _NONE, unseen, BRep_Tool.Tolerance_s(edge), True, part_of[index])
            continue
        degenerate = BRep_Tool.Degenerated_s(edge)
        points, tangents = (_NONE, _NONE) if degenerate else _along(edge)
        sides = []
        for use in uses:
            if use.face not in walls:
                sides.append(Side(use.face, uv=_parameters(use)))
            elif degenerate:
                sides.append(Side(use.face, points=_NONE, normals=_NONE))
            else:
                feet, normals, bends = walls[use.face](use, points, tangents)
                sides.append(Side(use.face, points=feet, normals=normals, curvatures=bends))
        yield Edge(
            index, points, tangents, tuple(sides), BRep_Tool.Tolerance_s(edge), degenerate,
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
        return np.array(line.Location().Coord()) + place[:, None] * direction, np.tile(direction, (_SAMPLES, 1))
    point, tangent = gp_Pnt(), gp_Vec()
    rows = []
    for t in place.tolist():
        curve.D1(t, point, tangent)
        rows.append(point.Coord() + tangent.Coord())
    table = np.array(rows)
    return table[:, :3], _unit(table[:, 3:])


def _wall(found: _Found, index: int) -> Callable[[_Use, Array, Array], tuple[Array, Array, Array]]:
    """How a face that does not move gives its points, outward normals and curvatures across an edge."""
    face = found.faces[index]
    sign = -1.0 if face.Orientation() == TopAbs_REVERSED else 1.0
    surface = BRepAdaptor_Surface(face, False)
    if isinstance(found.grounds[index], Geom_Plane):
        plane = surface.Plane()
        origin = np.array(plane.Location().Coord())
        normal = np.array(plane.Axis().Direction().Coord()) * (sign if plane.Direct() else -sign)
        return lambda use, points, tangents: (
            points - ((points - origin) @ normal)[:, None] * normal,
            np.tile(normal, (_SAMPLES, 1)),
            np.zeros(_SAMPLES),
        )

    def on_surface(use: _Use, _: Array, tangents: Array) -> tuple[Array, Array, Array]:
        point, *derivatives = gp_Pnt(), *(gp_Vec() for _ in range(5))
        du, dv, duu, dvv, duv = derivatives
        rows = []
        for u, v in _parameters(use).tolist():
            surface.D2(u, v, point, du, dv, duu, dvv, duv)
            rows.append(point.Coord() + du.Coord() + dv.Coord() + duu.Coord() + duv.Coord() + dvv.Coord())
        feet, su, sv, *second = np.array(rows).reshape(-1, 6, 3).swapaxes(0, 1)
        normals = _unit(cross(su, sv))
        bends = sign * curvature((su, sv, *second), cross(normals, tangents))
        return feet, sign * normals, bends

    return on_surface


def _parameters(use: _Use) -> Array:
    """Surface parameters at the edge's samples, ``(k, 2)``."""
    place = use.first + (use.last - use.first) * _SPREAD
    if isinstance(use.pcurve, Geom2d_Line):
        line = use.pcurve.Lin2d()
        return np.array(line.Location().Coord()) + place[:, None] * np.array(line.Direction().Coord())
    return np.array([point.Coord() for point in map(use.pcurve.Value, place.tolist())])


def _unit(vectors: Array) -> Array:
    """Vectors of length 1; a vanishing one stays zero."""
    lengths = np.linalg.norm(vectors, axis=1, keepdims=True)
    return vectors / np.where(lengths > 0, lengths, 1.0)
