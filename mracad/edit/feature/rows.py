"""Places in rows, all over the ground: hexagons or squares that follow a field of directions.

They grow from one place, ring by ring: every place has neighbours a spacing away in the directions of the field.  Where
rings meet, and where the ground is curved, they do not fit; then all places are moved a little at once (a sparse system
over all pairs of neighbours), so that the misfit spreads over all of them.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mracad.edit.feature.field import Cloud, Field, connection, framed, turned
from mracad.edit.feature.ground import SIDEWAYS
from mracad.edit.feature.patch import Patch
from mracad.edit.feature.spread import Spots, apart, arcs, close, nearest

Array = np.ndarray

CROWDED, EMPTY, OUTER = 0.7, 0.86, 1.45
"""Distances in spacings: of places that are too near, and of a point from all places where another one has room; beside
borders, where rows end, the last one."""

BONDS = {6: 1.4, 4: 1.25}
"""Distance of neighbours, in spacings, by number of directions."""

RELAXED, TURNS = 5, 3
"""How often all places are moved, and how often, before that, crowded ones are left out and empty ones filled."""

OFF = 20.0 * SIDEWAYS
"""Share of the spacing by which a point may lie beside the ground."""

FIRM = 1e6
"""Weight of a place that stays."""

STEPS = 4
"""Steps of Newton's method to a foot from a point of the cloud beside it."""


@dataclass(frozen=True, eq=False)
class Rows:
    """How places are arranged.

    Attributes
    ----------
    cloud : Cloud
    field : Field
    spacing : float
    inner : ndarray of bool (m,)
        Points of the cloud that are a spacing away from borders.
    """

    cloud: Cloud
    field: Field
    spacing: float
    inner: Array

    def over(self, own: Spots) -> Spots:
        """Places over the whole ground; first those given."""
        found = self._grown(own, own) if len(own) else own
        found = self._complete(found)
        for _ in range(TURNS):
            found = self._relaxed(found, len(own))
            found = found.only(apart(found, CROWDED * self.spacing))
            found = self._complete(found)
        return found

    def _complete(self, found: Spots) -> Spots:
        """Places with more, grown from points that are far from all of them, until there are none."""
        spots = self.cloud.spots
        while True:
            far = nearest(spots, found, OUTER * self.spacing)[0] if len(found) else np.full(len(spots), np.inf)
            empty = spots.only(far > self.spacing * np.where(self.inner, EMPTY, OUTER))
            if not len(empty):
                return found
            if not len(found):
                empty = empty.only(_middles(empty))
            new = empty.only(apart(empty, 4 * self.spacing))
            found = self._grown(found.and_(new), new)

    def _grown(self, found: Spots, front: Spots) -> Spots:
        """Places with rings of more around those of a front."""
        while len(front):
            new = self._ring(front)
            new = new.only(nearest(new, found, CROWDED * self.spacing)[0] >= CROWDED * self.spacing)
            new = self._merged(new)
            new = new.only(nearest(new, found, CROWDED * self.spacing)[0] >= CROWDED * self.spacing)
            found, front = found.and_(new), new
        return found

    def _ring(self, front: Spots) -> Spots:
        """The neighbours of places."""
        frames, count = framed(self.cloud.ground, front), self.field.count
        angles = self.field.angles(front, frames)[:, None] + 2 * np.pi * np.arange(count) / count
        way = np.cos(angles)[..., None] * frames[:, None, 0] + np.sin(angles)[..., None] * frames[:, None, 1]
        start = front.only(np.repeat(np.arange(len(front)), count))
        return self.walked(start, self.spacing * way.reshape(-1, 3))[0]

    def _merged(self, spots: Spots) -> Spots:
        """One place, in the middle, for all that are near each other."""
        first = apart(spots, CROWDED * self.spacing)
        if not len(first):
            return spots
        leaders = spots.only(first)
        _, which = nearest(spots, leaders, self.spacing)
        total, count = np.zeros((len(first), 3)), np.bincount(which, minlength=len(first))
        np.add.at(total, which, spots.points)
        return self.brought(total / count[:, None], leaders)[0]

    def walked(self, spots: Spots, way: Array) -> tuple[Spots, Array]:
        """Places at the ends of walks straight on along the ground, and which of the walks stay on it."""
        half, on = self.brought(spots.points + way / 2, spots)
        way, before = way[on] / 2, spots.normals[on]
        c = np.cross(before, half.normals)
        cross = np.cross(c, way)
        dot = (before * half.normals).sum(axis=1)
        way = way + cross + np.cross(c, cross) / np.maximum(1 + dot, 0.2)[:, None]
        end, also = self.brought(half.points + way, half)
        on[on] = also
        return end, on

    def brought(self, points: Array, spots: Spots) -> tuple[Spots, Array]:
        """Places on the ground nearest to points that are near other places of the same part, and which points have
        one."""
        cloud, ground = self.cloud, self.cloud.ground
        count = min(6, len(cloud.spots))
        hits = cloud.tree.query(points, k=count)[1].reshape(len(points), count)
        same = cloud.spots.part[hits] == spots.part[:, None]
        same &= (cloud.spots.normals[hits] * spots.normals[:, None]).sum(axis=2) > 0
        best, surface, uv = np.full(len(points), np.inf), np.zeros(len(points), int), np.zeros((len(points), 2))
        for index, patch in ground.patches.items():
            mine = same & (cloud.spots.surface[hits] == index)
            some = np.flatnonzero(mine.any(axis=1))
            if not len(some):
                continue
            start = cloud.spots.uv[hits[some, mine[some].argmax(axis=1)]]
            at = _foot(patch, points[some], start)
            foot, _, _, normal = patch.evaluate(at)
            off = points[some] - foot
            beside = np.linalg.norm(off - (off * normal).sum(axis=1, keepdims=True) * normal, axis=1)
            beside[ground.faces(np.full(len(some), index), at) < 0] = np.inf
            good = beside < np.minimum(best[some], OFF * self.spacing)
            best[some[good]], surface[some[good]], uv[some[good]] = beside[good], index, at[good]
        on = np.isfinite(best)
        return Spots.on(ground, self._parts, surface[on], uv[on]), on

    @property
    def _parts(self) -> Array:
        parts = np.full(len(self.cloud.ground.model.faces), -1)
        parts[self.cloud.spots.face] = self.cloud.spots.part
        return parts

    def _relaxed(self, spots: Spots, fixed: int) -> Spots:
        """Places moved so that neighbours are a spacing apart, as far as possible, the first ones excepted."""
        for _ in range(RELAXED):
            spots = self._moved(spots, fixed)
        return spots

    def _moved(self, spots: Spots, fixed: int) -> Spots:
        from scipy.sparse import diags_array
        from scipy.sparse.linalg import splu

        frames = framed(self.cloud.ground, spots)
        a, b = close(spots, BONDS[self.field.count] * self.spacing)
        angles = self.field.angles(spots, frames)
        turn = turned(frames[a], frames[b])
        there = _log(spots, frames, a, b)
        back = -_log(spots, frames, b, a) * turn
        length = arcs(spots.points[b] - spots.points[a], spots.normals[a], spots.normals[b])
        ahead = there / np.abs(there) + back / np.abs(back)
        ahead /= np.maximum(np.abs(ahead), 1e-300)
        fit, aim = self._aim(ahead, angles[a], angles[b], turn)
        weight = fit * np.clip(2.0 - 5.0 * np.abs(length / self.spacing - 1.0), 0.05, 1.0)
        miss = weight * (length * ahead - self.spacing * aim)
        pull = np.zeros(len(spots), complex)
        np.add.at(pull, a, miss)
        np.add.at(pull, b, -miss * turn.conj())
        firm = np.full(len(spots), 1e-6)
        firm[:fixed] = FIRM
        form = connection(frames, a, b, 1, weight) + diags_array(firm)
        shift = splu(form.tocsc()).solve(pull)
        shift *= np.minimum(1.0, 0.25 * self.spacing / np.maximum(np.abs(shift), 1e-300))
        way = shift.real[:, None] * frames[:, 0] + shift.imag[:, None] * frames[:, 1]
        found, on = self.walked(spots, way)
        return found if on[:fixed].all() else spots

    def _aim(self, ahead: Array, angles: Array, others: Array, turn: Array) -> tuple[Array, Array]:
        """Which pairs are neighbours in a direction of the field, and the unit direction between that and their own."""
        count = self.field.count
        mean = np.exp(1j * count * angles) + np.exp(1j * count * others) * turn**count
        base = np.angle(mean) / count
        k = np.round((np.angle(ahead) - base) * count / (2 * np.pi))
        row = np.exp(1j * (base + 2 * np.pi * k / count))
        fit = (ahead * row.conj()).real > np.cos(0.8 * np.pi / count)
        aim = row + ahead
        return np.where(fit | (count == 6), 1.0, 0.0), aim / np.abs(aim)


