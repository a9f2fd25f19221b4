"""What the kernel says of a document, for :mod:`mracad.audit.accept`."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from OCP.Bnd import Bnd_Box
from OCP.BRep import BRep_Tool
from OCP.BRepBndLib import BRepBndLib
from OCP.BRepGProp import BRepGProp
from OCP.GProp import GProp_GProps
from OCP.TopAbs import TopAbs_FACE, TopAbs_SHELL, TopAbs_SOLID, TopAbs_VERTEX
from OCP.TopLoc import TopLoc_Location
from OCP.TopoDS import TopoDS, TopoDS_Face

from mracad.audit.accept import Counts, Facts
from mracad.audit.continuity import seams
from mracad.model import Model
from mracad.occ.check import check
from mracad.occ.document import Document
from mracad.occ.measure import mass
from mracad.occ.settings import quiet
from mracad.occ.topology import box, inside, matrix
from mracad.occ.view import view

Array = np.ndarray
_EXACT = 1e-6  # relative error of an area


@dataclass(frozen=True, eq=False)
class Probe:
    """Exact measures of a document, taken when asked for."""

    document: Document

    def area(self, face: int) -> float:
        """Of a face, mm²."""
        return _area(self.document.faces[face], _EXACT)

    def volume(self) -> float:
        """Of all solids, placed, mm³."""
        return self._volume

    def box(self) -> Array:
        """Lowest and highest corner of everything, placed, ``(2, 3)``, mm."""
        bounds = Bnd_Box()
        with quiet():
            BRepBndLib.AddOptimal_s(self.document.shape, bounds, False, False)
        return np.array([bounds.CornerMin().Coord(), bounds.CornerMax().Coord()])

    @cached_property
    def _volume(self) -> float:
        return mass(self.document).volume


def facts(document: Document) -> Facts:
    """Everything that a file is judged by."""
    model = view(document)
    with quiet():
        places = list(_places(document))
        areas = np.array([_area(face) for face in document.faces])
    spots, owners, loose = (np.array(each) for each in zip(*places, strict=True))
    tolerances = np.zeros(len(document.faces))
    tolerances[owners] = loose
    return Facts(
        model, check(document), seams(model), spots, owners, areas, tolerances, _counts(document, model), Probe(document)
    )


def _counts(document: Document, model: Model) -> Counts:
    """What there is, placed."""
    times = [max(len(part.placements), 1) for part in document.parts]
    free = Counter(edge.part for edge in model.edges if edge.free)

    def placed(kind: object) -> int:
        return sum(n * sum(1 for _ in inside(part.shape, kind)) for n, part in zip(times, document.parts, strict=True))

    return Counts(
        placed(TopAbs_SOLID), placed(TopAbs_SHELL), placed(TopAbs_FACE), sum(times[part] * n for part, n in free.items())
    )


def _places(document: Document) -> Iterator[tuple[Array, int, float]]:
    """Where every placed face is, which face that is, and the largest tolerance of its vertices."""
    for part in document.parts:
        for index in range(part.first, part.first + part.faces.Extent()):
            face = document.faces[index]
            vertices = [TopoDS.Vertex_s(vertex) for vertex in inside(face, TopAbs_VERTEX)]
            points = np.array([BRep_Tool.Pnt_s(vertex).Coord() for vertex in vertices]).reshape(-1, 3)
            loose = max((BRep_Tool.Tolerance_s(vertex) for vertex in vertices), default=0.0)
            for placement in part.placements or [TopLoc_Location()]:
                corners = box(face.Moved(placement)).ravel()
                yield np.concatenate([corners, _middle(points, placement, corners)]), index, loose


def _middle(points: Array, placement: TopLoc_Location, corners: Array) -> Array:
    """The middle of points that are placed; of the box where there are none."""
    if not len(points):
        return (corners[:3] + corners[3:]) / 2
    frame = matrix(placement)
    return points.mean(axis=0) @ frame[:3, :3].T + frame[:3, 3]


def _area(face: TopoDS_Face, exact: float | None = None) -> float:
    surface = GProp_GProps()
    if exact is None:
        BRepGProp.SurfaceProperties_s(face, surface)
    else:
        BRepGProp.SurfaceProperties_s(face, surface, exact)
    return surface.Mass()
