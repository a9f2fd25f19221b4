"""A document in triangles whose corners know their parameters, with the surfaces under them: for pictures."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from OCP.BRep import BRep_Tool
from OCP.BRepMesh import BRepMesh_IncrementalMesh
from OCP.BRepTools import BRepTools
from OCP.Geom import (
    Geom_BSplineCurve,
    Geom_Curve,
    Geom_Surface,
    Geom_SurfaceOfLinearExtrusion,
    Geom_SurfaceOfRevolution,
    Geom_TrimmedCurve,
)
from OCP.gp import gp_Pnt, gp_Vec
from OCP.TopAbs import TopAbs_FORWARD, TopAbs_REVERSED
from OCP.TopLoc import TopLoc_Location
from OCP.TopoDS import TopoDS, TopoDS_Face

from mracad.bspline.curve import Curve
from mracad.bspline.knots import KnotVector
from mracad.model.facets import Body, Closed, Facets, Ground, Jet, Placed, Spline, Swept
from mracad.occ.document import Document, Part, nested_colours, tint
from mracad.occ.geometry import basis, is_nurbs, nets
from mracad.occ.labels import label_key, referred, usages
from mracad.occ.polygons import polygons
from mracad.occ.rails import elementary
from mracad.occ.settings import quiet
from mracad.occ.topology import box, compound, edge_uses, matrix, placed

Array = np.ndarray

_FINER = 1.0, 0.4  # of the angle: what is tried in turn
_OFF = 10.0  # chords: the kernel has left a face unfinished where a triangle is farther off


@dataclass(frozen=True, eq=False)
class _Asked:
    """A surface of any other kind, which the kernel evaluates point by point.

    Attributes
    ----------
    surface : Geom_Surface
    frame : ndarray (4, 4)
    """

    surface: Geom_Surface
    frame: Array

    def jets(self, uv: Array, order: int) -> Jet:
        point, (su, sv, suu, svv, suv) = gp_Pnt(), (gp_Vec() for _ in range(5))
        found = np.empty((6, len(uv), 3))
        for k, (u, v) in enumerate(uv.tolist()):
            self.surface.D2(u, v, point, su, sv, suu, svv, suv)
            found[:, k] = [each.Coord() for each in (point, su, sv, suu, suv, svv)]
        s, *slopes = found[: 3 if order == 1 else 6] @ self.frame[:3, :3].T
        return s + self.frame[:3, 3], *slopes


def facets(document: Document, chord: float, angle: float) -> Body:
    """Mesh a document for pictures: every face keeps points of its own, and their parameters.

    Parameters
    ----------
    document : Document
    chord : float
        Largest distance of triangles from the surface, as a share of the diagonal of the document's box.
    angle : float
        Largest turn between neighbouring triangles along a curve, degrees.
    """
    bounds = box(document.shape)
    size = float(np.linalg.norm(bounds[1] - bounds[0]))
    with quiet():
        whole = compound(part.shape for part in document.parts)
        known = grounds(document)
        every: dict[int, Facets] = {}
        least = np.inf
        for share in _FINER:
            BRepTools.Clean_s(whole)
            BRepMesh_IncrementalMesh(whole, chord * size, False, float(np.radians(share * angle)))
            found = _collected(document, known)
            off = max((each.off for each in found.values()), default=0.0)
            if off < least:
                every, least = found, off
            if least <= _OFF * chord * size:
                break
        BRepTools.Clean_s(whole)
    instances = tuple(_placed(document))
    ends = [_extent(placed(each.points, place.frame)) for place in instances for each in _of(every, place)]
    low, high = np.array(ends).reshape(-1, 2, 3).swapaxes(0, 1) if ends else np.zeros((2, 1, 3))
    return Body(document.name, every, instances, np.array([low.min(axis=0), high.max(axis=0)]))


def _collected(document: Document, known: list[tuple[Ground, int]]) -> dict[int, Facets]:
    """The triangles that the kernel keeps with the faces."""
    meshes = polygons(dict(enumerate(document.faces)))
    found = {}
    for part in document.parts:
        for index in filter(meshes.__contains__, part.numbers):
            (points, uv, corners), (ground, outward) = meshes[index], known[index]
            rims = _rims(part, document.faces[index])
            found[index] = Facets(index, points, uv, corners[:, ::outward], ground, outward, rims)
    return found


def _of(every: dict[int, Facets], place: Placed) -> Iterator[Facets]:
    return (every[face] for face in place.faces if face in every)


def _extent(points: Array) -> Array:
    return np.array([points.min(axis=0), points.max(axis=0)])


def _rims(part: Part, face: TopoDS_Face) -> dict[int, Array]:
    location = TopLoc_Location()
    mesh = BRep_Tool.Triangulation_s(face, location)
    found: dict[int, Array] = {}
    closing = set()
    for edge in edge_uses(TopoDS.Face_s(face.Oriented(TopAbs_FORWARD))):
        number = part.edge_number(edge)
        polygon = BRep_Tool.PolygonOnTriangulation_s(edge, mesh, location)
        if number in found:
            closing.add(number)
        if polygon is not None and not BRep_Tool.Degenerated_s(edge):
            found[number] = np.array([polygon.Node(i) for i in range(1, polygon.NbNodes() + 1)]) - 1
    return {number: points for number, points in found.items() if number not in closing}


def _placed(document: Document) -> Iterator[Placed]:
    """Every instance of every part."""
    parts = {label_key(part.label): part for part in document.parts}
    nested = dict(nested_colours(document))
    for usage in usages(document.shape_tool):
        part = parts.get(label_key(usage.product))
        if part is None:
            continue
        above: tuple[str, ...] = ()
        colour = ""
        for label in usage.chain:
            if not referred(label).IsEqual(label):
                above = (*above, label_key(label))
                colour = tint(nested, above, label, colour)
        faces = tuple(part.numbers)
        colours = tuple(part.face_colour(k, colour) for k in range(len(faces)))
        yield Placed(matrix(usage.frame), faces, colours)


def grounds(document: Document) -> list[tuple[Ground, int]]:
    """The surface under every face, and 1 where S_u × S_v points outward, otherwise -1."""
    found: list[tuple[Geom_Surface, Array]] = []
    for face in document.faces:
        location = TopLoc_Location()
        surface = basis(BRep_Tool.Surface_s(face, location))
        found.append((surface, matrix(location)))
    splines = list(dict.fromkeys(surface for surface, _ in found if is_nurbs(surface)))
    known = dict(zip(splines, nets(splines), strict=True))
    return [
        (
            Spline(known[surface], frame) if surface in known else _other(face, surface, frame),
            -1 if face.Orientation() == TopAbs_REVERSED else 1,
        )
        for face, (surface, frame) in zip(document.faces, found, strict=True)
    ]


def _other(face: TopoDS_Face, surface: Geom_Surface, frame: Array) -> Ground:
    shape = elementary(face)
    if shape:
        return Closed(shape)
    if isinstance(surface, Geom_SurfaceOfLinearExtrusion | Geom_SurfaceOfRevolution):
        curve = surface.BasisCurve()
        while isinstance(curve, Geom_TrimmedCurve):
            curve = curve.BasisCurve()
        if isinstance(curve, Geom_BSplineCurve):
            moved = isinstance(surface, Geom_SurfaceOfLinearExtrusion)
            centre = None if moved else np.array(surface.Location().Coord())
            return Swept(_spline(curve), np.array(surface.Direction().Coord()), centre, frame)
    return _Asked(surface, frame)


def _spline(curve: Geom_BSplineCurve | Geom_Curve) -> Curve:
    counts = range(1, curve.NbKnots() + 1)
    values, mults = [curve.Knot(i) for i in counts], [curve.Multiplicity(i) for i in counts]
    knots = KnotVector.from_multiplicities(np.array(values), np.array(mults), curve.Degree(), curve.IsPeriodic())
    numbers = range(1, curve.NbPoles() + 1)
    weights = np.array([curve.Weight(i) for i in numbers]) if curve.IsRational() else None
    return Curve(knots, np.array([curve.Pole(i).Coord() for i in numbers]), weights)
