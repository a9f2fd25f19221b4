"""Vertices, edges, faces, shells and solids of the kernel, and blocks with a sculpted top."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from OCP.BRep import BRep_Builder
from OCP.Geom import (
    Geom_BSplineCurve,
    Geom_BSplineSurface,
    Geom_Circle,
    Geom_Curve,
    Geom_CylindricalSurface,
    Geom_Line,
    Geom_Plane,
    Geom_Surface,
    Geom_SurfaceOfLinearExtrusion,
)
from OCP.Geom2d import Geom2d_Curve
from OCP.GeomAbs import GeomAbs_C2
from OCP.gp import gp_Ax3, gp_Dir, gp_Pnt
from OCP.TopAbs import TopAbs_FORWARD, TopAbs_REVERSED
from OCP.TopLoc import TopLoc_Location
from OCP.TopoDS import TopoDS_Edge, TopoDS_Face, TopoDS_Shell, TopoDS_Solid, TopoDS_Vertex, TopoDS_Wire

from .geometry import FINE, Path3, curve, line2d
from .splines import greville, settle

TOL = 1e-7
BUILD = BRep_Builder()


def vertex(point: Sequence[float], tolerance: float = TOL) -> TopoDS_Vertex:
    """Return a vertex."""
    shape = TopoDS_Vertex()
    BUILD.MakeVertex(shape, gp_Pnt(*map(float, point)), tolerance)
    return shape


def edge(
    path: Geom_Curve | None,
    ends: tuple[TopoDS_Vertex, TopoDS_Vertex],
    span: tuple[float, float],
    tolerance: float = TOL,
) -> TopoDS_Edge:
    """Return an edge along `path` over the parameters `span`; without a path it is degenerate."""
    shape = TopoDS_Edge()
    if path is None:
        BUILD.MakeEdge(shape)
        BUILD.Degenerated(shape, True)
    else:
        BUILD.MakeEdge(shape, path, tolerance)
        BUILD.Range(shape, *span)
    BUILD.Add(shape, ends[0].Oriented(TopAbs_FORWARD))
    BUILD.Add(shape, ends[1].Oriented(TopAbs_REVERSED))
    return shape


@dataclass(frozen=True)
class Side:
    """One step round a face: an edge, its curve in the parameter plane (none on a plane), and the sense walked."""

    edge: TopoDS_Edge
    path: Geom2d_Curve | None = None
    forward: bool = True


def face(
    on: Geom_Surface, loops: Sequence[Sequence[Side]], outward: bool = True, tolerance: float = TOL
) -> TopoDS_Face:
    """Return a face; outer loops run anticlockwise in the parameter plane, holes clockwise.

    A closing edge comes as two successive sides of one loop that name the same edge with two different curves.
    """
    shape = TopoDS_Face()
    BUILD.MakeFace(shape, on, tolerance)
    where = TopLoc_Location()
    for loop in loops:
        wire = TopoDS_Wire()
        BUILD.MakeWire(wire)
        for side in loop:
            BUILD.Add(wire, side.edge.Oriented(TopAbs_FORWARD if side.forward else TopAbs_REVERSED))
            other = next((item for item in loop if item is not side and item.edge.IsSame(side.edge)), None)
            if side.path is not None and other is None:
                BUILD.UpdateEdge(side.edge, side.path, on, where, tolerance)
            elif other is not None and side.forward:
                BUILD.UpdateEdge(side.edge, side.path, other.path, on, where, tolerance)
                BUILD.Continuity(side.edge, on, on, where, where, GeomAbs_C2)
        wire.Closed(True)
        BUILD.Add(shape, wire)
    return shape if outward else shape.Reversed()


def shell(faces: Sequence[TopoDS_Face], closed: bool = False) -> TopoDS_Shell:
    """Return the shell of faces that already share their edges."""
    shape = TopoDS_Shell()
    BUILD.MakeShell(shape)
    for item in faces:
        BUILD.Add(shape, item)
    shape.Closed(closed)
    return shape


def solid(faces: Sequence[TopoDS_Face]) -> TopoDS_Solid:
    """Return the solid inside a closed set of faces that point outward."""
    shape = TopoDS_Solid()
    BUILD.MakeSolid(shape)
    BUILD.Add(shape, shell(faces, closed=True))
    return shape


@dataclass(frozen=True)
class Rim:
    """One edge of the top of a `block`.

    Its curve in space, in the parameter plane of the top and on the ground z = 0 share one parameter.
    """

    path: Path3
    plane: Geom2d_Curve
    ground: Geom_Line | Geom_Circle | Geom_BSplineCurve
    span: tuple[float, float]
    forward: bool = True
    tolerance: float = TOL

    def wall(self) -> Geom_Surface:
        """Return the surface swept from the ground along z: a plane, a cylinder, or an extrusion."""
        up = gp_Dir(0, 0, 1)
        if isinstance(self.ground, Geom_Line):
            start = self.ground.Position()
            return Geom_Plane(start.Location(), start.Direction().Crossed(up))
        if isinstance(self.ground, Geom_Circle):
            circle = self.ground.Circ()
            return Geom_CylindricalSurface(gp_Ax3(circle.Position()), circle.Radius())
        return Geom_SurfaceOfLinearExtrusion(self.ground, up)


@dataclass(frozen=True)
class Corner:
    """A vertex of the top of a `block`, the one below it, and the edge between them."""

    high: TopoDS_Vertex
    low: TopoDS_Vertex
    upright: TopoDS_Edge

    @classmethod
    def at(cls, rim: Rim) -> Corner:
        """Return the corner where a rim is entered."""
        point = rim.path.geometry.Value(rim.span[not rim.forward])
        x, y, z = settle([point.X(), point.Y(), point.Z()], FINE).tolist()
        tolerance = max(rim.tolerance, 2.0**-FINE)
        high, low = vertex((x, y, z), tolerance), vertex((x, y, 0.0), tolerance)
        return cls(high, low, edge(Geom_Line(gp_Pnt(x, y, 0.0), gp_Dir(0, 0, 1)), (low, high), (0.0, z), tolerance))


def block(top: Geom_BSplineSurface, loops: Sequence[Sequence[Rim]]) -> TopoDS_Solid:
    """Return the solid between a freeform top and the plane z = 0, with walls swept along z."""
    walls, tops, bottoms = [], [], []
    for loop in loops:
        upper, lower = [], []
        corners = [Corner.at(rim) for rim in loop]
        for rim, *pair in zip(loop, corners, corners[1:] + corners[:1], strict=True):
            start, end = pair if rim.forward else pair[::-1]
            path, wall = rim.path, rim.wall()
            high = edge(path.geometry, (start.high, end.high), rim.span, rim.tolerance)
            low = edge(rim.ground, (start.low, end.low), rim.span, rim.tolerance)
            walk = [Side(low), Side(end.upright), Side(high, None, False), Side(start.upright, None, False)]
            if not isinstance(wall, Geom_Plane):
                height = np.column_stack((greville(path.knots, path.degree), path.poles[:, 2]))
                flat = [
                    line2d((0.0, 0.0), (1, 0)),
                    line2d((rim.span[1], 0.0), (0, 1)),
                    curve(height, path.knots, path.degree),
                    line2d((rim.span[0], 0.0), (0, 1)),
                ]
                walk = [replace(side, path=trace) for side, trace in zip(walk, flat, strict=True)]
            walls.append(face(wall, [walk], rim.forward, rim.tolerance))
            upper.append(Side(high, rim.plane, rim.forward))
            lower.append(Side(low, None, rim.forward))
        tops.append(upper)
        bottoms.append(lower)
    floor = face(Geom_Plane(gp_Pnt(0, 0, 0), gp_Dir(0, 0, 1)), bottoms, outward=False)
    return solid([face(top, tops), floor, *walls])
