"""Regions that edits must not change: balls, boxes, and all places where a surface bends more tightly than a radius."""

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
"""Points per knot span and direction at which a surface is examined."""


@dataclass(frozen=True, eq=False)
class Zoned:
    """The part of a surface that lies in regions.

    Attributes
    ----------
    net : Net
    faces : sequence of Face
        Faces on it, which tell where its instances are.
    zones : sequence of Zone
    look : Limit
        How its curvature is measured.
    """

    net: Net
    faces: Sequence[Face]
    zones: Sequence[Zone]
    look: Limit

    @classmethod
    def of(cls, net: Net, faces: Sequence[Face], zones: Sequence[Zone], look: Limit | None = None) -> Zoned:
        """The part of a surface in regions; by default its curvature is measured as it is."""
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
        """Mask ``(pu, pv)`` of points that lie in a region, or within half the distance to the next point of it."""
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
        return np.asarray((np.abs(a + c) / 2 + np.sqrt(((a - c) / 2) ** 2 + b * b)).T)

    def _apart(self, zone: Disc | Box, points: Array) -> Array:
        """Distance of points ``(…, 3)`` from a ball or a box, the least over all instances of the surface, mm."""
        return np.asarray(np.min([_distance(zone, face.placed(points)) for face in self.faces], axis=0))

    @property
    def within(self) -> Array:
        """Parameters ``(q, 2)`` of examined points in a region."""
        us, vs = self._parameters
        i, j = np.nonzero(self._inside)
        return np.stack([us.ravel()[i], vs.ravel()[j]], axis=1)

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
        if not self.zones or not self._inside.any():
            return np.full(self.net.poles.shape[:2], np.inf)
        from scipy.spatial import KDTree

        points = np.asarray(self.net.grid(self.net.u.greville(), self.net.v.greville()))
        return np.asarray(KDTree(self._points[self._inside]).query(points)[0])


def _padded(steps: Array, axis: int, side: int) -> Array:
    """Steps between points, padded to one per point: the step after it, or before it."""
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


def faded(away: Array, width: float) -> Array:
    """0 at no distance (mm), 1 beyond ``width``, smooth in between."""
    share = np.minimum(away / width, 1.0)
    return np.asarray(share**3 * (10 - 15 * share + 6 * share**2))
