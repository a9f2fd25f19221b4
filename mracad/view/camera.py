"""Directions of view, and the parallel projection of millimetres onto pixels."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mracad.bspline.vectors import unit
from mracad.spec.pictures import direction_of

Array = np.ndarray

MARGIN = 0.05
"""Share of a panel that stays free on each side."""

_UPRIGHT = 0.999  # cosine beyond which a direction of view counts as vertical


@dataclass(frozen=True, eq=False)
class Camera:
    """A parallel projection.

    Attributes
    ----------
    axes : ndarray (3, 3)
        Unit vectors to the right, up, and towards the viewer.
    centre : ndarray (2,)
        What lies in the middle of the picture, mm along the first two axes.
    pixel : float
        Size of a pixel, mm.
    size : (int, int)
        Width and height, pixels.
    """

    axes: Array
    centre: Array
    pixel: float
    size: tuple[int, int]

    @property
    def toward(self) -> Array:
        return np.asarray(self.axes[2])

    def project(self, points: Array) -> Array:
        """Points ``(…, 3)`` as pixels from the left, pixels from the top, and depth away from the viewer (mm)."""
        seen = points @ self.axes.T
        out = np.empty_like(seen)
        out[..., 0] = (seen[..., 0] - self.centre[0]) / self.pixel + 0.5 * self.size[0]
        out[..., 1] = (self.centre[1] - seen[..., 1]) / self.pixel + 0.5 * self.size[1]
        out[..., 2] = -seen[..., 2]
        return np.asarray(out)


def axes(view: str) -> Array:
    """Right, up and towards the viewer for ``"iso"``, ``"front"`` … or ``"X,Y,Z"``, which point to the viewer."""
    toward = unit(np.array(direction_of(view)))
    up = np.array([0.0, np.copysign(1.0, toward[2]), 0.0]) if abs(toward[2]) > _UPRIGHT else np.array([0.0, 0.0, 1.0])
    right = unit(np.cross(up, toward))
    return np.stack([right, np.cross(toward, right), toward])


def round_about(axes: Array, share: float) -> Array:
    """Axes after a share of a turn about the vertical: the model turns anticlockwise, seen from above."""
    angle = -2.0 * np.pi * share
    cos, sin = np.cos(angle), np.sin(angle)
    return np.asarray(axes @ np.array([[cos, sin, 0.0], [-sin, cos, 0.0], [0.0, 0.0, 1.0]]))


def fitted(
    axes: Array, points: Array, size: tuple[int, int], margin: float = MARGIN, middle: Array | None = None
) -> Camera:
    """A camera that shows all points ``(n, 3)``, around a ``middle`` (3,) or as large as possible."""
    seen = points @ axes[:2].T
    low, high = seen.min(axis=0), seen.max(axis=0)
    centre = 0.5 * (low + high) if middle is None else axes[:2] @ middle
    reach = 2.0 * np.maximum(high - centre, centre - low)
    pixel = float((reach / ((1.0 - 2.0 * margin) * np.array(size))).max())
    return Camera(axes, centre, pixel or 1.0, size)
