"""Put an edit into the document: control points move in place, everything else stays."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from OCP.BRep import BRep_Builder, BRep_Tool
from OCP.BRepTools import BRepTools
from OCP.Geom import Geom_BezierSurface, Geom_BSplineSurface
from OCP.TColStd import TColStd_Array1OfInteger, TColStd_Array1OfReal
from OCP.TopAbs import TopAbs_FORWARD
from OCP.TopLoc import TopLoc_Location
from OCP.TopoDS import TopoDS

from mracad.errors import MracadError, UsageError
from mracad.model.brep import Model, Surface
from mracad.model.displacement import Displacement, Offset
from mracad.occ.convert import lay
from mracad.occ.document import Document
from mracad.occ.follow import following
from mracad.occ.geometry import basis, nets, set_poles, spline
from mracad.occ.labels import label_key
from mracad.occ.settings import quiet
from mracad.occ.slide import Sliding
from mracad.occ.topology import edge_uses

Array = np.ndarray
_STILL = 1e-9, 0.01  # mm, and share of its tolerance: an edge that moves by less keeps its curve


def apply(document: Document, model: Model, displacement: Displacement) -> Sliding | None:
    """Displace the surfaces of a document, in place.

    Degrees are raised and knots inserted exactly; then only control points with a non-zero offset move, and all others
    keep every bit.  Faces that ``view(document, convert=…)`` showed as NURBS are put on their new surfaces first.
    Edges that move get new 3D curves and vertices.  Triangulations are dropped.

    Parameters
    ----------
    document : Document
    model : Model
        The view of the document for which the displacement was made.
    displacement : Displacement

    Returns
    -------
    Sliding or None
        Edges that slid, as they were, for :func:`restore`.

    Raises
    ------
    UsageError
        For a degree above the kernel's highest.
    """
    if not displacement.offsets:
        return None
    highest, most = max(max(o.degrees) for o in displacement.offsets.values()), Geom_BSplineSurface.MaxDegree_s()
    if highest > most:
        raise UsageError(f"a surface of degree {highest} is beyond the kernel", f"use at most {most}")
    edges = _moved_edges(model, displacement)
    sliding = _sliding(document, model, displacement, edges) if displacement.slid else None
    with quiet(), following(document, edges, _moved_faces(model, displacement), sliding):
        for index, offset in sorted(displacement.offsets.items()):
            surface = model.surfaces[index]
            _move(_handle(document, surface, offset), offset)
        _forget(document)
        document.moved |= {label_key(document.part_of(face).label) for face in _moved_faces(model, displacement)}
    return sliding


def restore(document: Document, model: Model, displacement: Displacement, sliding: Sliding | None = None) -> None:
    """Undo :func:`apply`: every control point gets its old bits, and refined surfaces are replaced by the old ones.

    Faces that were converted stay on their (undisplaced) NURBS surfaces.  ``sliding`` is the result of :func:`apply`.
    """
    edges = {e: face for e, face in _moved_edges(model, displacement).items() if e not in displacement.slid}
    with quiet(), following(document, edges, _moved_faces(model, displacement)):
        for index in sorted(displacement.offsets):
            surface = model.surfaces[index]
            handle = basis(BRep_Tool.Surface_s(document.faces[surface.faces[0]], TopLoc_Location()))
            now = nets([handle])[0]
            if (now.u, now.v) == (surface.net.u, surface.net.v):
                set_poles(handle, surface.net.poles)
            else:
                _lay_all(document, surface, spline(surface.net))
        if sliding:
            sliding.restore()
        _forget(document)


def _handle(document: Document, surface: Surface, offset: Offset) -> Geom_BSplineSurface | Geom_BezierSurface:
    """The kernel's surface to be moved, refined as the offset requires; a new one is put on its faces.

    The kernel cannot raise the degree: its results are wrong for periodic surfaces with uneven multiplicities, and it
    fails where ends are not clamped.
    """
    fine, first = offset.over(surface.net), surface.faces[0]
    if first in document.conversions:
        made = document.conversions.pop(first)
        lay(TopoDS.Face_s(document.faces[first].Oriented(TopAbs_FORWARD)), made.surface, made.pcurves, made.tolerances)
        handle = made.surface
    else:
        handle = basis(BRep_Tool.Surface_s(document.faces[first], TopLoc_Location()))
    raised = (fine.u.degree, fine.v.degree) != (surface.net.u.degree, surface.net.v.degree)
    if raised or (fine is not surface.net and isinstance(handle, Geom_BezierSurface)):
        handle = spline(fine)
        _lay_all(document, surface, handle)
    elif fine is not surface.net:
        _refine(handle, offset)
    return handle


def _lay_all(document: Document, surface: Surface, handle: Geom_BSplineSurface) -> None:
    """Put all faces of a surface on another one with the same parameters."""
    for face in (TopoDS.Face_s(document.faces[index].Oriented(TopAbs_FORWARD)) for index in surface.faces):
        edges = list(edge_uses(face))
        pcurves = [BRep_Tool.CurveOnSurface_s(edge, face, 0.0, 0.0) for edge in edges]
        ranges = [BRep_Tool.Range_s(edge, face) for edge in edges]
        lay(face, handle, pcurves, [BRep_Tool.Tolerance_s(edge) for edge in edges])
        for edge, (first, last) in zip(edges, ranges, strict=True):
            BRep_Builder().Range(edge, face, first, last)  # without a 3D curve the kernel takes the range of the pcurve


def _refine(surface: Geom_BSplineSurface, offset: Offset) -> None:
    """Insert the knots that an offset brings."""
    for knots, insert in ((offset.u_knots, surface.InsertUKnots), (offset.v_knots, surface.InsertVKnots)):
        if knots.size:
            values, counts = np.unique(knots, return_counts=True)
            places = TColStd_Array1OfReal(1, len(values))
            times = TColStd_Array1OfInteger(1, len(values))
            for i, (value, count) in enumerate(zip(values.tolist(), counts.tolist(), strict=True), 1):
                places.SetValue(i, value)
                times.SetValue(i, count)
            insert(places, times, 0.0, True)


def _move(surface: Geom_BSplineSurface | Geom_BezierSurface, offset: Offset) -> None:
    """Add an offset to the control points of a surface."""
    poles = nets([surface])[0].poles
    if poles.shape != offset.poles.shape:
        raise MracadError(f"offsets of shape {offset.poles.shape} for a surface of {poles.shape} control points")
    set_poles(surface, np.where(offset.poles.any(axis=2, keepdims=True), poles + offset.poles, poles))


def _moved_faces(model: Model, displacement: Displacement) -> list[int]:
    return [face for index in sorted(displacement.offsets) for face in model.surfaces[index].faces]


def _moved_edges(model: Model, displacement: Displacement) -> dict[int, int]:
    """The edges along which some side moves, each with a face that moves there."""
    sides: dict[int, list[tuple[int, int, Array]]] = {index: [] for index in displacement.offsets}
    for edge in model.edges:
        for side in edge.sides:
            index = model.faces[side.face].surface
            if index in sides and side.uv is not None and not edge.degenerate:
                sides[index].append((edge.index, side.face, side.uv))
    moved: dict[int, int] = {}
    for index, offset in displacement.offsets.items():
        if sides[index]:
            along = offset.motion(model.surfaces[index].net).evaluate(np.concatenate([uv for *_, uv in sides[index]]))
            starts = np.cumsum([0, *(len(uv) for *_, uv in sides[index][:-1])])
            far = np.maximum.reduceat(np.linalg.norm(along, axis=1), starts)
            loose = np.array([model.edges[edge].tolerance for edge, *_ in sides[index]])
            beyond = far > np.maximum(_STILL[0], _STILL[1] * loose)
            moved |= {edge: face for (edge, face, _), off in zip(sides[index], beyond, strict=True) if off}
    return dict(sorted(moved.items()))


def _sliding(document: Document, model: Model, displacement: Displacement, moved: Mapping[int, int]) -> Sliding:
    """The edges that slide, and those that stay and end on them."""
    sliding = [edge for edge in displacement.slid if edge in moved]
    vertices = {vertex for edge in sliding for vertex in model.rails.ends[edge]}
    ending = [e for e in model.rails.paths if e not in moved and not vertices.isdisjoint(model.rails.ends[e])]
    edges = {i: TopoDS.Edge_s(document.edges[i].Oriented(TopAbs_FORWARD)) for i in (*sliding, *ending)}
    beside = {i: sorted({side.face for side in model.edges[i].sides} - {displacement.slid.get(i)}) for i in edges}
    faces = {i: [TopoDS.Face_s(document.faces[f].Oriented(TopAbs_FORWARD)) for f in beside[i]] for i in edges}
    return Sliding({i: (edges[i], faces[i][0]) for i in sliding}, {i: (edges[i], faces[i]) for i in ending})


def _forget(document: Document) -> None:
    """Drop what is out of date: triangulations, and curves on replaced surfaces."""
    for part in document.parts:
        BRepTools.Clean_s(part.shape)
        BRepTools.RemoveUnusedPCurves_s(part.shape)
