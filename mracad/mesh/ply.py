"""PLY: vertices in double precision, mm; each triangle with its face's number and colour.

Where the scene has numbers at points, vertices have these, normals and colours, and triangles have no colours.
"""

from __future__ import annotations

import numpy as np

from mracad.mesh.scene import GREY, Body, Scene, rgba
from mracad.version import __version__

Array = np.ndarray
_NAMES = {"<f8": "double", "<f4": "float", "<i4": "int", "|u1": "uchar"}
_COLOURS = "red", "green", "blue", "alpha"


def write(scene: Scene) -> bytes:
    """A scene as binary PLY."""
    points, triangles = [], []
    before = 0
    for body in scene.placed():
        points.append(_table(_vertices(body, bool(scene.legends))))
        triangles.append(_table(_triangles(body, before, bool(scene.legends))))
        before += len(body.points)
    vertices, faces = np.concatenate(points), np.concatenate(triangles)
    lines = [
        "ply", "format binary_little_endian 1.0", f"comment mracad {__version__}, millimetres",
        *(f"comment {each.name}: {each.title}, {each.unit}" for each in scene.legends),
        *(f"comment {each.key}" for each in scene.legends[:1]),
        f"element vertex {len(vertices)}", *_properties(vertices),
        f"element face {len(faces)}", "property list uchar int vertex_indices", *_properties(faces, 2),
        "end_header", "",
    ]  # fmt: skip
    return "\n".join(lines).encode() + vertices.tobytes() + faces.tobytes()


def _vertices(body: Body, shown: bool) -> dict[str, Array]:
    columns = dict(zip("xyz", body.points.T.astype("<f8"), strict=True))
    if shown and body.places is not None:
        columns |= dict(zip(("nx", "ny", "nz"), body.places.normals.T.astype("<f4"), strict=True))
        columns |= {name: values.astype("<f4") for name, values in body.places.values.items()}
        columns |= dict(zip(_COLOURS, body.places.colours.T, strict=False))
    return columns


def _triangles(body: Body, before: int, shown: bool) -> dict[str, Array]:
    corners = (body.corners + before).astype("<i4")
    columns = {"count": np.full(len(corners), 3, np.uint8), "corners": corners, "face": body.numbers.astype("<i4")}
    if not shown:
        looks = np.array([rgba(colour or GREY) for colour in body.colours], np.uint8)[body.faces]
        columns |= dict(zip(_COLOURS, looks.T, strict=True))
    return columns


def _table(columns: dict[str, Array]) -> Array:
    """Columns as one table without gaps."""
    found = np.empty(len(next(iter(columns.values()))), [(k, v.dtype, v.shape[1:]) for k, v in columns.items()])
    for name, values in columns.items():
        found[name] = values
    return found


def _properties(table: Array, first: int = 0) -> list[str]:
    return [f"property {_NAMES[table.dtype[name].str]} {name}" for name in (table.dtype.names or ())[first:]]
