"""Faces along their edges: points, normals and curvatures, seen from inside each face."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from mracad.bspline.knots import Side as Limit
from mracad.bspline.scattered import normals, scattered
from mracad.bspline.surface import Net, curvature
from mracad.bspline.vectors import cross
from mracad.model.brep import Edge, Face, Model, Side
from mracad.seam.hold import ISO, local_span

Array = np.ndarray

BLOCK = 50_000
"""Number of samples that are looked at at once: about a kilobyte each."""


def views(model: Model, uses: Sequence[tuple[Edge, Side]]) -> list[Array]:
    """Faces at the samples of edges; see :class:`Looks`."""
    return Looks(model, uses).views()


class Looks:
    """Faces at the samples of edges, before and after their surfaces move.

    Faces are evaluated at once.

    Parameters
    ----------
    model : Model
    uses : sequence of (Edge, Side)
    nets : mapping of int to Net, optional
        Surfaces over other knots than in the model, by index.
    """

    def __init__(self, model: Model, uses: Sequence[tuple[Edge, Side]], nets: Mapping[int, Net] | None = None) -> None:
        self._still: list[Array] = [np.empty((0, 7))] * len(uses)
        groups: dict[tuple[int, tuple[Limit, Limit]], list[tuple[int, Array]]] = defaultdict(list)
        nets = {surface.index: surface.net for surface in model.surfaces} | dict(nets or {})
        for i, (edge, side) in enumerate(uses):
            if side.uv is None:
                bends = np.full(len(side.points), np.nan) if side.curvatures is None else side.curvatures  # type: ignore[arg-type]
                self._still[i] = np.column_stack([side.points, side.normals, bends])  # type: ignore[list-item]
            else:
                face = model.faces[side.face]
                assert face.surface is not None
                uv, limits = from_inside(face, nets[face.surface], edge.index, side.uv)
                groups[side.face, limits].append((i, uv))
        self._strips = []
        for (number, limits), members in groups.items():
            face = model.faces[number]
            assert face.surface is not None
            uv = np.concatenate([each for _, each in members])
            self._strips.append(_Strip(face, face.surface, nets[face.surface], limits, [i for i, _ in members], uv))
        self._along = [edge.tangents for edge, _ in uses]

    def views(self, moved: Mapping[int, Net] | None = None) -> list[Array]:
        """What is seen after some surfaces have moved, given over the same knots, by index.

        Returns
        -------
        list of ndarray (k, 7)
            Points (mm), outward normals and normal curvatures across the edge (1/mm) in the part's frame; NaN where
            there is none.
        """
        found = list(self._before)
        if moved:
            now = [replace(each, net=moved[each.surface]) for each in self._strips if each.surface in moved]
            for i, part in self._seen(now):
                found[i] = part
        return found

    @cached_property
    def _before(self) -> list[Array]:
        found = list(self._still)
        for i, part in self._seen(self._strips):
            found[i] = part
        return found

    def _seen(self, strips: Sequence[_Strip]) -> Iterator[tuple[int, Array]]:
        """What is seen at the samples of strips, by the number of the edge."""
        ends = np.cumsum([len(strip.uv) for strip in strips], dtype=int)
        for block in np.split(np.arange(len(strips)), np.flatnonzero(np.diff(ends // BLOCK)) + 1):
            if len(block):
                yield from self._at_once([strips[k] for k in block])

    def _at_once(self, strips: Sequence[_Strip]) -> Iterator[tuple[int, Array]]:
        sizes, members = [len(strip.uv) for strip in strips], [i for strip in strips for i in strip.members]
        places = [(strip.net, strip.uv, strip.limits) for strip in strips]
        stack = scattered(places, 2)
        frames = np.array([strip.face.frame for strip in strips])
        outward = np.repeat([float(strip.face.outward) for strip in strips], sizes)
        vectors: Array = np.stack([*stack, normals(places, *stack[1:3])])
        if (frames == frames[0]).all():
            vectors = vectors @ frames[0, :3, :3].T
        else:
            vectors = np.einsum("qij,kqj->kqi", np.repeat(frames[:, :3, :3], sizes, axis=0), vectors)
        point, *derivatives, normal = vectors
        along = [self._along[i] for i in members]
        bends = outward * curvature(tuple(derivatives), cross(normal, np.concatenate(along)))
        table = np.column_stack([point + np.repeat(frames[:, :3, 3], sizes, axis=0), outward[:, None] * normal, bends])
        yield from zip(members, np.split(table, np.cumsum([len(each) for each in along])[:-1]), strict=True)


@dataclass(frozen=True, eq=False)
class _Strip:
    """The samples of several edges of one face.

    Attributes
    ----------
    face : Face
    surface : int
    net : Net
    limits : pair of {"right", "left"}
    members : list of int
        Numbers of the edges.
    uv : ndarray (q, 2)
        Parameters of the samples of all of them.
    """

    face: Face
    surface: int
    net: Net
    limits: tuple[Limit, Limit]
    members: list[int]
    uv: Array


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
