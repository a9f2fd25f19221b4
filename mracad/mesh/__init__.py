"""Writing triangle meshes: one module per format, with numpy only."""

from collections.abc import Callable

from mracad.mesh import gltf, obj, ply, stl, threemf
from mracad.mesh.scene import Body, Node, Scene

__all__ = ["Body", "Node", "Scene", "write"]


def write(scene: Scene, format: str, ascii: bool = False) -> bytes:
    """A scene in a mesh format of ``mracad.formats``; ``ascii`` is for STL."""
    if format == "stl":
        return stl.write(scene, ascii)
    if format in ("gltf", "glb"):
        return gltf.write(scene, binary=format == "glb")
    others: dict[str, Callable[[Scene], bytes]] = {"3mf": threemf.write, "obj": obj.write, "ply": ply.write}
    return others[format](scene)
