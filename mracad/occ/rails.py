"""Surfaces and curves along which the edges of a document can slide."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from OCP.BRep import BRep_Tool
from OCP.BRepAdaptor import BRepAdaptor_Curve, BRepAdaptor_Surface
from OCP.BRepGProp import BRepGProp
from OCP.Geom2d import Geom2d_Line
from OCP.GeomAbs import GeomAbs_CurveType, GeomAbs_SurfaceType
from OCP.gp import gp_Ax2, gp_Ax3
from OCP.GProp import GProp_GProps
from OCP.TopAbs import TopAbs_FORWARD, TopAbs_REVERSED, TopAbs_VERTEX
from OCP.TopExp import TopExp
from OCP.TopoDS import TopoDS, TopoDS_Edge, TopoDS_Face
from OCP.TopTools import TopTools_IndexedMapOfShape

from mracad.model.brep import Model
from mracad.model.rails import Elementary, Path, Rails
from mracad.occ.document import Document
from mracad.occ.settings import quiet

Array = np.ndarray


def railed(document: Document, model: Model) -> Model:
    """The view of a document, with the surfaces and curves along which its edges can slide."""
    with quiet():
        grounds = {
            face.index: ground
            for face in model.faces
            if face.surface is None and (ground := elementary(document.faces[face.index]))
        }
        ends, paths = _ends(document), {}
        for edge in model.edges:
            if not edge.degenerate and all(side.face in grounds for side in edge.sides):
                faces = [document.faces[side.face] for side in edge.sides]
                path = _path(document.edges[edge.index], faces)
                if path is not None:
                    paths[edge.index] = path
    return replace(model, rails=Rails(grounds, ends, paths))


def elementary(face: TopoDS_Face) -> Elementary | None:
    """The surface of a face in its part's frame, if it is a plane, cylinder, cone, sphere or torus."""
    surface = BRepAdaptor_Surface(face, False)
    numbers = 0.0, 0.0, 0.0
    match surface.GetType():
        case GeomAbs_SurfaceType.GeomAbs_Plane:
            name, kind = "plane", surface.Plane()
        case GeomAbs_SurfaceType.GeomAbs_Cylinder:
            name, kind = "cylinder", surface.Cylinder()
            numbers = kind.Radius(), 0.0, 0.0
        case GeomAbs_SurfaceType.GeomAbs_Cone:
            name, kind = "cone", surface.Cone()
            numbers = kind.RefRadius(), 0.0, kind.SemiAngle()
        case GeomAbs_SurfaceType.GeomAbs_Sphere:
            name, kind = "sphere", surface.Sphere()
            numbers = kind.Radius(), 0.0, 0.0
        case GeomAbs_SurfaceType.GeomAbs_Torus:
            name, kind = "torus", surface.Torus()
            numbers = kind.MajorRadius(), kind.MinorRadius(), 0.0
        case _:
            return None
    position = kind.Position()
    outward = (-1 if face.Orientation() == TopAbs_REVERSED else 1) * (1 if position.Direct() else -1)
    return Elementary(name, _frame(position), outward, *numbers)


def _frame(position: gp_Ax3 | gp_Ax2) -> Array:
    frame = np.eye(4)
    axes = position.XDirection(), position.YDirection(), position.Direction()
    frame[:3, :3] = np.array([axis.Coord() for axis in axes]).T
    frame[:3, 3] = position.Location().Coord()
    return frame


def _ends(document: Document) -> dict[int, tuple[int, int]]:
    """The vertices of each edge, numbered over the document."""
    found, first = {}, 0
    for part in document.parts:
        vertices = TopTools_IndexedMapOfShape()
        TopExp.MapShapes_s(part.shape, TopAbs_VERTEX, vertices)
        for place in range(1, part.edges.Extent() + 1):
            edge = TopoDS.Edge_s(part.edges.FindKey(place).Oriented(TopAbs_FORWARD))
            pair = TopExp.FirstVertex_s(edge), TopExp.LastVertex_s(edge)
            one, other = (-1 if each.IsNull() else first + vertices.FindIndex(each) for each in pair)
            found[part.first_edge + place - 1] = one, other
        first += vertices.Extent()
    return found


def _path(edge: TopoDS_Edge, faces: list[TopoDS_Face]) -> Path | None:
    """The line or circle of an edge between elementary faces; None if its curves cannot get longer."""
    if len(faces) == 2 and faces[0].IsSame(faces[1]) and not _straight(edge, faces[0]):
        return None
    curve = BRepAdaptor_Curve(edge)
    kind = curve.GetType()
    if kind == GeomAbs_CurveType.GeomAbs_Line:
        line = curve.Line()
        frame, radius = _frame(gp_Ax2(line.Location(), line.Direction())), 0.0
        frame = frame[:, [2, 0, 1, 3]]
    elif kind == GeomAbs_CurveType.GeomAbs_Circle:
        frame, radius = _frame(curve.Circle().Position()), curve.Circle().Radius()
    else:
        return None
    size = GProp_GProps()
    BRepGProp.LinearProperties_s(edge, size)
    return Path(frame, radius, size.Mass())


def _straight(edge: TopoDS_Edge, face: TopoDS_Face) -> bool:
    """Whether a closing edge lies on straight lines in the parameter plane, on both sides."""
    return all(
        isinstance(BRep_Tool.CurveOnSurface_s(TopoDS.Edge_s(each), face, 0.0, 0.0), Geom2d_Line)
        for each in (edge, edge.Reversed())
    )
