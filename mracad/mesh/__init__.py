"""Writing triangle meshes: one module per format, with numpy only."""

from importlib import import_module

from mracad.mesh.scene import Body, Node, Scene

__all__ = ["Body", "Node", "Scene", "write"]


def write(scene: Scene, format: str, ascii: bool = False) -> bytes:
    """A scene in a mesh format of ``mracad.formats``; ``ascii`` is for STL."""
    home = import_module("mracad.mesh." + {"glb": "gltf", "3mf": "threemf"}.get(format, format))
    options = {"stl": {"ascii": ascii}, "gltf": {"binary": False}}.get(format, {})
    return bytes(home.write(scene, **options))
