"""Faces as triangles whose corners know their parameters, and the surfaces under them: what pictures are made of."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Protocol

import numpy as np

from mracad.bspline.curve import Curve
from mracad.bspline.surface import Net
from mracad.bspline.vectors import cross, unit
from mracad.model.rails import Elementary

Array = np.ndarray
Jet = tuple[Array, ...]
"""S, S_u, S_v and, of order 2, S_uu, S_uv, S_vv at points, each ``(q, 3)``, in the part's frame, mm."""


def carried(jet: Jet, frame: Array) -> Jet:
    """A jet in the frame to which a map ``(4, 4)`` leads."""
    if (frame == np.eye(4)).all():
        return jet
    point, *slopes = (each @ frame[:3, :3].T for each in jet)
    return point + frame[:3, 3], *slopes


class Ground(Protocol):
    """The surface under a face, evaluated as it is."""

    def jets(self, uv: Array, order: int) -> Jet:
        """Points and derivatives, up to the first or second, at parameters ``(q, 2)``."""
        ...


@dataclass(frozen=True, eq=False)
class Spline:
    """A NURBS surface in its part's frame.

    Attributes
    ----------
    net : Net
    frame : ndarray (4, 4)
    """

    net: Net
    frame: Array

    def jets(self, uv: Array, order: int) -> Jet:
        return carried(self.net.evaluate(uv, order), self.frame)


@dataclass(frozen=True, eq=False)
class Closed:
    """An elementary surface, by the formulas of the kernel's parameters."""

    shape: Elementary

    def jets(self, uv: Array, order: int) -> Jet:
        x, y, z = self.shape.frame[:3, :3].T
        u, v = uv[:, :1], uv[:, 1:]
        if self.shape.kind == "plane":
            none = np.zeros((len(uv), 3))
            flat = self.shape.frame[:3, 3] + u * x + v * y, none + x, none + y
            return flat if order == 1 else (*flat, none, none, none)
        rho, height = self._profile(v)
        out, about = np.cos(u) * x + np.sin(u) * y, np.cos(u) * y - np.sin(u) * x
        first = self.shape.frame[:3, 3] + rho[0] * out + height[0] * z, rho[0] * about, rho[1] * out + height[1] * z
        return first if order == 1 else (*first, -rho[0] * out, rho[1] * about, rho[2] * out + height[2] * z)

    def _profile(self, v: Array) -> tuple[tuple[Array, ...], tuple[Array, ...]]:
        """Distance from the axis and height along it, with their first and second derivatives."""
        nothing, one = np.zeros_like(v), np.ones_like(v)
        radius, minor, slope = self.shape.radius, self.shape.minor, self.shape.slope
        cos, sin = np.cos(v), np.sin(v)
        match self.shape.kind:
            case "cylinder":
                return (radius * one, nothing, nothing), (v, one, nothing)
            case "cone":
                return (
                    (radius + np.sin(slope) * v, np.sin(slope) * one, nothing),
                    (np.cos(slope) * v, np.cos(slope) * one, nothing),
                )
            case "sphere":
                middle, minor = 0.0, radius
            case _:
                middle = radius
        return (middle + minor * cos, -minor * sin, -minor * cos), (minor * sin, minor * cos, -minor * sin)


@dataclass(frozen=True, eq=False)
class Swept:
    """A spline curve moved along a direction, S = C(u) + v d, or turned about an axis, S = a + R(u) (C(v) − a).

    Attributes
    ----------
    curve : Curve
    way : ndarray (3,)
        d, or the unit direction of the axis.
    centre : ndarray (3,) or None
        a, a point of the axis; None for a curve that moves along a direction.
    frame : ndarray (4, 4)
        Map from the frame of all this to the part's.
    """

    curve: Curve
    way: Array
    centre: Array | None
    frame: Array

    def jets(self, uv: Array, order: int) -> Jet:
        if self.centre is None:
            point, *slopes = self.curve.evaluate(uv[:, 0], order)
            none = np.zeros_like(point)
            found = point + uv[:, 1:] * self.way, slopes[0], none + self.way, *slopes[1:], *[none] * (2 * order - 2)
        else:
            point, *slopes = self.curve.evaluate(uv[:, 1], order)
            arm, sv, *more = (self._turned(each, uv[:, :1]) for each in (point - self.centre, *slopes))
            su = cross(self.way, arm)
            found = self.centre + arm, su, sv
            if more:
                found = *found, cross(self.way, su), cross(self.way, sv), *more
        return carried(found, self.frame)

    def _turned(self, vectors: Array, angle: Array) -> Array:
        """Vectors turned about the axis (Rodrigues)."""
        along = (vectors @ self.way)[:, None] * self.way
        return np.asarray(along + np.cos(angle) * (vectors - along) + np.sin(angle) * cross(self.way, vectors))


@dataclass(frozen=True, eq=False)
class Facets:
    """The triangles of one face.

    Attributes
    ----------
    face : int
        Index in ``Model.faces``.
    points : ndarray (n, 3)
        In the part's frame, mm.
    uv : ndarray (n, 2)
        Their parameters on the surface.
    corners : ndarray of int (m, 3)
        Anticlockwise seen from outside.
    ground : Ground
    outward : {1, -1}
        1 where S_u × S_v points outward.
    rims : mapping of int to ndarray of int
        The points along each of its edges that is no pole and does not close the face, by edge index.
    """

    face: int
    points: Array
    uv: Array
    corners: Array
    ground: Ground
    outward: int
    rims: Mapping[int, Array]

    @cached_property
    def off(self) -> float:
        """The largest distance of the middle of a triangle from the surface, along the normal there, mm."""
        points, uv = (values[self.corners].mean(axis=1) for values in (self.points, self.uv))
        s, su, sv = self.ground.jets(uv, 1)
        return float(np.abs(((s - points) * unit(cross(su, sv))).sum(axis=1)).max())


@dataclass(frozen=True, eq=False)
class Placed:
    """An instance of a part.

    Attributes
    ----------
    frame : ndarray (4, 4)
        Map from the part's frame to the document's.
    faces : tuple of int
    colours : tuple of str
        Of those faces: ``"#rrggbb"``, ``"#rrggbbaa"`` or ``""``.
    """

    frame: Array
    faces: tuple[int, ...]
    colours: tuple[str, ...]


@dataclass(frozen=True, eq=False)
class Body:
    """A document in triangles.

    Attributes
    ----------
    name : str
    facets : mapping of int to Facets
        By face; a face that the kernel cannot mesh has none.
    placed : tuple of Placed
    extent : ndarray (2, 3)
        Least and largest coordinates of all points as placed, mm.
    """

    name: str
    facets: Mapping[int, Facets]
    placed: tuple[Placed, ...]
    extent: Array

    @property
    def diagonal(self) -> float:
        """Of the box of all points, mm."""
        return float(np.linalg.norm(self.extent[1] - self.extent[0]))
