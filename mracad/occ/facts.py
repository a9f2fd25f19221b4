"""Facts about a document for :mod:`mracad.inspect.accept`: quick ones at once, slow ones when needed."""

from __future__ import annotations

from collections import Counter
from collections.abc import Collection, Iterator
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from OCP.Bnd import Bnd_Box
from OCP.BRep import BRep_Tool
from OCP.BRepAdaptor import BRepAdaptor_Curve, BRepAdaptor_Surface
from OCP.BRepBndLib import BRepBndLib
from OCP.BRepGProp import BRepGProp
from OCP.Geom import Geom_ConicalSurface, Geom_CylindricalSurface, Geom_Plane
from OCP.gp import gp_Pnt, gp_Vec
from OCP.GProp import GProp_GProps
from OCP.TopAbs import TopAbs_FACE, TopAbs_FORWARD, TopAbs_SHELL, TopAbs_SOLID, TopAbs_VERTEX
from OCP.TopLoc import TopLoc_Location
from OCP.TopoDS import TopoDS, TopoDS_Edge, TopoDS_Face

from mracad.model.brep import Model
from mracad.model.facts import Counts, Facts, Line, Validity
from mracad.occ.check import check
from mracad.occ.document import Document
from mracad.occ.settings import quiet
from mracad.occ.sizes import mass, sizes
from mracad.occ.topology import box, edge_uses, inside, matrix, pcurve, placed
from mracad.occ.view import view

Array = np.ndarray
_PLACES = (0.04, 0.46, 0.91)  # of the range of an edge


@dataclass(frozen=True, eq=False)
class KernelProbe:
    """Slow measurements of a document, made when needed."""

    document: Document

    def validity(self) -> Validity:
        """The kernel's verdict on everything."""
        return self._validity

    def along(self, edges: Collection[int]) -> Model:
        """The view of the document with samples along some edges only."""
        return view(self.document, edges=frozenset(edges))

    def area(self, face: int, exact: bool) -> float:
        """Area of a face, mm², exactly or by a fast quadrature that gives the same for the same face."""
        if exact:
            return float(sizes([self.document.faces[face]], np.zeros(3))[0, 0])
        surface = GProp_GProps()
        with quiet():
            BRepGProp.SurfaceProperties_s(self.document.faces[face], surface)
        return surface.Mass()

    def volume(self) -> float:
        """Volume of all placed solids, mm³."""
        return self._volume

    def box(self) -> Array:
        """Lowest and highest corner of all placed shapes, ``(2, 3)``, mm."""
        bounds = Bnd_Box()
        with quiet():
            BRepBndLib.AddOptimal_s(self.document.shape, bounds, False, False)
        return np.array([bounds.CornerMin().Coord(), bounds.CornerMax().Coord()])

    @cached_property
    def _validity(self) -> Validity:
        return check(self.document)

    @cached_property
    def _volume(self) -> float:
        return mass(self.document).volume


def facts(document: Document) -> Facts:
    """The facts by which a file is judged."""
    with quiet():
        lines, closing = _lines(document)
        places = list(_places(document))
    spots, owners, loose = (np.array(each) for each in zip(*places, strict=True))
    vertices = np.zeros(len(document.faces))
    vertices[owners] = loose
    size = float(np.linalg.norm(spots[:, 3:6].max(axis=0) - spots[:, :3].min(axis=0)))
    return Facts(
        size, _counts(document, lines), spots, owners, frozenset(closing), vertices, tuple(lines), KernelProbe(document)
    )


def _counts(document: Document, lines: list[Line]) -> Counts:
    """Numbers of placed solids, shells, faces and free edges."""
    times = [max(len(part.placements), 1) for part in document.parts]
    free: Counter[int] = Counter()
    for number, part in enumerate(document.parts):
        own = lines[part.first_edge : part.first_edge + part.edges.Extent()]
        free[number] = sum(len(line.faces) == 1 for line in own)

    def placed(kind: object) -> int:
        return sum(n * sum(1 for _ in inside(part.shape, kind)) for n, part in zip(times, document.parts, strict=True))

    return Counts(
        placed(TopAbs_SOLID), placed(TopAbs_SHELL), placed(TopAbs_FACE), sum(times[k] * n for k, n in free.items())
    )


