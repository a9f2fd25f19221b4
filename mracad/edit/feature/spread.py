"""Points spread over the ground: at random by area, and no nearer to each other than a distance along it.

Distances along the ground are those of the arc of circle with the same chord and the same normals at its ends: exact on
planes and spheres and along circles of cylinders, and to the fourth order in the turn elsewhere.  Points whose normals
differ by more than about 78° are on other sides of a wall.
"""

from __future__ import annotations

import zlib
from dataclasses import dataclass

import numpy as np

from mracad.bspline.surface import Net, pairs
from mracad.edit.feature.ground import STEEP, Ground
from mracad.edit.feature.patch import Patch

Array = np.ndarray

CELLS = 48
"""Least number of cells in each direction in which the area of a surface is measured."""

BLOCK = 4096
"""Points that are taken or refused at a time, at least."""

NEAREST = 12
"""Points around one among which those on its side of a wall are looked for."""


@dataclass(frozen=True, eq=False)
class Spots:
    """Points on the ground.

    Attributes
    ----------
    surface, face, part : ndarray (m,) of int
        ``part`` numbers the pieces of the ground that smooth seams join.
    uv : ndarray (m, 2)
    points, normals : ndarray (m, 3)
        Outward unit normals.
    """

    surface: Array
    face: Array
    part: Array
    uv: Array
    points: Array
    normals: Array

    def __len__(self) -> int:
        return len(self.surface)

    def only(self, some: Array | slice) -> Spots:
        """Some of them, by index or mask."""
        return Spots(*(np.asarray(getattr(self, name))[some] for name in self.__dataclass_fields__))

    def and_(self, *others: Spots) -> Spots:
        """These and others."""
        every = (self, *others)
        return Spots(*(np.concatenate([getattr(each, name) for each in every]) for name in self.__dataclass_fields__))

    @classmethod
    def on(cls, ground: Ground, parts: Array, surface: Array, uv: Array) -> Spots:
        """The points at parameters of surfaces that lie on the faces of the ground; ``parts`` is by face."""
        face = ground.faces(surface, uv)
        on = face >= 0
        feet = ground.standing(surface[on], uv[on], np.zeros(int(on.sum())))
        return cls(surface[on], face[on], parts[face[on]], uv[on], feet.points, feet.normals)


_NONE = np.empty(0, int)
NOWHERE = Spots(_NONE, _NONE, _NONE, np.empty((0, 2)), np.empty((0, 3)), np.empty((0, 3)))
"""No points."""


def arcs(apart: Array, normals: Array, others: Array) -> Array:
    """Distances along the ground for vectors ``(…, 3)`` between points with these unit normals; infinite through
    walls."""
    chord = np.linalg.norm(apart, axis=-1)
    way = apart / np.maximum(chord, 1e-300)[..., None]
    a, b = (np.clip((each * way).sum(axis=-1), -1.0, 1.0) for each in (normals, others))
    straight = np.abs(a - b) < 1e-6
    arc = (np.arcsin(a) - np.arcsin(b)) / np.where(straight, 1.0, a - b)
    found = chord * np.where(straight, 1 / np.sqrt(np.maximum(1 - a * a, 1e-12)), arc)
    return np.where((normals * others).sum(axis=-1) > STEEP, found, np.inf)


