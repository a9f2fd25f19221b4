"""Deviation from another model: the distance to its nearest surface point, exact at every place that is seen."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from mracad.bspline.vectors import cross, unit
from mracad.model.facets import Body, Facets, Placed
from mracad.view.runs import groups, runs
from mracad.view.spots import Spots

Array = np.ndarray

CELLS = 250
"""Largest distance between the samples from which nearest points are sought, as a part of the diagonal."""

_NEIGHBOURS = 64  # samples among which other faces are sought
_STARTS = 8  # of Newton's method, of those, where a foot lies at the end of a face
_INWARD = 0.1  # of their spacing, to the middle of their triangles: samples are on no seam and at no pole
_STEPS = 8  # of Newton's method
_BEYOND = 0.01  # of a face: how far its surface goes on
_INSIDE = 1e-4  # of a face: how far from its ends normals are taken
_DONE = 1e-10  # of the diagonal: a step that ends it, and the least distance


@dataclass(frozen=True, eq=False)
class Reference:
    """The model from which deviation is measured.

    Attributes
    ----------
    entries : list of (Placed, Facets)
    uv : list of ndarray (n, 2)
        The samples of each face.
    trees : list of scipy.spatial.cKDTree
        Of the samples of each face.
    thin : scipy.spatial.cKDTree
        Of some samples, as dense on all faces.
    owner : ndarray of int (m,)
        The face of each of these.
    diagonal : float
    """

    entries: list[tuple[Placed, Facets]]
    uv: list[Array]
    trees: list[Any]
    thin: Any
    owner: Array
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
        some = [each[_thinned(each, 0.5 * body.diagonal / CELLS)] for each in points]
        owner = np.repeat(np.arange(len(entries)), [len(each) for each in some])
        return cls(entries, uv, [cKDTree(each) for each in points], cKDTree(np.concatenate(some)), owner, body.diagonal)

    def deviation(self, spots: Spots) -> Array:
        """Distances of places; see :meth:`distances`."""
        return self.distances(spots.point.T)

    def distances(self, points: Array) -> Array:
        """Distances of points ``(q, 3)`` from the nearest point, mm, positive on the outer side of its face."""
        found = np.full(len(points), np.inf)
        owner = self.owner[self.thin.query(points)[1]]
        self._approach(points, found, owner)
        left = np.flatnonzero(np.abs(found) > _DONE * self.diagonal)  # the nearest point may lie on a face beside it
        near = self.thin.query(points[left], np.arange(1, min(_NEIGHBOURS, len(self.owner)) + 1))[1]
        owners = self.owner[near]
        for entry in np.unique(owners):
            beside = left[(owners == entry).any(axis=1) & (owner[left] != entry)]
            self._nearer(points, found, beside, entry)
        return np.where(np.abs(found) > _DONE * self.diagonal, found, 0.0)

    def _approach(self, points: Array, found: Array, owner: Array) -> None:
        """Find the distances of points from a face each."""
        order = np.argsort(owner, kind="stable")
        for stretch in groups(owner[order]):
            own = order[stretch]
            self._nearer(points, found, own, owner[own[0]])

    def _nearer(self, points: Array, found: Array, own: Array, entry: int) -> None:
        """Replace distances of some points by those from a face where these are smaller."""
        tree = self.trees[entry]
        far, near = tree.query(points[own])
        ended = own[self._off(points, found, own, entry, near, far)]
        if len(ended):
            count = min(_NEIGHBOURS, tree.n)
            far, near = tree.query(points[ended], np.arange(1, count + 1))
            for k in range(0, count, max(count // _STARTS, 1)):
                self._off(points, found, ended, entry, near[:, k], far[:, 0])

    def _off(self, points: Array, found: Array, own: Array, entry: int, near: Array, far: Array) -> Array:
        """Replace distances by smaller ones, from starting samples on; where feet lie at the end of the face.

        A surface goes on beyond its face, but no point of that is nearer than its samples are, less their spacing.
        """
        place, facets = self.entries[entry]
        local = (points[own] - place.frame[:3, 3]) @ np.linalg.inv(place.frame[:3, :3]).T
        off, ended = _off(facets, local, self.uv[entry][near], _DONE * self.diagonal)
        least = far - self.diagonal / CELLS - 2.0 * facets.off
        off = np.copysign(np.maximum(np.abs(off), least), off)
        found[own] = np.where(np.abs(off) < np.abs(found[own]), off, found[own])
        return np.asarray(ended & (np.abs(found[own]) > _DONE * self.diagonal))


def _thinned(points: Array, most: float) -> Array:
    """One point of each cell of a grid."""
    return np.asarray(np.unique(np.floor(points / most).astype(int), axis=0, return_index=True)[1])


def _spread(facets: Facets, most: float) -> tuple[Array, Array]:
    """Weights ``(n, 3)`` of corners, and the corners, of places that are spread over triangles."""
    corners = facets.points[facets.corners]
    longest = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2).max(axis=1)
    parts = np.maximum(np.ceil(longest / most).astype(int), 1)
    which, first = runs(np.arange(len(parts)), np.zeros(len(parts), int), parts + 1)
    line, second = runs(np.arange(len(which)), np.zeros(len(which), int), parts[which] + 1 - first)
    own = which[line]
    a, b = first[line] / parts[own], second / parts[own]
    shares = np.stack([1.0 - a - b, a, b], axis=1)
    return shares + _INWARD / parts[own, None] * (1.0 / 3.0 - shares), facets.corners[own]


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
        a, b, c = np.where(bad, np.maximum(a, ee), a), np.where(bad, ff, b), np.where(bad, np.maximum(c, gg), c)
        determinant = np.maximum(a * c - b * b, 1e-300)
        step = -np.stack([c * gu - b * gv, a * gv - b * gu], axis=1) / determinant[:, None]
        new = np.clip(uv[left] + step, low - beyond, high + beyond)
        moved = np.linalg.norm((new - uv[left])[:, :1] * su + (new - uv[left])[:, 1:] * sv, axis=1)
        uv[left] = new
        left = left[moved > done]
        if not len(left):
            break
    s, su, sv = facets.ground.jets(uv, 1)
    ended = ((uv <= low) | (uv >= high)).any(axis=1)
    if ended.any():  # beyond a pole a surface goes on inside out
        inner = _INSIDE * (high - low)
        _, su[ended], sv[ended] = facets.ground.jets(np.clip(uv[ended], low + inner, high - inner), 1)
    r = points - s
    side = (r * (facets.outward * unit(cross(su, sv)))).sum(axis=1)
    return np.where(side < 0.0, -1.0, 1.0) * np.linalg.norm(r, axis=1), ended
