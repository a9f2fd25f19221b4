"""A document as a scene of triangles, for mesh formats."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from OCP.BRep import BRep_Tool
from OCP.TDF import TDF_Label
from OCP.TopAbs import TopAbs_FACE, TopAbs_SHELL, TopAbs_SOLID
from OCP.XCAFDoc import XCAFDoc_ShapeTool

from mracad.errors import FileError, UsageError
from mracad.mesh.scene import Body, Node, Places, Scene
from mracad.model.facts import Triangles
from mracad.occ.document import Document, nested_colours
from mracad.occ.document import tint as instance_tint
from mracad.occ.labels import components, label_key, label_name, labels, referred
from mracad.occ.topology import inside, matrix
from mracad.occ.triangles import triangles


def scene(
    document: Document, chord: float | None = None, angle: float | None = None
) -> tuple[Scene, tuple[int, ...], tuple[int, ...]]:
    """Mesh a document; parameters as for :func:`mracad.occ.triangles.triangles`.

    Returns
    -------
    Scene
    tuple of int
        Faces that the kernel could not mesh, where the mesh has holes.
    tuple of int
        Faces of closed bodies that their mesh leaves open.

    Raises
    ------
    UsageError
        When ``chord`` or ``angle`` is not positive.
    FileError
        When nothing can be meshed.
    """
    if (chord is not None and not chord > 0) or (angle is not None and not angle > 0):
        raise UsageError("chord and angle of a mesh must be positive", "leave them out for the defaults")
    mesh = triangles(document, chord, angle)
    if not len(mesh.corners):
        raise FileError(f"'{document.name}' cannot be meshed", "check its geometry")
    bodies = _Bodies(document, mesh)
    nodes = [bodies.node(label) for label in labels(document.shape_tool.GetFreeShapes)]
    return (
        Scene(document.name, tuple(bodies.made), tuple(node for node in nodes if node)),
        mesh.missing,
        _open(document, mesh),
    )


class _Bodies:
    """The meshes of parts: one for each colour that instances give a part.

    Attributes
    ----------
    made : list of Body
    """

    def __init__(self, document: Document, mesh: Triangles) -> None:
        self.mesh = mesh
        self.parts = {label_key(part.label): (number, part) for number, part in enumerate(document.parts)}
        self.nested = dict(nested_colours(document))
        self.made: list[Body] = []
        self.place: dict[tuple[int, tuple[str, ...]], int] = {}

    def node(self, label: TDF_Label, above: tuple[str, ...] = (), tint: str = "") -> Node | None:
        """The tree from a label down; None if it has no triangles.

        ``above`` are the keys of the instances that contain it, ``tint`` is the colour that they give it.
        """
        frame, name = matrix(XCAFDoc_ShapeTool.GetLocation_s(label)), label_name(label)
        product = referred(label)
        if not product.IsEqual(label):
            above = (*above, label_key(label))
            tint = instance_tint(self.nested, above, label, tint)
        children = tuple(node for node in (self.node(part, above, tint) for part in components(product)) if node)
        body = self.body(label_key(product), tint)
        return Node(name, frame, body, children) if children or body is not None else None

    def body(self, key: str, tint: str) -> int | None:
        """The position of the mesh of a part in a colour; None if it has no triangles."""
        number, part = self.parts.get(key, (-1, None))
        own = self.mesh.parts == number
        if part is None or not own.any():
            return None
        count = part.faces.Extent()
        colours = tuple(part.face_colour(i, tint) for i in range(count))
        if (number, colours) not in self.place:
            self.place[number, colours] = len(self.made)
            used, corners = np.unique(self.mesh.corners[own], return_inverse=True)
            those, places = np.unique(self.mesh.own[own], return_inverse=True)
            point = np.empty(len(those), int)
            point[places] = corners
            self.made.append(
                Body(
                    name=part.product,
                    points=self.mesh.points[used],
                    corners=corners.reshape(-1, 3),
                    faces=self.mesh.faces[own] - part.first,
                    labels=tuple(f"#{part.first + i + 1} {part.face_names.get(i, '')}".strip() for i in range(count)),
                    colours=colours,
                    places=Places(point, self.mesh.uv[those], places.reshape(-1, 3)),
                )
            )
        return self.place[number, colours]


def _open(document: Document, mesh: Triangles) -> tuple[int, ...]:
    """Faces of closed solids with a triangle side that has no opposite one."""
    sides = mesh.sides
    keys = sides.min(axis=1) * len(mesh.points) + sides.max(axis=1)
    _, place = np.unique(keys, return_inverse=True)
    unmet = np.bincount(place, np.where(sides[:, 0] < sides[:, 1], 1.0, -1.0))[place] != 0
    found = set(np.repeat(mesh.faces, 3)[unmet].tolist()) | set(mesh.missing)
    return tuple(sorted(found & set(_enclosing(document)))) if found else ()


def _enclosing(document: Document) -> Iterator[int]:
    """The faces of solids whose shells are all closed."""
    for part in document.parts:
        for solid in inside(part.shape, TopAbs_SOLID):
            if all(BRep_Tool.IsClosed_s(shell) for shell in inside(solid, TopAbs_SHELL)):
                yield from map(part.face_number, inside(solid, TopAbs_FACE))
