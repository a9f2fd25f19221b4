"""Places on faces, and surfaces evaluated there: what pictures and the points of meshes have in common."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from mracad.model.facets import Ground

Array = np.ndarray

_NUDGE = 1e-4  # share of the way to the middle of the triangles, away from where a surface is degenerate
_THIN = 1e-8  # sine of the angle between S_u and S_v at which it is


@dataclass(frozen=True, eq=False)
class Spots:
    """Places on faces.

    Attributes
    ----------
    face : ndarray of int (q,)
        Indices in ``Model.faces``.
    uv : ndarray (q, 2)
        Parameters on their surfaces.
    point, normal : ndarray (3, q)
        As placed, mm; normals are outward.
    bends : ndarray (2, q)
        Mean and Gaussian curvature, 1/mm and 1/mm²; mean curvature is positive where the face is convex.
    """

    face: Array
    uv: Array
    point: Array
    normal: Array
    bends: Array


def steady(ground: Ground, uv: Array, order: int, inner: Callable[[Array], Array]) -> Array:
    """Points and derivatives at parameters ``(q, 2)``, ``(orders, q, 3)``; where the surface is degenerate, a little
    towards the parameters that ``inner`` gives for some of the places."""
    jet = np.array(ground.jets(uv, order))
    for nudge in (_NUDGE, 100 * _NUDGE):
        su, sv = jet[1].T, jet[2].T
        cut = cross(su, sv)
        flat = np.flatnonzero(~(dot(cut, cut) > _THIN**2 * dot(su, su) * dot(sv, sv)))
        if not len(flat):
            break
        jet[:, flat] = ground.jets(uv[flat] + nudge * (inner(flat) - uv[flat]), order)
    return jet


def shape(jet: Array) -> tuple[Array, Array]:
    """Unit normals ``(3, q)`` and the shape operator, from derivatives ``(6, 3, q)``.

    Of the operator the components 11, 12 and 22 are given, ``(3, q)``, in the frame of S_u / |S_u| and the tangent
    normal to it: do Carmo, *Differential Geometry of Curves and Surfaces*, §3.3.
    """
    _, su, sv, suu, suv, svv = jet
    ee, ff = np.maximum(dot(su, su), 1e-300), dot(su, sv)
    cut = cross(su, sv)
    area2, normal = np.maximum(dot(cut, cut), 1e-300), unit(cut)
    e, f, g = dot(normal, suu), dot(normal, suv), dot(normal, svv)
    skew = ff / ee
    across = 1.0 / np.sqrt(area2)
    return normal, np.stack([e / ee, across * (f - skew * e), ee / area2 * (g - 2.0 * skew * f + skew * skew * e)])


def bends(shape: Array, outward: Array) -> Array:
    """Mean and Gaussian curvature ``(2, q)`` of shape operators, mean curvature positive where faces are convex."""
    a, b, c = shape
    return np.stack([-outward * 0.5 * (a + c), a * c - b * b])


def dot(a: Array, b: Array) -> Array:
    """Scalar products of vectors ``(2 or 3, q)``."""
    return np.asarray(np.einsum("iq,iq->q", a, b))


def cross(a: Array, b: Array) -> Array:
    """Vector products of vectors ``(3, q)``."""
    return np.stack([a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]])


def unit(a: Array) -> Array:
    """Vectors ``(3, q)`` of length 1."""
    return np.asarray(a / np.maximum(np.sqrt(dot(a, a)), 1e-300))
