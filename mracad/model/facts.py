"""Facts about a document as plain data: made in ``mracad.occ``, used by all other rooms."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from mracad.brief import line
from mracad.model.brep import Model

Array = np.ndarray


@dataclass(frozen=True)
class Failure:
    """One finding of the kernel's check.

    Attributes
    ----------
    kind : str
        ``"face"``, ``"wire"``, ``"edge"``, ``"vertex"``, ``"shell"`` or ``"solid"``.
    status : str
        The kernel's name for it, such as ``"SelfIntersectingWire"``.
    face : int or None
        Index of the face in which it was found; None for shells and solids.
    """

    kind: str
    status: str
    face: int | None

    def __str__(self) -> str:
        return f"{self.status} in a {self.kind}" + (f" of #{self.face + 1}" if self.face is not None else "")


@dataclass(frozen=True, eq=False)
class Spot:
    """A place on a face.

    Attributes
    ----------
    face : int
    uv : (float, float)
    point : ndarray (3,)
        mm, in the part's frame.
    distance : float
        From the point that was asked for, mm.
    normal : ndarray (3,) or None
        Outward; None at a pole.
    along : ndarray (3,) or None
        Direction in which u runs.
    bends : tuple of (float, ndarray (3,))
        Principal curvatures (1/mm, positive where convex) and their directions; none where they are not defined, equal
        ones with any direction.
    """

    face: int
    uv: tuple[float, float]
    point: Array
    distance: float
    normal: Array | None
    along: Array | None
    bends: tuple[tuple[float, Array], ...]

    __repr__ = line


@dataclass(frozen=True)
class Validity:
    """The kernel's verdict on a document; a part with several instances counts once.

    Attributes
    ----------
    valid : bool
    failures : tuple of Failure
    solids, shells, faces, open_shells : int
        Numbers in the whole document.
    free_edges : int
        Number of edges that a single face uses once.
    edge_tolerance, vertex_tolerance : float
        Largest tolerances of the faces that were checked, mm.
    curve_distance : float or None
        Largest distance between an edge's 3D curve and its curve on a face that was checked, at equal parameters, mm.
    """

    valid: bool
    failures: tuple[Failure, ...]
    solids: int
    shells: int
    faces: int
    open_shells: int
    free_edges: int
    edge_tolerance: float
    vertex_tolerance: float
    curve_distance: float | None = None


@dataclass(frozen=True)
class Occurrence:
    """One part, assembly or instance with its placement in the document.

    Attributes
    ----------
    path : tuple of str
        Names of the instances from the top down (of the product for a free shape).
    product : str
    frame : tuple of float
        The upper three rows of its placement in the whole, row-major, mm.
    """

    path: tuple[str, ...]
    product: str
    frame: tuple[float, ...]


@dataclass(frozen=True, order=True)
class Carrier:
    """The carrier of an attribute: a product, one of its components, or something inside it.

    Attributes
    ----------
    product, component : str
        ``component`` is ``""`` unless it is one.
    face : int
        Index of the face; -1 for everything else.
    inside : bool
        Whether it is another shape inside the product: a body or an edge.
    """

    product: str
    component: str = ""
    face: int = -1
    inside: bool = False


@dataclass(frozen=True)
class Contents:
    """The content of a document beyond geometry.

    Attributes
    ----------
    unit : str
    products : tuple of str
        Names of all parts and assemblies.
    usages : int
        Number of uses of products in assembly definitions.
    tree : tuple of Occurrence
    colours : tuple of (Carrier, str, str)
        Carrier, what is coloured, and ``"#rrggbb"`` or ``"#rrggbbaa"``; sorted.
    layers : tuple of (Carrier, str)
        Carrier and layer; sorted.
    materials : tuple of (Carrier, float)
        Carrier and density as the kernel gives it; sorted.
    annotations : dict of str to int
        Number of ``"dimensions"``, ``"tolerances"`` and ``"datums"``.
    """

    unit: str
    products: tuple[str, ...]
    usages: int
    tree: tuple[Occurrence, ...]
    colours: tuple[tuple[Carrier, str, str], ...]
    layers: tuple[tuple[Carrier, str], ...]
    materials: tuple[tuple[Carrier, float], ...]
    annotations: dict[str, int]


@dataclass(frozen=True)
class Mass:
    """Volume, area and centre of all placed instances of a document, or of one face in its part's frame.

    Attributes
    ----------
    volume : float
        Volume of the solids, mm³; 0 for a face.
    area : float
        Area of the faces, mm².
    centre : (float, float, float)
        Centre of the solids or, if there are none, of the faces, mm.
    """

    volume: float
    area: float
    centre: tuple[float, float, float]


@dataclass(frozen=True, eq=False)
class Triangles:
    """A mesh of all parts, each once and in its own frame, mm.

    Attributes
    ----------
    points : ndarray (n, 3)
    uv : ndarray (n, 2)
        Their parameters on the surface of their face.
    corners : ndarray of int (m, 3)
        Point numbers, anticlockwise seen from outside; corners that coincide within rounding are one point of their
        part.
    own : ndarray of int (m, 3)
        The corners as points of the triangle's own face.
    faces, parts : ndarray of int (m,)
        Indices of the face and of the part of each triangle.
    missing : tuple of int
        Faces that the kernel could not mesh.
    """

    points: Array
    uv: Array
    corners: Array
    own: Array
    faces: Array
    parts: Array
    missing: tuple[int, ...]

    @property
    def sides(self) -> Array:
        """The sides of the triangles as point numbers, three after three, ``(3 m, 2)``."""
        return np.asarray(self.corners[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2))


@dataclass(frozen=True)
class Stated:
    """A STEP file as parsed.

    Attributes
    ----------
    entities : int
    faces : int
        Number of faces in all shells, each counted once.
    uses : tuple of (int, int, bool)
        Every use of an edge by a face: number of the edge, index of the face, and whether the face's boundary runs in
        the direction of the edge.
    centres : tuple of (float, float, float)
        Middle of the vertices of each face, in the file's unit.
    senses : tuple of (bool or None)
        Whether each face has the orientation of its surface; None if that is not stated.
    broken : tuple of str
        Entities that could not be understood, at most a hundred: their place in the file and the reason.
    """

    entities: int
    faces: int
    uses: tuple[tuple[int, int, bool], ...]
    centres: tuple[tuple[float, float, float], ...]
    senses: tuple[bool | None, ...]
    broken: tuple[str, ...]


@dataclass(frozen=True)
class Counts:
    """Numbers of shapes, all instances counted."""

    solids: int
    shells: int
    faces: int
    free_edges: int


@dataclass(frozen=True, eq=False)
class Line:
    """An edge at a few points.

    Attributes
    ----------
    faces : tuple of int
        Faces that use it, once for each use.
    points : ndarray (1 + n, k, 6)
        Points of its own curve and of each face along it, in the part's frame, mm; and the unit normals of the
        surfaces there (for the curve zero).
    tolerance : float
        mm.
    """

    faces: tuple[int, ...]
    points: Array
    tolerance: float


class Probe(Protocol):
    """Measurements taken only where something differs; see :class:`mracad.occ.facts.KernelProbe`."""

    def validity(self) -> Validity: ...

    def along(self, edges: Collection[int]) -> Model: ...

    def area(self, face: int, exact: bool) -> float: ...

    def volume(self) -> float: ...

    def box(self) -> Array: ...


@dataclass(frozen=True, eq=False)
class Facts:
    """Facts about a document, in memory or as read back.

    Attributes
    ----------
    diagonal : float
        mm.
    counts : Counts
    spots : ndarray (p, 9)
        Position of each placed face: corners of its box, and middle of its vertices, mm.
    owners : ndarray of int (p,)
        The face of each spot.
    closing : frozenset of int
        Faces on closed surfaces without a closing edge, whose edges do not tell on which side of them the face lies.
    vertices : ndarray (f,)
        The largest tolerance among the vertices of each face, mm.
    edges : tuple of Line
        All edges; degenerate ones without samples or faces.
    probe : Probe
    """

    diagonal: float
    counts: Counts
    spots: Array
    owners: Array
    closing: frozenset[int]
    vertices: Array
    edges: tuple[Line, ...]
    probe: Probe

    @property
    def count(self) -> int:
        """The number of faces, instances counted once."""
        return len(self.vertices)

    @property
    def tolerance(self) -> float:
        """The largest tolerance, mm."""
        return max([*(edge.tolerance for edge in self.edges), float(self.vertices.max(initial=0.0))])
