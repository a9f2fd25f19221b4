"""The kernel's triangles of faces, as arrays."""

from __future__ import annotations

import io
from collections.abc import Mapping

import numpy as np
from OCP.BinTools import BinTools, BinTools_FormatVersion
from OCP.BRep import BRep_Builder, BRep_Tool
from OCP.Poly import Poly_Triangulation
from OCP.TopLoc import TopLoc_Location
from OCP.TopoDS import TopoDS_Face

from mracad.occ.topology import compound, matrix, placed

Array = np.ndarray
_TITLE = b"\nTriangulations %d\n"
_COUNTS = np.dtype([("nodes", "<i4"), ("triangles", "<i4"), ("uv", "u1"), ("normals", "u1"), ("chord", "<f8")])
_PARTS = ("<f8", "nodes", 3), ("<f8", "nodes", 2), ("<i4", "triangles", 3)


def polygons(faces: Mapping[int, TopoDS_Face]) -> dict[int, tuple[Array, Array, Array]]:
    """Points ``(n, 3)`` in the frame of the part, their parameters ``(n, 2)``, zero where the kernel knows none, and
    corners ``(m, 3)`` of the triangles that it keeps with faces; nothing for a face without any."""
    kept: dict[int, tuple[Poly_Triangulation, TopLoc_Location]] = {}
    for index, face in faces.items():
        location = TopLoc_Location()
        mesh = BRep_Tool.Triangulation_s(face, location)
        if mesh is not None and mesh.NbTriangles():
            kept[index] = mesh, location
    told = _told(list(dict.fromkeys(mesh for mesh, _ in kept.values())))
    found = {}
    for index, (mesh, location) in kept.items():
        points, uv, corners = told[mesh]
        found[index] = points if location.IsIdentity() else placed(points, matrix(location)), uv, corners
    return found


def _told(meshes: list[Poly_Triangulation]) -> dict[Poly_Triangulation, tuple[Array, Array, Array]]:
    """Distinct triangulations in their own frames: the kernel's binary writer tells them tens of times as fast as its
    methods, point by point."""
    faces = []
    for mesh in meshes:
        face = TopoDS_Face()
        BRep_Builder().MakeFace(face, mesh)
        faces.append(face)
    buffer = io.BytesIO()
    BinTools.Write_s(compound(faces), buffer, True, False, BinTools_FormatVersion.BinTools_FormatVersion_CURRENT)
    data, title = buffer.getvalue(), _TITLE % len(meshes)
    at = data.index(title) + len(title)
    found = {}
    for mesh in meshes:
        counts = np.frombuffer(data, _COUNTS, 1, at)[0]
        at += _COUNTS.itemsize
        points, uv, corners = (np.zeros((int(counts[of]), width), kind) for kind, of, width in _PARTS)
        for part in (points, uv, corners) if counts["uv"] else (points, corners):
            part[:] = np.frombuffer(data, part.dtype, part.size, at).reshape(part.shape)
            at += part.nbytes
        found[mesh] = points, uv, corners.astype(np.int64) - 1
    return found
