"""A document as a kernel-free Model."""

from __future__ import annotations

from collections.abc import Container, Iterable, Iterator
from dataclasses import dataclass, field, replace

import numpy as np
from OCP.BRep import BRep_Tool
from OCP.Geom import Geom_Surface
from OCP.TopAbs import TopAbs_FORWARD, TopAbs_REVERSED
from OCP.TopLoc import TopLoc_Location
from OCP.TopoDS import TopoDS, TopoDS_Face

from mracad.bspline.surface import Net
from mracad.errors import FileError, UsageError
from mracad.model.brep import Edge, Face, Model, Side, Surface, Trim
from mracad.occ.boxes import diagonal
from mracad.occ.convert import conversion
from mracad.occ.document import Document
from mracad.occ.geometry import basis, curves, is_nurbs, nets
from mracad.occ.samples import NONE, Use, along, beside, parameters
from mracad.occ.settings import quiet
from mracad.occ.topology import box, edge_uses, matrix, pcurve

Array = np.ndarray

_KINDS = {
    "Geom_BSplineSurface": "bspline",
    "Geom_BezierSurface": "bezier",
    "Geom_Plane": "plane",
    "Geom_CylindricalSurface": "cylinder",
    "Geom_ConicalSurface": "cone",
    "Geom_SphericalSurface": "sphere",
    "Geom_ToroidalSurface": "torus",
    "Geom_SurfaceOfLinearExtrusion": "extrusion",
    "Geom_SurfaceOfRevolution": "revolution",
    "Geom_OffsetSurface": "offset",
}
_ABSURD = 1e12  # mm: the distance of a planet


@dataclass(eq=False)
class _Found:
    """What a walk over the document finds, in order."""

    faces: list[TopoDS_Face]
    grounds: list[Geom_Surface] = field(default_factory=list)  # the untrimmed surface of each face
    frames: list[Array] = field(default_factory=list)
    surface_of: list[int | None] = field(default_factory=list)
    surfaces: dict[Geom_Surface, list[int]] = field(default_factory=dict)  # each NURBS surface and its faces
    uses: list[Use] = field(default_factory=list)


def view(document: Document, convert: Iterable[int] = (), edges: Container[int] | None = None) -> Model:
    """The geometry of a document as plain arrays, in mm.

    Parameters
    ----------
    document : Document
    convert : iterable of int
        Faces on analytic, swept or offset surfaces to show as NURBS faces too.  ``apply`` puts the NURBS surfaces on
        those that move.
    edges : container of int, optional
        Edges to sample, whose faces get trims; by default all.  With only some edges, the diagonal is that of the boxes
        of the parts' control points.

    Raises
    ------
    UsageError
        For a face that does not exist.
    EditError
        For a face that the kernel cannot convert.
    FileError
        For a face with absurd coordinates or weights.
    """
    chosen = frozenset(convert)
    for face in sorted(chosen):
        if not 0 <= face < len(document.faces):
            raise UsageError(f"there is no face #{face + 1}", f"the faces are #1 to #{len(document.faces)}")
    with quiet(), np.errstate(invalid="ignore", over="ignore"):
        found = _walk(document, chosen)
        kinds = [_KINDS.get(type(surface).__name__, "other") for surface in found.grounds]
        control = nets(list(found.surfaces))
        boxes = [box(face) for face in found.faces]
        _refuse_absurd(document.name, _stored(boxes, zip(found.surfaces.values(), control, strict=True)))
        trims = _trims(found, edges)
        faces = tuple(
            Face(
                index, kinds[index], found.surface_of[index], trims.get(index, ()),
                found.faces[index].Orientation() == TopAbs_REVERSED, found.frames[index], boxes[index],
                part.face_names.get(index - part.first, ""), part.product,
                part.face_colour(index - part.first) or part.tint, len(part.placements),
            )
            for part in document.parts
            for index in part.numbers
        )  # fmt: skip
        surfaces = tuple(
            Surface(index, net, tuple(members), kinds[members[0]])
            for index, (net, members) in enumerate(zip(control, found.surfaces.values(), strict=True))
        )
        lines = tuple(_edges(document, found, edges))
        _refuse_absurd(document.name, _seen(lines, found))
        products = tuple(part.product for part in document.parts)
        places = tuple(tuple(matrix(place) for place in part.placements) for part in document.parts)
        model = Model(document.name, surfaces, faces, lines, 0.0, document.unit, document.schema, products, places)
        size = diagonal(document, model) if edges is None else _boxed(boxes)
        _refuse_absurd(document.name, [(0, size)])
    return replace(model, diagonal=size)


def _boxed(boxes: list[Array]) -> float:
    """The diagonal of all boxes together, each in its part's frame."""
    low, high = np.min(boxes, axis=0)[0], np.max(boxes, axis=0)[1]
    return float(np.linalg.norm(high - low))


