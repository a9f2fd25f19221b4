"""glTF 2.0, text or binary: the tree with its names, and a primitive with a colour for each face; in metres, Y up.

https://registry.khronos.org/glTF/specs/2.0/glTF-2.0.html.  The faces of a body share its points, so that a closed body
is closed; viewers compute the normals.  Where the scene has numbers at points, each face has points of its own, with
normals, colours (COLOR_0) and the numbers (_DEVIATION …), whose units are in the extras of the scene.
"""

from __future__ import annotations

import base64
import json
import struct
from typing import Any

import numpy as np

from mracad.mesh.scene import GREY, Body, Node, Scene, rgba
from mracad.version import __version__

Array = np.ndarray
_UPRIGHT = [-(0.5**0.5), 0.0, 0.0, 0.5**0.5]  # quaternion: Z up to Y up
_FLOAT, _INDEX, _SHORT, _POINTS, _TRIANGLES = 5126, 5125, 5123, 34962, 34963  # component types and buffer targets


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
    store = _Store()
    bodies = [body.apart for body in scene.bodies] if scene.legends else scene.bodies
    meshes = [_mesh(body, colours, store) for body in bodies]
    nodes: list[dict[str, Any]] = []
    top = [_node(node, nodes) for node in scene.roots]
    nodes.append({"name": scene.name, "rotation": _UPRIGHT, "scale": [1e-3] * 3, "children": top})
    content = {
        "asset": {"version": "2.0", "generator": f"mracad {__version__}"},
        "scene": 0,
        "scenes": [{"name": scene.name, "nodes": [len(nodes) - 1], **_extras(scene)}],
        "nodes": nodes,
        "meshes": meshes,
        "materials": [_material(colour) for colour in colours],
        "accessors": store.accessors,
        "bufferViews": store.views,
        "buffers": [{"byteLength": len(store.data)}],
    }
    return bytes(store.data), content


class _Store:
    """The buffer, and what describes it."""

    def __init__(self) -> None:
        self.data = bytearray()
        self.views: list[dict[str, Any]] = []
        self.accessors: list[dict[str, Any]] = []

    def view(self, values: Array, target: int) -> None:
        """Append numbers, whose rows fill whole words."""
        place = {"buffer": 0, "byteOffset": len(self.data), "byteLength": values.nbytes, "target": target}
        self.views.append(place)
        self.data += values.tobytes()

    def attribute(self, values: Array, **more: Any) -> int:
        """Append numbers of points; returns the accessor."""
        self.view(values, _POINTS)
        kind = _FLOAT if values.dtype.kind == "f" else _SHORT
        shape = "SCALAR" if values.ndim == 1 else f"VEC{values.shape[1]}"
        entry = {"bufferView": len(self.views) - 1, "componentType": kind, "count": len(values), "type": shape}
        return self.accessor({**entry, **more})

    def accessor(self, entry: dict[str, Any]) -> int:
        self.accessors.append(entry)
        return len(self.accessors) - 1


def _extras(scene: Scene) -> dict[str, Any]:
    """What the numbers at points are."""
    if not scene.legends:
        return {}
    named = {f"_{each.name.upper()}": {"title": each.title, "unit": each.unit} for each in scene.legends}
    return {"extras": {"scalars": named, "colours": scene.legends[0].key.partition(": ")[2]}}


def _mesh(body: Body, colours: list[str], store: _Store) -> dict[str, Any]:
    """The mesh entry of a body, whose numbers are appended to the store."""
    points = body.points.astype("<f4")
    attributes = {"POSITION": store.attribute(points, min=points.min(axis=0).tolist(), max=points.max(axis=0).tolist())}
    places = body.places
    if places is not None and places.values:
        attributes["NORMAL"] = store.attribute(places.normals.astype("<f4"))
        light = np.append(_linear(places.colours / 255.0), np.ones((len(points), 1)), axis=1)
        attributes["COLOR_0"] = store.attribute(np.round(65535.0 * light).astype("<u2"), normalized=True)
        attributes |= {f"_{n.upper()}": store.attribute(each.astype("<f4")) for n, each in places.values.items()}
    store.view(body.corners.astype("<u4"), _TRIANGLES)
    primitives = []
    for face, triangles in body.groups():
        count = triangles.stop - triangles.start
        place = {"bufferView": len(store.views) - 1, "byteOffset": 12 * triangles.start}
        indices = store.accessor({**place, "componentType": _INDEX, "count": 3 * count, "type": "SCALAR"})
        primitives.append(
            {
                "attributes": attributes,
                "indices": indices,
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
    *solid, alpha = (value / 255 for value in rgba(colour))
    base = [*_linear(np.array(solid)).tolist(), alpha]
    look = {"baseColorFactor": base, "metallicFactor": 0.0, "roughnessFactor": 0.6}
    kind = {"alphaMode": "BLEND"} if alpha < 1 else {}
    return {"name": colour, "pbrMetallicRoughness": look, "doubleSided": True, **kind}


def _linear(colours: Array) -> Array:
    """Amounts of light of colours from 0 to 1."""
    return np.where(colours <= 0.04045, colours / 12.92, ((colours + 0.055) / 1.055) ** 2.4)
