"""Faces along their edges: points, normals and curvatures, seen from inside each face."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from mracad.bspline.knots import Side as Limit
from mracad.bspline.scattered import Place, Scattered, normals, scattered
from mracad.bspline.surface import Net, curvature
from mracad.bspline.vectors import cross
from mracad.model.brep import Edge, Face, Model, Side
from mracad.seam.hold import ISO, local_span

Array = np.ndarray

BLOCK = 50_000
"""Number of samples that are looked at at once: about a kilobyte each."""


def views(model: Model, uses: Sequence[tuple[Edge, Side]]) -> list[Array]:
    """Faces at the samples of edges, evaluated at once.

    Returns
    -------
    list of ndarray (k, 7)
        Points (mm), outward normals and normal curvatures across the edge (1/mm) in the part's frame; NaN where there
        is none.
    """
    found, strips = _still(uses), list(_strips(model, dict(enumerate(uses)), {}))
    ends = np.cumsum([len(strip.place[1]) for strip in strips], dtype=int)
    for block in np.split(np.arange(len(strips)), np.flatnonzero(np.diff(ends // BLOCK)) + 1):
        if len(block):
            for i, table in _seen([strips[k] for k in block], uses):
                found[i] = table
    return found


class Bends:
    """Normal curvatures of faces across edges while surfaces move.

    Parameters
    ----------
    model : Model
    uses : sequence of (Edge, Side)
    nets : mapping of int to Net
        The surfaces that move, over the knots of their displacements, by index.
    still : dict of int to ndarray
        What is known of sides that did not move, by the identity of each; more is added.
    """

    def __init__(
        self, model: Model, uses: Sequence[tuple[Edge, Side]], nets: Mapping[int, Net], still: dict[int, Array]
    ) -> None:
        moving = [side.uv is not None and model.faces[side.face].surface in nets for _, side in uses]
        new = [use for use, moves in zip(uses, moving, strict=True) if not moves and id(use[1]) not in still]
        still |= {id(side): seen[:, 6].copy() for (_, side), seen in zip(new, views(model, new), strict=True)}
        both = zip(uses, moving, strict=True)
        self._found = [np.empty(0) if moves else still[id(side)] for (_, side), moves in both]
        self._strips = list(_strips(model, {i: use for i, use in enumerate(uses) if moving[i]}, nets))
        if self._strips:
            self._functions = Scattered([strip.place for strip in self._strips], 2)
            self._sense = _Sense.of(self._strips, uses)

    def after(self, moved: Mapping[int, Net]) -> list[Array]:
        """Curvatures at the samples of each edge, 1/mm; NaN where there is none.  All surfaces that move are given."""
        found = list(self._found)
        if self._strips:
            _, *derivatives = self._functions.evaluate([moved[strip.surface] for strip in self._strips])
            vectors = self._sense.turned(np.stack(derivatives))
            bends = self._sense.bends(vectors, cross(vectors[0], vectors[1]))
            for i, part in self._sense.divided(bends):
                found[i] = part
        return found


@dataclass(frozen=True, eq=False)
class _Strip:
    """The samples of several edges of one face.

    Attributes
    ----------
    face : Face
    surface : int
    place : Place
        The surface, parameters of the samples of all of them, and limits.
    members : list of int
        Numbers of the edges.
    """

    face: Face
    surface: int
    place: Place
    members: list[int]


def _strips(model: Model, uses: Mapping[int, tuple[Edge, Side]], nets: Mapping[int, Net]) -> Iterator[_Strip]:
    """The samples of edges that lie on surfaces, some of which have other knots than in the model."""
    groups: dict[tuple[int, tuple[Limit, Limit]], list[tuple[int, Array]]] = defaultdict(list)

    def known(surface: int) -> Net:
        return nets[surface] if surface in nets else model.surfaces[surface].net

    for i, (edge, side) in uses.items():
        face = model.faces[side.face]
        if side.uv is not None and face.surface is not None:
            uv, limits = from_inside(face, known(face.surface), edge.index, side.uv)
            groups[side.face, limits].append((i, uv))
    for (number, limits), members in groups.items():
        face = model.faces[number]
        assert face.surface is not None
        place = known(face.surface), np.concatenate([uv for _, uv in members]), limits
        yield _Strip(face, face.surface, place, [i for i, _ in members])


@dataclass(frozen=True, eq=False)
class _Sense:
    """How the samples of strips lie in the part.

    Attributes
    ----------
    members : list of int
        Numbers of the edges, one after another.
    ends : ndarray of int
        Ends of their samples.
    along : ndarray (q, 3)
        Tangents of the edges.
    outward : ndarray (q,)
        1 where normals point outwards, otherwise -1.
    frames : ndarray (q, 4, 4) or (1, 4, 4)
        Places of the faces.
    """

    members: list[int]
    ends: Array
    along: Array
    outward: Array
    frames: Array

    @classmethod
    def of(cls, strips: Sequence[_Strip], uses: Sequence[tuple[Edge, Side]]) -> _Sense:
        """Those of strips of some of the edges."""
        sizes, members = [len(strip.place[1]) for strip in strips], [i for strip in strips for i in strip.members]
        along = [uses[i][0].tangents for i in members]
        frames = np.array([strip.face.frame for strip in strips])
        outward = np.repeat([float(strip.face.outward) for strip in strips], sizes)
        frames = frames[:1] if (frames == frames[0]).all() else np.repeat(frames, sizes, axis=0)
        return cls(members, np.cumsum([len(each) for each in along]), np.concatenate(along), outward, frames)

    def turned(self, vectors: Array) -> Array:
        """Vectors ``(k, q, 3)`` in the part's frame."""
        turn = self.frames[:, :3, :3]
        return vectors @ turn[0].T if len(turn) == 1 else np.asarray(np.einsum("qij,kqj->kqi", turn, vectors))

    def bends(self, derivatives: Array, normal: Array) -> Array:
        """Normal curvatures across the edges, from first and second derivatives and normals of any length."""
        return np.asarray(self.outward * curvature(tuple(derivatives), cross(normal, self.along)))

    def divided(self, figures: Array) -> Iterator[tuple[int, Array]]:
        """The figures of each edge, with its number."""
        return zip(self.members, np.split(figures, self.ends[:-1]), strict=True)


