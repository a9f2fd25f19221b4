"""Outlines embossed: a flat top within closed curves, smooth flanks along them, from the exact distance to them."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from mracad.bspline.surface import pairs
from mracad.edit.feature.detail import taper
from mracad.edit.feature.source.curves import Shape, inside, shapes
from mracad.edit.feature.source.relief import CELLS, Relief
from mracad.errors import FileError
from mracad.spec.sources import Outline

Array = np.ndarray

BEND = 5.7735
"""Largest second derivative of the flank's profile of width and height 1."""

STEEPEST = 1.1
"""Least width of a flank over its height: 60° at its steepest."""

FINE, LEAST = 14, 6
"""Cells across a flank: where there are enough, and at least."""

ROUND = 0.1
"""Rounding of corners, over the width of a flank."""


def relief(given: Outline) -> Relief:
    """The relief of an outline, whose flanks rise from half their width outside the curves to half of it inside.

    Raises
    ------
    FileError
        For a file without closed curves.
    """
    from scipy.ndimage import gaussian_filter

    file = Path(given.path)
    found, assumed = shapes(file)
    corners = np.concatenate([loop for shape in found for loop in shape.loops])
    low, high = corners.min(axis=0), corners.max(axis=0)
    scale = 1.0 if given.width is None else given.width / float(high[0] - low[0])
    found = [Shape(tuple(scale * (x - (low + high) / 2) for x in each.loops), each.odd) for each in found]
    side = scale * (high - low)
    edge = given.height if given.edge is None else given.edge
    asked = max(math.sqrt(BEND * given.height * edge), STEEPEST * given.height)
    width = max(asked, LEAST * float(side.max()) / (CELLS - 6 * LEAST))
    cell = max(width / FINE, float(side.max() + 2 * width) / CELLS)
    axes = [cell * (np.arange(n) - (n - 1) / 2) for n in np.ceil((side + 2 * width) / cell).astype(int)]
    distance = signed(found, axes, 0.5 * width + 4 * ROUND * width, cell, file.name)
    distance = gaussian_filter(distance, ROUND * width / cell, mode="nearest")
    heights = given.height * (1 - taper(0.5 + distance / width))
    notes = list(assumed) if given.width is None else []
    if width > asked:
        notes.append(f"flanks {width:.3g} mm wide, the narrowest that a net of this size can hold")
    if heights.max() < 0.99 * given.height:
        notes.append(
            f"too narrow for a flat top: it reaches {heights.max():.3g} mm; a smaller edge makes flanks narrower"
        )
    ends = [1 - taper((x - x[0]) / width) for x in axes]
    window = np.outer(*(np.minimum(end, end[::-1]) for end in ends))
    return Relief(heights, cell, window, notes=tuple(notes), called="with its flanks it is")


def signed(found: Sequence[Shape], axes: Sequence[Array], band: float, cell: float, name: str) -> Array:
    """Distance ``(nx, ny)`` from the border of shapes, positive inside them, no larger than ``band``; mm."""
    from scipy.spatial import cKDTree

    pieces = np.concatenate([_pieces(loop, cell) for shape in found for loop in shape.loops])
    way = pieces[:, 1] - pieces[:, 0]
    across = np.stack([-way[:, 1], way[:, 0]], axis=1)
    across *= 1e-3 * cell / np.linalg.norm(across, axis=1, keepdims=True)
    middle = pieces.mean(axis=1)
    border = inside(found, middle + across) != inside(found, middle - across)
    if not border.any():
        raise FileError(f"'{name}' encloses nothing", "draw closed curves around some area")
    pieces, middle = pieces[border], middle[border]
    points = pairs(*axes)
    near, which = cKDTree(middle).query(points, k=min(3, len(middle)), distance_upper_bound=band + cell)
    near, which = near.reshape(len(points), -1), which.reshape(len(points), -1)
    distance = np.full(len(points), band)
    for k in range(near.shape[1]):
        hit = np.flatnonzero(np.isfinite(near[:, k]))
        distance[hit] = np.minimum(distance[hit], _apart(points[hit], pieces[which[hit, k]]))
    return np.where(inside(found, points), distance, -distance).reshape([len(x) for x in axes])


def _pieces(loop: Array, longest: float) -> Array:
    """The sides of a polygon ``(m, 2, 2)``, cut into pieces."""
    ends = np.roll(loop, -1, axis=0)
    size = np.linalg.norm(ends - loop, axis=1)
    loop, ends, size = loop[size > 0], ends[size > 0], size[size > 0]
    count = np.ceil(size / longest).astype(int)
    which = np.repeat(np.arange(len(loop)), count)
    first = (np.arange(len(which)) - np.repeat(np.cumsum(count) - count, count)) / count[which]
    step = (1 / count)[which]
    way = (ends - loop)[which]
    return np.stack([loop[which] + first[:, None] * way, loop[which] + (first + step)[:, None] * way], axis=1)


def _apart(points: Array, pieces: Array) -> Array:
    """Distances of points from a piece each."""
    way = pieces[:, 1] - pieces[:, 0]
    share = np.clip(((points - pieces[:, 0]) * way).sum(axis=1) / (way**2).sum(axis=1), 0.0, 1.0)
    return np.asarray(np.linalg.norm(points - pieces[:, 0] - share[:, None] * way, axis=1))
