"""The metric of control points, in which each has the same weight, and noise on them is white.

    x = argmin Σ w |x − f|² + Σ λ_u |D_u x|² + λ_v |D_v x|²

D are third derivatives along u and v as differences of control points (:mod:`mracad.bspline.differences`), scaled so
that on even knots they are plain differences of neighbours: a wave of Λ control points keeps
1 / (1 + λ (2 sin π/Λ)⁶).  Knots inserted into a surface have no effect: w and the differences depend on the spacing of
its own points.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from mracad.bspline.differences import differences, divided
from mracad.bspline.knots import KnotVector
from mracad.bspline.surface import Net
from mracad.seam.energy import Forms
from mracad.seam.ladders import Creases
from mracad.seam.solve import Problem, Soft, Space

Array = np.ndarray

ORDER = 3
"""Order of the differences."""


@dataclass(frozen=True, eq=False)
class White:
    """Forms of one surface in the metric of its control points, in row-major order.

    Attributes
    ----------
    mass : ndarray (points,)
        w; 0 for control points on which its faces do not depend.
    along : pair of csr_array (points, points)
        DᵀD in u and v.
    """

    mass: Array
    along: tuple[Any, Any]


def white(net: Net, origin: Net, points: Array, creases: Creases, order: int = ORDER) -> White:
    """The forms of a surface.

    Parameters
    ----------
    net, origin : Net
        The surface over the knots on which it is solved, and over its own.
    points : ndarray of bool (nu, nv)
        Control points of ``net`` that count.
    creases : pair of frozenset of float
        Lines in u and v that differences do not cross.
    order : int
        Order of the differences.
    """
    both = (net.u, origin.u), (net.v, origin.v)
    mass = np.multiply.outer(*(_spacing(knots.greville(), own.greville()) for knots, own in both)) * points
    along = [_energy(bends(*each, creases[axis], order), points, axis) for axis, each in enumerate(both)]
    return White(mass.ravel(), (along[0], along[1]))


def bends(knots: KnotVector, own: KnotVector, creases: frozenset[float] = frozenset(), order: int = ORDER) -> Array:
    """The differences along one direction, ``(rows, n)``: see the module.

    Parameters
    ----------
    knots, own : KnotVector
        Knots with inserted ones, and without.
    creases : frozenset of float
    order : int
    """
    weights, columns = (divided if knots.degree > own.degree else differences)(knots, order)
    matrix = np.zeros((len(weights), knots.count))
    if not len(weights):
        return matrix
    at = knots.greville()[columns]
    at = np.unwrap(at, period=knots.period, axis=1) if knots.periodic else at
    middle, step = at.mean(axis=1), np.diff(at, axis=1).mean(axis=1)
    spacing = _local(own, middle) if own.count > 1 else step
    with np.errstate(divide="ignore", invalid="ignore"):
        weights = weights * ((spacing / step) ** (order - 0.5))[:, None]
    crossed = np.any([(at[:, 0] < c) & (c < at[:, -1]) for c in creases] or [np.zeros(len(at), bool)], axis=0)
    rows = np.flatnonzero(np.isfinite(weights).all(axis=1) & ~crossed)
    np.add.at(matrix, (np.arange(len(rows))[:, None], columns[rows]), weights[rows])
    return matrix[: len(rows)]


def _local(knots: KnotVector, at: Array) -> Array:
    """Spacing of the Greville points of a knot vector about places."""
    g = knots.greville()
    if not knots.periodic:
        return np.asarray(np.interp(at, g, np.gradient(g)))
    g = np.sort(g)
    around = np.concatenate([g[-1:] - knots.period, g, g[:1] + knots.period])
    return np.asarray(np.interp(at, g, (around[2:] - around[:-2]) / 2, period=knots.period))


def _spacing(g: Array, own: Array) -> Array:
    """Spacing of Greville points over that of others near them."""
    if len(g) < 2 or len(own) < 2:
        return np.ones(len(g))
    return np.asarray(np.gradient(g) / np.maximum(np.interp(g, own, np.gradient(own)), 1e-300))


def _energy(matrix: Array, points: Array, axis: int) -> Any:
    """DᵀD for all lines of a net along an axis, of the differences that only involve ``points``."""
    from scipy.sparse import csr_array, eye_array, kron

    used = np.abs(matrix) > 0
    here = points if axis == 0 else points.T
    whole = (used @ ~here) == 0
    single = csr_array(matrix), eye_array(here.shape[1])
    every = kron(*(single if axis == 0 else single[::-1]), format="csr")
    rows = every[np.flatnonzero((whole if axis == 0 else whole.T).ravel())]
    return (rows.T @ rows).tocsr()


@dataclass(frozen=True, eq=False)
class Whitened:
    """A problem in the metric of control points.

    Attributes
    ----------
    problem : Problem
        The problem in the metric of the surfaces.
    forms : mapping of int to White
    precision : ndarray (points, 1)
        Factors on w: control points with less noise have more weight.
    scale : mapping of int to float
        Factors on λ: those of the noisy control points of each surface.
    noisy : ndarray of bool (points,)
        Control points with noise; all others stay.
    """

    problem: Problem
    forms: Mapping[int, White]
    precision: Array
    scale: Mapping[int, float]
    noisy: Array

    @cached_property
    def weights(self) -> Array:
        """w of all control points, ``(points, 1)``."""
        return np.concatenate([form.mass for form in self.forms.values()])[:, None]

    @cached_property
    def seen(self) -> Array:
        """Control points that count, ``(points,)``."""
        return np.asarray((self.weights[:, 0] > 0) & self.noisy)

    def at(self, stiffness: Mapping[int, tuple[float, float]]) -> Problem:
        """The problem with λ along u and v for each surface; joints stay as they are."""
        from scipy.sparse import csr_array, diags_array

        spaces: dict[int, Space] = {}
        parts = (self.problem.split(each).values() for each in (self.precision, self.seen[:, None]))
        for (i, space), precision, seen in zip(self.problem.spaces.items(), *parts, strict=True):
            form, (lu, lv) = self.forms[i], stiffness[i]
            mass = diags_array(precision.ravel() * form.mass).tocsr()
            bending = self.scale[i] * (lu * form.along[0] + lv * form.along[1])
            forms = Forms(mass, bending.tocsr(), csr_array(mass.shape))
            points = seen[..., 0]
            spaces[i] = replace(space, forms=forms, free=space.free & points, seen=points, trend=None)
        old = self.problem
        area = float(old.mass.diagonal().sum() / max(self.seen.sum(), 1))
        soft, between = (None if each is None else each / area for each in (old.soft, old.between))
        return Problem(spaces, old.rows, None, Soft(soft, between=between), old.effort)
