"""What a model is like at a place: the face, its parameters, its frame and its curvature there."""

from __future__ import annotations

import numpy as np
from OCP.BRep import BRep_Tool
from OCP.BRepAdaptor import BRepAdaptor_Surface
from OCP.BRepBuilderAPI import BRepBuilderAPI_MakeVertex
from OCP.BRepClass import BRepClass_FaceClassifier
from OCP.BRepExtrema import BRepExtrema_DistShapeShape, BRepExtrema_IsInFace
from OCP.BRepLProp import BRepLProp_SLProps
from OCP.BRepTools import BRepTools
from OCP.gp import gp_Dir, gp_Pnt, gp_Pnt2d
from OCP.ShapeAnalysis import ShapeAnalysis_Surface
from OCP.TopAbs import TopAbs_IN, TopAbs_ON, TopAbs_REVERSED
from OCP.TopoDS import TopoDS_Face

from mracad.errors import EditError
from mracad.model.brep import Model
from mracad.model.facts import Spot
from mracad.occ.document import Document
from mracad.occ.settings import quiet

Array = np.ndarray

CONFUSION = 1e-7
"""Points closer than this are one to the kernel, mm."""

POLE = 1e-9
"""Length of S_u over that of S_v below which u runs nowhere."""


def nearest(document: Document, model: Model, point: Array) -> Spot:
    """The place on the faces, within their trims, nearest to a point ``(3,)`` (mm), in their parts' frames."""
    low, high = np.array([face.box for face in model.faces]).swapaxes(0, 1)
    apart = np.linalg.norm(np.maximum(np.maximum(low - point, point - high), 0.0), axis=1)
    vertex = BRepBuilderAPI_MakeVertex(gp_Pnt(*point.tolist())).Vertex()
    best, found = np.inf, (0, np.zeros(2))
    with quiet():
        for index in np.argsort(apart, kind="stable").tolist():
            if apart[index] >= best:
                break
            face = document.faces[index]
            search = BRepExtrema_DistShapeShape(vertex, face)
            if search.IsDone() and search.NbSolution() and search.Value() < best - CONFUSION:
                best, found = search.Value(), (index, _parameters(face, search))
    return spot(document, *found, point)


def on_face(document: Document, index: int, uv: Array) -> Spot:
    """The place on a face at parameters ``(2,)``; raises EditError outside the face."""
    face = document.faces[index]
    if BRepClass_FaceClassifier(face, gp_Pnt2d(*uv.tolist()), CONFUSION).State() not in (TopAbs_IN, TopAbs_ON):
        low_u, high_u, low_v, high_v = BRepTools.UVBounds_s(face)
        text = f"#{index + 1}@{uv[0]:g},{uv[1]:g} is outside the face"
        within = f"its parameters lie within u {low_u:.6g} to {high_u:.6g}, v {low_v:.6g} to {high_v:.6g}"
        raise EditError(text, within)
    return spot(document, index, uv)


def _parameters(face: TopoDS_Face, search: BRepExtrema_DistShapeShape) -> Array:
    """Parameters of the nearest point of a face."""
    if search.SupportTypeShape2(1) == BRepExtrema_IsInFace:
        return np.array(search.ParOnFaceS2(1))
    uv = ShapeAnalysis_Surface(BRep_Tool.Surface_s(face)).ValueOfUV(search.PointOnShape2(1), CONFUSION)
    return np.array([uv.X(), uv.Y()])


def middles(document: Document) -> list[Spot]:
    """Every face in the middle of its parameters, whether or not a hole is there."""
    bounds = (np.array(BRepTools.UVBounds_s(face)).reshape(2, 2) for face in document.faces)
    return [spot(document, index, each.mean(axis=1)) for index, each in enumerate(bounds)]


def spot(document: Document, index: int, uv: Array, point: Array | None = None) -> Spot:
    """What a face is like at parameters ``(2,)``; ``point`` (mm) is what its distance is measured from."""
    face = document.faces[index]
    with quiet():
        there = BRepLProp_SLProps(BRepAdaptor_Surface(face), *uv.tolist(), 2, CONFUSION)
        at = np.array(there.Value().Coord())
        outward = -1.0 if face.Orientation() == TopAbs_REVERSED else 1.0
        normal = outward * np.array(there.Normal().Coord()) if there.IsNormalDefined() else None
        along, across = np.array(there.D1U().Coord()), np.array(there.D1V().Coord())
        bends: tuple[tuple[float, Array], ...] = ()
        if there.IsCurvatureDefined():
            ways = gp_Dir(), gp_Dir()
            there.CurvatureDirections(*ways)
            sizes = there.MaxCurvature(), there.MinCurvature()
            bends = tuple((-outward * k, np.array(way.Coord())) for k, way in zip(sizes, ways, strict=True))
    size = float(np.linalg.norm(along))
    along_u = along / size if size > POLE * np.linalg.norm(across) else None
    distance = 0.0 if point is None else float(np.linalg.norm(at - point))
    return Spot(index, (float(uv[0]), float(uv[1])), at, distance, normal, along_u, bends)
