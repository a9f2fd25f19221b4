"""Triangles of every face of a document, as arrays."""

from __future__ import annotations

from collections.abc import Container, Iterable, Mapping

import numpy as np
from OCP.BRep import BRep_Tool
from OCP.BRepMesh import BRepMesh_IncrementalMesh
from OCP.BRepTools import BRepTools
from OCP.Geom import (
    Geom_BezierSurface,
    Geom_BSplineSurface,
    Geom_ConicalSurface,
    Geom_CylindricalSurface,
    Geom_Plane,
    Geom_SphericalSurface,
    Geom_ToroidalSurface,
)
from OCP.IMeshTools import IMeshTools_MeshAlgoType, IMeshTools_Parameters
from OCP.TopAbs import TopAbs_REVERSED
from OCP.TopLoc import TopLoc_Location

from mracad.errors import UsageError
from mracad.model.facts import Triangles
from mracad.occ.document import Document
from mracad.occ.geometry import basis, is_nurbs
from mracad.occ.polygons import polygons
from mracad.occ.settings import quiet
from mracad.occ.topology import box, compound

Array = np.ndarray
SMALLEST = 1e-6, 0.5
"""Least chord, as a share of the diagonal, and least angle, degrees."""

_CHORD = 2e-4  # of the diagonal
_ANGLE = 12.0  # degrees
_ALGORITHMS = (
    IMeshTools_MeshAlgoType.IMeshTools_MeshAlgoType_Watson,
    IMeshTools_MeshAlgoType.IMeshTools_MeshAlgoType_Delabella,
)
_LAID = (
    Geom_Plane,
    Geom_CylindricalSurface,
    Geom_ConicalSurface,
    Geom_SphericalSurface,
    Geom_ToroidalSurface,
    Geom_BSplineSurface,
    Geom_BezierSurface,
)  # on which it lays a grid
_MANY = 5_000  # knot cells of a surface, beyond which the first is slow: it takes the square of their number
_WELD = 2e-7  # of a part's diagonal: about the resolution of 32-bit numbers


def triangles(document: Document, chord: float | None = None, angle: float | None = None) -> Triangles:
    """Mesh a document.

    Parameters
    ----------
    document : Document
    chord : float, optional
        Largest distance of the mesh from the surface, mm; by default 1/5000 of the model's diagonal.
    angle : float, optional
        Largest turn between neighbouring triangles along a curve, degrees; by default 12.

    Raises
    ------
    UsageError
        For a chord or an angle that is too small.
    """
    if angle is not None and not SMALLEST[1] <= angle <= 180:
        raise UsageError(f"angle: {angle:g} is not between {SMALLEST[1]:g} and 180 degrees", "give --angle 12")
    with quiet():
        bounds = box(document.shape)
        size = float(np.linalg.norm(bounds[1] - bounds[0]))
        if chord is not None and not chord >= SMALLEST[0] * size:
            least = f"give at least {SMALLEST[0] * size:.3g} mm, a millionth of the model's diagonal"
            raise UsageError(f"chord: {chord:g} mm is too small", least)
    best: Triangles | None = None
    fewest = 0
    for algorithm in _ALGORITHMS[:: -1 if _cells(document) > _MANY else 1]:
        found = _meshed(document, chord or _CHORD * size, angle or _ANGLE, algorithm)
        folds = _repeated(found, found.sides)
        if best is None or folds < fewest:
            best, fewest = found, folds
        if not folds or folds == _repeated(found, _rims(found)):  # every algorithm divides edges alike
            break
    assert best is not None
    return best


def facets(document: Document, chord: float, faces: Iterable[int] | None = None) -> Triangles:
    """Few triangles, which follow edges, and surfaces other than NURBS, within the chord.

    Parameters
    ----------
    document : Document
    chord : float
        mm.
    faces : iterable of int, optional
        By default all.
    """
    chosen = range(len(document.faces)) if faces is None else sorted(set(faces))
    shapes = {i: document.faces[i] for i in chosen}
    laid = (isinstance(basis(BRep_Tool.Surface_s(face, TopLoc_Location())), _LAID) for face in shapes.values())
    swept = [face for face, is_laid in zip(shapes.values(), laid, strict=True) if not is_laid]
    best: dict[int, tuple[Array, Array, Array]] = {}
    bad = 0
    with quiet():
        whole = compound(shapes.values())
        for algorithm in reversed(_ALGORITHMS):  # the second is faster, but fails on extrusions
            BRepTools.Clean_s(whole)
            if swept:
                BRepMesh_IncrementalMesh(compound(swept), _settings(chord, _ANGLE, _ALGORITHMS[0], follow=True))
            BRepMesh_IncrementalMesh(whole, _settings(chord, _ANGLE, algorithm, follow=False))
            found = polygons(shapes)
            BRepTools.Clean_s(whole)
            lacking = len(shapes) - len(found) + sum(map(_folds, found.values()))
            if not best or lacking < bad:
                best, bad = found, lacking
            if not bad:
                break
    return _collected(document, chosen, best)


