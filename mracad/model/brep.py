"""The kernel-free snapshot of a CAD document: surfaces, faces, edges.

Lengths are millimetres.  Every array is float64 and must be treated as read-only.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from mracad.brief import line, model_line
from mracad.bspline.curve import Curve
from mracad.bspline.surface import Net
from mracad.model.rails import Rails

Array = np.ndarray

SAME = 9
"""Number of decimals to which equal frames agree."""


@dataclass(frozen=True, eq=False)
class Surface:
    """One NURBS surface of the document; several faces may lie on it.

    Attributes
    ----------
    index : int
        Position in ``Model.surfaces``.
    net : Net
        Its control net in the surface's own frame (see ``Face.frame``), mm.
    faces : tuple of int
        Indices of the faces that lie on it.
    origin : str
        ``"bspline"``, ``"bezier"``, or the analytic kind from which it is converted (``"extrusion"``, …).
    """

    index: int
    net: Net
    faces: tuple[int, ...]
    origin: str = "bspline"

    __repr__ = line


@dataclass(frozen=True, eq=False)
class Trim:
    """One use of an edge by a face: the edge's curve in the parameter plane of the face's surface.

    Attributes
    ----------
    edge : int
        Index in ``Model.edges``.
    curve : Curve
        The pcurve as a 2D NURBS curve over the edge's own parameter range (poles ``(n, 2)`` in ``u, v``).
    """

    edge: int
    curve: Curve

    __repr__ = line


@dataclass(frozen=True, eq=False)
class Face:
    """One face of one part.  A part with several instances counts once (see ``instances``).

    Attributes
    ----------
    index : int
        Position in ``Model.faces``, from 0; users write ``#1`` for the first.
    name, product : str
        Names from the document, or ``""``.
    colour : str
        ``"#rrggbb"`` or ``""``.
    kind : str
        ``"bspline"``, ``"bezier"``, ``"plane"``, ``"cylinder"``, ``"cone"``, ``"sphere"``, ``"torus"``,
        ``"extrusion"``, ``"revolution"``, ``"offset"``, ``"other"``.
    surface : int or None
        Index in ``Model.surfaces`` of a NURBS face; None for any other face, which never changes.
    trims : tuple of Trim
        The boundary, one entry per use of an edge (two for a closing edge); empty unless ``surface`` is set.
    reversed : bool
        Whether the face's outward normal is opposite to S_u × S_v.
    frame : ndarray (4, 4)
        Rigid map from the surface's frame to the part's.
    box : ndarray (2, 3)
        Lowest and highest corner of its control points' box in the part's frame, mm; see ``occ.boxes.face_boxes`` for
        that of the face itself.
    instances : int
        Number of instances of the part in the document.
    """

    index: int
    kind: str
    surface: int | None
    trims: tuple[Trim, ...]
    reversed: bool
    frame: Array
    box: Array
    name: str = ""
    product: str = ""
    colour: str = ""
    instances: int = 1

    __repr__ = line

    @property
    def outward(self) -> int:
        """1 where S_u × S_v points outward, otherwise -1."""
        return -1 if self.reversed else 1

    def trim(self, edge: int) -> Trim:
        """Its first use of an edge."""
        return next(trim for trim in self.trims if trim.edge == edge)

    def turned(self, vectors: Array) -> Array:
        """Vectors ``(…, 3)`` of the surface's frame in the part's."""
        return np.asarray(vectors @ self.frame[:3, :3].T)

    def placed(self, points: Array) -> Array:
        """Points ``(…, 3)`` of the surface's frame in the part's."""
        return np.asarray(self.turned(points) + self.frame[:3, 3])

    def local(self, points: Array) -> Array:
        """Points ``(…, 3)`` of the part's frame in the surface's."""
        return np.asarray((points - self.frame[:3, 3]) @ self.frame[:3, :3])


@dataclass(frozen=True, eq=False)
class Side:
    """One face's view of an edge, at the edge's sample parameters (see ``Edge.points``).

    A NURBS side has ``uv`` and is evaluated on its surface, so that it follows an edit; any other side does not
    move and carries its points, normals and curvature as measured by the kernel.

    Attributes
    ----------
    face : int
        Index in ``Model.faces``.
    uv : ndarray (k, 2) or None
        Parameters on the face's surface.
    points, normals : ndarray (k, 3) or None
        Points (mm) and outward unit normals in the part's frame.
    curvatures : ndarray (k,) or None
        Normal curvatures across the edge (1/mm), positive where the face bends towards its normal.
    """

    face: int
    uv: Array | None = None
    points: Array | None = None
    normals: Array | None = None
    curvatures: Array | None = None

    __repr__ = line


@dataclass(frozen=True, eq=False)
class Edge:
    """An edge of a part.

    Attributes
    ----------
    index : int
        Position in ``Model.edges``, from 0; users write ``edge#1`` for the first.
    points, tangents : ndarray (k, 3)
        Samples of its 3D curve in the part's frame (mm) and unit tangents there; empty when degenerate.
    sides : tuple of Side
        One per use by a face: one for a free edge, two for a seam, two of the same face for a closing edge.
    tolerance : float
        The edge's tolerance, mm.
    degenerate : bool
        A pole: the edge is a point in space.
    part : int
        Index of the part (shape definition) to which it belongs.
    """

    index: int
    points: Array
    tangents: Array
    sides: tuple[Side, ...]
    tolerance: float
    degenerate: bool = False
    part: int = 0

    __repr__ = line

    @property
    def free(self) -> bool:
        return len(self.sides) == 1 and not self.degenerate

    @property
    def closing(self) -> bool:
        return len(self.sides) == 2 and self.sides[0].face == self.sides[1].face


@dataclass(frozen=True, eq=False)
class Model:
    """A document as faces on surfaces, joined by edges.

    Attributes
    ----------
    name : str
        File name without folder.
    surfaces, faces, edges
        The parts' geometry.
    diagonal : float
        Diagonal of the bounding box of the whole document, instances placed, mm.
    unit : str
        The file's length unit (``"mm"``, ``"m"``, ``"in"``, …).
    schema : str
        STEP schema (``"AP203"``, ``"AP214"``, ``"AP242"``).
    products : tuple of str
        Names of the parts.
    places : tuple of tuple of ndarray (4, 4)
        Frames of the instances, by part; empty for a model of one part in its place.
    rails : Rails
        Surfaces and curves along which edges can slide; empty if not asked for.
    """

    name: str
    surfaces: tuple[Surface, ...]
    faces: tuple[Face, ...]
    edges: tuple[Edge, ...]
    diagonal: float
    unit: str = "mm"
    schema: str = ""
    products: tuple[str, ...] = ()
    places: tuple[tuple[Array, ...], ...] = ()
    rails: Rails = field(default_factory=Rails)

    def __repr__(self) -> str:
        nurbs = sum(face.surface is not None for face in self.faces)
        more = f"{len(self.edges)} edges", self.unit, self.schema
        return model_line("Model", self.name, (nurbs, len(self.faces)), *more)

    @cached_property
    def spaces(self) -> tuple[int, ...]:
        """The coordinate space of each part: parts with a single instance in the same place share one."""
        first: dict[bytes, int] = {}
        bases = [
            first.setdefault((frames[0].round(SAME) + 0.0).tobytes(), part) if len(frames) == 1 else part
            for part, frames in enumerate(self.places)
        ]
        return tuple(bases)

    def with_surfaces(self, surfaces: Sequence[Surface]) -> Model:
        """The model with other surfaces under the same faces (sides with fixed points stay as they are)."""
        return replace(self, surfaces=tuple(surfaces))
