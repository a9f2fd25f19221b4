"""Faces along their edges: points, normals and curvatures, seen from inside each face."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Mapping, Sequence
from functools import cached_property

import numpy as np

from mracad.bspline.knots import Side as Limit
from mracad.bspline.surface import Collocation, Net, curvature
from mracad.bspline.vectors import cross
from mracad.model.brep import Edge, Face, Model, Side
from mracad.seam.hold import ISO, local_span

Array = np.ndarray


def views(model: Model, uses: Sequence[tuple[Edge, Side]]) -> list[Array]:
    """Faces at the samples of edges; see :class:`Looks`."""
    return Looks(model, uses).views()


class Looks:
    """Faces at the samples of edges, before and after their surfaces move.

    Each face is evaluated once for all its edges.

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
            tangents = np.concatenate([uses[i][0].tangents for i, _ in members])
            self._strips.append(_Strip(face, nets[face.surface], limits, members, tangents))

    def views(self, moved: Mapping[int, Net] | None = None) -> list[Array]:
        """What is seen after some surfaces have moved, given over the same knots, by index.

        Returns
        -------
        list of ndarray (k, 7)
            Points (mm), outward normals and normal curvatures across the edge (1/mm) in the part's frame; NaN where
            there is none.
        """
        found = list(self._still)
        for strip in self._strips:
            net = (moved or {}).get(strip.surface)
            for i, part in zip(strip.members, strip.before if net is None else strip.seen(net), strict=True):
                found[i] = part
        return found


class _Strip:
    """The samples of several edges of one face."""

    def __init__(
        self, face: Face, net: Net, limits: tuple[Limit, Limit], members: list[tuple[int, Array]], tangents: Array
    ) -> None:
        assert face.surface is not None
        self.face, self.surface, self.net, self.limits = face, face.surface, net, limits
        self.members, self.tangents = [i for i, _ in members], tangents
        self.uv = np.concatenate([uv for _, uv in members])
        self.ends = np.cumsum([len(uv) for _, uv in members])[:-1]
        self.functions = Collocation.of(net.u, net.v, self.uv, 2, limits)

    @cached_property
    def before(self) -> list[Array]:
        """What is seen before the surface moves, by edge."""
        return self.seen(self.net)

    def seen(self, net: Net) -> list[Array]:
        """What is seen on a net over the same knots, by edge."""
        face, (point, su, sv, *second) = self.face, self.functions.evaluate(net)
        jets = face.turned(np.stack([point, su, sv, *second, net.normals(self.uv, self.limits, (su, sv))]))
        point, *derivatives, normal = jets
        bends = face.outward * curvature(tuple(derivatives), cross(normal, self.tangents))
        table = np.column_stack([point + face.frame[:3, 3], face.outward * normal, bends])
        return np.split(table, self.ends)


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
