"""Bounding boxes of faces (the kernel's fast ones are those of control points), and the size of a document."""

from __future__ import annotations

from functools import cached_property
from itertools import product

import numpy as np
from OCP.BRep import BRep_Tool
from OCP.BRepBuilderAPI import BRepBuilderAPI_Copy
from OCP.BRepMesh import BRepMesh_IncrementalMesh
from OCP.TopAbs import TopAbs_VERTEX
from OCP.TopoDS import TopoDS, TopoDS_Face

from mracad.model.boxes import box as nurbs_box
from mracad.model.boxes import rims
from mracad.model.brep import Face, Model
from mracad.occ.document import Document
from mracad.occ.polygons import polygons
from mracad.occ.topology import box, inside, placed

Array = np.ndarray

MISSED = 1e-4
"""Share of a document's size that its box may miss on each side."""

SIMPLE = ("plane", "cylinder", "cone", "sphere")
"""Kinds of faces for which the kernel finds the exact box quickly; for others that takes longer than reading them."""

ANGLE = 1.0
"""Largest turn from facet to facet of a mesh that is made for a box, radians."""

COARSE = 1e-3
"""Share of a face's size that the box of a face of another kind may miss."""


def face_boxes(document: Document, model: Model) -> list[Array]:
    """The box (2, 3) of every face in its part's frame, mm; it may miss ``MISSED`` of the document's size."""
    fitter = _Fitter(document, model)
    return [fitter.fitted(face, MISSED * model.diagonal) for face in model.faces]


def diagonal(document: Document, model: Model) -> float:
    """Diagonal of the box around all placed faces, mm; boxes of the faces that determine it are exact."""
    fitter, boxes = _Fitter(document, model), [face.box for face in model.faces]
    owner, places = _placed(model, document)
    corners = np.array([_corners(boxes[face], frame) for face, frame in zip(owner.tolist(), places, strict=True)])
    low, high = corners.min(axis=1), corners.max(axis=1)
    fitted: set[int] = set()
    while True:
        outermost = {int(owner[k]) for k in (*low.argmin(axis=0), *high.argmax(axis=0))}
        if outermost <= fitted:
            return float(np.linalg.norm(high.max(axis=0) - low.min(axis=0)))
        slack = MISSED * float(np.linalg.norm(high.max(axis=0) - low.min(axis=0)))
        for face in outermost - fitted:
            own = fitter.fitted(model.faces[face], slack)
            for k in np.flatnonzero(owner == face).tolist():
                placed = _corners(own, places[k])
                low[k], high[k] = placed.min(axis=0), placed.max(axis=0)
        fitted |= outermost


_CORNERS = np.array(list(product((0, 1), repeat=3)))  # low (0) or high (1) on each axis


class _Fitter:
    """Fits boxes to faces."""

    def __init__(self, document: Document, model: Model) -> None:
        self.shapes, self.model = document.faces, model
        self.edges: dict[int, set[int]] = {}
        for edge in model.edges:
            for side in edge.sides:
                self.edges.setdefault(side.face, set()).add(edge.index)

    @cached_property
    def rims(self) -> list[Array]:
        """The box of each edge."""
        return rims(self.model.edges)

    def fitted(self, face: Face, slack: float = 0.0) -> Array:
        """The box of a face in its part's frame, which may miss ``slack``."""
        shape = self.shapes[face.index]
        if face.kind in SIMPLE:
            return box(shape, tight=True)
        if face.surface is None and face.kind != "extrusion":
            return _meshed(shape, max(slack, COARSE * float(np.linalg.norm(face.box[1] - face.box[0]))), face.box)
        corners = np.array([BRep_Tool.Pnt_s(TopoDS.Vertex_s(v)).Coord() for v in inside(shape, TopAbs_VERTEX)])
        own = [self.rims[k] for k in sorted(self.edges.get(face.index, ()))]
        every = np.concatenate([*own, corners.reshape(-1, 3)])
        rim = np.array([every.min(axis=0), every.max(axis=0)]) if len(every) else face.box
        if face.surface is None:  # parameter lines through any of its points end on the boundary
            return rim
        return nurbs_box(face, self.model.surfaces[face.surface].net, rim, face.box, slack)


def _meshed(shape: TopoDS_Face, chord: float, outer: Array) -> Array:
    """The box of the points of a mesh of a face; ``outer`` where there is none."""
    copy = BRepBuilderAPI_Copy(shape, False, False).Shape()
    BRepMesh_IncrementalMesh(copy, chord, False, ANGLE, False)
    meshes = polygons({0: TopoDS.Face_s(copy)})
    if not meshes:
        return outer
    points = meshes[0][0]
    return np.clip(np.array([points.min(axis=0), points.max(axis=0)]), outer[0], outer[1])


def _placed(model: Model, document: Document) -> tuple[Array, list[Array]]:
    """A face and a frame for each instance of a face."""
    pairs = [
        (face, frame)
        for part, frames in zip(document.parts, model.places, strict=True)
        for face in part.numbers
        for frame in frames
    ]
    return np.array([face for face, _ in pairs]), [frame for _, frame in pairs]


def _corners(bounds: Array, frame: Array) -> Array:
    """The eight corners of a box, placed."""
    return placed(bounds[_CORNERS, [0, 1, 2]], frame)
