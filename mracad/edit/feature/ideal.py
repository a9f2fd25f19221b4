"""Copies of a feature on the ground, and the ideal displacement that they are at any point of it.

The ideal displacement of a copy at a point of the coarse surface is that of the feature at the same normal
coordinates (turned, mirrored, scaled), in the frame carried there from the copy's place.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from mracad.edit.feature.chart import Charts
from mracad.edit.feature.detail import Feature
from mracad.edit.feature.ground import STEEP, Feet, Ground
from mracad.edit.feature.locate import Place
from mracad.edit.feature.patch import Patch

Array = np.ndarray

BATCH = 48
"""Copies worked on at a time."""


@dataclass(frozen=True, eq=False)
class Copies:
    """Copies of a feature at places.

    Attributes
    ----------
    ground : Ground
        What they stand on, the source's own feature taken away.
    feature : Feature
    places : sequence of Place
    feet : Feet
        Where those stand.
    overlap : {"add", "max", "replace"}
    mirror : bool
    charts : Charts
        Of the ground around each.
    touched : ndarray of bool (copies, patches)
        Which patches of the ground each reaches.
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
        """Largest displacement of the least of them, mm."""
        return float(self.feature.height * np.abs(self.heights).min())

    def on(self, patch: Patch) -> Array:
        """Which copies ``(copies,)`` reach a patch."""
        return np.asarray(self.touched[:, list(self.ground.patches).index(patch.index)])

    def ideal(self, patch: Patch, points: Array, normals: Array, some: Array | None = None) -> tuple[Array, Array]:
        """The displacement ``(q, 3)`` at points of a patch, in the part's frame, and how many copies reach each.

        Only copies in ``some`` (a mask) count; all by default.
        """
        from scipy.spatial import cKDTree

        total, count = np.zeros((len(points), 3)), np.zeros(len(points), int)
        chosen = np.flatnonzero(self.on(patch) & (True if some is None else some))
        if not len(points) or not len(chosen):
            return total, count
        tree = cKDTree(points)
        for k in range(0, len(chosen), BATCH):
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
                self._over(total, index[own], delta[own], window[own])
        return total, count

    def _over(self, total: Array, at: Array, delta: Array, window: Array) -> None:
        """Lay one copy over what is there already."""
        if self.overlap == "max":
            larger = (delta**2).sum(axis=1) > (total[at] ** 2).sum(axis=1)
            total[at] = np.where(larger[:, None], delta, total[at])
        else:
            total[at] = (1 - window[:, None]) * total[at] + delta

    def _each(self, points: Array, which: Array) -> tuple[Array, Array]:
        """Displacement and window of one copy each at points."""
        xy, frames = self.charts.jets(self.charts.local(points, which), which)
        xy = xy / self.sizes[which][:, None]
        cos, sin = np.cos(self.turns[which]), np.sin(self.turns[which])
        x, y = cos * xy[:, 0] + sin * xy[:, 1], cos * xy[:, 1] - sin * xy[:, 0]
        flip = -1.0 if self.mirror else 1.0
        found = self.feature.lookup(np.stack([x, flip * y], axis=1))
        t, s = found[:, 0], flip * found[:, 1]
        size, height = self.sizes[which], self.heights[which]
        moved = np.stack([size * (cos * t - sin * s), size * (sin * t + cos * s), height * found[:, 2]], axis=1)
        return np.einsum("qij,qi->qj", frames, moved), np.clip(found[:, 3], 0.0, 1.0)


def copies(ground: Ground, feature: Feature, places: Sequence[Place], feet: Feet, overlap: str, mirror: bool) -> Copies:
    """Copies of a feature at places; parameters as the attributes of :class:`Copies`."""
    given = np.array([feet.along[i] if p.direction is None else p.direction for i, p in enumerate(places)])
    reach = feature.reach * np.array([place.size for place in places])
    blocks = [slice(k, k + BATCH) for k in range(0, len(places), BATCH)]
    parts = [ground.charts(feet.part(b), given[b], 1.05 * reach[b]) for b in blocks]
    names = ("origin", "axes", "reach", "graph", "log", "exp")
    charts = Charts(*(np.concatenate([getattr(c, name) for c, _ in parts]) for name in names))
    touched = np.concatenate([t for _, t in parts])
    return Copies(ground, feature, places, feet, overlap, mirror, charts, touched)
