"""The noise of a control net: the part that no smooth surface explains.

Divided differences with weights of unit norm keep the standard deviation of white noise on control points; those of a
smooth surface are small.  The noise is the least of the estimates by differences of order 3 along both axes and of
order 4 along each, or the mean of those that agree with it.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

from mracad.bspline.surface import Net

Array = np.ndarray

ORDERS = (3, 3), (4, 0), (0, 4)
"""Orders of the differences along u and v."""

MEDIAN = 1.5381723
"""Median length of a vector of three standard normal numbers: of χ with three degrees of freedom."""

AGREE = 1.15
"""An estimate above this times the least contains shape."""

FEWEST, ACROSS = 40, 6
"""Least number of differences, and of control points along either axis, to tell noise."""


def noise(net: Net, points: Array) -> float | None:
    """Standard deviation of each coordinate of control points, mm; None where there are too few to tell.

    Parameters
    ----------
    net : Net
    points : ndarray of bool (nu, nv)
        Control points that may have noise.
    """
    if min(points.any(axis=0).sum(), points.any(axis=1).sum()) < ACROSS:
        return None
    found = np.array([np.median(each) for each in _lengths(net, points) if len(each) >= FEWEST]) / MEDIAN
    return float(found[found <= AGREE * found.min()].mean()) if len(found) else None


def _lengths(net: Net, points: Array) -> Iterator[Array]:
    """Lengths of the differences of each order that only involve these points."""
    for orders in ORDERS:
        window = orders[0] + 1, orders[1] + 1
        if all(count >= size for count, size in zip(points.shape, window, strict=True)):
            whole = sliding_window_view(points, window).all(axis=(2, 3))
            found = net.poles
            for axis, order in enumerate(orders):
                found = _differences((net.u, net.v)[axis].greville(), found, order, axis)
            yield np.linalg.norm(found, axis=2)[whole & np.isfinite(found).all(axis=2)]


def _differences(x: Array, values: Array, order: int, axis: int) -> Array:
    """Divided differences of values at places along an axis, their weights of unit norm."""
    if not order:
        return values
    at = sliding_window_view(x, order + 1)
    apart = at[:, :, None] - at[:, None, :] + np.eye(order + 1)
    with np.errstate(divide="ignore", invalid="ignore"):
        weights = 1.0 / apart.prod(axis=2)
        weights /= np.linalg.norm(weights, axis=1, keepdims=True)
        windows = sliding_window_view(np.moveaxis(values, axis, 0), order + 1, axis=0)
        return np.moveaxis(np.einsum("nk,n...k->n...", weights, windows), 0, axis)
