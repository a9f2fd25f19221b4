"""Directions by name: which parameter of a surface grows along them."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from mracad.bspline.vectors import cross
from mracad.errors import UsageError
from mracad.model.brep import Face, Model
from mracad.model.region import covered
from mracad.spec.places import AXES, whole

Array = np.ndarray

ASKEW = math.radians(30.0)
"""Largest mean angle between a direction and the parameter lines that follow it."""

UPRIGHT = 0.5
"""Smallest mean share of a direction that must lie in a surface."""


def lead(model: Model, faces: Sequence[Face], along: str | None) -> int | None:
    """The parameter of a surface that grows along a direction: 0 for u, 1 for v; None if neither does.

    Parameters
    ----------
    model : Model
    faces : sequence of Face
        Faces on the surface.
    along : str, optional
        ``x``, ``y``, ``z``, ``u``, ``v`` or ``edge#4``; by default the parameter along which the faces are longer.

    Raises
    ------
    UsageError
        For an edge that the model does not have.
    """
    if along in ("u", "v"):
        return "uv".index(along)
    surface = faces[0].surface
    assert surface is not None
    net = model.surfaces[surface].net
    us, vs = ((knots.breaks[1:] + knots.breaks[:-1]) / 2 for knots in (net.u, net.v))
    inside = np.logical_or.reduce([covered(net, face) for face in faces])
    points = faces[0].placed(np.asarray(net.grid(us, vs)))
    if along is None:
        return int(_extent(points, inside, 1) > _extent(points, inside, 0))
    tangents = [faces[0].turned(net.tangents(us, vs, axis)) for axis in (0, 1)]
    normals = cross(*tangents)
    areas = np.linalg.norm(normals, axis=-1)
    normals /= np.maximum(areas, 1e-300)[..., None]
    areas = areas * inside * np.multiply.outer(*(np.diff(knots.breaks) for knots in (net.u, net.v)))
    wanted = _wanted(model, along, points)
    wanted = wanted - (wanted * normals).sum(axis=-1, keepdims=True) * normals
    lying = float((areas * np.linalg.norm(wanted, axis=-1)).sum())
    if lying <= UPRIGHT * areas.sum():
        return None
    found = []
    for each in tangents:
        unit = each / np.maximum(np.linalg.norm(each, axis=-1, keepdims=True), 1e-300)
        found.append(float((areas * np.abs((unit * wanted).sum(axis=-1))).sum()) / lying)
    return int(np.argmax(found)) if max(found) >= math.cos(ASKEW) else None


def _wanted(model: Model, along: str, points: Array) -> Array:
    """Unit vectors of a direction at points ``(nu, nv, 3)``: for an edge, its tangent at the nearest point."""
    from scipy.spatial import KDTree

    if along in AXES:
        return np.broadcast_to(np.array(AXES[along][3:]), points.shape)
    number = whole(along.removeprefix("edge#")) or 0
    if not 1 <= number <= len(model.edges):
        raise UsageError(f"along: {along!r}: the model has edges #1 to #{len(model.edges)}", "see mracad info --all")
    edge = model.edges[number - 1]
    if edge.degenerate:
        raise UsageError(f"along: {along!r} is a point", "name another edge")
    return np.asarray(edge.tangents[KDTree(edge.points).query(points)[1]])


def _extent(points: Array, inside: Array, axis: int) -> float:
    """Mean length of the parts of parameter lines along an axis that lie inside faces, mm."""
    lines, seen = (np.moveaxis(each, axis, 0) for each in (points, inside))
    low, high = (
        how(np.where(seen[..., None], lines, far), axis=0) for how, far in ((np.min, np.inf), (np.max, -np.inf))
    )
    every = seen.any(axis=0)
    return float(np.linalg.norm((high - low)[every], axis=-1).mean()) if every.any() else 0.0