def _foot(patch: Patch, points: Array, uv: Array) -> Array:
    """Parameters of the feet of points that are near the places at given parameters."""
    low, high = patch.domain
    for _ in range(STEPS):
        s, su, sv = patch.net.evaluate(uv, 1)
        off = points - s
        e, f, g = ((a * b).sum(axis=1) for a, b in ((su, su), (su, sv), (sv, sv)))
        p, q = (off * su).sum(axis=1), (off * sv).sum(axis=1)
        det = np.maximum(e * g - f * f, 1e-14 * e * g + np.finfo(float).tiny)
        uv = uv + np.stack([(g * p - f * q) / det, (e * q - f * p) / det], axis=1)
        uv = np.where(patch.periodic, uv, np.clip(uv, low, high))
    return np.asarray(uv)


def _log(spots: Spots, frames: Array, a: Array, b: Array) -> Array:
    """Directions from places a to b along the ground, complex numbers in the frames of a."""
    way = spots.points[b] - spots.points[a]
    return np.asarray((way * frames[a, 0]).sum(axis=1) + 1j * (way * frames[a, 1]).sum(axis=1))


def _middles(spots: Spots) -> Array:
    """The point of each part that is nearest to its middle."""
    found = []
    for part in np.unique(spots.part):
        own = np.flatnonzero(spots.part == part)
        middle = spots.points[own].mean(axis=0)
        found.append(own[np.linalg.norm(spots.points[own] - middle, axis=1).argmin()])
    return np.array(found)
