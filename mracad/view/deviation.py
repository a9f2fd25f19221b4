"""Deviation from another model: the distance to its nearest surface point, exact at every place that is seen."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from mracad.bspline.vectors import cross, unit
from mracad.model.facets import Body, Facets, Placed
from mracad.view.runs import groups, runs
from mracad.view.seen import Seen, Stage

Array = np.ndarray

CELLS = 250
"""Largest distance between the samples from which nearest points are sought, as a part of the diagonal."""

_NEIGHBOURS = 64  # samples among which another face is sought
_STEPS = 8  # of Newton's method
_BEYOND = 0.01  # of a face: how far its surface goes on
_DONE = 1e-10  # of the diagonal: a step that ends it


@dataclass(frozen=True, eq=False)
class Reference:
    """The model from which deviation is measured.

    Attributes
    ----------
    entries : list of (Placed, Facets)
    entry : ndarray of int (n,)
        The face of each sample.
    uv : ndarray (n, 2)
    tree : scipy.spatial.cKDTree
        Of the samples.
    diagonal : float
    """

    entries: list[tuple[Placed, Facets]]
    entry: Array
    uv: Array
    tree: Any
    diagonal: float

    @classmethod
    def of(cls, body: Body) -> Reference:
        """Samples on the triangles of a body."""
        from scipy.spatial import cKDTree

        entries = [(place, body.facets[f]) for place in body.placed for f in place.faces if f in body.facets]
        points, uv = [], []
        for place, facets in entries:
            shares, corner = _spread(facets, body.diagonal / CELLS)
            mixed = [(shares[:, :, None] * values[corner]).sum(axis=1) for values in (facets.points, facets.uv)]
            points.append(mixed[0] @ place.frame[:3, :3].T + place.frame[:3, 3])
            uv.append(mixed[1])
        owner = np.repeat(np.arange(len(entries)), [len(each) for each in uv])
        return cls(entries, owner, np.concatenate(uv), cKDTree(np.concatenate(points)), body.diagonal)

    def deviation(self, stage: Stage, seen: Seen) -> Array:
        """Distances of places from the nearest point, mm, positive on the outer side of its face."""
        points = seen.point.T
        near = self.tree.query(points)[1]
        found, ended = self._off(points, near)
        if not ended.any():
            return found
        rim = np.flatnonzero(ended)  # the nearest point may lie on a face beside it
        around = self.tree.query(points[rim], min(_NEIGHBOURS, len(self.entry)))[1]
        owners = self.entry[around]
        for entry in np.unique(owners):
            beside = np.flatnonzero((owners == entry).any(axis=1) & (self.entry[near[rim]] != entry))
            own = rim[beside]
            other, _ = self._off(points[own], around[beside, (owners[beside] == entry).argmax(axis=1)])
            found[own] = np.where(np.abs(other) < np.abs(found[own]), other, found[own])
        return found

    def _off(self, points: Array, near: Array) -> tuple[Array, Array]:
        """Signed distances of points from the faces of samples, and whether their feet lie at the end of them."""
        found, ended = np.zeros(len(near)), np.zeros(len(near), bool)
        owner = self.entry[near]
        order = np.argsort(owner, kind="stable")
        for stretch in groups(owner[order]):
            own = order[stretch]
            place, facets = self.entries[owner[own[0]]]
            local = (points[own] - place.frame[:3, 3]) @ np.linalg.inv(place.frame[:3, :3]).T
            found[own], ended[own] = _off(facets, local, self.uv[near[own]], _DONE * self.diagonal)
        return found, ended


def _spread(facets: Facets, most: float) -> tuple[Array, Array]:
    """Weights ``(n, 3)`` of corners, and the corners, of places that are spread over triangles."""
    corners = facets.points[facets.corners]
    longest = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2).max(axis=1)
    parts = np.maximum(np.ceil(longest / most).astype(int), 1)
    which, first = runs(np.arange(len(parts)), np.zeros(len(parts), int), parts + 1)
    line, second = runs(np.arange(len(which)), np.zeros(len(which), int), parts[which] + 1 - first)
    own = which[line]
    a, b = first[line] / parts[own], second / parts[own]
    return np.stack([1.0 - a - b, a, b], axis=1), facets.corners[own]


def _off(facets: Facets, points: Array, uv: Array, done: float) -> tuple[Array, Array]:
    """Signed distances of points from a face's surface, from starting parameters on, and whether it ends there."""
    low, high = facets.uv.min(axis=0), facets.uv.max(axis=0)
    beyond = _BEYOND * (high - low)
    uv = np.array(uv)
    left = np.arange(len(uv))
    for _ in range(_STEPS):
        s, su, sv, suu, suv, svv = facets.ground.jets(uv[left], 2)
        r = s - points[left]
        gu, gv = (r * su).sum(axis=1), (r * sv).sum(axis=1)
        ee, ff, gg = (su * su).sum(axis=1), (su * sv).sum(axis=1), (sv * sv).sum(axis=1)
        a, b, c = ee + (r * suu).sum(axis=1), ff + (r * suv).sum(axis=1), gg + (r * svv).sum(axis=1)
        bad = ~((a > 0) & (a * c - b * b > 1e-3 * (ee * gg - ff * ff)))
        a, b, c = np.where(bad, ee, a), np.where(bad, ff, b), np.where(bad, gg, c)
        determinant = np.maximum(a * c - b * b, 1e-300)
        step = -np.stack([c * gu - b * gv, a * gv - b * gu], axis=1) / determinant[:, None]
        new = np.clip(uv[left] + step, low - beyond, high + beyond)
        moved = np.linalg.norm((new - uv[left])[:, :1] * su + (new - uv[left])[:, 1:] * sv, axis=1)
        uv[left] = new
        left = left[moved > done]
        if not len(left):
            break
    s, su, sv = facets.ground.jets(uv, 1)
    r = points - s
    side = (r * (facets.outward * unit(cross(su, sv)))).sum(axis=1)
    ended = ((uv <= low) | (uv >= high)).any(axis=1)
    return np.where(side < 0.0, -1.0, 1.0) * np.linalg.norm(r, axis=1), ended