def _still(uses: Sequence[tuple[Edge, Side]]) -> list[Array]:
    """What is known of edges on faces without control points; nothing of others."""
    found = [np.empty((0, 7))] * len(uses)
    for i, (_, side) in enumerate(uses):
        if side.uv is None:
            bends = np.full(len(side.points), np.nan) if side.curvatures is None else side.curvatures  # type: ignore[arg-type]
            found[i] = np.column_stack([side.points, side.normals, bends])  # type: ignore[list-item]
    return found


def _seen(strips: Sequence[_Strip], uses: Sequence[tuple[Edge, Side]]) -> Iterator[tuple[int, Array]]:
    """What is seen at the samples of strips, by the number of the edge."""
    places, sense = [strip.place for strip in strips], _Sense.of(strips, uses)
    stack = scattered(places, 2)
    point, *derivatives, normal = sense.turned(np.stack([*stack, normals(places, *stack[1:3])]))
    bends = sense.bends(np.stack(derivatives), normal)
    point = point + sense.frames[:, :3, 3]
    return sense.divided(np.column_stack([point, sense.outward[:, None] * normal, bends]))


def from_inside(face: Face, net: Net, edge: int, uv: Array) -> tuple[Array, tuple[Limit, Limit]]:
    """Parameters ``uv`` (k, 2) along an edge of a face, moved onto the knot line that it lies on, and the limits there.

    They matter where the surface continues differently beyond the edge.
    """
    found: list[Limit] = ["right", "right"]
    for axis, knots in enumerate((net.u, net.v)):
        at = float(uv[:, axis].mean())
        low, high = knots.domain
        near = 2 * ISO * local_span(knots, at)
        nearest = float(knots.breaks[np.argmin(np.abs(knots.breaks - at))])
        if low < at < high and np.abs(uv[:, axis] - nearest).max() <= near:
            found[axis] = inner_side(face, edge, axis, nearest)
            uv = np.where(np.arange(2) == axis, nearest, uv)
    return uv, (found[0], found[1])


def inner_side(face: Face, edge: int, axis: int, at: float) -> Limit:
    """The side of the line ``at`` on which the rest of the face's boundary lies."""
    others = [trim.curve.poles[:, axis] for trim in face.trims if trim.edge != edge]
    return "right" if others and np.concatenate(others).mean() > at else "left"
