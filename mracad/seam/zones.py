"""Regions that edits must not touch: balls, boxes, and wherever a surface bends more tightly than a radius."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from mracad.bspline.surface import Net
from mracad.model.brep import Face
from mracad.model.region import supported
from mracad.seam.stretch import Limit, orthonormal
from mracad.spec.places import Box, Disc, Point, Tight, Zone

Array = np.ndarray

POINTS = 4
"""Points a knot span, in either direction, at which a surface is looked at."""


@dataclass(frozen=True, eq=False)
class Zoned:
    """The part of a surface that lies in regions.

    Attributes
    ----------
    net : Net
    faces : sequence of Face
        On it: where it stands.
    zones : sequence of Zone
    look : Limit
        How its curvature is seen.
    """

    net: Net
    faces: Sequence[Face]
    zones: Sequence[Zone]
    look: Limit

    @classmethod
    def of(cls, net: Net, faces: Sequence[Face], zones: Sequence[Zone], look: Limit | None = None) -> Zoned:
        """The part of a surface in regions; its curvature is seen as it is by default."""
        return cls(net, faces, zones, look or Limit(1.0, ((0.0, net),)))

    @cached_property
    def _parameters(self) -> tuple[Array, Array]:
        share = (np.arange(POINTS) + 0.5) / POINTS
        us, vs = (k.breaks[:-1, None] + np.diff(k.breaks)[:, None] * share for k in (self.net.u, self.net.v))
        return us, vs

    @cached_property
    def _points(self) -> Array:
        us, vs = self._parameters
        return np.asarray(self.net.grid(us.ravel(), vs.ravel()))

    @cached_property
    def _inside(self) -> Array:
        """Which points lie in a region, or within half the distance to the next point of it, ``(pu, pv)``."""
        steps = [np.linalg.norm(np.diff(self._points, axis=axis), axis=2) for axis in (0, 1)]
        wide = [np.maximum(_padded(each, axis, 0), _padded(each, axis, 1)) for axis, each in enumerate(steps)]
        slack = np.hypot(*wide) / 2
        found = np.zeros(slack.shape, bool)
        for zone in self.zones:
            if isinstance(zone, Tight):
                found |= self._curvature >= 1 / zone.radius
            else:
                found |= self._apart(zone, self._points) <= slack
        return found

    @cached_property
    def _curvature(self) -> Array:
        """The largest curvature at the points, 1/mm."""
        us, vs = self._parameters
        a, b, c = self.look.shape(us, vs, orthonormal(self.net, us, vs))
        return np.asarray(np.abs(a + c) / 2 + np.sqrt(((a - c) / 2) ** 2 + b * b))

    def _apart(self, zone: Disc | Box, points: Array) -> Array:
        """Distance of points ``(…, 3)`` from a ball or a box, wherever the surface stands, mm."""
        return np.asarray(np.min([_distance(zone, face.placed(points)) for face in self.faces], axis=0))

    @property
    def held(self) -> Array:
        """Control points ``(nu, nv)`` on which a part of the surface in a region depends."""
        if not self.zones:
            return np.zeros(self.net.poles.shape[:2], bool)
        cells = self._inside.reshape(self.net.u.spans, POINTS, self.net.v.spans, POINTS)
        return supported(self.net, np.asarray(cells.any(axis=(1, 3))))

    @property
    def away(self) -> Array:
        """Distance from the regions at the Greville points, mm, ``(nu, nv)``; infinite where there are none."""
        from scipy.spatial import KDTree

        points = np.asarray(self.net.grid(self.net.u.greville(), self.net.v.greville()))
        found = np.full(points.shape[:2], np.inf)
        if self.zones and self._inside.any():
            found = np.asarray(KDTree(self._points[self._inside]).query(points)[0])
        return found


def _padded(steps: Array, axis: int, side: int) -> Array:
    """Steps between points as one for each point: the one after it, or before it."""
    return np.pad(steps, [(side, 1 - side) if each == axis else (0, 0) for each in (0, 1)], mode="edge")


def _distance(zone: Disc | Box, points: Array) -> Array:
    if isinstance(zone, Box):
        low, high = np.array(zone.low), np.array(zone.high)
        return np.asarray(np.linalg.norm(np.maximum(np.maximum(low - points, points - high), 0.0), axis=-1))
    assert isinstance(zone.middle, Point)
    return np.asarray(np.maximum(np.linalg.norm(points - np.array(zone.middle.xyz), axis=-1) - zone.radius, 0.0))


def zoned(net: Net, faces: Iterable[Face], zones: Sequence[Zone]) -> Array:
    """Control points ``(nu, nv)`` that regions hold, with the curvature of the surface as it is."""
    return Zoned.of(net, tuple(faces), zones).held
