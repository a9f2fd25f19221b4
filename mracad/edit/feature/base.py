"""The surface under a feature: a smooth one through its surroundings.

A *form* is fitted to the points of a ring around the feature, and a thin plate through what the ring lies off it, along
its normals, corrects it.  Forms, from the simplest:

- a plane, or the graph of a polynomial of degree 4;
- a quadric: planes, cylinders, cones and spheres exactly;
- the graph of a polynomial of degree 6;
- a Darboux cyclide, λ|p|⁴ + |p|² (a·p) + q(p) = 0 with a quadric q: tori and Dupin cyclides exactly, too.

Each is fitted to the inner half of the ring and compared with the outer one, and the other way round; a form is taken
if it is nearer there than the simpler ones, and that error is reported.  Algebraic forms f are fitted by min Σ f²
subject to Σ |∇f|² = 1 (Taubin 1991), and f / |∇f| is their distance.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from mracad.bspline.surface import pairs
from mracad.edit.feature.chart import Charts, charts
from mracad.edit.feature.ground import STEEP, Ground, axes
from mracad.edit.feature.locate import Window
from mracad.errors import EditError

Array = np.ndarray

RING = 1.5
"""Outer radius, over that of the feature, of the ring that determines the surface under it."""

BETTER = 1.25
"""How many times nearer to the ring than the simpler ones a form must come."""

SECTORS = 16
"""Number of directions in three quarters of which the ring must be covered."""

PLATE, TRIED = 600, 200
"""Number of points of the ring through which the thin plate passes, and while forms are compared."""

CLOSE, CELLS = 1.2, 64
"""Distance, over the reach, of those taken first, and number of cells, up to there, over which it is tabulated."""

NORMALS = 6
"""Steps to find the foot of a point."""

RIDGE = 1e-14
"""Relative weight of the coefficients of an algebraic form, so that few points give a tame one."""

SPREAD = 48
"""Samples of a patch in each direction around a feature."""


@dataclass(frozen=True, eq=False)
class Form:
    """A surface f(x, y, z) = 0, f a polynomial.

    Attributes
    ----------
    exponents : ndarray (terms, 3) of int
    coefficients : ndarray (terms,)
    """

    exponents: Array
    coefficients: Array

    def distance(self, points: Array) -> tuple[Array, Array]:
        """Distance of points ``(q, 3)`` from the form, f / |∇f|, ``(q,)``, and its gradient there, of length 1."""
        value, slope = _terms(self.exponents, points)
        normal = np.stack([self.coefficients @ each for each in slope], axis=1)
        size = np.maximum(np.linalg.norm(normal, axis=1), 1e-300)
        return np.asarray(self.coefficients @ value / size), normal / size[:, None]


def _terms(exponents: Array, points: Array) -> tuple[Array, list[Array]]:
    """Monomials ``(terms, q)`` at points, and their derivatives by x, y and z."""
    powers = np.ones((exponents.max() + 1, *points.shape))
    for k in range(1, len(powers)):
        powers[k] = powers[k - 1] * points
    own = [powers[exponents[:, k], :, k] for k in range(3)]
    less = [exponents[:, k, None] * powers[np.maximum(exponents[:, k] - 1, 0), :, k] for k in range(3)]
    slope = [less[0] * own[1] * own[2], own[0] * less[1] * own[2], own[0] * own[1] * less[2]]
    return own[0] * own[1] * own[2], slope


def _graph(points: Array, degree: int) -> Form:
    """z − c(x, y) through points, c of a degree."""
    flat = [(i, j, 0) for i, j, k in _exponents(degree) if not k]
    rows = _terms(np.array(flat), points)[0].T
    graph = np.linalg.lstsq(rows, points[:, 2], rcond=None)[0]
    return Form(np.array([*flat, (0, 0, 1)]), np.append(-graph, 1.0))


def _algebraic(points: Array, round_: bool) -> Form:
    """The quadric through points, or the cyclide."""
    from scipy.linalg import eigh

    exponents = np.array(_exponents(4 if round_ else 2))
    mix = _cyclides(exponents) if round_ else np.eye(len(exponents))
    value, slope = _terms(exponents, points)
    rows, ways = value.T @ mix, np.concatenate([each.T @ mix for each in slope])
    off, size = rows.T @ rows, ways.T @ ways
    tame = RIDGE * len(points) * np.eye(len(off))
    found = eigh(off + tame, size + 1e-12 * np.trace(size) / len(size) * np.eye(len(size)))[1][:, 0]
    up = found @ (slope[2].T @ mix).sum(axis=0)
    return Form(exponents, mix @ found * (1.0 if up >= 0 else -1.0))


def _exponents(degree: int) -> list[tuple[int, int, int]]:
    some = range(degree + 1)
    return [(i, j, k) for i in some for j in some for k in some if i + j + k <= degree]


def _cyclides(exponents: Array) -> Array:
    """Columns that combine monomials to the terms of a quadric, |p|² x, |p|² y, |p|² z and |p|⁴."""
    place = {tuple(each): row for row, each in enumerate(exponents.tolist())}
    low = [row for each, row in place.items() if sum(each) <= 2]
    mix = np.zeros((len(exponents), len(low) + 4))
    mix[low, np.arange(len(low))] = 1.0
    double = 2 * np.eye(3, dtype=int)
    for k, one in enumerate(np.eye(3, dtype=int)):
        for square in double:
            mix[place[tuple(one + square)], len(low) + k] = 1.0
            mix[place[tuple(double[k] + square)], -1] += 1.0
    return mix


FORMS: tuple[Callable[[Array], Form], ...] = (
    lambda points: Form(np.array([(0, 0, 1)]), np.ones(1)),
    lambda points: _graph(points, 4),
    lambda points: _algebraic(points, False),
    lambda points: _graph(points, 6),
    lambda points: _algebraic(points, True),
)
"""How each form is fitted to points ``(q, 3)`` around the origin, in units of the reach; the simplest first."""


@dataclass(frozen=True, eq=False)
class Base:
    """The surface under a window.

    Attributes
    ----------
    chart : Charts
        Chart of one place: that of the window, projected onto the base.
    form : Form
        In the axes of the window; all lengths are fractions of the reach.
    rest : scipy.interpolate.RectBivariateSpline
        How far the base lies off the form, along its normals, by place in those axes.
    reach : float
        mm.
    level : float
        Height of the chart's origin over that of the window.
    error : float
        How far the form is off one half of the ring when fitted to the other, root mean square, mm.
    points : ndarray (q, 3)
        Samples of the ground under the window, mm.
    heights : ndarray (q,)
        How high they stand above the base, mm.
    """

    chart: Charts
    form: Form
    rest: Any
    reach: float
    level: float
    error: float
    points: Array
    heights: Array

    def feet(self, local: Array) -> Array:
        """The feet on the base of points ``(q, 3)``, along its normals; both in the chart's axes, mm."""
        at = local / self.reach + [0.0, 0.0, self.level]
        height, foot = np.zeros(len(at)), at
        for _ in range(NORMALS):
            off, slope = _off(self.form, self.rest, foot)
            normal = slope / np.linalg.norm(slope, axis=1, keepdims=True)
            foot = at - height[:, None] * normal
            off, slope = _off(self.form, self.rest, foot)
            height = height + off / np.maximum((slope * normal).sum(axis=1), STEEP)
            foot = at - height[:, None] * normal
        return np.asarray(self.reach * (foot - [0.0, 0.0, self.level]))


