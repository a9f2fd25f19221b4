"""Areas, volumes and centres of shapes."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from types import MappingProxyType

import numpy as np
from OCP.BRep import BRep_Tool
from OCP.BRepGProp import BRepGProp_Domain, BRepGProp_Face, BRepGProp_Sinert, BRepGProp_Vinert
from OCP.Geom import Geom_Surface
from OCP.gp import gp_Pnt
from OCP.TopAbs import TopAbs_FACE, TopAbs_FORWARD, TopAbs_REVERSED, TopAbs_SOLID
from OCP.TopExp import TopExp, TopExp_Explorer
from OCP.TopLoc import TopLoc_Location
from OCP.TopoDS import TopoDS, TopoDS_Face, TopoDS_Shape
from OCP.TopTools import TopTools_IndexedMapOfShape

from mracad.bspline.moments import moments
from mracad.model.facts import Mass
from mracad.occ.document import Document
from mracad.occ.geometry import basis, curves, is_nurbs, nets
from mracad.occ.settings import quiet
from mracad.occ.topology import box, compound, edge_uses, inside, matrix, pcurve, placed

Array = np.ndarray

_EXACT = 1e-6  # relative error of the kernel's integrals; its default has errors of 1 % on NURBS faces
_SIGNS = {TopAbs_FORWARD: 1, TopAbs_REVERSED: -1}
_NONE: Mapping[int, Array] = MappingProxyType({})


def sizes(faces: Sequence[TopoDS_Face], about: Array, known: Mapping[int, Array] = _NONE) -> Array:
    """Area, its first moment, volume towards a point and its first moment of faces, ``(f, 8)``, mm.

    The point ``about`` must be the same for all faces of a body.  If it is near, the volume hardly depends on how well
    the faces meet.

    NURBS faces are integrated by :func:`mracad.bspline.moments.moments`, for which the kernel takes tens of times as
    long; others by the kernel.  Surfaces count as forward.  Those of ``known`` faces, by place, are taken as they are.
    """
    found = np.zeros((len(faces), 8))
    for place, size in known.items():
        found[place] = size
    with quiet():
        left = {place: TopoDS.Face_s(faces[place].Oriented(TopAbs_FORWARD)) for place in range(len(faces))}
        left = {place: face for place, face in left.items() if place not in known}
        grounds = {place: _ground(face) for place, face in left.items()}
        splines = list(dict.fromkeys(surface for surface, _ in grounds.values() if is_nurbs(surface)))
        control = dict(zip(splines, nets(splines), strict=True))
        uses = [
            (place, edge)
            for place, face in left.items()
            if grounds[place][0] in control
            for edge in edge_uses(face)
            if edge.Orientation() in _SIGNS
        ]
        pieces = curves([(pcurve(edge, left[p]), *BRep_Tool.Range_s(edge, left[p])) for p, edge in uses])
        rims: dict[int, list] = {place: [] for place in left}
        for (place, edge), curve in zip(uses, pieces, strict=True):
            rims[place].append((curve, _SIGNS[edge.Orientation()]))
        for place, face in left.items():
            surface, frame = grounds[place]
            if surface in control:
                net = control[surface]
                row = moments(net.with_poles(placed(net.poles, frame) - about), rims[place])
                row[[1, 2, 3, 5, 6, 7]] += np.outer(row[[0, 4]], about).ravel()
            else:
                row = _by_kernel(face, about)
            found[place] = row
    return found


def document_sizes(
    document: Document, known: Mapping[int, Array] = _NONE, about: Array | None = None
) -> tuple[Array, Array]:
    """The :func:`sizes` of all faces of a document, each in its part's frame, and the point towards which volumes are
    measured: ``about``, that of the ``known`` ones, or else the middle of all."""
    if about is None:
        about = box(compound(part.shape for part in document.parts)).mean(axis=0)
    return sizes(document.faces, about, known), about


def _ground(face: TopoDS_Face) -> tuple[Geom_Surface, Array]:
    """The untrimmed surface of a face, and its frame."""
    location = TopLoc_Location()
    surface = basis(BRep_Tool.Surface_s(face, location))
    return surface, matrix(location)


def _by_kernel(face: TopoDS_Face, about: Array) -> Array:
    """The row of a face."""
    row = []
    for integral in (BRepGProp_Sinert, BRepGProp_Vinert):
        ground = BRepGProp_Face()
        ground.Load(face)
        found = integral(ground, BRepGProp_Domain(face), gp_Pnt(*about.tolist()), _EXACT)
        row += [found.Mass(), *(found.Mass() * x for x in found.CentreOfMass().Coord())]
    return np.array(row)


def mass(document: Document, each: Array | None = None) -> Mass:
    """Volume, area and centre of all placed shapes; ``each`` are the sizes of its faces, if known."""
    each = document_sizes(document)[0] if each is None else each
    whole, solid = np.zeros((2, 4))
    for part in document.parts:
        own = _summed(part.shape, part.faces, each[part.first :])
        for place in part.placements or [TopLoc_Location()]:
            whole, solid = (total + _moved(four, place) for total, four in zip((whole, solid), own, strict=True))
    return _mass(whole, solid)


def mass_of(shape: TopoDS_Shape) -> Mass:
    """Volume, area and centre of a shape."""
    faces = TopTools_IndexedMapOfShape()
    TopExp.MapShapes_s(shape, TopAbs_FACE, faces)
    members = [TopoDS.Face_s(faces.FindKey(i)) for i in range(1, faces.Extent() + 1)]
    each = sizes(members, box(shape).mean(axis=0) if members else np.zeros(3))
    return _mass(*_summed(shape, faces, each))


def face_masses(document: Document, each: Array | None = None) -> list[Mass]:
    """Area and centre of every face, in its part's frame; ``each`` as for :func:`mass`."""
    each = document_sizes(document)[0] if each is None else each
    return [_mass(row[:4], np.zeros(4)) for row in each]


def _summed(shape: TopoDS_Shape, faces: TopTools_IndexedMapOfShape, each: Array) -> tuple[Array, Array]:
    """Area and its first moment of a shape, volume and its first moment of its solids; rows of ``each`` are of the
    ``faces``."""
    whole, solid = np.zeros((2, 4))
    for face in _uses(shape):
        whole = whole + each[faces.FindIndex(face) - 1, :4]
    for body in inside(shape, TopAbs_SOLID):
        for face in _uses(body):
            solid = solid + _SIGNS.get(face.Orientation(), 0) * each[faces.FindIndex(face) - 1, 4:]
    return whole, solid


def _uses(shape: TopoDS_Shape):
    """The faces of a shape as it uses them."""
    explorer = TopExp_Explorer(shape, TopAbs_FACE)
    while explorer.More():
        yield explorer.Current()
        explorer.Next()


def _moved(four: Array, place: TopLoc_Location) -> Array:
    """A size and its first moment, placed."""
    frame = matrix(place)
    return np.append(four[:1], frame[:3, :3] @ four[1:] + frame[:3, 3] * four[0])


def _mass(whole: Array, solid: Array) -> Mass:
    """Areas and volumes as figures; the centre is that of the volume if there is one."""
    four = solid if solid[0] else whole
    x, y, z = (four[1:] / four[0] if four[0] else four[1:]).tolist()
    return Mass(float(solid[0]), float(whole[0]), (x, y, z))
