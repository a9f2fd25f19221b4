"""Traversal of shapes, and their placements and boxes as arrays."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

import numpy as np
from OCP.Adaptor3d import Adaptor3d_CurveOnSurface
from OCP.Bnd import Bnd_Box
from OCP.BRep import BRep_Builder, BRep_Tool
from OCP.BRepAdaptor import BRepAdaptor_Curve, BRepAdaptor_Curve2d, BRepAdaptor_Surface
from OCP.BRepBndLib import BRepBndLib
from OCP.BRepLib import BRepLib_ValidateEdge
from OCP.Geom2d import Geom2d_Curve
from OCP.ShapeFix import ShapeFix_Edge
from OCP.TopAbs import TopAbs_EDGE, TopAbs_SOLID
from OCP.TopExp import TopExp, TopExp_Explorer
from OCP.TopLoc import TopLoc_Location
from OCP.TopoDS import TopoDS, TopoDS_Compound, TopoDS_Edge, TopoDS_Face, TopoDS_Shape
from OCP.TopTools import TopTools_IndexedMapOfShape

Array = np.ndarray


def edge_uses(face: TopoDS_Face) -> Iterator[TopoDS_Edge]:
    """The edges of a forward face as the face uses them; a closing edge comes twice."""
    explorer = TopExp_Explorer(face, TopAbs_EDGE)
    while explorer.More():
        yield TopoDS.Edge_s(explorer.Current())
        explorer.Next()


def pcurve(edge: TopoDS_Edge, face: TopoDS_Face) -> Geom2d_Curve:
    """The edge's curve in the parameter plane of a face, made by projection if the file lacks it."""
    curve = BRep_Tool.CurveOnSurface_s(edge, face, 0.0, 0.0)
    if curve is None:
        ShapeFix_Edge().FixAddPCurve(edge, face, False)
        curve = BRep_Tool.CurveOnSurface_s(edge, face, 0.0, 0.0)
    return curve


def validated(edge: TopoDS_Edge, face: TopoDS_Face, together: bool) -> BRepLib_ValidateEdge:
    """The kernel's distance between an edge and its curve on a face, at equal parameters if ``together``."""
    on_face = Adaptor3d_CurveOnSurface(BRepAdaptor_Curve2d(edge, face), BRepAdaptor_Surface(face, False))
    found = BRepLib_ValidateEdge(BRepAdaptor_Curve(edge), on_face, together)
    found.Process()
    return found


def inside(shape: TopoDS_Shape, kind) -> Iterator[TopoDS_Shape]:
    """The distinct sub-shapes of one kind."""
    found = TopTools_IndexedMapOfShape()
    TopExp.MapShapes_s(shape, kind, found)
    return (found.FindKey(i) for i in range(1, found.Extent() + 1))


def compound(shapes: Iterable[TopoDS_Shape]) -> TopoDS_Compound:
    """A compound of shapes."""
    whole = TopoDS_Compound()
    builder = BRep_Builder()
    builder.MakeCompound(whole)
    for shape in shapes:
        builder.Add(whole, shape)
    return whole


def matrix(location: TopLoc_Location) -> Array:
    """A location as a 4 × 4 matrix."""
    out = np.eye(4)
    if not location.IsIdentity():
        transform = location.Transformation()
        out[:3] = [[transform.Value(i, j) for j in (1, 2, 3, 4)] for i in (1, 2, 3)]
    return out


def placed(points: Array, frame: Array) -> Array:
    """Points ``(…, 3)`` transformed by a frame."""
    return np.asarray(points @ frame[:3, :3].T + frame[:3, 3])


def box(shape: TopoDS_Shape, tight: bool = False) -> Array:
    """Lowest and highest corner of a shape, ``(2, 3)``, memory units: never too small, at most that of its control
    points; ``tight`` ones are slow on NURBS."""
    bounds = Bnd_Box()
    if tight:
        BRepBndLib.AddOptimal_s(shape, bounds, False, False)
    else:
        BRepBndLib.Add_s(shape, bounds, False)
    return np.array([bounds.CornerMin().Coord(), bounds.CornerMax().Coord()])


def has_solids(shape: TopoDS_Shape) -> bool:
    """Whether a shape contains a solid."""
    return TopExp_Explorer(shape, TopAbs_SOLID).More()
