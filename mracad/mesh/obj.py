"""OBJ: an object for each instance, a group for each face, in mm."""

from __future__ import annotations

from mracad import __version__
from mracad.mesh.scene import Scene


def write(scene: Scene) -> bytes:
    """A scene as Wavefront OBJ, with all digits."""
    lines = [f"# mracad {__version__}, millimetres"]
    before = 1
    for body in scene.placed():
        lines.append(f"o {_word(body.name) or 'part'}")
        lines += [f"v {x!r} {y!r} {z!r}" for x, y, z in body.points.tolist()]
        corners = (body.corners + before).tolist()
        for face, triangles in body.groups():
            number, _, name = body.labels[face].partition(" ")
            lines.append(f"g face{number[1:]} {_word(name)}".rstrip())
            lines += [f"f {a} {b} {c}" for a, b, c in corners[triangles]]
        before += len(body.points)
    return "\n".join([*lines, ""]).encode(errors="replace")


def _word(name: str) -> str:
    """A name without what would end it or begin something else."""
    return "_".join("".join(c if c.isprintable() and c not in "#\\" else " " for c in name).split())
