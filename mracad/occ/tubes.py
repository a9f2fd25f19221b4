"""Faces on surfaces that close both ways, rebuilt as two tubes whose closing edges avoid holes."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from OCP.BRep import BRep_Builder, BRep_Tool
from OCP.BRepAdaptor import BRepAdaptor_Curve2d
from OCP.Geom import Geom_BSplineSurface
from OCP.Geom2d import Geom2d_Curve, Geom2d_Line
from OCP.gp import gp_Dir2d, gp_Pnt2d, gp_Vec2d
from OCP.TopAbs import TopAbs_FORWARD
from OCP.TopExp import TopExp
from OCP.TopLoc import TopLoc_Location
from OCP.TopoDS import TopoDS, TopoDS_Edge, TopoDS_Face, TopoDS_Shell, TopoDS_Vertex, TopoDS_Wire

from mracad.occ.topology import edge_uses

Array = np.ndarray
_SAMPLES = 32  # points along an edge
_TOLERANCE = 1e-7


def tubes(face: TopoDS_Face) -> TopoDS_Shell | None:
    """Two tubes in place of a face that goes round both ways.

    Parameters
    ----------
    face : TopoDS_Face
        The face, forward.

    Returns
    -------
    TopoDS_Shell or None
        None if the surface does not close both ways, or holes leave no place for the closing edges.
    """
    location = TopLoc_Location()
    surface = BRep_Tool.Surface_s(face, location)
    if not (isinstance(surface, Geom_BSplineSurface) and surface.IsUClosed() and surface.IsVClosed()):
        return None
    surface = surface.Copy()
    surface.SetUPeriodic()
    surface.SetVPeriodic()
    periods = np.array([surface.UPeriod(), surface.VPeriod()])
    rims = [edge for edge in edge_uses(face) if not BRep_Tool.IsClosed_s(edge, face)]
    if any(BRep_Tool.Degenerated_s(edge) for edge in rims):
        return None
    paths = [along(edge, face) for edge in rims]
    if not paths:
        return None
    gaps = [_gaps([path[:, axis] for path in paths], periods[axis]) for axis in (0, 1)]
    if len(gaps[0]) < 2 or not gaps[1]:
        return None
    (start, middle), low = sorted(gaps[0][:2]), gaps[1][0]
    corner = np.array([start, low])
    moved = [periods * np.floor((path.mean(axis=0) - corner) / periods) for path in paths]
    builder, shell = BRep_Builder(), TopoDS_Shell()
    builder.MakeShell(shell)
    ends = start + periods[0], low + periods[1]
    knots = [(u, _vertex(surface, u, low)) for u in (start, middle)]
    rings = [_edge(surface.UIso(u), vertex, vertex, low, ends[1]) for u, vertex in knots]
    seams = [
        _edge(surface.VIso(low), knots[0][1], knots[1][1], start, middle),
        _edge(surface.VIso(low), knots[1][1], knots[0][1], middle, ends[0]),
    ]
    for side, (first, last) in enumerate(((start, middle), (middle, ends[0]))):
        own = surface.Copy()
        made = TopoDS_Face()
        builder.MakeFace(made, own, location, _TOLERANCE)
        seam, near, far = seams[side], rings[side], rings[1 - side]
        builder.UpdateEdge(seam, _line(0, low, 1), _line(0, ends[1], 1), own, location, _TOLERANCE)
        builder.UpdateEdge(near, _line(first, 0, 0), own, location, _TOLERANCE)
        builder.UpdateEdge(far, _line(last, 0, 0), own, location, _TOLERANCE)
        builder.Add(made, _wire([seam, far, TopoDS.Edge_s(seam.Reversed()), TopoDS.Edge_s(near.Reversed())]))
        inside = []
        for edge, path, shift in zip(rims, paths, moved, strict=True):
            if first < path[:, 0].mean() - shift[0] < last:
                builder.UpdateEdge(edge, _shifted(edge, face, -shift), own, location, BRep_Tool.Tolerance_s(edge))
                inside.append(edge)
        for loop in _loops(inside):
            builder.Add(made, _wire(loop))
        builder.Add(shell, made)
    return shell


def along(edge: TopoDS_Edge, face: TopoDS_Face) -> Array:
    """Parameters of the face along an edge, ``(n, 2)``."""
    curve = BRepAdaptor_Curve2d(edge, face)
    at = np.linspace(curve.FirstParameter(), curve.LastParameter(), _SAMPLES)
    return np.array([curve.Value(t).Coord() for t in at.tolist()])


def _gaps(values: list[Array], period: float) -> list[float]:
    """The middles of the parts of a circle that no run of values enters, the widest first."""
    runs = sorted((run.min() % period, np.ptp(run)) for run in values)
    found, reached = [], max(low + length for low, length in runs) - period
    for low, length in runs:
        if low > reached:
            found.append((low - reached, (low + reached) / 2))
        reached = max(reached, low + length)
    wide = sorted(found, reverse=True)
    if len(wide) == 1:
        width, middle = wide[0]
        return [middle - width / 4, middle + width / 4]
    return [middle for _, middle in wide]


def _vertex(surface: Geom_BSplineSurface, u: float, v: float) -> TopoDS_Vertex:
    vertex = TopoDS_Vertex()
    BRep_Builder().MakeVertex(vertex, surface.Value(u, v), _TOLERANCE)
    return vertex


def _edge(curve, start: TopoDS_Vertex, end: TopoDS_Vertex, first: float, last: float) -> TopoDS_Edge:
    edge = TopoDS_Edge()
    builder = BRep_Builder()
    builder.MakeEdge(edge, curve, _TOLERANCE)
    builder.Add(edge, start.Oriented(TopAbs_FORWARD))
    builder.Add(edge, end.Reversed())
    builder.Range(edge, first, last)
    return edge


def _line(u: float, v: float, axis: int) -> Geom2d_Line:
    """A line in the parameter plane along u (axis 1) or v (axis 0), parameterised by u or v."""
    return Geom2d_Line(gp_Pnt2d(u, v), gp_Dir2d(axis, 1 - axis))


def _shifted(edge: TopoDS_Edge, face: TopoDS_Face, by: Array) -> Geom2d_Curve:
    curve = BRep_Tool.CurveOnSurface_s(edge, face, 0.0, 0.0).Copy()
    curve.Translate(gp_Vec2d(*by.tolist()))
    return curve


def _wire(edges: list[TopoDS_Edge]) -> TopoDS_Wire:
    wire, builder = TopoDS_Wire(), BRep_Builder()
    builder.MakeWire(wire)
    for edge in edges:
        builder.Add(wire, edge)
    wire.Closed(True)
    return wire


def _loops(edges: list[TopoDS_Edge]) -> Iterator[list[TopoDS_Edge]]:
    """Edges grouped into loops, each in order."""
    left = list(edges)
    while left:
        loop = [left.pop()]
        while True:
            end = TopExp.LastVertex_s(loop[-1], True)
            follower = next((edge for edge in left if TopExp.FirstVertex_s(edge, True).IsSame(end)), None)
            if follower is None:
                break
            left.remove(follower)
            loop.append(follower)
        yield loop
