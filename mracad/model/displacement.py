"""The displacement of a model by an edit: offsets of the control points of its surfaces."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass, field, replace

import numpy as np

from mracad.brief import line
from mracad.bspline.closest import feet
from mracad.bspline.surface import Net
from mracad.bspline.vectors import cross, unit
from mracad.model.brep import Edge, Face, Model, Side
from mracad.model.sampling import shares

Array = np.ndarray


@dataclass(frozen=True, eq=False)
class Offset:
    """Offsets of the control points of one surface, in its own spline space or a larger one (higher degree, more
    knots).

    Attributes
    ----------
    poles : ndarray (nu, nv, 3)
        Offsets of the Euclidean control points of the net from ``over``, mm; weights are kept.
        Control points with a zero offset stay bit-identical.
    u_knots, v_knots : ndarray
        Knots to insert first (with repetition), beyond those the (elevated) surface has; empty for none.
    degrees : (int, int)
        Degrees in u and v to which the surface is elevated before that, unless its own are higher.
    """

    poles: Array
    u_knots: Array = field(default_factory=lambda: np.empty(0))
    v_knots: Array = field(default_factory=lambda: np.empty(0))
    degrees: tuple[int, int] = (0, 0)

    __repr__ = line

    @classmethod
    def of(cls, own: Net, fine: Net, poles: Array) -> Offset:
        """Offsets of the control points of a finer net of a surface."""
        degrees = (fine.u.degree, fine.v.degree)
        u, v = (
            kv.beyond(old.elevated(degree))
            for kv, old, degree in zip((fine.u, fine.v), (own.u, own.v), degrees, strict=True)
        )
        return cls(poles, u, v, degrees)

    def over(self, net: Net) -> Net:
        """The net of the undisplaced surface whose control points the offset moves; ``net`` itself where it does."""
        u, v = (kv.elevated(degree) for kv, degree in zip((net.u, net.v), self.degrees, strict=True))
        return net.over(u.refined(self.u_knots), v.refined(self.v_knots))

    def motion(self, net: Net) -> Net:
        """The displacement of a surface as a net of its own."""
        return self.over(net).with_poles(self.poles)


@dataclass(frozen=True, eq=False)
class Displacement:
    """The result of an edit: offsets of control points by surface index.  Surfaces without an entry do not move.

    Attributes
    ----------
    offsets : dict of int to Offset
    slid : dict of int to int
        Edges that slid along a neighbour that stays, with their face that moved.
    """

    offsets: dict[int, Offset] = field(default_factory=dict)
    slid: dict[int, int] = field(default_factory=dict)

    __repr__ = line

    def scaled(self, factor: float) -> Displacement:
        """The displacement multiplied by ``factor``."""
        return Displacement({i: replace(o, poles=factor * o.poles) for i, o in self.offsets.items()}, self.slid)

    def around(self, model: Model) -> set[int]:
        """The faces that meet edges that slid, at their ends too."""
        ends = model.rails.ends
        met = {vertex for edge in self.slid for vertex in ends[edge]}
        edges = (edge for edge in model.edges if met and not met.isdisjoint(ends[edge.index]))
        return {side.face for edge in edges for side in edge.sides}

    def slid_at(self, model: Model, faces: Collection[int]) -> set[int]:
        """The edges that slid and meet some faces; all that slid if no face is known (−1)."""
        known = {face for face in faces if face >= 0}
        if not self.slid or not known:
            return set(self.slid)
        ends = model.rails.ends
        edges = (edge for edge in model.edges if any(side.face in known for side in edge.sides))
        met = {vertex for edge in edges for vertex in ends[edge.index]}
        return {edge for edge in self.slid if not met.isdisjoint(ends[edge])}

    def applied(self, model: Model) -> Model:
        """The model with its surfaces displaced, and edges that slid (other sides with fixed points stay as they
        are)."""
        surfaces = list(model.surfaces)
        for index, offset in self.offsets.items():
            net = offset.over(surfaces[index].net)
            surfaces[index] = replace(surfaces[index], net=net.with_poles(net.poles + offset.poles))
        moved = model.with_surfaces(surfaces)
        if not self.slid:
            return moved
        edges = [_slid(moved, e, moved.faces[self.slid[e.index]]) if e.index in self.slid else e for e in model.edges]
        return replace(moved, edges=tuple(edges))


def lifted(own: Net, fine: Net, offset: Array) -> Array:
    """Offsets of the control points of a net as those of a finer one of the same surface."""
    return offset if fine is own else own.with_poles(offset).over(fine.u, fine.v).poles


def _slid(model: Model, edge: Edge, face: Face) -> Edge:
    """An edge moved onto its face that moved, with the nearest points of its neighbour."""
    assert face.surface is not None
    trim = face.trim(edge.index)
    first, last = trim.curve.knots.domain
    uv, way = trim.curve.evaluate(first + (last - first) * shares(len(edge.points)), 1)
    points, su, sv = model.surfaces[face.surface].net.evaluate(uv, 1)
    points, tangents = face.placed(points), face.turned(unit(su * way[:, :1] + sv * way[:, 1:]))
    sides = tuple(side if side.face == face.index else _beside(model, side, points, tangents) for side in edge.sides)
    return replace(edge, points=points, tangents=tangents, sides=sides)


def _beside(model: Model, side: Side, points: Array, tangents: Array) -> Side:
    """The side of a face that stays, at its points nearest to an edge."""
    face = model.faces[side.face]
    if face.surface is not None:
        assert side.uv is not None
        return replace(side, uv=feet(model.surfaces[face.surface].net, face.local(points), side.uv)[0])
    ground = model.rails.grounds[face.index]
    foot, normals = ground.feet(points)
    return replace(side, points=foot, normals=normals, curvatures=ground.bends(foot, cross(normals, tangents)))
