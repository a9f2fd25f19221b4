"""The ground that features lie on: the chosen faces of a model, in their part's frame."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from mracad.bspline.closest import feet as closest
from mracad.edit.feature.chart import Charts, charts
from mracad.edit.feature.patch import Patch, from_boxes
from mracad.model.brep import Model

if TYPE_CHECKING:
    from scipy.spatial import cKDTree

Array = np.ndarray

GRID = 11
"""Samples in each direction around a place."""

STEEP = 0.2
"""Least cosine between normals at one place: beyond it is the other side of a wall."""

SAME = 1e-12
"""Distances that differ by less, mm, are equal: of two surfaces the first then counts."""

SIDEWAYS = 1e-3
"""Share of its distance by which a point may lie beside the normal at its foot; beyond that the ground has ended."""


@dataclass(frozen=True, eq=False)
class Feet:
    """The feet of points on the ground.

    Attributes
    ----------
    surface : ndarray (m,) of int
    uv : ndarray (m, 2)
    points, normals, along : ndarray (m, 3)
        The feet, outward normals, and unit tangents S_u.
    apart : ndarray (m,)
        Distance of the points from their feet, mm.
    """

    surface: Array
    uv: Array
    points: Array
    normals: Array
    along: Array
    apart: Array

    def part(self, some: slice | Array) -> Feet:
        """Some of them."""
        return Feet(*(getattr(self, name)[some] for name in self.__dataclass_fields__))

    def beside(self, points: Array) -> Array:
        """Distance of points from the normals at their feet, mm."""
        way = points - self.points
        return np.asarray(np.linalg.norm(way - (way * self.normals).sum(axis=1, keepdims=True) * self.normals, axis=1))


@dataclass(frozen=True, eq=False)
class _Nearest:
    """The nearest feet found so far: like :class:`Feet`, and how far the faces themselves are, mm."""

    surface: Array
    uv: Array
    apart: Array
    reached: Array

    @classmethod
    def none(cls, count: int) -> _Nearest:
        return cls(np.zeros(count, int), np.zeros((count, 2)), np.full(count, np.inf), np.full(count, np.inf))

    def take(self, index: int, which: Array, uv: Array, apart: Array, reached: Array) -> None:
        """Take feet on a surface where they are nearer, ``which`` being different points."""
        best = self.reached[which]
        better = (reached < best - SAME) | ((reached <= best + SAME) & (index < self.surface[which]))
        some = which[better]
        self.surface[some], self.uv[some] = index, uv[better]
        self.apart[some], self.reached[some] = apart[better], reached[better]


@dataclass(frozen=True, eq=False)
class Ground:
    """Faces of a model.

    Attributes
    ----------
    model : Model
    chosen : frozenset of int
        NURBS faces.
    patches : dict of int to Patch
        Their surfaces.
    """

    model: Model
    chosen: frozenset[int]
    patches: dict[int, Patch]

    @classmethod
    def of(cls, model: Model, faces: Collection[int], poles: Mapping[int, Array] | None = None) -> Ground:
        """Faces of a model, with control points by surface that replace the model's."""
        surfaces = sorted({s for i in faces if (s := model.faces[i].surface) is not None})
        return cls(model, frozenset(faces), {i: Patch.of(model, i, faces, (poles or {}).get(i)) for i in surfaces})

    def without(self, offsets: Mapping[int, Array]) -> Ground:
        """The ground with offsets subtracted, by surface over the model's own nets."""
        return Ground.of(
            self.model, self.chosen, {i: self.model.surfaces[i].net.poles - each for i, each in offsets.items()}
        )

    @cached_property
    def _stands(self) -> list[tuple[int, Array]]:
        """For surfaces with several instances, the motions from the others to the first."""
        found: list[tuple[int, Array]] = []
        for index, patch in self.patches.items():
            for face in patch.faces:
                way = patch.frame @ np.linalg.inv(face.frame)
                known = [np.eye(4), *(other for surface, other in found if surface == index)]
                if not any(np.allclose(way, other, rtol=0, atol=1e-12) for other in known):
                    found.append((index, way))
        return found

    def brought(self, points: Array) -> Array:
        """Points ``(m, 3)`` near any instance of a surface, moved to the first instance: an edit of the surface shows
        at all of them."""
        if not self._stands or not len(points):
            return points
        best, least = points, self.feet(points).apart
        for index, way in self._stands:
            moved = points @ way[:3, :3].T + way[:3, 3]
            feet = self.feet(moved)
            nearer = (feet.surface == index) & (feet.apart < least - 1e-9)
            best, least = np.where(nearer[:, None], moved, best), np.where(nearer, feet.apart, least)
        return best

    def feet(self, points: Array) -> Feet:
        """The nearest points of the ground.

        The surface whose faces come nearest within their trims counts; where that is at a rim, the foot lies on the
        surface beyond it.
        """
        nearest, (tree, owners) = _Nearest.none(len(points)), self._spots
        if len(owners) and len(points):
            first = owners[tree.query(points)[1]]
            for index in self.patches:  # what is found there leaves few others to be looked at
                self._look(nearest, index, points, np.flatnonzero(first == index))
            far = np.flatnonzero(np.isinf(nearest.reached))
            most = nearest.reached.copy()
            if len(far):
                most[far] = self._marks.query(points[far])[0]
            for index, patch in self.patches.items():
                most = np.minimum(most, nearest.reached)
                some = np.flatnonzero((first != index) & (from_boxes(points, patch.whole) <= most + SAME))
                some = some[from_boxes(points[some], patch.boxes) <= most[some] + SAME]
                self._look(nearest, index, points, some)
        return self.standing(nearest.surface, nearest.uv, nearest.apart)

    @cached_property
    def _spots(self) -> tuple[cKDTree, Array]:
        """The seeds of all surfaces, and the surface of each."""
        from scipy.spatial import cKDTree

        seeds = [patch.seeds[1] for patch in self.patches.values()]
        owners = np.repeat(list(self.patches), list(map(len, seeds)))
        return cKDTree(np.concatenate([*seeds, np.empty((0, 3))])), owners

    @cached_property
    def _marks(self) -> cKDTree:
        """Points within the faces and on their boundaries."""
        from scipy.spatial import cKDTree

        return cKDTree(np.concatenate([patch.marks for patch in self.patches.values()]))

    def _look(self, nearest: _Nearest, index: int, points: Array, some: Array) -> None:
        """Look for nearer feet of some points on one surface, from its three nearest seeds."""
        patch = self.patches[index]
        count = min(3, len(patch.seeds[0]))
        if not len(some) or not count:
            return
        seeds = patch.spots.query(points[some], k=count)[1].reshape(len(some), count)
        at, off = closest(patch.net, np.repeat(points[some], count, axis=0), patch.seeds[0][seeds.ravel()])
        at, off = at.reshape(len(some), count, 2), off.reshape(len(some), count)
        for k in range(count):
            new = (off[:, k] <= nearest.reached[some] + SAME) & patch.covers(at[:, k])
            new &= (np.abs(off[:, :k] - off[:, k : k + 1]) > SAME).all(axis=1)
            which, uv, apart = some[new], at[new, k], off[new, k]
            nearest.take(index, which, uv, apart, np.maximum(apart, patch.beyond(points[which], uv)))

    def standing(self, surface: Array, uv: Array, apart: Array) -> Feet:
        """Feet given by parameters."""
        points, normals, along = (np.zeros((len(uv), 3)) for _ in range(3))
        for index, patch in self.patches.items():
            own = surface == index
            if own.any():
                points[own], su, _, normals[own] = patch.evaluate(uv[own])
                along[own] = su / np.maximum(np.linalg.norm(su, axis=1, keepdims=True), 1e-300)
        return Feet(surface, uv, points, normals, along, apart)

    def faces(self, surface: Array, uv: Array) -> Array:
        """The face of the ground that each place of a surface lies in, or -1."""
        found = np.full(len(uv), -1)
        for index, patch in self.patches.items():
            for face in patch.faces:
                own = np.flatnonzero((surface == index) & (found < 0))
                if len(own):
                    found[own[patch.inside(face, uv[own])]] = face.index
        return found

    def samples(self, feet: Feet, reach: Array, count: int = GRID) -> tuple[Array, Array, Array]:
        """Points around feet on all surfaces, the points that count, and the surfaces that each foot reaches.

        Returns
        -------
        points : ndarray (m, q, 3)
        near : ndarray of bool (m, q)
        touched : ndarray of bool (m, patches)
        """
        from scipy.spatial import cKDTree

        points, near = [], []
        touched = np.zeros((len(reach), len(self.patches)), bool)
        for number, (index, patch) in enumerate(self.patches.items()):
            start, here = feet.uv.copy(), feet.surface == index
            seeds, spots = patch.seeds
            if len(seeds):
                spread = float(np.linalg.norm(np.ptp(spots, axis=0)) / 8)
                far, which = cKDTree(spots).query(feet.points)
                other = ~here & (far <= 1.5 * reach + spread)
                start[other] = closest(patch.net, feet.points[other], seeds[which[other]])[0]
                here |= other
            if not here.any():
                continue
            found, normals, ok = patch.around(start[here], feet.points[here], reach[here], count)
            ok &= (normals * feet.normals[here][:, None]).sum(axis=2) > STEEP
            touched[here, number] = ok.any(axis=1)
            if ok.any():
                every, counts = np.zeros((len(here), *found.shape[1:])), np.zeros((len(here), found.shape[1]), bool)
                every[here], counts[here] = found, ok
                points.append(every)
                near.append(counts)
        return np.concatenate(points, axis=1), np.concatenate(near, axis=1), touched

    def charts(self, feet: Feet, directions: Array, reach: Array) -> tuple[Charts, Array]:
        """Charts around feet with x along given directions, and the surfaces that each reaches."""
        points, near, touched = self.samples(feet, reach)
        return charts(feet.points, axes(feet.normals, directions), reach, points, near), touched


def axes(normals: Array, directions: Array) -> Array:
    """Right-handed frames ``(m, 3, 3)`` with the given normals and x as near as possible to the given directions."""
    x = directions - (directions * normals).sum(axis=1, keepdims=True) * normals
    size = np.linalg.norm(x, axis=1, keepdims=True)
    spare = np.cross(normals, np.eye(3)[np.abs(normals).argmin(axis=1)])
    x = np.where(size > 1e-9, x / np.maximum(size, 1e-300), spare / np.linalg.norm(spare, axis=1, keepdims=True))
    return np.stack([x, np.cross(normals, x), normals], axis=1)