def _off(form: Form, rest: Any, points: Array) -> tuple[Array, Array]:
    """Distances of points from the base, and their gradients; lengths are fractions of the reach."""
    off, slope = form.distance(points)
    x, y = points[:, 0], points[:, 1]
    slope[:, 0] -= rest.ev(x, y, dx=1)
    slope[:, 1] -= rest.ev(x, y, dy=1)
    return off - rest.ev(x, y), slope


def under(ground: Ground, window: Window) -> Base:
    """The base under a window.

    Raises
    ------
    EditError
        If there is too little surface around the window.
    """
    from scipy.interpolate import RectBivariateSpline

    reach = window.reach
    frame, local, ring, within = _levelled(ground, window)
    own, inside = local[ring] / reach, local[within] / reach
    fit, error = _best(own, inside)
    form = fit(own)
    side = np.linspace(-CLOSE, CLOSE, CELLS + 1)
    ab = pairs(side, side)
    rest = RectBivariateSpline(side, side, _plate(form, _thinned(own, PLATE))(ab).reshape(CELLS + 1, -1))
    some = ab[np.linalg.norm(ab, axis=1) <= CLOSE][::8]
    points, there = _over(form, rest, np.concatenate([np.zeros((1, 2)), some]), own)
    # the chart's origin is the place on the base, not on the feature
    level = float(points[0, 2])
    origin = window.point + reach * level * frame[2]
    spread = window.point + reach * points[1:] @ frame
    chart = charts(origin[None], frame[None], np.array([CLOSE * reach]), spread[None], there[None, 1:])
    heights = reach * _off(form, rest, inside)[0]
    inner = window.point + local[within] @ frame
    return Base(chart, form, rest, reach, level, error * reach, inner, heights)


