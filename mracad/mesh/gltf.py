"""glTF 2.0, text or binary: the tree with its names, and a primitive with a colour for each face; in metres, Y up.

https://registry.khronos.org/glTF/specs/2.0/glTF-2.0.html.  The faces of a body share its points, so that a closed body
is closed; viewers compute the normals.
"""

from __future__ import annotations

import base64
import json
import struct
from typing import Any

import numpy as np

from mracad.mesh.scene import GREY, Body, Node, Scene, rgba
from mracad.version import __version__

_UPRIGHT = [-(0.5**0.5), 0.0, 0.0, 0.5**0.5]  # quaternion: Z up to Y up
_FLOAT, _INDEX, _POINTS, _TRIANGLES = 5126, 5125, 34962, 34963  # component types and buffer targets


def write(scene: Scene, binary: bool = True) -> bytes:
    """A scene as glTF: one file, binary (GLB) or JSON with the data inside."""
    data, content = _content(scene)
    if not binary:
        content["buffers"][0]["uri"] = "data:application/octet-stream;base64," + base64.b64encode(data).decode()
        return (json.dumps(content, ensure_ascii=False, indent=1) + "\n").encode(errors="replace")
    text = json.dumps(content, ensure_ascii=False, separators=(",", ":")).encode(errors="replace")
    text += b" " * (-len(text) % 4)
    chunks = struct.pack("<II", len(text), 0x4E4F534A) + text + struct.pack("<II", len(data), 0x004E4942) + data
    return struct.pack("<III", 0x46546C67, 2, 12 + len(chunks)) + chunks


def _content(scene: Scene) -> tuple[bytes, dict[str, Any]]:
    """The buffer and the JSON that describes it."""
    colours = list(dict.fromkeys(colour or GREY for body in scene.bodies for colour in body.colours))
    data = bytearray()
    views: list[dict[str, Any]] = []
    accessors: list[dict[str, Any]] = []
    meshes = [_mesh(body, colours, data, views, accessors) for body in scene.bodies]
    nodes: list[dict[str, Any]] = []
    top = [_node(node, nodes) for node in scene.roots]
    nodes.append({"name": scene.name, "rotation": _UPRIGHT, "scale": [1e-3] * 3, "children": top})
    content = {
        "asset": {"version": "2.0", "generator": f"mracad {__version__}"},
        "scene": 0,
        "scenes": [{"name": scene.name, "nodes": [len(nodes) - 1]}],
        "nodes": nodes,
        "meshes": meshes,
        "materials": [_material(colour) for colour in colours],
        "accessors": accessors,
        "bufferViews": views,
        "buffers": [{"byteLength": len(data)}],
    }
    return bytes(data), content


def _mesh(body: Body, colours: list[str], data: bytearray, views: list[Any], accessors: list[Any]) -> dict[str, Any]:
    """The mesh entry of a body, whose numbers are appended to the buffer."""
    points = body.points.astype("<f4")
    views.append({"buffer": 0, "byteOffset": len(data), "byteLength": points.nbytes, "target": _POINTS})
    data += points.tobytes()
    positions = len(accessors)
    bounds = {"min": points.min(axis=0).tolist(), "max": points.max(axis=0).tolist()}
    shared = {"bufferView": len(views) - 1, "componentType": _FLOAT, "count": len(points), "type": "VEC3"}
    accessors.append({**shared, **bounds})
    corners = body.corners.astype("<u4")
    views.append({"buffer": 0, "byteOffset": len(data), "byteLength": corners.nbytes, "target": _TRIANGLES})
    data += corners.tobytes()
    primitives = []
    for face, triangles in body.groups():
        count = triangles.stop - triangles.start
        place = {"bufferView": len(views) - 1, "byteOffset": 12 * triangles.start}
        accessors.append({**place, "componentType": _INDEX, "count": 3 * count, "type": "SCALAR"})
        primitives.append(
            {
                "attributes": {"POSITION": positions},
                "indices": len(accessors) - 1,
                "material": colours.index(body.colours[face] or GREY),
                "extras": {"face": body.labels[face]},
            }
        )
    return {"name": body.name, "primitives": primitives}


def _node(node: Node, nodes: list[dict[str, Any]]) -> int:
    """Add a node and its children; returns its number."""
    entry: dict[str, Any] = {"name": node.name}
    if not np.array_equal(node.frame, np.eye(4)):
        entry["matrix"] = node.frame.T.ravel().tolist()  # by columns
    if node.body is not None:
        entry["mesh"] = node.body
    if node.children:
        entry["children"] = [_node(child, nodes) for child in node.children]
    nodes.append(entry)
    return len(nodes) - 1


def _material(colour: str) -> dict[str, Any]:
    red, green, blue, alpha = (value / 255 for value in rgba(colour))
    linear = [c / 12.92 if c <= 0.04045 else ((c + 0.055) / 1.055) ** 2.4 for c in (red, green, blue)]
    look = {"baseColorFactor": [*linear, alpha], "metallicFactor": 0.0, "roughnessFactor": 0.6}
    kind = {"alphaMode": "BLEND"} if alpha < 1 else {}
    return {"name": colour, "pbrMetallicRoughness": look, "doubleSided": True, **kind}
