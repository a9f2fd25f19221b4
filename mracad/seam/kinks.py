"""Energy of kinks of displacements on the knot lines of a surface where second derivatives do not measure them."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from mracad.bspline.basis import jet
from mracad.bspline.knots import KnotVector, Side
from mracad.bspline.surface import Net
from mracad.memo import kept
from mracad.model.cells import Quadrature
from mracad.seam.integrals import inner, sites, sparse
from mracad.seam.stretch import Stretch

Array = np.ndarray

KINK_WEIGHT = 1e3
"""Weight of squared kinks on knot lines against squared curvature."""

FLATTEST = 1e-4
"""Least ratio of the metric's singular values: where it is smaller (at poles), the shorter direction is floored."""


def kinks(
    net: Net, metric: Net, quadrature: Quadrature, creases: Sequence[Collection[float]], stretch: Stretch
) -> tuple[Any, Any]:
    """Energies of kinks on knot lines of full multiplicity; those of creases separately."""
    found = [_nothing(net.u.count * net.v.count)] * 2
    for axis in (0, 1):
        full = (net.u, net.v)[axis].full
        for sharp in (False, True):
            lines = [t for t in full if (t in creases[axis]) == sharp]
            if lines:
                kink = _kink(net, metric, quadrature, axis, np.array(lines))
                found[sharp] = found[sharp] + stretch.lengths[axis] ** 4 * kink
    return found[0], found[1]


@kept(16)
def _nothing(n: int) -> Any:
    from scipy.sparse import csr_array

    return csr_array((n, n))


def _kink(net: Net, metric: Net, quadrature: Quadrature, axis: int, lines: Array) -> Any:
    """``10³ ∫ [∂_n x]² / h`` on some knot lines of one direction.

    On a line, with N_a and M_b the functions across and along it, the kink of w_ab N_a M_b / w is a sum of three
    products of a number and a function along the line for each of its sides,

        w_ab Σ ± (N_a' · M_b + N_a · (f / g · w_t − w_n) / w · M_b − N_a · f / g · M_b') / (w |X_n|),

    so that the form is a sum of products of numbers and integrals along the line.
    """
    knots, along = (net.u, net.v)[:: 1 - 2 * axis]
    at, weight = ((quadrature.v, quadrature.wv), (quadrature.u, quadrature.wu))[axis]
    where = sites(along, at, weight)
    low, high = _sides(net, metric, axis, lines, where.at.ravel())
    breaks = _onwards(knots)
    near = np.searchsorted(breaks, lines)
    before, after = ((breaks[near + k + 1] - breaks[near + k])[:, None] for k in (-1, 0))
    step = 0.5 * (before * low.height + after * high.height)
    share = KINK_WEIGHT * high.length * where.weight.ravel() / step
    root = np.sqrt(np.where(_crossed(quadrature, axis, knots, lines), share, 0.0))
    start, numbers = _window(knots, (low, high))
    terms = [
        (number[r], order, sign * root * part)
        for side, number, sign in zip((low, high), numbers, (-1.0, 1.0), strict=True)
        for r, order, part in side.parts
    ]
    width, n, wide = numbers.shape[3], along.count, 2 * along.degree + 1
    outer = np.stack([x[:, :, None] * y[:, None] for x, _, _ in terms for y, _, _ in terms], axis=1)
    groups = [[(i, j, (a * b).T)] for _, i, a in terms for _, j, b in terms]
    products = inner(where, groups, [False] * len(groups))
    places = (start[:, None] + np.arange(width)) % knots.count
    rows, place = np.unique(places, return_inverse=True)
    form = np.zeros((len(rows), n, 2 * width - 1, wide))
    for mine, numbers_, each in zip(place.reshape(places.shape), outer, products, strict=True):
        block = (numbers_.reshape(len(groups), -1).T @ each).reshape(width, width, n, wide)
        for k, row in enumerate(mine):
            form[row, :, width - 1 - k : 2 * width - 1 - k] += block[k].swapaxes(0, 1)
    every = np.arange(n)
    if axis:
        return sparse([form.transpose(1, 0, 3, 2)], net, (every, rows))[0]
    return sparse([form], net, (rows, every))[0]


