"""A bound on a displacement, by blending it back locally."""

from __future__ import annotations

import numpy as np

Array = np.ndarray


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
