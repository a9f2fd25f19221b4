"""Which edges can slide along a neighbour that stays, and what holds their ends."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Collection, Iterable, Mapping

import numpy as np

from mracad.bspline.vectors import cross
from mracad.model.brep import Edge, Face, Model, Side, Trim
from mracad.model.rails import Path
from mracad.seam.cause import Cause, Still
from mracad.seam.guide import Freeform, Pin, Slide
from mracad.seam.sides import views
from mracad.seam.space import end
from mracad.seam.trace import trace_of

Array = np.ndarray

STEEP = 10.0
"""Least angle (°) between the two faces of an edge that slides: along a flatter neighbour it would slide far."""


def slides(
    model: Model, frozen: Mapping[int, Cause], pairs: Iterable[tuple[int, int, int]], movable: Collection[int]
) -> tuple[Slide, ...]:
    """The edges that can slide.

    Parameters
    ----------
    model : Model
    frozen : mapping of int to Cause
        Edges that may slide, and why they stay if they cannot.
    pairs : iterable of (int, int, int)
        Edges that move, with the two surfaces that they join (free edges: the same one twice).
    movable : collection of int
        Faces that move.
    """
    found = [
        (model.edges[edge], cause, sides)
        for edge, cause in frozen.items()
        if edge in model.rails.ends and (sides := _sides(model, model.edges[edge], cause, movable))
    ]
    looks = views(model, [(edge, side) for edge, _, sides in found for side in sides])
    steep = [
        each
        for each, a, b in zip(found, looks[::2], looks[1::2], strict=True)
        if np.linalg.norm(cross(a[:, 3:6], b[:, 3:6]), axis=1).min() >= np.sin(np.radians(STEEP))
    ]
    meets = _Meets(model, {edge.index: sides[0].face for edge, _, sides in steep}, list(pairs))
    return tuple(_slide(model, edge, cause, sides, meets) for edge, cause, sides in steep)


def _sides(model: Model, edge: Edge, cause: Cause, movable: Collection[int]) -> tuple[Side, Side] | None:
    """The side of an edge that moves and the one that stays, if the edge can slide along the latter."""
    if cause.still not in (Still.ANALYTIC, Still.NEIGHBOUR) or len(edge.sides) != 2 or edge.closing:
        return None
    moving = [side.face in movable for side in edge.sides]
    if sum(moving) != 1:
        return None
    moves, stays = edge.sides[:: 1 if moving[0] else -1]
    return (moves, stays) if stays.face in model.rails.grounds or _roomy(model, edge, stays, movable) else None


def _roomy(model: Model, edge: Edge, side: Side, movable: Collection[int]) -> bool:
    """Whether a NURBS face stays with its whole surface, which goes on beyond an edge."""
    face = model.faces[side.face]
    if face.surface is None:
        return False
    surface = model.surfaces[face.surface]
    trim = face.trim(edge.index)
    return end(surface.net, trim) is None and not any(each in movable for each in surface.faces)


def _slide(model: Model, edge: Edge, cause: Cause, sides: tuple[Side, Side], meets: _Meets) -> Slide:
    face, stays = (model.faces[side.face] for side in sides)
    trim = face.trim(edge.index)
    assert face.surface is not None
    ground = model.rails.grounds.get(stays.index) or _sheet(model, stays, sides[1])
    border = end(model.surfaces[face.surface].net, trim)
    return Slide(
        edge.index, stays.index, trace_of(model, face, trim), border, ground, meets.pins(edge, face, trim), cause
    )


def _sheet(model: Model, face: Face, side: Side) -> Freeform:
    assert face.surface is not None and side.uv is not None
    return Freeform(model.surfaces[face.surface].net, face, side.uv)


class _Meets:
    """The edges that meet at each vertex.

    Parameters
    ----------
    model : Model
    sliding : mapping of int to int
        Edges that slide, with their face that moves.
    pairs : sequence of (int, int, int)
        Other edges that move, and their surfaces.
    """

    def __init__(self, model: Model, sliding: Mapping[int, int], pairs: Collection[tuple[int, int, int]]) -> None:
        self.model, self.sliding = model, sliding
        self.joined = {edge: (a, b) for edge, a, b in pairs}
        self.at: dict[int, set[int]] = defaultdict(set)
        for index, vertices in model.rails.ends.items():
            if not model.edges[index].degenerate:
                for vertex in vertices:
                    self.at[vertex].add(index)

    def pins(self, edge: Edge, face: Face, trim: Trim) -> tuple[Pin, ...]:
        """The ends of an edge that slides, without those that just follow the faces."""
        found = []
        uv = trim.curve.evaluate(np.array(trim.curve.knots.domain))[0]
        for place, vertex in zip(uv, self.model.rails.ends[edge.index], strict=True):
            free, path = self._end(vertex, edge, face)
            if not free:
                found.append(Pin(place, path))
        return tuple(found)

    def _end(self, vertex: int, edge: Edge, face: Face) -> tuple[bool, Path | None]:
        """Whether all edges at a vertex move, and else the edge along which it moves."""
        others = self.at[vertex]
        stays = others - self.sliding.keys() - self.joined.keys()
        joined: list[set[int | None]] = [set(self.joined[each]) for each in others & self.joined.keys()]
        joined += [{self.model.faces[self.sliding[each]].surface} for each in others & self.sliding.keys()]
        together: set[int | None] = {face.surface}
        for _ in joined:
            together = together.union(*(each for each in joined if together & each))
        if not all(each <= together for each in joined):  # surfaces that do not move together meet there
            return False, None
        path = self.model.rails.paths.get(next(iter(stays))) if len(stays) == 1 else None
        return not stays, path
