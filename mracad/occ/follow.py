"""Edges and vertices that follow their faces."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping
from contextlib import contextmanager

from OCP.BRep import BRep_Builder, BRep_Tool
from OCP.BRepAdaptor import BRepAdaptor_Curve
from OCP.BRepLib import BRepLib
from OCP.gp import gp_Pnt, gp_Vec
from OCP.TopAbs import TopAbs_FORWARD
from OCP.TopExp import TopExp
from OCP.TopoDS import TopoDS, TopoDS_Edge, TopoDS_Face
from OCP.TopTools import TopTools_MapOfShape

from mracad.occ.document import Document
from mracad.occ.slide import Sliding
from mracad.occ.topology import edge_uses, validated

_TOLERANCE = 1e-7  # memory units
_ABOVE = 1 + 1e-6  # factor on the distance that the kernel finds, for a tolerance that it accepts


@contextmanager
def following(
    document: Document, edges: Mapping[int, int], faces: Collection[int], sliding: Sliding | None = None
) -> Iterator[None]:
    """Let edges follow faces that move inside the block: they get new 3D curves on the faces, and vertices move by as
    much as the ends of the edges' curves on the faces.

    A stale curve must never be left to the kernel, which would hide it in a large tolerance.  The faces of an edge must
    move together: its curves on them stay.  An edge that slid gets a new curve on its face that stays, and edges along
    which its vertices moved end there.  A vertex stays as far from the ends of its edges as it was, so that edges that
    do not move get no gap there that a reader would close.  An edge never gets a smaller tolerance than it had: files
    state the mean of all, by which a reader would heal edges that did not change.  An edge that stays may get a larger
    one: kernels state tolerances as tightly as possible, and evaluate moved surfaces of high degree slightly
    differently.

    Parameters
    ----------
    document : Document
    edges : mapping of int to int
        Indices of edges, none of them degenerate, each with a face that it bounds.
    faces : collection of int
        Indices of the faces that move.
    sliding : Sliding, optional
        Edges that slide, and edges that end on them.
    """
    builder = BRep_Builder()
    chosen = [
        (TopoDS.Edge_s(document.edges[edge].Oriented(TopAbs_FORWARD)), TopoDS.Face_s(document.faces[face]))
        for edge, face in edges.items()
    ]
    old = [_ends(*each) for each in chosen]
    tolerances = [_own(edge) for edge, _ in chosen]
    near = [
        (edge, face)
        for edge, face in _uses(document, faces)
        if validated(edge, face, BRep_Tool.SameParameter_s(edge)).CheckTolerance(_own(edge))
    ]
    yield
    beside = sliding.bare() if sliding else []
    for (edge, _), tolerance in zip(chosen, tolerances, strict=True):
        builder.UpdateEdge(edge, None, _TOLERANCE)
        BRepLib.BuildCurve3d_s(edge, _TOLERANCE)
        builder.SameRange(edge, True)
        builder.SameParameter(edge, False)
        BRepLib.SameParameter_s(edge, _TOLERANCE)
        builder.UpdateEdge(edge, tolerance)
    moved = TopTools_MapOfShape()
    for (edge, face), ends in zip(chosen, old, strict=True):
        vertices = TopExp.FirstVertex_s(edge), TopExp.LastVertex_s(edge)
        for vertex, before, now in zip(vertices, ends, _ends(edge, face), strict=True):
            if moved.Add(vertex):
                place = BRep_Tool.Pnt_s(vertex).Translated(gp_Vec(before, now))
                builder.UpdateVertex(vertex, place, BRep_Tool.Tolerance_s(vertex))
    near += sliding.again(beside) if sliding else []
    for edge, face in near:
        found = validated(edge, face, BRep_Tool.SameParameter_s(edge))
        if not found.CheckTolerance(_own(edge)):
            builder.UpdateEdge(edge, _ABOVE * found.GetMaxDistance())
    for part in document.parts if near else ():
        BRepLib.UpdateTolerances_s(part.shape)


def _uses(document: Document, faces: Collection[int]) -> Iterator[tuple[TopoDS_Edge, TopoDS_Face]]:
    """The edges of faces as the faces use them, without degenerate ones."""
    for face in (TopoDS.Face_s(document.faces[index].Oriented(TopAbs_FORWARD)) for index in faces):
        yield from ((edge, face) for edge in edge_uses(face) if not BRep_Tool.Degenerated_s(edge))


def _own(edge: TopoDS_Edge) -> float:
    return float(BRep_Tool.Tolerance_s(edge))


def _ends(edge: TopoDS_Edge, face: TopoDS_Face) -> tuple[gp_Pnt, gp_Pnt]:
    """Start and end point of the curve of an edge on a face."""
    curve = BRepAdaptor_Curve(edge, face)
    return curve.Value(curve.FirstParameter()), curve.Value(curve.LastParameter())
