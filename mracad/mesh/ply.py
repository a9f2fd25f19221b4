"""PLY: vertices in double precision, mm; each triangle with its face's number and colour."""

from __future__ import annotations

import numpy as np

from mracad.mesh.scene import GREY, Scene, rgba
from mracad.version import __version__

_LAYOUT = np.dtype([("count", "u1"), ("corners", "<i4", 3), ("face", "<i4"), ("colour", "u1", 4)])
_HEADER = """ply
format binary_little_endian 1.0
comment mracad {version}, millimetres
element vertex {vertices}
property double x
property double y
property double z
element face {triangles}
property list uchar int vertex_indices
property int face
property uchar red
property uchar green
property uchar blue
property uchar alpha
end_header
"""


def write(scene: Scene) -> bytes:
    """A scene as binary PLY."""
    points, tables = [], []
    before = 0
    for body in scene.placed():
        table = np.zeros(len(body.corners), _LAYOUT)
        table["count"] = 3
        table["corners"] = body.corners + before
        table["face"] = np.array([int(label.partition(" ")[0][1:]) for label in body.labels])[body.faces]
        table["colour"] = np.array([rgba(colour or GREY) for colour in body.colours], np.uint8)[body.faces]
        points.append(body.points)
        tables.append(table)
        before += len(body.points)
    header = _HEADER.format(version=__version__, vertices=before, triangles=sum(map(len, tables)))
    return header.encode() + np.concatenate(points).astype("<f8").tobytes() + np.concatenate(tables).tobytes()
