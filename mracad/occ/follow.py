"""Edges and vertices that follow their faces."""

from __future__ import annotations

from collections.abc import Iterable

from OCP.BRep import BRep_Builder, BRep_Tool
from OCP.BRepAdaptor import BRepAdaptor_Curve
from OCP.BRepLib import BRepLib
from OCP.TopAbs import TopAbs_FORWARD
from OCP.TopExp import TopExp
from OCP.TopoDS import TopoDS

from mracad.occ.document import Document

_TOLERANCE = 1e-7  # memory units


def follow(document: Document, edges: Iterable[int]) -> None:
    """Give edges whose faces have moved 3D curves on their faces, and their vertices the ends of those curves.

    A stale curve must never be left to the kernel, which would hide it in a large tolerance.  The faces of an edge
    must have moved together: its curves on them stay.

    Parameters
    ----------
    document : Document
    edges : iterable of int
        Indices of edges, none of them degenerate.
    """
    builder = BRep_Builder()
    chosen = [TopoDS.Edge_s(document.edges[index].Oriented(TopAbs_FORWARD)) for index in edges]
    for edge in chosen:
        builder.UpdateEdge(edge, None, _TOLERANCE)
        BRepLib.BuildCurve3d_s(edge, _TOLERANCE)
        builder.SameRange(edge, True)
        builder.SameParameter(edge, False)
        BRepLib.SameParameter_s(edge, _TOLERANCE)
    for edge in chosen:
        curve = BRepAdaptor_Curve(edge)
        ends = (TopExp.FirstVertex_s(edge), curve.FirstParameter()), (TopExp.LastVertex_s(edge), curve.LastParameter())
        for vertex, place in ends:
            builder.UpdateVertex(vertex, curve.Value(place), BRep_Tool.Tolerance_s(vertex))
    for part in document.parts if chosen else ():
        BRepLib.UpdateTolerances_s(part.shape)
