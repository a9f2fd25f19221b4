"""Faces that have not changed at all: their numbers are compared, and nothing of them needs to be measured twice."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterator
from itertools import zip_longest

import numpy as np

from mracad.bspline.surface import Net
from mracad.inspect.compare.subject import EQUAL, Array
from mracad.model.brep import Edge, Face, Model

_ELEMENTARY = frozenset({"plane", "cylinder", "cone", "sphere", "torus"})
"""Surfaces that their points and normals along a boundary determine."""

_PARAMETERS = 1e-12
"""Share of the domain by which knots and curves in a parameter plane may differ."""

_TURNED = 1e-9
"""Largest difference of unit normals."""


def same(ref: Model, new: Model) -> dict[int, float]:
    """Faces that are those of the reference with the same number, and how far apart they are at most, mm.

    Their edges have the same numbers and points, and their surfaces the same control points, or the same normals along
    these edges.
    """
    slack = EQUAL * ref.diagonal
    uses: dict[int, list[Edge]] = defaultdict(list)
    for edge in ref.edges:
        for face in {side.face for side in edge.sides}:
            uses[face].append(edge)
    count = min(len(ref.edges), len(new.edges))
    off = [_edge(a, b) for a, b in zip(ref.edges[:count], new.edges[:count], strict=True)]
    off += [np.inf] * (len(ref.edges) - count)
    found = {}
    for a, b in zip(ref.faces, new.faces, strict=False):
        if (a.kind, a.reversed, a.surface is None) != (b.kind, b.reversed, b.surface is None):
            continue
        apart = max([_ground(ref, new, a, b), *(off[edge.index] for edge in uses[a.index])])
        if apart <= slack:
            found[a.index] = apart
    return found


def _edge(one: Edge, other: Edge) -> float:
    """How far two edges are apart, with the sides of faces that are not NURBS; infinite for different ones."""
    if [side.face for side in one.sides] != [side.face for side in other.sides]:
        return float("inf")
    far = _apart(one.points, other.points)
    for a, b in zip(one.sides, other.sides, strict=True):
        if a.points is not None and b.points is not None and a.normals is not None and b.normals is not None:
            turned = _apart(a.normals, b.normals)
            far = max(far, _apart(a.points, b.points), 0.0 if turned <= _TURNED else np.inf)
    return far


def _ground(ref: Model, new: Model, one: Face, other: Face) -> float:
    """How far the surfaces under two faces are apart, by their control points; 0 where edges tell."""
    if one.surface is None or other.surface is None:
        return 0.0 if one.kind in _ELEMENTARY else float("inf")
    old, fresh = ref.surfaces[one.surface].net, new.surfaces[other.surface].net
    pairs = zip_longest(_parameters(old, one), _parameters(fresh, other), fillvalue=np.empty(0))
    if any(_apart(a, b) > _PARAMETERS for a, b in pairs):
        return float("inf")
    return _apart(one.placed(old.poles), other.placed(fresh.poles))


def _parameters(net: Net, face: Face) -> Iterator[Array]:
    """The numbers of a NURBS face in its parameter plane, as shares of the domain, and its weights."""
    lengths = np.array([net.u.period, net.v.period])
    for kv in (net.u, net.v):
        yield np.array([kv.degree, kv.periodic, *(kv.knots / kv.period)])
    if net.weights is not None:
        yield net.weights / net.weights.max()
    for trim in face.trims:
        yield trim.curve.poles / lengths
        yield np.array([trim.curve.knots.degree, *(trim.curve.knots.knots / trim.curve.knots.period)])
        if trim.curve.weights is not None:
            yield trim.curve.weights / trim.curve.weights.max()


def _apart(one: Array, other: Array) -> float:
    """The largest difference of numbers; infinite for arrays of different shapes, and where something is undefined."""
    if one.shape != other.shape:
        return float("inf")
    largest = float(np.abs(one - other).max(initial=0.0))
    return largest if largest == largest else float("inf")
