"""The kernel's verdict on a document, as plain data."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterable, Iterator

from OCP.BRep import BRep_Tool
from OCP.BRepCheck import BRepCheck_Analyzer, BRepCheck_NoError
from OCP.ShapeAnalysis import ShapeAnalysis_ShapeTolerance
from OCP.TopAbs import TopAbs_EDGE, TopAbs_FACE, TopAbs_FORWARD, TopAbs_SHELL, TopAbs_SOLID, TopAbs_VERTEX, TopAbs_WIRE
from OCP.TopoDS import TopoDS, TopoDS_Face, TopoDS_Shape

from mracad.model.facts import Failure, Validity
from mracad.occ.document import Document
from mracad.occ.settings import quiet, threads
from mracad.occ.topology import compound, edge_uses, inside, validated

_KINDS = {
    TopAbs_SOLID: "solid", TopAbs_SHELL: "shell", TopAbs_FACE: "face", TopAbs_WIRE: "wire", TopAbs_EDGE: "edge",
    TopAbs_VERTEX: "vertex",
}  # fmt: skip


def check(document: Document, faces: Iterable[int] | None = None, distances: bool = False) -> Validity:
    """Check the geometry of a document.

    Parameters
    ----------
    document : Document
    faces : iterable of int, optional
        Check only these, with their edges and vertices: those that an edit in place can have made invalid.  By default
        all, and also shells and solids.
    distances : bool
        Also measure ``curve_distance``.
    """
    chosen = range(len(document.faces)) if faces is None else sorted(set(faces))
    members = [document.faces[index] for index in chosen]
    subject = compound(members if faces is not None else [part.shape for part in document.parts])
    with quiet():
        analyzer = BRepCheck_Analyzer(subject, True, threads())
        failures = () if analyzer.IsValid() else tuple(_failures(analyzer, subject, chosen, members))
        tolerance = ShapeAnalysis_ShapeTolerance()
        shells = [shell for part in document.parts for shell in inside(part.shape, TopAbs_SHELL)]
        return Validity(
            valid=not failures,
            failures=failures,
            solids=sum(1 for part in document.parts for _ in inside(part.shape, TopAbs_SOLID)),
            shells=len(shells),
            faces=len(document.faces),
            open_shells=sum(not BRep_Tool.IsClosed_s(shell) for shell in shells),
            free_edges=sum(count == 1 for count in Counter(edge for edge, _, _ in looks(document)).values()),
            edge_tolerance=tolerance.Tolerance(subject, 1, TopAbs_EDGE),
            vertex_tolerance=tolerance.Tolerance(subject, 1, TopAbs_VERTEX),
            curve_distance=max(map(_distance, members), default=0.0) if distances else None,
        )


def lone_faces(document: Document) -> int:
    """Number of open shells of one face: STEP puts a face without a shell into one."""
    shells = (shell for part in document.parts for shell in inside(part.shape, TopAbs_SHELL))
    return sum(not BRep_Tool.IsClosed_s(shell) and len(list(inside(shell, TopAbs_FACE))) == 1 for shell in shells)


def _failures(
    analyzer: BRepCheck_Analyzer, subject: TopoDS_Shape, chosen: Iterable[int], members: list[TopoDS_Face]
) -> Iterator[Failure]:
    """All failures that the analyzer finds in the subject."""
    for kind in (TopAbs_SOLID, TopAbs_SHELL):
        for shape in inside(subject, kind):
            for status in _statuses(analyzer, shape, shape):
                yield Failure(_KINDS[kind], status, None)
    for index, face in zip(chosen, members, strict=True):
        if analyzer.IsValid(face):
            continue
        for kind in (TopAbs_FACE, TopAbs_WIRE, TopAbs_EDGE, TopAbs_VERTEX):
            for shape in inside(face, kind):
                for status in _statuses(analyzer, shape, face):
                    yield Failure(_KINDS[kind], status, index)


def _statuses(analyzer: BRepCheck_Analyzer, shape: TopoDS_Shape, context: TopoDS_Shape) -> list[str]:
    """Names of the failures of a shape, by itself and in the context of another."""
    result = analyzer.Result(shape)
    found = list(result.Status())
    result.InitContextIterator()
    while result.MoreShapeInContext():
        if result.ContextualShape().IsSame(context):
            found += list(result.StatusOnShape())
        result.NextShapeInContext()
    names = (status.name.removeprefix("BRepCheck_") for status in found if status != BRepCheck_NoError)
    return list(dict.fromkeys(names))


def _distance(face: TopoDS_Face) -> float:
    """Largest distance between the 3D curves of a face's edges and their curves on it, memory units."""
    forward = TopoDS.Face_s(face.Oriented(TopAbs_FORWARD))
    edges = (edge for edge in edge_uses(forward) if not BRep_Tool.Degenerated_s(edge))
    return max((validated(edge, forward, True).GetMaxDistance() for edge in edges), default=0.0)


def looks(document: Document) -> Iterator[tuple[int, int, bool]]:
    """Every use of an edge by a face of the document: edge, face, and whether the boundary runs along the edge."""
    for part in document.parts:
        for index in part.numbers:
            for edge in edge_uses(document.faces[index]):
                if not BRep_Tool.Degenerated_s(edge):
                    along = edge.Orientation() == TopAbs_FORWARD
                    yield part.edge_number(edge), index, along


def centres(document: Document) -> list[tuple[float, float, float]]:
    """The middle of the vertices of each face, in its part's frame, mm."""
    found = []
    for face in document.faces:
        points = [BRep_Tool.Pnt_s(TopoDS.Vertex_s(vertex)).Coord() for vertex in inside(face, TopAbs_VERTEX)]
        x, y, z = (sum(values) / len(points) for values in zip(*points, strict=True)) if points else (math.inf,) * 3
        found.append((x, y, z))
    return found
