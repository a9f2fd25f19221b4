"""The surface under a feature: a thin plate through its surroundings."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from mracad.bspline.surface import pairs
from mracad.edit.feature.chart import DEGREE, Charts, charts, monomials
from mracad.edit.feature.ground import Ground, axes
from mracad.edit.feature.locate import Window
from mracad.errors import EditError

Array = np.ndarray

RING = 1.5
"""Outer radius, over that of the feature, of the ring that determines the surface under it."""

WORTH, BETTER = 3e-3, 3.0
"""A polynomial bridges the ground if that changes the ring by more than this share of the feature's height.  Its degree
is 6 instead of 4 if that fits better by the second factor."""

SECTORS = 16
"""Number of directions in three quarters of which the ring must be covered."""

PLATE, CLOSE, CELLS = 600, 1.2, 64
"""Number of points of the ring through which the thin plate passes; the distance, over the reach, of those taken first;
and the number of cells, up to there, over which it is tabulated."""

NORMALS = 6
"""Steps to find the foot of a point on the plate."""

SPREAD = 48
"""Samples of a patch in each direction around a feature."""


@dataclass(frozen=True, eq=False)
class Plate:
    """A thin plate through the surroundings of a window.

    Attributes
    ----------
    chart : Charts
        Chart of one place: that of the window, projected onto the plate.
    height : scipy.interpolate.RectBivariateSpline
        Height of the plate in the chart's axes; all lengths are fractions of the reach.
    reach : float
        mm.
    """

    chart: Charts
    height: Any
    reach: float

    def feet(self, local: Array) -> Array:
        """The feet on the plate of points ``(q, 3)``, along its normals; both in the chart's axes, mm."""
        at = local / self.reach
        height, foot = np.zeros(len(at)), at
        for _ in range(NORMALS):
            slopes = [self.height.ev(foot[:, 0], foot[:, 1], dx=dx, dy=1 - dx) for dx in (1, 0)]
            normal = np.stack([-slopes[0], -slopes[1], np.ones(len(at))], axis=1)
            normal /= np.linalg.norm(normal, axis=1, keepdims=True)
            foot = at - height[:, None] * normal
            height = height + (foot[:, 2] - self.height.ev(foot[:, 0], foot[:, 1])) * normal[:, 2]
            foot = at - height[:, None] * normal
        return np.asarray(self.reach * foot)


def plate(ground: Ground, window: Window) -> Plate:
    """The plate under a window.

    Raises
    ------
    EditError
        If there is too little surface around the window.
    """
    from scipy.interpolate import RBFInterpolator, RectBivariateSpline

    reach = window.reach
    frame, local, ring, within = _levelled(ground, window)
    local = local / reach
    degree = _bridging(local, ring, within)
    own = local[ring]
    rows = monomials(own[:, 0], own[:, 1], degree)
    graph = np.linalg.lstsq(rows, own[:, 2], rcond=None)[0]
    rim = _thinned(own[:, :2])
    rest = own[rim, 2] - rows[rim] @ graph
    bent = RBFInterpolator(own[rim, :2], rest, kernel="thin_plate_spline", degree=1)
    side = np.linspace(-CLOSE, CLOSE, CELLS + 1)
    ab = pairs(side, side)
    heights = monomials(ab[:, 0], ab[:, 1], degree) @ graph + bent(ab)
    level = float(heights[len(heights) // 2])
    # the chart's origin is the place on the plate, not on the feature
    origin = window.point + reach * level * frame[2]
    some = np.flatnonzero(np.linalg.norm(ab, axis=1) <= CLOSE)[::8]
    points = origin + reach * np.c_[ab, heights - level][some] @ frame
    chart = charts(origin[None], frame[None], np.array([CLOSE * reach]), points[None], np.ones((1, len(some)), bool))
    return Plate(chart, RectBivariateSpline(side, side, (heights - level).reshape(CELLS + 1, -1)), reach)


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
    return frame, (points - window.point) @ frame.T, ring, near & ~ring


def _thinned(places: Array) -> Array:
    """Indices of some of the places ``(q, 2)`` of a ring, the nearest first, each place once."""
    order = np.random.default_rng(0).permutation(len(places))
    far = np.linalg.norm(places[order], axis=1) > CLOSE
    some = order[np.argsort(far, kind="stable")][:PLATE]
    # samples of two faces coincide along their seam
    return some[np.sort(np.unique(places[some].round(9), axis=0, return_index=True)[1])]


def _bridging(local: Array, ring: Array, within: Array) -> int:
    """Degree of the polynomial that the plate corrects.

    A plate reproduces cubics whatever its hole; beyond them a higher degree must bridge the ground.  That also
    magnifies the feature's own tails, so it is only done where the effect is large.
    """

    def missed(degree: int) -> tuple[float, float]:
        rows = monomials(local[:, 0], local[:, 1], degree)
        rest = local[:, 2] - rows @ np.linalg.lstsq(rows[ring], local[ring, 2], rcond=None)[0]
        return float(np.sqrt((rest[ring] ** 2).mean())), float(np.abs(rest[within]).max(initial=0.0))

    rest, height = missed(3)
    if rest <= WORTH * height:
        return 1
    return DEGREE if missed(DEGREE)[0] * BETTER < missed(4)[0] else 4