def _folds(mesh: tuple[Array, Array, Array]) -> int:
    """Number of sides of the triangles of a face that have occurred before in the same direction."""
    points, _, corners = mesh
    return _again(corners[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), len(points))


def _meshed(document: Document, chord: float, angle: float, algorithm: object) -> Triangles:
    """A mesh by one of the kernel's algorithms."""
    with quiet():
        whole = compound(part.shape for part in document.parts)
        BRepTools.Clean_s(whole)
        BRepMesh_IncrementalMesh(whole, _settings(chord, angle, algorithm, follow=True))
        found = polygons(dict(enumerate(document.faces)))
        BRepTools.Clean_s(whole)
    return _collected(document, range(len(document.faces)), found)


def _settings(chord: float, angle: float, algorithm: object, follow: bool) -> IMeshTools_Parameters:
    """Settings of the kernel, which may ``follow`` curved surfaces between edges that it does not lay a grid on."""
    settings = IMeshTools_Parameters()
    settings.Deflection, settings.Angle, settings.MeshAlgo = chord, float(np.radians(angle)), algorithm
    settings.ControlSurfaceDeflection = follow
    return settings


def _cells(document: Document) -> int:
    """The largest number of knot cells of a surface."""
    surfaces = (basis(BRep_Tool.Surface_s(face, TopLoc_Location())) for face in document.faces)
    return max(((s.NbUKnots() - 1) * (s.NbVKnots() - 1) for s in surfaces if is_nurbs(s)), default=0)


def _repeated(mesh: Triangles, sides: Array) -> int:
    """Number of sides that have occurred before in the same direction: the kernel's default sometimes folds a mesh
    over itself."""
    return _again(sides, len(mesh.points))


def _again(sides: Array, points: int) -> int:
    """Number of sides that have occurred before in the same direction, among some points."""
    keys = np.sort(sides @ [points, 1])
    return int((keys[1:] == keys[:-1]).sum())


def _rims(mesh: Triangles) -> Array:
    """The sides of triangles along edges, as point numbers."""
    ends = np.sort(mesh.own[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1) @ [len(mesh.points), 1]
    _, place, counts = np.unique(ends, return_inverse=True, return_counts=True)
    return np.asarray(mesh.sides[counts[place] == 1])


def _collected(
    document: Document, chosen: Container[int], meshes: Mapping[int, tuple[Array, Array, Array]]
) -> Triangles:
    """The triangles of the chosen faces, given their :func:`mracad.occ.polygons.polygons`."""
    points: list[Array] = []
    uv: list[Array] = []
    corners: list[Array] = []
    owners: list[tuple[int, int, int]] = []
    missing = []
    leaders: list[Array] = []
    count = 0
    for number, part in enumerate(document.parts):
        first = count
        own: list[Array] = []
        for index in filter(chosen.__contains__, part.numbers):
            if index not in meshes:
                missing.append(index)
                continue
            where, at, three = meshes[index]
            own.append(where)
            uv.append(at)
            three = three + count
            turned = document.faces[index].Orientation() == TopAbs_REVERSED
            corners.append(three[:, ::-1] if turned else three)
            owners.append((index, number, len(three)))
            count += len(own[-1])
        if own:
            points.append(np.concatenate(own))
            leaders.append(_weld(points[-1]) + first)
    if not corners:
        none, one = np.empty((0, 3), int), np.empty(0, int)
        return Triangles(np.empty((0, 3)), np.empty((0, 2)), none, none, one, one, tuple(missing))
    own_three = np.concatenate(corners)
    three = np.concatenate(leaders)[own_three]
    faces, parts = (np.repeat([o[k] for o in owners], [o[2] for o in owners]) for k in (0, 1))
    whole_ones = (three[:, 0] != three[:, 1]) & (three[:, 1] != three[:, 2]) & (three[:, 2] != three[:, 0])
    three, own_three, faces, parts = (each[whole_ones] for each in (three, own_three, faces, parts))
    return Triangles(np.concatenate(points), np.concatenate(uv), three, own_three, faces, parts, tuple(missing))


def _weld(points: Array) -> Array:
    """For each point, the first of the points that coincide with it.

    The kernel evaluates both sides of a closing edge, and rounds them differently.
    """
    from scipy.sparse import coo_array  # takes tenths of a second, which reading and writing STEP need not spend
    from scipy.sparse.csgraph import connected_components
    from scipy.spatial import cKDTree

    reach = _WELD * float(np.linalg.norm(np.ptp(points, axis=0)))
    pairs = cKDTree(points).query_pairs(reach, output_type="ndarray")
    links = coo_array((np.ones(len(pairs)), (pairs[:, 0], pairs[:, 1])), shape=(len(points), len(points)))
    groups = connected_components(links, directed=False)[1]
    _, first = np.unique(groups, return_index=True)
    return first[groups]