class Area:
    """The area of one surface of the ground by cells, in which points are spread at random."""

    def __init__(self, patch: Patch, seed: int) -> None:
        self.index = patch.index
        lines = []
        for knots in patch.knots:
            pieces = -(-CELLS // knots.spans)
            share = np.arange(knots.spans * pieces + 1) / pieces
            lines.append(np.interp(share, np.arange(knots.spans + 1), knots.breaks))
        self._low = pairs(*(x[:-1] for x in lines))
        self._size = pairs(*(np.diff(x) for x in lines))
        middle = self._low + self._size / 2
        _, su, sv = patch.net.evaluate(middle, 1)
        area = np.linalg.norm(np.cross(su, sv), axis=1) * self._size.prod(axis=1)
        self._cumulated = np.cumsum(np.where(patch.covers(middle), area, 0.0))
        self._rng = np.random.default_rng([seed, _mark(patch.net)])

    @property
    def total(self) -> float:
        """Of all cells that the faces touch, mm²."""
        return float(self._cumulated[-1])

    def random(self, count: int) -> tuple[Array, Array]:
        """Parameters ``(count, 2)`` of points evenly over the area, and random numbers by which they come in turn."""
        at = (np.arange(count) + self._rng.random(count)) / max(count, 1) * self.total
        cell = np.minimum(np.searchsorted(self._cumulated, at, side="right"), len(self._low) - 1)
        return self._low[cell] + self._rng.random((count, 2)) * self._size[cell], self._rng.random(count)


def _mark(net: Net) -> int:
    """A number that depends on the place of a surface alone."""
    middle = net.poles.reshape(-1, 3).mean(axis=0)
    return zlib.crc32((np.round(middle, 6) + 0.0).tobytes())


def thrown(ground: Ground, parts: Array, areas: list[Area], density: float) -> Spots:
    """Points at random all over the ground, ``density`` per mm², in random order."""
    found = [(area, *area.random(round(area.total * density))) for area in areas]
    surface = np.concatenate([np.full(len(uv), area.index) for area, uv, _ in found])
    order = np.argsort(np.concatenate([turn for *_, turn in found]), kind="stable")
    return Spots.on(ground, parts, surface[order], np.concatenate([uv for _, uv, _ in found])[order])


def nearest(spots: Spots, others: Spots, most: float) -> tuple[Array, Array]:
    """Distance along the ground of each point from the nearest of the others, and which one that is; infinite beyond
    ``most``, mm, and from points of other parts."""
    from scipy.spatial import cKDTree

    best, which = np.full(len(spots), np.inf), np.zeros(len(spots), int)
    for part in np.unique(others.part):
        here, there = np.flatnonzero(spots.part == part), np.flatnonzero(others.part == part)
        if not len(here):
            continue
        tree = cKDTree(others.points[there])
        near, hit = tree.query(spots.points[here], k=min(NEAREST, len(there)), distance_upper_bound=most)
        near, hit = near.reshape(len(here), -1), hit.reshape(len(here), -1)
        some = np.isfinite(near[:, 0])
        here, hit, known = here[some], there[np.where(np.isfinite(near), hit, 0)[some]], np.isfinite(near)[some]
        apart = spots.points[here, None] - others.points[hit]
        far = np.where(known, arcs(apart, others.normals[hit], spots.normals[here, None]), np.inf)
        first = far.argmin(axis=1)
        best[here], which[here] = far[np.arange(len(here)), first], hit[np.arange(len(here)), first]
    return np.where(best <= most, best, np.inf), which


def apart(spots: Spots, least: float, given: Spots | None = None) -> Array:
    """Indices of points that are taken one after the other unless they are nearer than ``least`` (mm, along the
    ground) to one taken before, or to a given one."""
    left = np.arange(len(spots))
    if given is not None and len(given):
        left = left[nearest(spots, given, least)[0] >= least]
    taken = [np.empty(0, int)]
    size = BLOCK
    while len(left):
        block, left = left[:size], left[size:]
        new = block[_first(spots.only(block), least)]
        taken.append(new)
        left = left[nearest(spots.only(left), spots.only(new), least)[0] >= least]
        size *= 2
    return np.concatenate(taken)


def _first(spots: Spots, least: float) -> Array:
    """The same among a few points: in each round those are taken that nothing before them can still exclude."""
    a, b = close(spots, least)
    unsure, taken = np.ones(len(spots), bool), np.zeros(len(spots), bool)
    while unsure.any():
        ready = unsure.copy()
        ready[b] = False
        taken |= ready
        out = np.zeros(len(spots), bool)
        out[b[ready[a]]] = True
        unsure &= ~ready & ~out
        both = unsure[a] & unsure[b]
        a, b = a[both], b[both]
    return np.flatnonzero(taken)


def close(spots: Spots, least: float) -> tuple[Array, Array]:
    """Pairs (a before b) of points nearer than ``least`` along the ground."""
    from scipy.spatial import cKDTree

    a, b = cKDTree(spots.points).query_pairs(least, output_type="ndarray").T
    a, b = np.minimum(a, b), np.maximum(a, b)
    far = arcs(spots.points[b] - spots.points[a], spots.normals[a], spots.normals[b])
    near = (far < least) & (spots.part[a] == spots.part[b])
    return a[near], b[near]
