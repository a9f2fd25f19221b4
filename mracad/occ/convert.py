"""Analytic, swept and offset faces as NURBS faces, without touching the topology."""

from __future__ import annotations

from collections.abc import Sequence

from OCP.BRep import BRep_Builder, BRep_Tool
from OCP.BRepBuilderAPI import BRepBuilderAPI_Copy, BRepBuilderAPI_NurbsConvert
from OCP.BRepCheck import BRepCheck_Analyzer
from OCP.BRepLib import BRepLib
from OCP.Geom import Geom_BSplineSurface, Geom_Surface
from OCP.Geom2d import Geom2d_Curve
from OCP.TopAbs import TopAbs_FORWARD, TopAbs_REVERSED
from OCP.TopLoc import TopLoc_Location
from OCP.TopoDS import TopoDS, TopoDS_Edge, TopoDS_Face

from mracad.errors import EditError
from mracad.occ.document import Conversion, Document
from mracad.occ.topology import edge_uses

_LEAST = 3  # degree in both directions: with a lower one, edits would make facets
_SLACK = 1e-4  # memory units by which an edge's tolerance may grow in a conversion: offsets are approximated


def conversion(document: Document, index: int) -> Conversion:
    """The NURBS form of a face: made once, kept with the document, not yet put on the face.

    A copy of the face is put on the surface that the kernel's conversion finds, and the new pcurves are reparameterised
    to the edges' own 3D curves, which stay unchanged.

    Parameters
    ----------
    document : Document
    index : int
        Index of a face whose surface is not NURBS.

    Raises
    ------
    EditError
        When the kernel cannot convert it, or the result is invalid or less accurate.
    """
    if index not in document.conversions:
        bare = document.faces[index].Located(TopLoc_Location()).Oriented(TopAbs_FORWARD)
        copied = TopoDS.Face_s(BRepBuilderAPI_Copy(bare, True, False).Shape())
        converter = BRepBuilderAPI_NurbsConvert(copied, True)
        if not converter.IsDone():
            raise EditError(f"face #{index + 1} cannot be converted to NURBS", "leave it out of the selection")
        converted = TopoDS.Face_s(converter.ModifiedShape(copied))
        surface = BRep_Tool.Surface_s(converted, TopLoc_Location())
        if isinstance(surface, Geom_BSplineSurface):
            surface.IncreaseDegree(max(surface.UDegree(), _LEAST), max(surface.VDegree(), _LEAST))
        edges = list(edge_uses(copied))
        twins = [TopoDS.Edge_s(converter.ModifiedShape(edge).Oriented(edge.Orientation())) for edge in edges]
        tolerances = [BRep_Tool.Tolerance_s(edge) for edge in edges]
        lay(copied, surface, [_pcurve(twin, converted) for twin in twins], tolerances)
        for edge, tolerance in zip(edges, tolerances, strict=True):
            if not BRep_Tool.Degenerated_s(edge):
                BRep_Builder().SameParameter(edge, False)
                BRepLib.SameParameter_s(edge, tolerance)
        needed = [BRep_Tool.Tolerance_s(edge) for edge in edges]
        worse = any(new > 1.5 * old + _SLACK for new, old in zip(needed, tolerances, strict=True))
        if worse or not BRepCheck_Analyzer(copied).IsValid():
            raise EditError(
                f"the kernel's conversion of face #{index + 1} to NURBS is not valid", "leave it out of the selection"
            )
        document.conversions[index] = Conversion(surface, [_pcurve(edge, copied) for edge in edges], needed)
    return document.conversions[index]


def lay(face: TopoDS_Face, surface: Geom_Surface, pcurves: Sequence[Geom2d_Curve], tolerances: Sequence[float]) -> None:
    """Put a face on another surface of the same shape.

    Parameters
    ----------
    face : TopoDS_Face
        The face, forward.
    surface : Geom_Surface
        The new surface, in the frame of the present one.
    pcurves : sequence of Geom2d_Curve
        For each edge use of the face, in its own order, the curve on ``surface``.
    tolerances : sequence of float
        Tolerances of those curves.
    """
    location = TopLoc_Location()
    BRep_Tool.Surface_s(face, location)
    builder = BRep_Builder()
    edges = list(edge_uses(face))
    builder.UpdateFace(face, surface, location, BRep_Tool.Tolerance_s(face))
    for edge, pcurve, tolerance in zip(edges, pcurves, tolerances, strict=True):
        twin = next((other for other in zip(edges, pcurves, strict=True) if _opposite(edge, other[0])), None)
        if twin is None:
            builder.UpdateEdge(edge, pcurve, surface, location, tolerance)
        elif edge.Orientation() != TopAbs_REVERSED:
            builder.UpdateEdge(edge, pcurve, twin[1], surface, location, tolerance)


def _opposite(edge: TopoDS_Edge, other: TopoDS_Edge) -> bool:
    """Whether two uses are the two sides of a closing edge."""
    return edge.IsSame(other) and edge.Orientation() != other.Orientation()


def _pcurve(edge: TopoDS_Edge, face: TopoDS_Face) -> Geom2d_Curve:
    return BRep_Tool.CurveOnSurface_s(edge, face, 0.0, 0.0)
