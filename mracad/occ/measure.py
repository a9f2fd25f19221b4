"""Points on faces, and exact distances from them."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass

import numpy as np
from OCP.BRep import BRep_Tool
from OCP.BRepAdaptor import BRepAdaptor_Surface
from OCP.BRepBuilderAPI import BRepBuilderAPI_MakeVertex
from OCP.BRepExtrema import BRepExtrema_DistShapeShape
from OCP.BRepTools import BRepTools
from OCP.BRepTopAdaptor import BRepTopAdaptor_FClass2d
from OCP.Geom import Geom_Surface
from OCP.GeomAPI import GeomAPI_ProjectPointOnSurf
from OCP.gp import gp_Dir, gp_Lin, gp_Pnt, gp_Pnt2d, gp_Vec
from OCP.IntCurvesFace import IntCurvesFace_ShapeIntersector
from OCP.ShapeAnalysis import ShapeAnalysis_Surface
from OCP.TopAbs import TopAbs_FORWARD, TopAbs_IN, TopAbs_REVERSED
from OCP.TopLoc import TopLoc_Location
from OCP.TopoDS import TopoDS, TopoDS_Shape

from mracad.occ.document import Document, Part
from mracad.occ.settings import quiet
from mracad.occ.topology import compound, matrix

Array = np.ndarray
Point = tuple[float, float, float]
_LEAST = 9  # least number of sample lines across a face in each direction


@dataclass(frozen=True, eq=False)
class KernelGauge:
    """Points on the faces of a document and exact distances from them; lengths in mm, in the part's frame."""

    document: Document

    def sample(self, index: int, lines: tuple[int, int]) -> Array:
        """Points inside a face, ``(q, 3)``, on a grid of ``lines`` (at least nine) each way in its parameter plane."""
        face = TopoDS.Face_s(self.document.faces[index].Oriented(TopAbs_FORWARD))
        bounds = BRepTools.UVBounds_s(face)
        within = BRepTopAdaptor_FClass2d(face, 1e-9)
        surface = BRepAdaptor_Surface(face, False)
        us, vs = (
            low + (high - low) * (np.arange(max(count, _LEAST)) + 0.5) / max(count, _LEAST)
            for low, high, count in zip(bounds[::2], bounds[1::2], lines, strict=True)
        )
        points = [
            surface.Value(u, v).Coord()
            for u in us.tolist()
            for v in vs.tolist()
            if within.Perform(gp_Pnt2d(u, v)) == TopAbs_IN
        ]
        return np.array(points).reshape(-1, 3)

    def distances(self, index: int, points: Array) -> Array:
        """Distances of points ``(q, 3)`` from the whole surface under a face."""
        location = TopLoc_Location()
        surface = BRep_Tool.Surface_s(self.document.faces[index], location)
        frame = matrix(location)
        with quiet():
            return np.fromiter(_off(surface, (points - frame[:3, 3]) @ frame[:3, :3]), float, len(points))

    def facing(self, index: int) -> Array:
        """The orientation of a face, ``(4,)``: its mean outward normal, and how far that points away from its centre.

        Two faces that coincide with opposite orientations have opposite ones.
        """
        face = self.document.faces[index]
        surface = BRepAdaptor_Surface(face, False)
        bounds = BRepTools.UVBounds_s(face)
        sign = -1.0 if face.Orientation() == TopAbs_REVERSED else 1.0
        point, du, dv = gp_Pnt(), gp_Vec(), gp_Vec()
        rows = []
        shares = (np.arange(_LEAST) + 0.5) / _LEAST
        for u in (bounds[0] + (bounds[1] - bounds[0]) * shares).tolist():
            for v in (bounds[2] + (bounds[3] - bounds[2]) * shares).tolist():
                surface.D1(u, v, point, du, dv)
                rows.append(point.Coord() + du.Crossed(dv).Coord())
        points, normals = np.array(rows)[:, :3], sign * np.array(rows)[:, 3:]
        normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-300)
        out = points - points.mean(axis=0)
        size = max(float(np.linalg.norm(out, axis=1).max()), 1e-300)
        return np.append(normals.mean(axis=0), (out * normals).sum(axis=1).mean() / size)

    def face_distances(self, index: int, points: Array) -> Array:
        """Distances of points ``(q, 3)`` from a face, within its boundary."""
        return _apart(points, self.document.faces[index])

    def thinnest(self, index: int, part: Part) -> tuple[float, Point | None]:
        """Least distance from points of a face through the material of its part, along the normal; and where."""
        face = self.document.faces[index]
        rays = IntCurvesFace_ShapeIntersector()
        rays.Load(part.shape, 1e-7)
        surface = BRepAdaptor_Surface(face, False)
        within = BRepTopAdaptor_FClass2d(TopoDS.Face_s(face.Oriented(TopAbs_FORWARD)), 1e-9)
        bounds = BRepTools.UVBounds_s(face)
        sign = 1.0 if face.Orientation() == TopAbs_REVERSED else -1.0
        best: tuple[float, Point | None] = (float("inf"), None)
        point, du, dv = gp_Pnt(), gp_Vec(), gp_Vec()
        shares = (np.arange(_LEAST) + 0.5) / _LEAST
        for u in (bounds[0] + (bounds[1] - bounds[0]) * shares).tolist():
            for v in (bounds[2] + (bounds[3] - bounds[2]) * shares).tolist():
                surface.D1(u, v, point, du, dv)
                normal = du.Crossed(dv)
                if normal.Magnitude() < 1e-12 or within.Perform(gp_Pnt2d(u, v)) != TopAbs_IN:
                    continue
                rays.Perform(gp_Lin(point, gp_Dir(normal * sign)), 1e-4, 1e10)
                hits = [rays.WParameter(k) for k in range(1, rays.NbPnt() + 1)]
                if hits and min(hits) < best[0]:
                    best = min(hits), point.Coord()
        return best

    def edge_distances(self, edges: Iterable[int], points: Array) -> Array:
        """Distances of points ``(q, 3)`` from the nearest of some edges."""
        return _apart(points, compound(self.document.edges[index] for index in edges))


def _apart(points: Array, target: TopoDS_Shape) -> Array:
    """Distances of points ``(q, 3)`` from a shape."""
    with quiet():
        vertices = (BRepBuilderAPI_MakeVertex(gp_Pnt(*point)).Vertex() for point in points.tolist())
        return np.array([BRepExtrema_DistShapeShape(vertex, target).Value() for vertex in vertices])


def _off(surface: Geom_Surface, points: Array) -> Iterator[float]:
    """Orthogonal distances; the distance from the border for a point without a foot on the surface."""
    project = GeomAPI_ProjectPointOnSurf()
    project.Init(surface, *surface.Bounds(), 1e-9)
    analysis = ShapeAnalysis_Surface(surface)
    for x, y, z in points.tolist():
        point = gp_Pnt(x, y, z)
        project.Perform(point)
        if project.NbPoints():
            yield project.LowerDistance()
        else:
            analysis.ValueOfUV(point, 1e-9)
            yield analysis.Gap()