def _onwards(knots: KnotVector) -> Array:
    """The breaks; in a periodic direction also the first one of the next turn."""
    return np.append(knots.breaks, knots.breaks[1] + knots.period) if knots.periodic else knots.breaks


def _crossed(quadrature: Quadrature, axis: int, knots: KnotVector, lines: Array) -> Array:
    """Gauss points along knot lines with a face on both sides, ``(lines, points)``."""
    across = (quadrature.u, quadrature.v)[axis]
    mask = quadrature.mask if axis == 0 else quadrature.mask.T
    breaks, after = _onwards(knots), across.ravel()[0] + knots.period if knots.periodic else np.inf
    points = np.concatenate([[-np.inf], across.ravel(), [after]])
    above, near = np.searchsorted(points, lines), np.searchsorted(breaks, lines)
    beside = (points[above - 1] > breaks[near - 1]) & (points[above] < breaks[near + 1])
    mask = np.concatenate([np.zeros_like(mask[:1]), mask, mask[:1] if knots.periodic else np.zeros_like(mask[:1])])
    return np.asarray(mask[above - 1] & mask[above] & beside[:, None])


@dataclass(frozen=True, eq=False)
class _Side:
    """One side of lines.

    Attributes
    ----------
    first : ndarray (lines,) of int
        First function across each line.
    values : ndarray (lines, 2, d + 1)
        Functions across it and their derivatives.
    height, length : ndarray (lines, points)
        Lengths per parameter across and along it.
    parts : list of (int, int, ndarray (lines, points))
        The derivative across the lines by length: coefficients of products of functions, by the orders across and
        along.
    """

    first: Array
    values: Array
    height: Array
    length: Array
    parts: list[tuple[int, int, Array]]


def _sides(net: Net, metric: Net, axis: int, lines: Array, points: Array) -> tuple[_Side, _Side]:
    """Both sides of knot lines, at points along them."""
    sides: tuple[Side, Side] = ("left", "right")
    low, high = (_sided(net, metric, axis, lines, points, side) for side in sides)
    return low, high


def _sided(net: Net, metric: Net, axis: int, lines: Array, points: Array, side: Side) -> _Side:
    def seen(surface: Net) -> list[Array]:
        at: tuple[Array, Array] = (points, lines) if axis else (lines, points)
        limits: tuple[Side, Side] = ("right", side) if axis else (side, "right")
        value, *slopes = surface.grid(*at, 1, limits)
        return [each.swapaxes(0, 1) if axis else each for each in (value, *slopes[:: 1 - 2 * axis])]

    _, xn, xt = seen(metric)
    e, f, g = ((a * b).sum(axis=2) for a, b in ((xn, xn), (xn, xt), (xt, xt)))
    g = np.maximum(g, 1e-300)
    height = np.sqrt(np.maximum(e - f * f / g, FLATTEST * e + 1e-300))
    parts = [(1, 0, 1 / height), (0, 1, -f / g / height)]
    if net.weights is not None:
        w, wn, wt = (each[..., 0] for each in seen(Net(net.u, net.v, net.weights[..., None])))
        parts = [(i, j, part / w) for i, j, part in parts]
        parts.append((0, 0, (f / g * wt - wn) / (w * w * height)))
    first, values = jet((net.u, net.v)[axis], lines, (0, 1), side)
    return _Side(first, values, height, np.sqrt(g), parts)


def _window(knots: KnotVector, sides: tuple[_Side, _Side]) -> tuple[Array, Array]:
    """The first of the functions that do not vanish on either side of each line, with their slopes, and these numbers,
    ``(2, 2, lines, width)`` by side and order."""
    low, high = sides
    begin = np.stack([np.zeros_like(low.first), (high.first - low.first) % knots.count])
    count = knots.degree + 1
    found = np.zeros((2, 2, len(low.first), int(begin.max()) + count))
    each = np.arange(len(low.first))[:, None]
    for numbers, side, more in zip(found, sides, begin, strict=True):
        numbers[:, each, more[:, None] + np.arange(count)] = side.values.swapaxes(0, 1)
    used = np.flatnonzero(found.any(axis=(0, 1, 2)))
    return low.first + used[0], found[..., used[0] : used[-1] + 1]
