"""STL: all triangles, in mm; the format holds nothing else."""

from __future__ import annotations

import numpy as np

from mracad.mesh.scene import Scene
from mracad.version import __version__

Array = np.ndarray
_LAYOUT = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])


def write(scene: Scene, ascii: bool = False) -> bytes:
    """A scene as STL, binary or text."""
    corners = np.concatenate([body.points[body.corners] for body in scene.placed()]).astype("<f4")
    a, b, c = corners.swapaxes(0, 1)
    flat = (a == b).all(axis=1) | (b == c).all(axis=1) | (c == a).all(axis=1)  # in 32 bits
    table = np.zeros(len(corners) - flat.sum(), _LAYOUT)
    table["corners"] = corners[~flat]
    table["normal"] = _normals(table["corners"].astype(float))
    return _text(table) if ascii else _binary(table)


def _normals(corners: Array) -> Array:
    a, b, c = corners.swapaxes(0, 1)
    normals = np.cross(b - a, c - a)
    lengths = np.linalg.norm(normals, axis=1, keepdims=True)
    return normals / np.where(lengths > 0, lengths, 1.0)


def _binary(table: Array) -> bytes:
    header = f"mracad {__version__}, millimetres".encode().ljust(80)
    return bytes(header + np.uint32(len(table)).astype("<u4").tobytes() + table.tobytes())


def _text(table: Array) -> bytes:
    lines = ["solid mracad"]
    for normal, corners in zip(table["normal"].tolist(), table["corners"].tolist(), strict=True):
        lines.append("facet normal {:.9g} {:.9g} {:.9g}\n outer loop".format(*normal))
        lines.extend("  vertex {:.9g} {:.9g} {:.9g}".format(*corner) for corner in corners)
        lines.append(" endloop\nendfacet")
    return "\n".join([*lines, "endsolid mracad", ""]).encode()
