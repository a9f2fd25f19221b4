"""Triangles of bodies in a tree, as plain arrays: the source of every mesh format."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

Array = np.ndarray

GREY = "#b3b3b3"
"""Colour of what has none, for formats that need one."""


@dataclass(frozen=True, eq=False)
class Body:
    """The mesh of one part, in its own frame, mm.

    Attributes
    ----------
    name : str
    points : ndarray (n, 3)
    corners : ndarray of int (m, 3)
        Point numbers, anticlockwise seen from outside; neighbouring triangles share them, across faces too.
    faces : ndarray of int (m,)
        Index of the face of each triangle, from 0, ascending.
    labels : tuple of str
        For each face, its number in the document (``"#7"``) and its name.
    colours : tuple of str
        Colour of each face: ``"#rrggbb"``, ``"#rrggbbaa"`` or ``""``.
    """

    name: str
    points: Array
    corners: Array
    faces: Array
    labels: tuple[str, ...]
    colours: tuple[str, ...]

    def groups(self) -> Iterator[tuple[int, slice]]:
        """The faces that have triangles, and the slice of their triangles."""
        present, first = np.unique(self.faces, return_index=True)
        ends = [*first[1:].tolist(), len(self.faces)]
        yield from ((face, slice(*run)) for face, *run in zip(present.tolist(), first.tolist(), ends, strict=True))


@dataclass(frozen=True, eq=False)
class Node:
    """A place in the tree.

    Attributes
    ----------
    name : str
    frame : ndarray (4, 4)
        Placement of its content in the frame of the node above.
    body : int or None
        Index of the body here.
    children : tuple of Node
    """

    name: str
    frame: Array
    body: int | None = None
    children: tuple[Node, ...] = ()


@dataclass(frozen=True, eq=False)
class Scene:
    """Bodies and the tree of their instances.

    Attributes
    ----------
    name : str
    bodies : tuple of Body
    roots : tuple of Node
    """

    name: str
    bodies: tuple[Body, ...]
    roots: tuple[Node, ...]

    def placed(self) -> Iterator[Body]:
        """Every instance of a body, with its points in the frame of the scene."""
        yield from self._below(self.roots, np.eye(4))

    def _below(self, nodes: tuple[Node, ...], above: Array) -> Iterator[Body]:
        for node in nodes:
            frame = above @ node.frame
            if node.body is not None:
                body = self.bodies[node.body]
                mirrored = np.linalg.det(frame[:3, :3]) < 0
                corners = body.corners[:, ::-1] if mirrored else body.corners
                points = body.points @ frame[:3, :3].T + frame[:3, 3]
                yield Body(body.name, points, corners, body.faces, body.labels, body.colours)
            yield from self._below(node.children, frame)


def rgba(colour: str) -> tuple[int, int, int, int]:
    """``"#rrggbb"`` or ``"#rrggbbaa"`` as bytes."""
    red, green, blue, *alpha = bytes.fromhex(colour[1:])
    return red, green, blue, alpha[0] if alpha else 255
