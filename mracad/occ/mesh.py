"""Triangle meshes out."""

from __future__ import annotations

import os
import tempfile
from pathlib import Path
from typing import BinaryIO

import numpy as np
from OCP.BRep import BRep_Tool
from OCP.BRepMesh import BRepMesh_IncrementalMesh
from OCP.BRepTools import BRepTools
from OCP.StlAPI import StlAPI_Writer
from OCP.TopLoc import TopLoc_Location

from mracad import __version__
from mracad.errors import FileError, UsageError
from mracad.occ.document import Document
from mracad.occ.settings import quiet
from mracad.occ.topology import box
from mracad.output import put

Array = np.ndarray
_TRIANGLES = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])
_CHORD = 2e-4  # of the diagonal
_ANGLE = 12.0  # degrees
_WELD = 2e-7  # of the diagonal: about the resolution of the file's 32-bit numbers


def write_stl(
    document: Document,
    target: str | os.PathLike | BinaryIO,
    ascii: bool = False,
    chord: float | None = None,
    angle: float | None = None,
) -> tuple[int, ...]:
    """Write all placed parts as one STL mesh, in mm.

    Parameters
    ----------
    document : Document
    target : path or binary stream
        A path is replaced only once the whole file is written.
    ascii : bool
        Text rather than binary.
    chord : float, optional
        How far the mesh may be from the surface, mm; by default 1/5000 of the model's diagonal.
    angle : float, optional
        How far neighbouring triangles may turn along a curve, degrees; by default 12.

    Returns
    -------
    tuple of int
        Faces that the kernel could not mesh: the mesh has holes there.

    Raises
    ------
    UsageError
        When ``chord`` or ``angle`` is not positive.
    FileError
        When nothing can be meshed, or the target cannot be written.
    """
    if (chord is not None and not chord > 0) or (angle is not None and not angle > 0):
        raise UsageError("chord and angle of a mesh must be positive", "leave them out for the defaults")
    triangles, missing = _triangles(document, chord, _ANGLE if angle is None else angle)
    if not len(triangles):
        raise FileError(f"'{document.name}' gives no triangles", "check its geometry")
    put(_text(triangles) if ascii else _binary(triangles), target)
    return missing


def _triangles(document: Document, chord: float | None, angle: float) -> tuple[Array, tuple[int, ...]]:
    """Normals and corners of all triangles, mm, and the faces that have none."""
    shape = document.shape
    with quiet(), tempfile.TemporaryDirectory() as folder:
        BRepTools.Clean_s(shape)
        corners = box(shape)
        deflection = chord if chord else _CHORD * float(np.linalg.norm(corners[1] - corners[0]))
        BRepMesh_IncrementalMesh(shape, deflection, False, float(np.radians(angle)), False)
        nowhere = TopLoc_Location()
        missing = tuple(i for i, face in enumerate(document.faces) if BRep_Tool.Triangulation_s(face, nowhere) is None)
        raw = Path(folder, "mesh.stl")
        writer = StlAPI_Writer()
        writer.ASCIIMode = False
        writer.Write(shape, str(raw))
        BRepTools.Clean_s(shape)
        data = raw.read_bytes() if raw.exists() else b""
    triangles = np.frombuffer(data[84:], _TRIANGLES).copy()
    return _welded(triangles), missing


def _welded(triangles: Array) -> Array:
    """The same triangles with corners that differ by rounding made one; those that vanish are left out.

    The kernel evaluates both sides of a closing edge, and rounds them differently.
    """
    from scipy.sparse import coo_array  # a few tenths of a second that reading and writing STEP can do without
    from scipy.sparse.csgraph import connected_components
    from scipy.spatial import cKDTree

    points, index = np.unique(triangles["corners"].reshape(-1, 3), axis=0, return_inverse=True)
    if not len(points):
        return triangles
    reach = _WELD * float(np.linalg.norm(points.max(axis=0) - points.min(axis=0)))
    pairs = cKDTree(points).query_pairs(reach, output_type="ndarray")
    count = len(points)
    links = coo_array((np.ones(len(pairs)), (pairs[:, 0], pairs[:, 1])), shape=(count, count))
    groups = connected_components(links, directed=False)[1]
    _, leader = np.unique(groups, return_index=True)
    index = leader[groups[index]].reshape(-1, 3)
    whole = (index[:, 0] != index[:, 1]) & (index[:, 1] != index[:, 2]) & (index[:, 2] != index[:, 0])
    triangles["corners"] = points[index]
    return triangles[whole]


def _binary(triangles: Array) -> bytes:
    header = f"mracad {__version__}, millimetres".encode().ljust(80)
    return header + np.uint32(len(triangles)).astype("<u4").tobytes() + triangles.tobytes()


def _text(triangles: Array) -> bytes:
    lines = ["solid mracad"]
    for normal, corners in zip(triangles["normal"].tolist(), triangles["corners"].tolist(), strict=True):
        lines.append("facet normal {:.9g} {:.9g} {:.9g}\n outer loop".format(*normal))
        lines.extend("  vertex {:.9g} {:.9g} {:.9g}".format(*corner) for corner in corners)
        lines.append(" endloop\nendfacet")
    return "\n".join([*lines, "endsolid mracad", ""]).encode()
