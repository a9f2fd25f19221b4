"""Surfaces and curves along which edges can slide: elementary surfaces in closed form, and the edges that end on them.

The signed distance of a point p from an elementary surface is d(p), whose gradient n is the normal at the foot p − d n.
With ρ the distance from the axis and z the height along it,

    plane     d = z                          cylinder  d = ρ − R
    cone      d = (ρ − R) cos α − z sin α    sphere    d = |p| − R
    torus     d = hypot(ρ − R, z) − r
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from mracad.brief import line

Array = np.ndarray


@dataclass(frozen=True, eq=False)
class Elementary:
    """A plane, cylinder, cone, sphere or torus.

    Attributes
    ----------
    kind : str
        ``"plane"``, ``"cylinder"``, ``"cone"``, ``"sphere"`` or ``"torus"``.
    frame : ndarray (4, 4)
        Map from its own frame, with z along the axis, to that of the part; x, y, z may be left-handed.
    outward : {1, −1}
        1 if outward normals of the face are the gradient of the distance, −1 if they are opposite.
    radius : float
        R, mm; for a cone that at z = 0.
    minor : float
        r of a torus, mm.
    slope : float
        α, half the angle of a cone, radians.
    """

    kind: str
    frame: Array
    outward: int = 1
    radius: float = 0.0
    minor: float = 0.0
    slope: float = 0.0

    __repr__ = line

    def off(self, points: Array) -> tuple[Array, Array]:
        """Signed distances (mm) of points ``(q, 3)`` and the unit normals at their feet, ``(q,)`` and ``(q, 3)``."""
        local = self._local(points)
        rho, out = self._round(local)
        up = np.zeros_like(out)
        up[:, 2] = 1.0
        z = local[:, 2]
        match self.kind:
            case "plane":
                distance, normal = z, up
            case "cylinder":
                distance, normal = rho - self.radius, out
            case "cone":
                cos, sin = np.cos(self.slope), np.sin(self.slope)
                distance, normal = (rho - self.radius) * cos - z * sin, cos * out - sin * up
            case "sphere":
                length = np.linalg.norm(local, axis=1)
                distance, normal = length - self.radius, local / np.maximum(length, 1e-300)[:, None]
            case _:
                way = (rho - self.radius)[:, None] * out + z[:, None] * up
                length = np.linalg.norm(way, axis=1)
                distance, normal = length - self.minor, way / np.maximum(length, 1e-300)[:, None]
        return distance, normal @ self.frame[:3, :3].T

    def far(self, points: Array) -> Array:
        """Distances of points ``(q, 3)``, mm."""
        return np.asarray(np.abs(self.off(points)[0]))

    def feet(self, points: Array) -> tuple[Array, Array]:
        """The nearest points of the surface and the outward normals of the face there, both ``(q, 3)``."""
        distance, normal = self.off(points)
        return points - distance[:, None] * normal, self.outward * normal

    def bends(self, points: Array, ways: Array) -> Array:
        """Normal curvatures (1/mm) of the face in unit directions ``ways`` (q, 3) at feet, positive where it bends
        towards its outward normal."""
        local, way = self._local(points), ways @ self.frame[:3, :3]
        rho, out = self._round(local)
        about = np.stack([-out[:, 1], out[:, 0], np.zeros(len(out))], axis=1)
        round_about, rise = (way * about).sum(axis=1) ** 2, np.zeros_like(rho)
        length = np.maximum(rho, 1e-300)
        match self.kind:
            case "plane":
                pace = np.zeros_like(rho)
            case "cylinder":
                pace = 1 / length
            case "cone":
                pace = np.cos(self.slope) / length
            case "sphere":
                pace = rise = np.full_like(rho, 1 / self.radius)
            case _:
                pace, rise = (rho - self.radius) / self.minor / length, np.full_like(rho, 1 / self.minor)
        return np.asarray(-self.outward * (pace * round_about + rise * (1.0 - round_about)))

    def parameters(self, points: Array) -> Array:
        """The kernel's parameters ``(q, 2)`` of the feet of points; angles lie within (−π, π]."""
        local = self._local(points)
        rho, _ = self._round(local)
        x, y, z = local.T
        around = np.arctan2(y, x)
        match self.kind:
            case "plane":
                found = x, y
            case "cylinder":
                found = around, z
            case "cone":
                found = around, (rho - self.radius) * np.sin(self.slope) + z * np.cos(self.slope)
            case "sphere":
                found = around, np.arctan2(z, rho)
            case _:
                found = around, np.arctan2(z, rho - self.radius)
        return np.stack(found, axis=1)

    @property
    def periods(self) -> tuple[float, float]:
        """Periods of the parameters; 0 where there is none."""
        whole = 2 * np.pi
        return 0.0 if self.kind == "plane" else whole, whole if self.kind == "torus" else 0.0

    def _local(self, points: Array) -> Array:
        return np.asarray((points - self.frame[:3, 3]) @ self.frame[:3, :3])

    def _round(self, local: Array) -> tuple[Array, Array]:
        """Distances from the axis, and directions away from it."""
        rho = np.hypot(local[:, 0], local[:, 1])
        out = np.zeros_like(local)
        out[:, :2] = local[:, :2] / np.maximum(rho, 1e-300)[:, None]
        return rho, out


@dataclass(frozen=True, eq=False)
class Path:
    """The line or circle of an edge, which may get longer or shorter.

    Attributes
    ----------
    frame : ndarray (4, 4)
        For a line, a point of it, with x along it; for a circle, its centre, with z along its axis.
    radius : float
        Radius of a circle, mm; 0 for a line.
    length : float
        Length of the edge, mm.
    """

    frame: Array
    radius: float
    length: float

    __repr__ = line

    def feet(self, points: Array) -> tuple[Array, Array]:
        """The nearest points ``(q, 3)`` of the path and its unit tangents there, ``(q, 3)``."""
        local = (points - self.frame[:3, 3]) @ self.frame[:3, :3]
        foot, way = np.zeros_like(local), np.zeros_like(local)
        if self.radius:
            out = local[:, :2] / np.maximum(np.hypot(local[:, 0], local[:, 1]), 1e-300)[:, None]
            foot[:, :2] = self.radius * out
            way[:, 0], way[:, 1] = -out[:, 1], out[:, 0]
        else:
            foot[:, 0], way[:, 0] = local[:, 0], 1.0
        turn = self.frame[:3, :3].T
        return foot @ turn + self.frame[:3, 3], way @ turn


@dataclass(frozen=True, eq=False)
class Rails:
    """The surfaces and curves of a model along which edges can slide.

    Attributes
    ----------
    grounds : mapping of int to Elementary
        Faces on elementary surfaces, by index.
    ends : mapping of int to (int, int)
        Start and end vertex of each edge, by edge index; vertices are numbered over the whole model.
    paths : mapping of int to Path
        Edges that may get longer or shorter.
    """

    grounds: Mapping[int, Elementary] = field(default_factory=dict)
    ends: Mapping[int, tuple[int, int]] = field(default_factory=dict)
    paths: Mapping[int, Path] = field(default_factory=dict)

    __repr__ = line
