"""Triangles of bodies in a tree, as plain arrays: the source of every mesh format."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace

import numpy as np

Array = np.ndarray

GREY = "#b3b3b3"
"""Colour of what has none, for formats that need one."""


@dataclass(frozen=True)
class Legend:
    """What numbers at points are, and what the colours there stand for.

    Attributes
    ----------
    name : str
        A word.
    title, unit : str
    low, high : float
        The range of the colours.
    lowest, highest : float
        The extreme numbers.
    """

    name: str
    title: str
    unit: str
    low: float
    high: float
    lowest: float
    highest: float

    def __str__(self) -> str:
        return f"{self.title} {self.lowest:.3g} to {self.highest:.3g} {self.unit}".replace(" -", " −")

    @property
    def key(self) -> str:
        """What the colours stand for."""
        return f"colours: {self.title} from {self.low:g} to {self.high:g} {self.unit}"


@dataclass(frozen=True, eq=False)
class Places:
    """The points of a body as places on its faces: one for each face that meets in a point.

    Attributes
    ----------
    point : ndarray of int (k,)
        Point numbers.
    uv : ndarray (k, 2)
        Parameters on the surface of the face.
    corners : ndarray of int (m, 3)
        The corners of triangles as places.
    values : mapping of str to ndarray (k,)
        Numbers by name, if they have any.
    normals : ndarray (k, 3)
        Outward unit normals, where there are numbers.
    colours : ndarray of uint8 (k, 3)
        Red, green and blue for the first number.
    """

    point: Array
    uv: Array
    corners: Array
    values: Mapping[str, Array] = field(default_factory=dict)
    normals: Array = field(default_factory=lambda: np.zeros((0, 3)))
    colours: Array = field(default_factory=lambda: np.zeros((0, 3), np.uint8))


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
    places : Places, optional
    """

    name: str
    points: Array
    corners: Array
    faces: Array
    labels: tuple[str, ...]
    colours: tuple[str, ...]
    places: Places | None = None

    @property
    def numbers(self) -> Array:
        """The number in the document of the face of each triangle."""
        return np.asarray(np.array([int(label.partition(" ")[0][1:]) for label in self.labels])[self.faces])

    @property
    def apart(self) -> Body:
        """The body with a point for each place, so that numbers and colours differ between faces."""
        assert self.places is not None
        return replace(self, points=self.points[self.places.point], corners=self.places.corners)

    def moved(self, frame: Array) -> Body:
        """The body in another frame."""
        turn = frame[:3, :3]
        way = -1 if np.linalg.det(turn) < 0 else 1
        places = self.places
        if places is not None:
            places = replace(places, corners=places.corners[:, ::way], normals=places.normals @ turn.T)
        points = self.points @ turn.T + frame[:3, 3]
        return replace(self, points=points, corners=self.corners[:, ::way], places=places)

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
    legends : tuple of Legend
        Of the numbers at the places of all bodies.
    """

    name: str
    bodies: tuple[Body, ...]
    roots: tuple[Node, ...]
    legends: tuple[Legend, ...] = ()

    def placed(self) -> Iterator[Body]:
        """Every instance of a body, with its points in the frame of the scene."""
        yield from self._below(self.roots, np.eye(4))

    def _below(self, nodes: tuple[Node, ...], above: Array) -> Iterator[Body]:
        for node in nodes:
            frame = above @ node.frame
            if node.body is not None:
                body = self.bodies[node.body].moved(frame)
                yield body.apart if self.legends else body
            yield from self._below(node.children, frame)


def rgba(colour: str) -> tuple[int, int, int, int]:
    """``"#rrggbb"`` or ``"#rrggbbaa"`` as bytes."""
    red, green, blue, *alpha = bytes.fromhex(colour[1:])
    return red, green, blue, alpha[0] if alpha else 255
