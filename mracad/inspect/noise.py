"""The noise of a control net: the part that no smooth surface explains.

Divided differences with weights of unit norm keep the standard deviation of white noise on control points, whatever
their order; those of a smooth surface are small, and change with the order.  The noise is the least of the estimates
by differences of order 3 along both axes and of order 4 along each, or the mean of those that agree with it, if those
of neighbouring orders do.  Only noise along the normal shows, and scanners make little other: the differences along
normals are used if their estimate differs from that of all three coordinates by more than chance.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

from mracad.bspline.surface import Net, pairs

Array = np.ndarray
Orders = tuple[int, int]
Deviation = Callable[[Net, Orders, Array, Array], float]
"""The standard deviation of some differences of given orders of a net."""

KINDS: tuple[tuple[Orders, ...], ...] = ((3, 3), (2, 2)), ((4, 0), (3, 0), (5, 0)), ((0, 4), (0, 3), (0, 5))
"""Orders of differences along u and v: for each kind the one that counts, and its neighbours."""

MEDIAN = 1.5381723
"""Median length of a vector of three standard normal numbers: of χ with three degrees of freedom."""

NORMAL = 0.6744898
"""Median of the absolute value of a standard normal number."""

CHANCE = 8.0
"""Factor on 1 / √n: largest difference of estimates along normals and in all coordinates for noise without
direction."""

AGREE = 1.15
"""An estimate above the least by this factor contains shape."""

LEVEL = 1.6
"""Largest factor between estimates of neighbouring orders if there is noise."""

FEWEST, BESIDE = 16, 8
"""Least number of differences that show noise, and of neighbouring orders."""

ROUNDING = 1e-12
"""Share of the coordinates below which differences are rounding."""

MOST, UNEVEN = 0.8, 1.6
"""A quantile of lengths of differences, and the largest factor by which it may exceed that of white noise, over the
median: noise along one direction has 1.4; a few kinks among smooth pieces have more."""

LONGEST = 2.1539
"""That quantile of the length of a vector of three standard normal numbers."""

LOCAL, CALM, RUN = 7, 0.3, 5
"""Number of differences in a row that are used together, the share of the noise below which there is none, and the
least number of control points in a row without noise."""


@dataclass(frozen=True, eq=False)
class Noise:
    """The noise of a net.

    Attributes
    ----------
    size : float
        Standard deviation of each coordinate of control points, mm.
    where : ndarray of bool (nu, nv)
        Control points that have noise.
    at : (ndarray, ndarray)
        Their Greville points along u and v.
    order : int
        Order of the differences that show how smooth the shape is.
    precision : (float, float), optional
        Inverse variance of these differences along u and v, 1/mm², if known.
    """

    size: float
    where: Array
    at: tuple[Array, Array]
    order: int = 3
    precision: tuple[float, float] | None = None

    def over(self, net: Net) -> Array:
        """Control points that have noise, for the same surface over more knots."""
        own = (net.u.greville(), net.v.greville())
        near = [np.abs(there[:, None] - here).argmin(axis=1) for there, here in zip(own, self.at, strict=True)]
        return np.asarray(self.where[np.ix_(*near)])


def noise(net: Net, points: Array, seen: Array) -> Noise | None:
    """The noise of a net; None if none is found.

    Parameters
    ----------
    net : Net
    points : ndarray of bool (nu, nv)
        Control points from which it is estimated.
    seen : ndarray of bool (nu, nv)
        Control points on which the faces depend.
    """
    mean = _size(net, points, seen, seen, _mean)
    if not mean:
        return None
    where = seen & ~_runs(_around(net, seen) <= (CALM * mean) ** 2)
    if not even(net, where & points, seen):
        return None
    size = _size(net, where & points, seen, where, _along_normals)
    at = net.u.greville(), net.v.greville()
    return Noise(size, where, at) if size > ROUNDING * float(np.abs(net.poles).max()) else None


def calm(net: Net, points: Array, size: float) -> bool:
    """Whether control points of a mask ``(nu, nv)`` have no noise of a size (mm), by the differences among them."""
    told = []
    for orders in ((4, 0), (0, 4)):
        found, _, within = _differences(net, orders, points, points, points)
        told.append(np.linalg.norm(found[within], axis=1))
    lengths = np.concatenate(told)
    return len(lengths) >= BESIDE and float(np.median(lengths)) <= CALM * size * MEDIAN


def even(net: Net, noisy: Array, seen: Array) -> bool:
    """Whether differences about ``noisy`` control points, of one kind at least, are as evenly long as those of noise;
    true where there are too few."""
    least = np.inf
    for orders, *_ in KINDS:
        found, share, within = _differences(net, orders, noisy, seen, noisy)
        use = within & (share > 0)
        if use.sum() >= FEWEST:
            lengths = np.linalg.norm(found[use], axis=1) / np.sqrt(share[use])
            most = float(np.quantile(lengths, MOST)) / LONGEST
            least = min(least, most / max(float(np.median(lengths)) / MEDIAN, 1e-300))
    return least <= UNEVEN or least == np.inf


def _size(net: Net, points: Array, seen: Array, noisy: Array, deviation: Deviation) -> float:
    """Standard deviation by the differences about ``points``, if ``noisy`` ones have noise; 0 for none."""

    def estimate(orders: Orders, fewest: int) -> float:
        found, share, within = _differences(net, orders, points, seen, noisy)
        use = within & (share > 0)
        return deviation(net, orders, found / np.sqrt(share)[..., None], use) if use.sum() >= fewest else np.inf

    with np.errstate(divide="ignore", invalid="ignore"):
        every = [[estimate(orders, BESIDE if k else FEWEST) for k, orders in enumerate(kind)] for kind in KINDS]
    found = [each for each in every if np.isfinite(each[0])]
    if not found:
        return 0.0
    known = [x for x in min(found) if np.isfinite(x)]
    if len(known) < 2 or max(known) > LEVEL * min(known):
        return 0.0
    main = np.array([each[0] for each in found])
    return float(main[main <= AGREE * main.min()].mean())


def _mean(net: Net, orders: Orders, found: Array, use: Array) -> float:
    """The deviation of differences, the mean of all coordinates."""
    return float(np.median(np.linalg.norm(found[use], axis=1)) / MEDIAN)


def _along_normals(net: Net, orders: Orders, found: Array, use: Array) -> float:
    """The deviation along normals if it differs from the mean by more than chance, else the mean."""
    us, vs = (kv.greville()[k // 2 :][:n] for kv, k, n in zip((net.u, net.v), orders, use.shape, strict=True))
    normals = net.normals(pairs(us, vs)).reshape(found.shape)
    heights = np.abs((found * normals).sum(axis=2)[use])
    heights = heights[np.isfinite(heights)]
    mean = _mean(net, orders, found, use)
    if not len(heights):
        return mean
    along = float(np.median(heights)) / NORMAL
    return along if abs(along - mean) > CHANCE / np.sqrt(len(heights)) * mean else mean


def _around(net: Net, seen: Array) -> Array:
    """Mean square of the differences in a row about each control point, the least of both axes, mm²."""
    from scipy.ndimage import uniform_filter1d

    least = np.full(seen.shape, np.inf)
    for axis, orders in enumerate(((4, 0), (0, 4))):
        found, _, within = _differences(net, orders, seen, seen, seen)
        counted = np.zeros((2, *seen.shape))
        middle = tuple(slice(k // 2, k // 2 + n) for k, n in zip(orders, within.shape, strict=True))
        counted[0][middle], counted[1][middle] = np.where(within, (found**2).mean(axis=2), 0.0), within
        total, count = uniform_filter1d(counted, LOCAL, axis=1 + axis, mode="constant")
        least = np.where(count > 2.5 / LOCAL, np.minimum(least, total / np.maximum(count, 1e-300)), least)
    return least


def _runs(points: Array) -> Array:
    """The points of a mask that have enough neighbours in a row in it, along an axis."""
    from scipy.ndimage import binary_opening

    return np.asarray(binary_opening(points, np.ones((RUN, 1))) | binary_opening(points, np.ones((1, RUN))))


def _differences(net: Net, orders: Orders, points: Array, seen: Array, noisy: Array) -> tuple[Array, Array, Array]:
    """Differences ``(…, 3)``, the share of each that is due to ``noisy`` control points, and whether it is centred on
    ``points`` and follows the surface."""
    window = orders[0] + 1, orders[1] + 1
    if any(count < size for count, size in zip(points.shape, window, strict=True)):
        return np.zeros((0, 0, 3)), np.zeros((0, 0)), np.zeros((0, 0), bool)
    found, share = net.poles, noisy.astype(float)
    for axis, order in enumerate(orders):
        if order:
            weights = _weights((net.u, net.v)[axis].greville(), order)
            found, share = _applied(weights, found, axis), _applied(weights**2, share, axis)
    within = sliding_window_view(seen, window).all(axis=(2, 3)) & np.isfinite(found).all(axis=2)
    for i in _middle(orders[0]):
        for j in _middle(orders[1]):
            within &= points[i : i + within.shape[0], j : j + within.shape[1]]
    return found, share, within


def _middle(order: int) -> Sequence[int]:
    """The control points with the largest weights in a difference."""
    return sorted({order // 2, (order + 1) // 2})


def _weights(x: Array, order: int) -> Array:
    """Weights of divided differences at places, ``(n - order, order + 1)``, of unit norm."""
    at = sliding_window_view(x, order + 1)
    apart = at[:, :, None] - at[:, None, :] + np.eye(order + 1)
    with np.errstate(divide="ignore", invalid="ignore"):
        weights = 1.0 / apart.prod(axis=2)
        return np.asarray(weights / np.linalg.norm(weights, axis=1, keepdims=True))


def _applied(weights: Array, values: Array, axis: int) -> Array:
    """Weighted sums of neighbours along an axis."""
    windows = sliding_window_view(np.moveaxis(values, axis, 0), weights.shape[1], axis=0)
    with np.errstate(invalid="ignore"):
        return np.moveaxis(np.einsum("nk,n...k->n...", weights, windows), 0, axis)
