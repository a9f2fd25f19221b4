"""Directions all over the ground, as smooth as it permits: a field that is alike in n directions.

Directions at points spread over the ground are complex numbers z in frames there, to the n-th power, so that all n
count as one.  Between neighbours a frame is turned the shortest way that takes one normal to the other.  The field
minimizes Σ |z_a − z_b|² over neighbours (Knöppel et al. 2013): without directions asked for it is the smoothest one,
turned so that it comes nearest to the parameter lines.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from mracad.edit.feature.ground import STEEP, Ground, axes
from mracad.edit.feature.spread import Spots, arcs, close, nearest

Array = np.ndarray

LINKED = 2.2
"""Distance of neighbours, in those between points."""

ROUNDS = 30
"""Steps of inverse iteration."""

LEAST = 1e-3
"""Weight from which a direction is asked for: a part without any gets the smoothest field."""

AROUND = 6
"""Points from which a direction between them is taken."""


@dataclass(frozen=True, eq=False)
class Cloud:
    """Points spread evenly over the ground.

    Attributes
    ----------
    ground : Ground
    spots : Spots
    step : float
        Their least distance, mm.
    """

    ground: Ground
    spots: Spots
    step: float

    @cached_property
    def frames(self) -> Array:
        """Rows x along S_u, y and normal, ``(m, 3, 3)``."""
        return framed(self.ground, self.spots)

    @cached_property
    def tree(self) -> Any:
        from scipy.spatial import cKDTree

        return cKDTree(self.spots.points)

    def near(self, spots: Spots) -> tuple[Array, Array]:
        """Indices ``(q, k)`` of points around each place, and weights that sum to 1; 0 beyond walls and borders."""
        count = min(AROUND, len(self.spots))
        hit = self.tree.query(spots.points, k=count)[1].reshape(len(spots), count)
        apart = self.spots.points[hit] - spots.points[:, None]
        far = arcs(apart, spots.normals[:, None], self.spots.normals[hit])
        far = np.where(self.spots.part[hit] == spots.part[:, None], far, np.inf)
        weight = 1 / (far + 1e-3 * self.step) ** 2
        total = weight.sum(axis=1, keepdims=True)
        return hit, np.where(total > 0, weight / np.where(total > 0, total, 1.0), 1.0 / count)

    def far(self, sources: Spots) -> Array:
        """Distances along the ground of the points from the nearest source ``(m,)``, through neighbours: at most a few
        hundredths too long; infinite where there is no way."""
        from scipy.sparse import coo_array
        from scipy.sparse.csgraph import dijkstra

        spots, m = self.spots, len(self.spots)
        a, b = close(spots, LINKED * self.step)
        step = arcs(spots.points[b] - spots.points[a], spots.normals[a], spots.normals[b])
        first, _ = nearest(spots, sources, LINKED * self.step)
        start = np.flatnonzero(np.isfinite(first))
        lengths = np.concatenate([step, np.maximum(first[start], 1e-9)])
        place = np.append(a, np.full(len(start), m)), np.append(b, start)
        return np.asarray(dijkstra(coo_array((lengths, place), shape=(m + 1, m + 1)).tocsr(), False, m)[:m])

    def field(self, count: int, wanted: Array | None = None, weight: Array | None = None) -> Field:
        """Directions of which ``count`` at each place are alike.

        Parameters
        ----------
        count : int
        wanted : ndarray (m, 3), optional
            Directions asked for; lengths do not matter.
        weight : ndarray (m,), optional
            How much each of them counts, against neighbours.
        """
        from scipy.sparse import diags_array
        from scipy.sparse.linalg import splu

        form = connection(self.frames, *close(self.spots, LINKED * self.step), count)
        if wanted is None or weight is None:
            solve = splu((form + diags_array(np.full(form.shape[0], 1e-6))).tocsc()).solve
            z = np.ones(len(self.spots), complex)
            for _ in range(ROUNDS):
                z = solve(z)
                for part in np.unique(self.spots.part):
                    own = self.spots.part == part
                    z[own] /= np.abs(z[own]).max()
            return Field(self, count, z)
        x, y = (np.einsum("mj,mj->m", wanted, self.frames[:, k]) for k in (0, 1))
        size = np.hypot(x, y)
        target = (x + 1j * y) / np.maximum(size, 1e-300)
        every = form + diags_array(weight + 1e-9)
        z = splu(every.tocsc()).solve(weight * target**count)
        asked = np.isin(self.spots.part, self.spots.part[weight > LEAST])
        return Field(self, count, z if asked.all() else np.where(asked, z, self.field(count).z))


@dataclass(frozen=True, eq=False)
class Field:
    """Directions ``z (m,)`` at the points of a cloud, in its frames, to the power ``count``."""

    cloud: Cloud
    count: int
    z: Array

    def angles(self, spots: Spots, frames: Array) -> Array:
        """Angles of the direction at places, in frames there; any of those that are alike."""
        hit, weight = self.cloud.near(spots)
        unit = self.z[hit] / np.maximum(np.abs(self.z[hit]), 1e-300)
        turn = turned(frames[:, None], self.cloud.frames[hit])
        return np.asarray(np.angle((weight * unit * turn**self.count).sum(axis=1)) / self.count)


def framed(ground: Ground, spots: Spots) -> Array:
    """Frames at places: rows x along S_u, y and normal, ``(m, 3, 3)``."""
    feet = ground.standing(spots.surface, spots.uv, np.zeros(len(spots)))
    return axes(feet.normals, feet.along)


def turned(frames: Array, others: Array) -> Array:
    """The x of other frames as a complex number in frames, ``(…,)``, brought there by the shortest way."""
    n, m, x = frames[..., 2, :], others[..., 2, :], others[..., 0, :]
    c, dot = np.cross(m, n), (m * n).sum(axis=-1)
    cross = np.cross(c, x)
    moved = x + cross + np.cross(c, cross) / np.maximum(1 + dot, STEEP)[..., None]
    found = (moved * frames[..., 0, :]).sum(axis=-1) + 1j * (moved * frames[..., 1, :]).sum(axis=-1)
    return np.asarray(found / np.abs(found))


def connection(frames: Array, a: Array, b: Array, count: int, weight: Array | None = None) -> Any:
    """The form Σ w |z_a − t_ab z_b|² over pairs, ``scipy.sparse.csr_array`` (Hermitian); z to the power ``count``."""
    from scipy.sparse import coo_array

    m, w = len(frames), np.ones(len(a)) if weight is None else weight
    turn = -w * turned(frames[a], frames[b]) ** count
    degree = np.bincount(a, w, m) + np.bincount(b, w, m)
    every = np.concatenate([degree, turn, turn.conj()])
    place = np.concatenate([np.arange(m), a, b]), np.concatenate([np.arange(m), b, a])
    return coo_array((every, place), shape=(m, m)).tocsr()
