"""Triangle meshes out."""

from __future__ import annotations

import os
import tempfile
from pathlib import Path
from typing import BinaryIO

import numpy as np
from OCP.BRepMesh import BRepMesh_IncrementalMesh
from OCP.BRepTools import BRepTools
from OCP.StlAPI import StlAPI_Writer

from mracad import __version__
from mracad.errors import FileError, UsageError
from mracad.occ.document import Document
from mracad.occ.output import put
from mracad.occ.settings import quiet
from mracad.occ.topology import box

Array = np.ndarray
_TRIANGLES = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])
_CHORD = 2e-4  # of the diagonal
_ANGLE = 12.0  # degrees


def write_stl(
    document: Document,
    target: str | os.PathLike | BinaryIO,
    ascii: bool = False,
    chord: float | None = None,
    angle: float | None = None,
) -> None:
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

    Raises
    ------
    UsageError
        When ``chord`` or ``angle`` is not positive.
    FileError
        When nothing can be meshed, or the target cannot be written.
    """
    if (chord is not None and not chord > 0) or (angle is not None and not angle > 0):
        raise UsageError("chord and angle of a mesh must be positive", "leave them out for the defaults")
    triangles = _triangles(document, chord, _ANGLE if angle is None else angle)
    if not len(triangles):
        raise FileError(f"'{document.name}' gives no triangles", "check its geometry")
    put(_text(triangles) if ascii else _binary(triangles), target)


def _triangles(document: Document, chord: float | None, angle: float) -> Array:
    """Normals and corners of all triangles, mm."""
    shape = document.shape
    with quiet(), tempfile.TemporaryDirectory() as folder:
        BRepTools.Clean_s(shape)
        corners = box(shape)
        deflection = chord / document.unit_mm if chord else _CHORD * float(np.linalg.norm(corners[1] - corners[0]))
        BRepMesh_IncrementalMesh(shape, deflection, False, float(np.radians(angle)), False)
        raw = Path(folder, "mesh.stl")
        StlAPI_Writer().Write(shape, str(raw))
        BRepTools.Clean_s(shape)
        data = raw.read_bytes() if raw.exists() else b""
    triangles = np.frombuffer(data[84:], _TRIANGLES).copy()
    triangles["corners"] *= document.unit_mm
    return triangles


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
