"""Where a mesh crosses itself: triangles of NURBS faces are divided only where they come near others.

A triangle is off its surface by its *sag*, estimated in the middles of its sides.  Two triangles may be neglected
where the surfaces over them are certainly apart: if a plane divides them with room for their sags, or if they have a
corner in common and all normals of both lie within a half space, so that together they are a graph over a plane.
All others are divided at the middles of sides that are off by more than the chord, or by so much that a narrow one may
be turned over, until none is; what never gets there, as where a surface is torn, is left out.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from itertools import product

import numpy as np

from mracad.bspline.scattered import Place, scattered
from mracad.bspline.vectors import across, between, cross, unit
from mracad.inspect.crossing import crossings, near
from mracad.model.brep import Model
from mracad.model.facts import Triangles

Array = np.ndarray
_ROUNDS = 10  # each divides sags by four
_ROOM = 1.5  # times the sag in the middles of sides: that in the middle of a triangle is up to 4/3 of it
_HALF = np.radians(150.0)  # of normals that lie within a half space, with some room
_SHARP, _FINEST = 0.25, 1 / 4  # largest sag over the height of a triangle, unless it is so small beside the chord
_CURVED = np.radians(12.0)  # the kernel's triangles on elementary surfaces turn by no more


def crossing_faces(mesh: Triangles, model: Model, chord: float) -> dict[tuple[int, int], tuple[float, float, float]]:
    """Pairs of faces of one part that cross, or a face and itself, and a place of each crossing.

    Parameters
    ----------
    mesh : Triangles
        Those on surfaces other than NURBS follow them within the chord.
    model : Model
    chord : float
        mm.
    """
    facets = _Facets.of(mesh, model)
    shapes = _Shapes.of(facets, model, chord)
    pairs = shapes.near()
    found: dict[tuple[int, int], tuple[float, float, float]] = {}
    for _ in range(_ROUNDS):
        rough = shapes.rough(chord)
        open_ones = np.asarray(rough.any(axis=1))[pairs].any(axis=1)
        shapes.crossing(pairs[~open_ones], found)
        live, pairs = np.unique(pairs[open_ones], return_inverse=True)
        if not len(live):
            break
        facets, parents = facets.some(live).divided(rough[live], shapes.sides[live], shapes.middles)
        shapes = _Shapes.of(facets, model, chord)
        pairs = shapes.among(pairs, parents)
    return found


def _sharing(corners: Array, pairs: Array) -> Array:
    """Whether triangles have a corner in common."""
    columns = np.asfortranarray(corners).T
    shared = np.zeros(len(pairs), bool)
    for one, other in product(columns, repeat=2):
        shared |= one[pairs[:, 0]] == other[pairs[:, 1]]
    return shared


@dataclass(frozen=True, eq=False)
class _Facets:
    """Triangles of faces.

    Attributes
    ----------
    points : ndarray (n, 3)
    uv : ndarray (n, 2)
    gaps : ndarray (n, 3)
        What leads from the points of NURBS surfaces there to these: edges lie off them.
    leaders : ndarray of int (n,)
        The point of the part that each point of a face is.
    own : ndarray of int (m, 3)
        Corners as points of the triangle's face.
    inner : ndarray of bool (m, 3)
        Whether its sides, each from a corner to the next, lie between two triangles of the face.
    faces, parts : ndarray of int (m,)
    """

    points: Array
    uv: Array
    gaps: Array
    leaders: Array
    own: Array
    inner: Array
    faces: Array
    parts: Array

    @classmethod
    def of(cls, mesh: Triangles, model: Model) -> _Facets:
        leaders = np.arange(len(mesh.points))
        leaders[mesh.own] = mesh.corners
        _, sides, counts = np.unique(_sides(mesh.own), return_inverse=True, return_counts=True)
        inner = counts[sides].reshape(-1, 3) == 2
        rim, owner = np.zeros(len(leaders), bool), np.zeros(len(leaders), int)
        rim[mesh.own[~inner]] = rim[mesh.own[~np.roll(inner, 1, axis=1)]] = True
        owner[mesh.own] = mesh.faces[:, None]
        those = np.flatnonzero(rim & _on_nets(model, owner))
        gaps = np.zeros_like(mesh.points)
        gaps[those] = mesh.points[those] - _evaluated(model, owner[those], mesh.uv[those])[0]
        return cls(mesh.points, mesh.uv, gaps, leaders, mesh.own, inner, mesh.faces, mesh.parts)

    @property
    def corners(self) -> Array:
        return np.asarray(self.leaders[self.own])

    def some(self, those: Array) -> _Facets:
        """Some of the triangles."""
        chosen = (each[those] for each in (self.own, self.inner, self.faces, self.parts))
        return _Facets(self.points, self.uv, self.gaps, self.leaders, *chosen)

    def divided(self, marked: Array, sides: Array, middles: Array) -> tuple[_Facets, Array]:
        """The triangles, divided at the middles of marked sides, and which ones each is part of, ascending.

        Parameters
        ----------
        marked : ndarray of bool (m, 3)
        sides : ndarray of int (m, 3)
            Numbers of the sides.
        middles : ndarray (s, 8)
            Points, parameters and gaps in the middles of sides.
        """
        used, new = np.unique(sides[marked], return_inverse=True)
        number = np.full(marked.shape, -1)
        number[marked] = len(self.points) + new
        leaders = np.concatenate([self.leaders, len(self.points) + np.arange(len(used))])
        new_ones = middles[used]
        points, uv, gaps = (
            np.concatenate([old, new_ones[:, own]])
            for old, own in ((self.points, slice(3)), (self.uv, slice(3, 5)), (self.gaps, slice(5, 8)))
        )
        own, inner, owners = [], [], []
        for count, parts in _PARTS.items():
            those = np.flatnonzero(marked.sum(axis=1) == count)
            turn = marked[those].argmin(axis=1) + 1 if count == 2 else marked[those].argmax(axis=1)
            order = (turn[:, None] + np.arange(3)) % 3
            names = np.concatenate([np.take_along_axis(x[those], order, axis=1) for x in (self.own, number)], axis=1)
            between = np.take_along_axis(self.inner[those], order, axis=1)
            between = np.concatenate([between, np.ones((len(those), 1), bool)], axis=1)
            for corners, along in parts:
                own.append(names[:, corners])
                inner.append(between[:, along])
                owners.append(those)
        owner = np.concatenate(owners)
        order = np.argsort(owner, kind="stable")
        owner = owner[order]
        three, between = (np.concatenate(each)[order] for each in (own, inner))
        return _Facets(points, uv, gaps, leaders, three, between, self.faces[owner], self.parts[owner]), owner


_PARTS = {
    0: [((0, 1, 2), (0, 1, 2))],
    1: [((0, 3, 2), (0, 3, 2)), ((3, 1, 2), (0, 1, 3))],
    2: [((3, 1, 4), (0, 1, 3)), ((0, 3, 4), (0, 3, 3)), ((0, 4, 2), (3, 1, 2))],
    3: [((0, 3, 5), (0, 3, 2)), ((3, 1, 4), (0, 1, 3)), ((5, 4, 2), (3, 1, 2)), ((3, 4, 5), (3, 3, 3))],
}
"""By the number of divided sides, the first ones: the parts of a triangle, as corners (3 to 5 are the middles of its
sides) and the sides that theirs are or lie on; 3 is a new one."""


def _sides(own: Array) -> Array:
    """A number for each side, ``(3 m,)``, the same from both of its triangles."""
    ends = np.sort(own[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
    return np.asarray(ends[:, 0] * (int(own.max(initial=0)) + 1) + ends[:, 1])


@dataclass(frozen=True, eq=False)
class _Shapes:
    """How triangles lie in space.

    Attributes
    ----------
    spots : ndarray (m, 3, 3)
        Corners.
    corners : ndarray of int (m, 3)
        As points of the part.
    faces, parts : ndarray of int (m,)
    normals : ndarray (m, 3)
    sags : ndarray (m, 3)
        Of sides of triangles on NURBS faces that are not on edges, mm; zero for others.
    off : ndarray (m,)
        Distance within which the surface over a triangle is, mm.
    turns : ndarray (m,)
        Largest angle between its normal and those of its surface.
    sides : ndarray of int (m, 3)
        Numbers of the sides of triangles on NURBS faces.
    middles : ndarray (s, 8)
        Where surfaces are in the middles of sides, as far off as at their ends, parameters and gaps there.
    """

    spots: Array
    corners: Array
    faces: Array
    parts: Array
    normals: Array
    sags: Array
    off: Array
    turns: Array
    sides: Array
    middles: Array

    @classmethod
    def of(cls, facets: _Facets, model: Model, chord: float) -> _Shapes:
        spots = facets.points[facets.own]
        normals = unit(cross(spots[:, 1] - spots[:, 0], spots[:, 2] - spots[:, 0]))
        flat = np.array([face.kind == "plane" for face in model.faces], bool)[facets.faces]
        sags, sides = np.zeros((len(spots), 3)), np.zeros((len(spots), 3), int)
        off, turns = np.where(flat, 0.0, chord), np.where(flat, 0.0, _CURVED)
        those = np.flatnonzero(_on_nets(model, facets.faces))
        _, first, number = np.unique(_sides(facets.own[those]), return_index=True, return_inverse=True)
        owner, side = those[first // 3], first % 3
        ends = np.stack([facets.own[owner, side], facets.own[owner, (side + 1) % 3]])
        at, gaps = facets.uv[ends].mean(axis=0), facets.gaps[ends].mean(axis=0)
        middles, outward = _evaluated(model, facets.faces[owner], at)
        middles = middles + gaps
        start, stop = facets.points[ends]
        apart = np.linalg.norm(across(middles - start, stop - start), axis=1)
        sides[those] = number.reshape(-1, 3)
        sags[those] = np.where(facets.inner[those], apart[sides[those]], 0.0)
        off[those] = _ROOM * sags[those].max(axis=1, initial=0.0)
        turns[those] = between(normals[those, None], outward[sides[those]]).max(axis=1, initial=0.0)
        middles = np.concatenate([middles, at, gaps], axis=1)
        return cls(spots, facets.corners, facets.faces, facets.parts, normals, sags, off, turns, sides, middles)

    def rough(self, chord: float) -> Array:
        """Sides ``(m, 3)`` to be divided, from both of their triangles."""
        limits = np.clip(_SHARP * self.heights, _FINEST * chord, chord)
        marked = np.zeros(max(len(self.middles), 1), bool)
        marked[self.sides[self.sags > limits[:, None]]] = True
        return np.asarray(marked[self.sides] & (self.sags > 0.0))

    @cached_property
    def heights(self) -> Array:
        """The least height of each triangle, mm."""
        sides = np.roll(self.spots, -1, axis=1) - self.spots
        longest = np.linalg.norm(sides, axis=2).max(axis=1, initial=0.0)
        return np.asarray(np.linalg.norm(cross(sides[:, 0], sides[:, 1]), axis=1) / np.maximum(longest, 1e-300))

    def crossing(self, pairs: Array, found: dict[tuple[int, int], tuple[float, float, float]]) -> None:
        """Add the faces of those of some pairs of triangles that cross, and where."""
        pairs = pairs[
            ~_sharing(self.corners, pairs) & (self.sags.max(axis=1) <= _SHARP * self.heights)[pairs].all(axis=1)
        ]
        pairs, where = crossings(self.spots, pairs)
        for (a, b), (x, y, z) in zip(np.sort(self.faces[pairs], axis=1).tolist(), where.tolist(), strict=True):
            found.setdefault((a, b), (x, y, z))

    def near(self) -> Array:
        """Pairs of triangles over which surfaces may cross."""
        return self._close(near(*self._boxes))

    def among(self, pairs: Array, parents: Array) -> Array:
        """Those of parts of triangles, given the pairs of these, and which of them each is part of, ascending."""
        ends = np.searchsorted(parents, np.arange(pairs.max() + 2))
        whole = np.arange(pairs.max() + 1)
        pairs = np.concatenate([pairs, np.column_stack([whole, whole])])
        first, counts = ends[pairs], np.diff(ends)[pairs]
        every = counts.prod(axis=1)
        which = np.repeat(np.arange(len(pairs)), every)
        step = np.arange(len(which)) - np.repeat(np.cumsum(every) - every, every)
        one, other = np.divmod(step, counts[which, 1])
        found = np.column_stack([first[which, 0] + one, first[which, 1] + other])
        found = found[(pairs[which, 0] != pairs[which, 1]) | (found[:, 0] < found[:, 1])]
        low, high = self._boxes
        for least, most in zip(low.T, high.T, strict=True):
            a, b = found.T
            found = found[(least[a] <= most[b]) & (least[b] <= most[a])]
        return self._close(found)

    @property
    def _boxes(self) -> tuple[Array, Array]:
        """Those of the surfaces, with the number of the part as a fourth coordinate."""
        part = self.parts[:, None]
        a, b, c = self.spots.swapaxes(0, 1)
        low = np.minimum(np.minimum(a, b), c) - self.off[:, None]
        high = np.maximum(np.maximum(a, b), c) + self.off[:, None]
        return np.concatenate([low, part], axis=1), np.concatenate([high, part], axis=1)

    def _close(self, pairs: Array) -> Array:
        """Those of some pairs that no plane divides, and that are no graph together."""
        shared = _sharing(self.corners, pairs)
        beside, others = pairs[shared], pairs[~shared]
        turn = between(*self.normals[beside.T]) + self.turns[beside].sum(axis=1)
        for one, other in ((0, 1), (1, 0)):
            others = others[~self._divided(others[:, one], others[:, other])]
        return np.concatenate([beside[turn >= _HALF], others])

    def _divided(self, ones: Array, others: Array) -> Array:
        """Whether others lie beyond the plane of a triangle, or beyond one through a side of it."""
        apart = np.zeros(len(ones), bool)
        left = np.arange(len(ones))
        for axes, low, high in self._slabs:
            axis = axes[ones[left]]
            heights = [np.einsum("kj,kj->k", self.spots[others[left], k], axis) for k in range(3)]
            room = self.off[ones[left]] + self.off[others[left]]
            beyond = np.minimum(np.minimum(*heights[:2]), heights[2]) > high[ones[left]] + room
            beyond |= np.maximum(np.maximum(*heights[:2]), heights[2]) < low[ones[left]] - room
            apart[left[beyond]] = True
            left = left[~beyond]
        return apart

    @cached_property
    def _slabs(self) -> list[tuple[Array, Array, Array]]:
        """Directions of each triangle, its normal and those across its sides, and how far it reaches in them."""
        sides = [unit(cross(self.spots[:, (k + 1) % 3] - self.spots[:, k], self.normals)) for k in range(3)]
        found = []
        for axis in (self.normals, *sides):
            a, b, c = np.einsum("kij,kj->ik", self.spots, axis)
            found.append((axis, np.minimum(np.minimum(a, b), c), np.maximum(np.maximum(a, b), c)))
        return found


def _on_nets(model: Model, faces: Array) -> Array:
    """Whether faces are NURBS faces."""
    return np.asarray(np.array([face.surface is not None for face in model.faces], bool)[faces])


def _evaluated(model: Model, faces: Array, uv: Array) -> tuple[Array, Array]:
    """Points ``(s, 3)`` of NURBS faces and their outward normals, of any length."""
    order = np.argsort(faces, kind="stable")
    those, first = np.unique(faces[order], return_index=True)
    points, normals = np.empty((len(uv), 3)), np.empty((len(uv), 3))
    if not len(those):
        return points, normals
    owners = [model.faces[face] for face in those.tolist()]
    places: list[Place] = [
        (model.surfaces[face.surface or 0].net, uv[own], ("right", "right"))
        for face, own in zip(owners, np.split(order, first[1:]), strict=True)
    ]
    sizes = [len(own) for _, own, _ in places]
    turn, shift, sense = (
        np.repeat(each, sizes, axis=0)
        for each in ([f.frame[:3, :3] for f in owners], [f.frame[:3, 3] for f in owners], [f.outward for f in owners])
    )
    found, su, sv = scattered(places, 1)
    points[order] = np.einsum("qij,qj->qi", turn, found) + shift
    normals[order] = sense[:, None] * np.einsum("qij,qj->qi", turn, cross(su, sv))
    return points, normals
