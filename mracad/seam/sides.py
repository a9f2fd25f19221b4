"""Faces along their edges: points, normals and curvatures, seen from inside each face."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Sequence

import numpy as np

from mracad.bspline.knots import Side as Limit
from mracad.bspline.surface import Net, curvature
from mracad.bspline.vectors import cross
from mracad.model.brep import Edge, Face, Model, Side
from mracad.seam.hold import ISO, local_span

Array = np.ndarray


def views(model: Model, uses: Sequence[tuple[Edge, Side]]) -> list[Array]:
    """Faces at the samples of edges; each face is evaluated once for all its edges.

    Parameters
    ----------
    model : Model
    uses : sequence of (Edge, Side)

    Returns
    -------
    list of ndarray (k, 7)
        Points (mm), outward normals and normal curvatures across the edge (1/mm) in the part's frame; NaN where
        there is none.
    """
    result: list[Array] = [np.empty((0, 7))] * len(uses)
    groups: dict[tuple[int, tuple[Limit, Limit]], list[tuple[int, Array]]] = defaultdict(list)
    for i, (edge, side) in enumerate(uses):
        if side.uv is None:
            bends = np.full(len(side.points), np.nan) if side.curvatures is None else side.curvatures  # type: ignore[arg-type]
            result[i] = np.column_stack([side.points, side.normals, bends])  # type: ignore[list-item]
        else:
            face = model.faces[side.face]
            uv, limits = from_inside(face, _net(model, face), edge.index, side.uv)
            groups[side.face, limits].append((i, uv))
    for (number, limits), members in groups.items():
        face = model.faces[number]
        net = _net(model, face)
        uv = np.concatenate([uv for _, uv in members])
        point, su, sv, *second = net.evaluate(uv, 2, limits)
        jets = face.turned(np.stack([point, su, sv, *second, net.normals(uv, limits, (su, sv))]))
        point, *derivatives, normal = jets
        tangents = np.concatenate([uses[i][0].tangents for i, _ in members])
        bends = face.outward * curvature(tuple(derivatives), cross(normal, tangents))
        table = np.column_stack([point + face.frame[:3, 3], face.outward * normal, bends])
        ends = np.cumsum([len(uv) for _, uv in members])[:-1]
        for (i, _), part in zip(members, np.split(table, ends), strict=True):
            result[i] = part
    return result


def _net(model: Model, face: Face) -> Net:
    assert face.surface is not None
    return model.surfaces[face.surface].net


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
