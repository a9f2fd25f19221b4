"""Bounds on a displacement."""

from __future__ import annotations

import numpy as np

from mracad.bspline.net import Net

Array = np.ndarray

OVERSHOOT = 1.25
"""A result that deviates by more than this many times what smoothing the whole surface does is refused: at high
degrees control points lie far from the surface, and leaving some of them breaks the cancellation among them."""


def bounded(moved: Array, bound: float) -> Array:
    """Offsets ``(nu, nv, 3)`` blended back locally until none is longer than ``bound``.

    Each point's share a = min(1, bound / |δ|) is replaced by the mean over a window of the least share over the
    same window around each of its points: never more than a, and smooth.  The window is a sixteenth of the net.
    """
    from scipy.ndimage import minimum_filter, uniform_filter

    size = np.linalg.norm(moved, axis=-1)
    share = (1 - 1e-12) * bound / np.maximum(size, (1 - 1e-12) * bound)
    if share.min() == 1.0:
        return moved
    shape = tuple(2 * max(count // 16, 1) + 1 for count in size.shape)
    least = minimum_filter(share, shape, mode="nearest")
    share = np.minimum(share, uniform_filter(least, shape, mode="nearest"))
    return moved * share[..., None]


def deviation(net: Net, change: Array) -> float:
    """Largest displacement, mm, at the Greville points of ``net`` when its poles move by ``change``."""
    delta = Net(net.u, net.v, change, net.weights)
    return float(np.linalg.norm(delta.grid(net.u.greville(), net.v.greville()), axis=-1).max())