def _lines(document: Document) -> tuple[list[Line], list[int]]:
    """Samples of every edge at a few places, and the faces on closed surfaces that have no closing edge."""
    owners: list[list[int]] = [[] for _ in document.edges]
    sides: list[list[Array]] = [[] for _ in document.edges]
    whole = [BRep_Tool.Degenerated_s(edge) for edge in document.edges]
    own = [np.empty((0, 6)) if lost else _along(edge) for edge, lost in zip(document.edges, whole, strict=True)]
    closing = []
    for part in document.parts:
        for index in part.numbers:
            face = TopoDS.Face_s(document.faces[index].Oriented(TopAbs_FORWARD))
            surface = BRep_Tool.Surface_s(face, TopLoc_Location())
            plane = _plane(face) if isinstance(surface, Geom_Plane) else None
            ground = BRepAdaptor_Surface(face, False)
            if not isinstance(surface, Geom_Plane | Geom_CylindricalSurface | Geom_ConicalSurface) and (
                surface.IsUClosed() or surface.IsVClosed()
            ):
                closing.append(index)
            for edge in edge_uses(face):
                number = part.edge_number(edge)
                if not whole[number]:
                    owners[number].append(index)
                    sides[number].append(_onto(own[number], *plane) if plane else _beside(edge, face, ground))
    lines = [
        Line(tuple(faces), np.stack([points, *beside]), BRep_Tool.Tolerance_s(edge))
        for faces, points, beside, edge in zip(owners, own, sides, document.edges, strict=True)
    ]
    closed = {face for line in lines for face in line.faces if line.faces.count(face) > 1}
    return lines, [face for face in closing if face not in closed]


def _along(edge: TopoDS_Edge) -> Array:
    """Points of an edge, with NaN for normals."""
    curve = BRepAdaptor_Curve(edge)
    first, last = curve.FirstParameter(), curve.LastParameter()
    return np.array([(*curve.Value(first + share * (last - first)).Coord(), 0.0, 0.0, 0.0) for share in _PLACES])


def _beside(edge: TopoDS_Edge, face: TopoDS_Face, surface: BRepAdaptor_Surface) -> Array:
    """Points of a face along an edge, and the normals there."""
    curve = pcurve(edge, face)
    first, last = BRep_Tool.Range_s(edge, face)
    point, du, dv = gp_Pnt(), gp_Vec(), gp_Vec()
    rows = []
    for share in _PLACES:
        surface.D1(*curve.Value(first + share * (last - first)).Coord(), point, du, dv)
        normal = du.Crossed(dv)
        rows.append(point.Coord() + normal.Divided(normal.Magnitude() or 1.0).Coord())
    return np.array(rows)


def _plane(face: TopoDS_Face) -> tuple[Array, Array]:
    """A point and the normal of a plane."""
    location = TopLoc_Location()
    surface = BRep_Tool.Surface_s(face, location)
    plane = surface.Pln().Transformed(location.Transformation())
    return np.array(plane.Location().Coord()), np.array(plane.Axis().Direction().Coord())


def _onto(points: Array, origin: Array, normal: Array) -> Array:
    heights = (points[:, :3] - origin) @ normal
    return np.hstack([points[:, :3] - heights[:, None] * normal, np.tile(normal, (len(points), 1))])


def _places(document: Document) -> Iterator[tuple[Array, int, float]]:
    """Position, index and largest vertex tolerance of every placed face."""
    for part in document.parts:
        for index in part.numbers:
            face = document.faces[index]
            vertices = [TopoDS.Vertex_s(vertex) for vertex in inside(face, TopAbs_VERTEX)]
            points = np.array([BRep_Tool.Pnt_s(vertex).Coord() for vertex in vertices]).reshape(-1, 3)
            loose = max((BRep_Tool.Tolerance_s(vertex) for vertex in vertices), default=0.0)
            for placement in part.placements or [TopLoc_Location()]:
                corners = box(face.Moved(placement)).ravel()
                yield np.concatenate([corners, _middle(points, placement, corners)]), index, loose


def _middle(points: Array, placement: TopLoc_Location, corners: Array) -> Array:
    """The middle of placed points; of a box if there are none."""
    if not len(points):
        return (corners[:3] + corners[3:]) / 2
    return placed(points.mean(axis=0), matrix(placement))
