"""A document as a scene of triangles, for mesh formats."""

from __future__ import annotations

import numpy as np
from OCP.TDF import TDF_Label
from OCP.XCAFDoc import XCAFDoc_ShapeTool

from mracad.errors import FileError, UsageError
from mracad.mesh.scene import Body, Node, Scene
from mracad.occ.document import Document, Part, components, label_key, label_name, labels, referred
from mracad.occ.topology import matrix
from mracad.occ.triangles import Triangles, triangles


def scene(document: Document, chord: float | None = None, angle: float | None = None) -> tuple[Scene, tuple[int, ...]]:
    """Mesh a document.

    Parameters
    ----------
    document : Document
    chord : float, optional
        How far the mesh may be from the surface, mm; by default 1/5000 of the model's diagonal.
    angle : float, optional
        How far neighbouring triangles may turn along a curve, degrees; by default 12.

    Returns
    -------
    Scene
    tuple of int
        Faces that the kernel could not mesh: the mesh has holes there.

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
        raise FileError(f"'{document.name}' gives no triangles", "check its geometry")
    bodies = {label_key(part.label): _body(mesh, number, part) for number, part in enumerate(document.parts)}
    filled = {key: body for key, body in bodies.items() if len(body.corners)}
    place = {key: number for number, key in enumerate(filled)}
    nodes = (_node(label, place) for label in labels(document.shape_tool.GetFreeShapes))
    return Scene(document.name, tuple(filled.values()), tuple(node for node in nodes if node)), mesh.missing


def _body(mesh: Triangles, number: int, part: Part) -> Body:
    """The mesh of one part."""
    own = mesh.parts == number
    used, corners = np.unique(mesh.corners[own], return_inverse=True)
    count = part.faces.Extent()
    return Body(
        name=part.product,
        points=mesh.points[used],
        corners=corners.reshape(-1, 3),
        faces=mesh.faces[own] - part.first,
        labels=tuple(f"#{part.first + i + 1} {part.face_names.get(i, '')}".strip() for i in range(count)),
        colours=tuple(part.face_colours.get(i, part.colour) for i in range(count)),
    )


def _node(label: TDF_Label, place: dict[str, int]) -> Node | None:
    """The tree from a label down; None where it holds no triangles."""
    frame, name = matrix(XCAFDoc_ShapeTool.GetLocation_s(label)), label_name(label)
    product = referred(label)
    body = place.get(label_key(product))
    children = tuple(node for node in (_node(part, place) for part in components(product)) if node)
    return Node(name, frame, body, children) if children or body is not None else None