def _refuse_absurd(name: str, numbers: Iterable[tuple[int, Array | float]]) -> None:
    """Raise FileError if numbers of a face are infinite, undefined or astronomical."""
    found = list(numbers)
    if (np.abs(np.concatenate([np.ravel(values) for _, values in found] or [NONE.ravel()])) < _ABSURD).all():
        return
    for face, values in found:
        if not (np.abs(values) < _ABSURD).all():
            raise FileError(
                f"'{name}' is damaged: #{face + 1} has coordinates or weights beyond {_ABSURD:.0e}", "export it again"
            )


def _stored(boxes: list[Array], surfaces: Iterable[tuple[list[int], Net]]) -> Iterator[tuple[int, Array]]:
    """The numbers of each face that the file states."""
    yield from enumerate(boxes)
    for members, net in surfaces:
        yield members[0], net.poles
        if net.weights is not None:
            yield members[0], net.weights


def _seen(edges: tuple[Edge, ...], found: _Found) -> Iterator[tuple[int, Array | float]]:
    """The evaluated numbers of each face, and its placement."""
    yield from enumerate(found.frames)
    for edge in edges:
        for side in edge.sides:
            yield side.face, edge.points
            for values in (side.uv, side.points, side.normals):
                if values is not None:
                    yield side.face, values


def _walk(document: Document, chosen: frozenset[int]) -> _Found:
    """Collect all faces and their edges."""
    found = _Found(document.faces)
    for part in document.parts:
        for index in part.numbers:
            face = TopoDS.Face_s(found.faces[index].Oriented(TopAbs_FORWARD))
            location = TopLoc_Location()
            ground = basis(BRep_Tool.Surface_s(face, location))
            replaced = conversion(document, index) if index in chosen and not is_nurbs(ground) else None
            handle = replaced.surface if replaced else ground
            members = found.surfaces.setdefault(handle, []) if is_nurbs(handle) else []
            members.append(index)
            found.grounds.append(ground)
            found.frames.append(matrix(location))
            found.surface_of.append(list(found.surfaces).index(handle) if handle in found.surfaces else None)
            for position, edge in enumerate(edge_uses(face)):
                place = part.edge_number(edge)
                curve = replaced.pcurves[position] if replaced else pcurve(edge, face)
                found.uses.append(Use(index, place, curve, *BRep_Tool.Range_s(edge, face)))
    return found


def _trims(found: _Found, edges: Container[int] | None) -> dict[int, tuple[Trim, ...]]:
    """The boundaries of the NURBS faces, by face."""
    meant = {use.face for use in found.uses if edges is None or use.edge in edges}
    uses = [use for use in found.uses if found.surface_of[use.face] is not None and use.face in meant]
    trims: dict[int, tuple[Trim, ...]] = {}
    for use, curve in zip(uses, curves([(u.pcurve, u.first, u.last) for u in uses]), strict=True):
        trims[use.face] = (*trims.get(use.face, ()), Trim(use.edge, curve))
    return trims


def _edges(document: Document, found: _Found, edges: Container[int] | None) -> Iterator[Edge]:
    """All edges, the chosen ones with samples."""
    part_of = np.repeat(np.arange(len(document.parts)), [part.edges.Extent() for part in document.parts]).tolist()
    by_edge: list[list[Use]] = [[] for _ in document.edges]
    for use in found.uses:
        by_edge[use.edge].append(use)
    seen = [edges is None or index in edges for index in range(len(by_edge))]
    lost = [BRep_Tool.Degenerated_s(edge) for edge in document.edges]
    lines = along([None if gone or not shown else e for e, shown, gone in zip(document.edges, seen, lost, strict=True)])
    shown = [
        use for use in found.uses if seen[use.edge] and not (lost[use.edge] and found.surface_of[use.face] is None)
    ]
    places = dict(zip(shown, parameters(shown), strict=True))
    fixed = beside(found.faces, {use: uv for use, uv in places.items() if found.surface_of[use.face] is None}, lines)
    for index, (edge, uses) in enumerate(zip(document.edges, by_edge, strict=True)):
        points, tangents = lines[index]
        sides = []
        for use in uses:
            if use not in places:
                sides.append(Side(use.face, points=NONE, normals=NONE))
            elif use in fixed:
                feet, normals, bends = fixed[use]
                sides.append(Side(use.face, points=feet, normals=normals, curvatures=bends))
            else:
                sides.append(Side(use.face, uv=places[use]))
        yield Edge(
            index, points, tangents, tuple(sides), BRep_Tool.Tolerance_s(edge), lost[index] or not seen[index],
            part_of[index],
        )  # fmt: skip
