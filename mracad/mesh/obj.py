"""OBJ: an object for each instance and a group for each face, in mm; points carry colours, which many readers accept.

Materials would need a second file.  Faces share their points, so that a closed body is closed; where two colours meet,
a point has that of the later face.
"""

from __future__ import annotations

from collections.abc import Iterator

from mracad.mesh.scene import GREY, Body, Scene, rgba
from mracad.version import __version__


def write(scene: Scene) -> bytes:
    """A scene as Wavefront OBJ, with all digits."""
    lines = [f"# mracad {__version__}, millimetres"]
    looks = _looks(scene)
    before = 1
    for body in scene.placed():
        lines.append(f"o {_word(body.name) or 'part'}")
        lines += [" ".join(["v", *map(repr, point), *look]) for point, look in _points(body, looks)]
        corners = (body.corners + before).tolist()
        for face, triangles in body.groups():
            number, _, name = body.labels[face].partition(" ")
            lines.append(f"g face{number[1:]} {_word(name)}".rstrip())
            lines += [f"f {a} {b} {c}" for a, b, c in corners[triangles]]
        before += len(body.points)
    return "\n".join([*lines, ""]).encode(errors="replace")


def _looks(scene: Scene) -> dict[str, list[str]]:
    """The values after the points of each colour: red, green and blue, and opacity if anything is transparent."""
    every = {colour or GREY for body in scene.bodies for colour in body.colours}
    if every <= {GREY}:
        return {GREY: []}
    shown = 3 + any(rgba(colour)[3] < 255 for colour in every)
    return {colour: [f"{value / 255:.6g}" for value in rgba(colour)[:shown]] for colour in every}


def _points(body: Body, looks: dict[str, list[str]]) -> Iterator[tuple[list[float], list[str]]]:
    """The points of a body, and the colour values after each."""
    own = [body.colours[0] or GREY] * len(body.points)
    for coloured in (False, True):
        for face, triangles in body.groups():
            if bool(body.colours[face]) == coloured:
                for point in set(body.corners[triangles].ravel().tolist()):
                    own[point] = body.colours[face] or GREY
    return zip(body.points.tolist(), (looks[colour] for colour in own), strict=True)


def _word(name: str) -> str:
    """A name without characters that would end it or start something else."""
    return "_".join("".join(c if c.isprintable() and c not in "#\\" else " " for c in name).split())
