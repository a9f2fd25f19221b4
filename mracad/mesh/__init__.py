"""Writing triangle meshes: one module per format, with numpy only."""

from importlib import import_module

from mracad.mesh.scene import Body, Node, Scene

_HOMES = {"glb": "gltf", "3mf": "threemf", "vtp": "vtk", "vtu": "vtk"}

__all__ = ["Body", "Node", "Scene", "write"]


def write(scene: Scene, format: str, ascii: bool = False) -> bytes:
    """A scene in a mesh format of ``mracad.formats``; ``ascii`` is for STL."""
    home = import_module("mracad.mesh." + _HOMES.get(format, format))
    options = {"stl": {"ascii": ascii}, "gltf": {"binary": False}, "vtu": {"grid": True}}.get(format, {})
    return bytes(home.write(scene, **options))
