"""Copies of a feature on the ground, and their ideal displacement at any point of it.

The ideal displacement of a copy at a point of the coarse surface is that of the feature at the same normal
coordinates (turned, mirrored, scaled), in the frame carried there from the copy's place.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from mracad.edit.feature.chart import Charts
from mracad.edit.feature.detail import Feature
from mracad.edit.feature.ground import STEEP, Feet, Ground
from mracad.edit.feature.locate import Place
from mracad.edit.feature.patch import Patch

Array = np.ndarray

BATCH = 192
"""Copies processed at a time."""


@dataclass(frozen=True, eq=False)
class Way:
    """Rotation of detail (radians), factors along the face and along the normal, and mirroring; a number each, or
    arrays ``(q,)`` by point."""

    turn: Array | float
    size: Array | float
    height: Array | float
    mirror: bool

    def back(self, xy: Array) -> Array:
        """Places ``(q, 2)`` of the detail for places of the copy."""
        (x, y), cos, sin = xy.T / self.size, np.cos(self.turn), np.sin(self.turn)
        return np.stack([cos * x + sin * y, self._flip * (cos * y - sin * x)], axis=1)

    def on(self, local: Array) -> Array:
        """Displacements ``(q, 3)`` of the copy for those of the detail, along x, y and the normal."""
        t, s, cos, sin = local[:, 0], self._flip * local[:, 1], np.cos(self.turn), np.sin(self.turn)
        along = self.size * (cos * t - sin * s), self.size * (sin * t + cos * s)
        return np.stack([*along, self.height * local[:, 2]], axis=1)

    @property
    def _flip(self) -> float:
        return -1.0 if self.mirror else 1.0


@dataclass(frozen=True, eq=False)
class Copies:
    """Copies of a feature at places.

    Attributes
    ----------
    ground : Ground
        The ground without the source's own feature.
    feature : Feature
    places : sequence of Place
    feet : Feet
        Their feet on the ground.
    overlap : {"add", "max", "replace"}
    mirror : bool
    charts : Charts
        Of the ground around each.
    touched : ndarray of bool (copies, patches)
        The patches of the ground that each reaches.
    """

    ground: Ground
    feature: Feature
    places: Sequence[Place]
    feet: Feet
    overlap: str
    mirror: bool
    charts: Charts
    touched: Array

    @cached_property
    def sizes(self) -> Array:
        return np.array([place.size for place in self.places])

    @cached_property
    def heights(self) -> Array:
        return np.array([place.height for place in self.places])

    @cached_property
    def turns(self) -> Array:
        return np.array([place.rotate for place in self.places])

    @cached_property
    def reach(self) -> Array:
        """Radius of each, mm."""
        return self.feature.reach * self.sizes

    @cached_property
    def height(self) -> float:
        """Largest displacement of the lowest copy, mm."""
        return float(self.feature.height * np.abs(self.heights).min())

    def on(self, patch: Patch) -> Array:
        """The copies that reach a patch, ``(copies,)``."""
        return np.asarray(self.touched[:, list(self.ground.patches).index(patch.index)])

    def only(self, some: Array) -> Copies:
        """The copies of a mask; all others reach no patch."""
        return replace(self, touched=self.touched & some[:, None])

    def at(self, patch: Patch, uv: Array) -> Array:
        """The displacement ``(q, 3)`` at parameters of a patch, in the part's frame."""
        points, _, _, normals = patch.evaluate(uv)
        return self.ideal(patch, points, normals)[0]

    def ideal(self, patch: Patch, points: Array, normals: Array) -> tuple[Array, Array]:
        """The displacement ``(q, 3)`` at points of a patch, in the part's frame, and how many copies reach each."""
        from scipy.spatial import cKDTree

        total, count = np.zeros((len(points), 3)), np.zeros(len(points), int)
        chosen = np.flatnonzero(self.on(patch))
        tree = cKDTree(points)
        for k in range(0, len(chosen) if len(points) else 0, BATCH):
            batch = chosen[k : k + BATCH]
            lists = tree.query_ball_point(self.charts.origin[batch], 1.02 * self.reach[batch], return_sorted=True)
            which = np.repeat(batch, [len(x) for x in lists])
            index = np.concatenate([np.asarray(x, int) for x in lists])
            same = (normals[index] * self.feet.normals[which]).sum(axis=1) > STEEP
            which, index = which[same], index[same]
            delta, window = self._each(points[index], which)
            np.add.at(count, index, 1)
            if self.overlap == "add":
                np.add.at(total, index, delta)
                continue
            for copy in batch:
                own = which == copy
                total[index[own]] = self._over(total[index[own]], delta[own], window[own])
        return total, count

    def _over(self, below: Array, delta: Array, window: Array) -> Array:
        """One copy combined with what is already there."""
        if self.overlap == "max":
            return np.where(((delta**2).sum(axis=1) > (below**2).sum(axis=1))[:, None], delta, below)
        return np.asarray((1 - window[:, None]) * below + delta)

    def _each(self, points: Array, which: Array) -> tuple[Array, Array]:
        """Displacement and window of one copy each at points."""
        xy, frames = self.charts.jets(self.charts.local(points, which), which)
        way = Way(self.turns[which], self.sizes[which], self.heights[which], self.mirror)
        found = self.feature.lookup(way.back(xy))
        return np.einsum("qij,qi->qj", frames, way.on(found)), np.clip(found[:, 3], 0.0, 1.0)


def copies(ground: Ground, feature: Feature, places: Sequence[Place], feet: Feet, overlap: str, mirror: bool) -> Copies:
    """Copies of a feature at places; parameters as the attributes of :class:`Copies`."""
    given = np.array([feet.along[i] if p.direction is None else p.direction for i, p in enumerate(places)])
    reach = 1.05 * (feature.reach * np.array([place.size for place in places]))
    blocks = [slice(k, k + BATCH) for k in range(0, len(places), BATCH)]
    parts = [ground.charts(feet.part(b), given[b], reach[b]) for b in blocks]
    charts = Charts.joined([c for c, _ in parts])
    return Copies(ground, feature, places, feet, overlap, mirror, charts, np.concatenate([t for _, t in parts]))