def _best(own: Array, inside: Array) -> tuple[Callable[[Array], Form], float]:
    """How to fit the form for points of a ring, and its error there; lengths are fractions of the reach.

    A form above which points inside the ring would stand higher than they can is none.
    """
    radius = np.linalg.norm(own[:, :2], axis=1)
    inner = radius < np.median(radius)
    tallest = _tallest(own, inside)
    best, least = FORMS[0], np.inf
    for fit in FORMS:
        missed = np.concatenate([_missed(fit, own[part], own[~part]) for part in (inner, ~inner)])
        error = float(np.sqrt((missed**2).mean()))
        tame = np.abs(_missed(fit, own, inside)).max(initial=0.0) <= tallest
        if fit is best or (tame and error * BETTER < least):
            best, least = fit, error
    return best, least


def _missed(fit: Callable[[Array], Form], known: Array, asked: Array) -> Array:
    """How far some points ``(q, 3)`` lie off the base through others."""
    some, form = _thinned(known, TRIED), fit(known)
    return np.asarray(form.distance(asked)[0] - _plate(form, some)(asked[:, :2]))


def _tallest(own: Array, inside: Array) -> float:
    """The largest height that a feature can have above points of a ring around it."""
    disc = _graph(own, 2)
    sag = Form(disc.exponents[:-1], disc.coefficients[:-1])
    bent = _terms(sag.exponents, inside)[0].T @ sag.coefficients
    return float(np.ptp(np.concatenate([own, inside])[:, 2]) + np.ptp(bent))


def _plate(form: Form, points: Array) -> Any:
    """The thin plate through the distances of points ``(q, 3)`` from a form, over x and y."""
    from scipy.interpolate import RBFInterpolator

    return RBFInterpolator(points[:, :2], form.distance(points)[0], kernel="thin_plate_spline", degree=1)


def _over(form: Form, rest: Any, ab: Array, own: Array) -> tuple[Array, Array]:
    """The points ``(q, 3)`` of the base over places ``(q, 2)``, and whether they exist."""
    graph = _graph(own, 4)
    points = np.column_stack([ab, np.zeros(len(ab))])
    points[:, 2] = -(_terms(graph.exponents[:-1], points)[0].T @ graph.coefficients[:-1])
    for _ in range(2 * NORMALS):
        off, slope = _off(form, rest, points)
        points[:, 2] -= off / np.maximum(slope[:, 2], STEEP)
    off, slope = _off(form, rest, points)
    return points, (np.abs(off) < 1e-9) & (slope[:, 2] > STEEP)


def _levelled(ground: Ground, window: Window) -> tuple[Array, Array, Array, Array]:
    """Samples around a window in a frame that lies on the ring.

    Returns
    -------
    frame : ndarray (3, 3)
    local : ndarray (q, 3)
        mm.
    ring, within : ndarray of bool (q,)
        Whether they lie in the ring, and inside it.
    """
    feet, reach = window.feet, window.reach
    points, near = (x[0] for x in ground.samples(feet, np.array([RING * reach]), SPREAD)[:2])
    normal = feet.normals[0]
    for _ in range(3):
        frame = axes(normal[None], feet.along)[0]
        local = (points - window.point) @ frame.T
        radius = np.linalg.norm(local[:, :2], axis=1)
        ring = near & (radius > reach) & (radius <= RING * reach)
        angle = np.arctan2(local[ring, 1], local[ring, 0])
        if len(np.unique(np.floor((angle / (2 * np.pi) + 0.5) * SECTORS))) < 0.75 * SECTORS:
            raise EditError(
                f"{window.label}: the feature, {2 * reach:.4g} mm across with its taper, is larger than its face",
                "use a smaller window or a shorter --taper, or select its neighbours as well",
            )
        rows = np.c_[local[ring, :2], np.ones(ring.sum())]
        a, b, _ = np.linalg.lstsq(rows, local[ring, 2], rcond=None)[0]
        normal = frame.T @ (np.array([-a, -b, 1.0]) / np.sqrt(1 + a**2 + b**2))
    frame = axes(normal[None], feet.along)[0]
    return frame, (points - window.point) @ frame.T, ring, near & (radius <= reach)


def _thinned(points: Array, count: int) -> Array:
    """Some of the points ``(q, 3)`` of a ring, the nearest first, each place once."""
    order = np.random.default_rng(0).permutation(len(points))
    far = np.linalg.norm(points[order, :2], axis=1) > CLOSE
    some = points[order[np.argsort(far, kind="stable")][:count]]
    # samples of two faces coincide along their seam
    return some[np.sort(np.unique(some[:, :2].round(9), axis=0, return_index=True)[1])]
