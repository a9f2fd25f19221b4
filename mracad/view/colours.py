"""Colours of pictures: maps that are straight in Oklab, where equal steps look equal, and neutral greys.

Björn Ottosson, *A perceptual color space for image processing*, 2020.
"""

from __future__ import annotations

import numpy as np

from mracad.mesh.scene import rgba

Array = np.ndarray

PAPER = np.array([1.0, 1.0, 1.0])
INK = np.array([0.13, 0.15, 0.18])
CLAY = "#b9c1c9"
"""Colour of what has none."""

_SEQUENTIAL = "#f3f1e7", "#b8d6b6", "#4fa6a0", "#2b6f94", "#2d2f66"
_DIVERGING = "#204a87", "#6d9fc9", "#f2f2f0", "#dd8a62", "#8f2318"
_TO_LMS = np.array(
    [
        [0.4122214708, 0.5363325363, 0.0514459929],
        [0.2119034982, 0.6806995451, 0.1073969566],
        [0.0883024619, 0.2817188376, 0.6299787005],
    ]
)
_TO_LAB = np.array(
    [
        [0.2104542553, 0.7936177850, -0.0040720468],
        [1.9779984951, -2.4285922050, 0.4505937099],
        [0.0259040371, 0.7827717662, -0.8086757660],
    ]
)


def rgb(colour: str) -> Array:
    """``"#rrggbb…"`` as red, green, blue in [0, 1]."""
    return np.array(rgba(colour)[:3]) / 255.0


def opacity(colour: str) -> float:
    """The opacity of a colour; 1 where there is none."""
    return rgba(colour)[3] / 255.0 if colour else 1.0


def sequential(x: Array) -> Array:
    """Colours ``(…, 3)`` for values from 0 to 1."""
    return _between(_SEQUENTIAL, x)


def diverging(x: Array) -> Array:
    """Colours ``(…, 3)`` for values from -1 to 1, nearly white at 0."""
    return _between(_DIVERGING, 0.5 * (np.asarray(x) + 1.0))


def several(count: int) -> Array:
    """Colours ``(count, 3)`` that differ from each other: hues a golden angle apart, at two lightnesses."""
    k = np.arange(count)
    hue = 2.399963229728653 * k
    return _srgb(np.stack([0.82 - 0.07 * (k % 2), 0.085 * np.cos(hue), 0.085 * np.sin(hue)], axis=1))


def _between(stops: tuple[str, ...], x: Array) -> Array:
    at = np.linspace(0.0, 1.0, len(stops))
    table = _oklab(np.array([rgb(stop) for stop in stops]))
    return _srgb(np.stack([np.interp(x, at, column) for column in table.T], axis=-1))


def linear(srgb: Array) -> Array:
    """Amounts of light of colours."""
    return np.where(srgb <= 0.04045, srgb / 12.92, ((srgb + 0.055) / 1.055) ** 2.4)


def encoded(light: Array) -> Array:
    """The colours of amounts of light."""
    light = np.clip(light, 0.0, 1.0)
    return np.where(light <= 0.0031308, 12.92 * light, 1.055 * light ** (1 / 2.4) - 0.055)


def _oklab(srgb: Array) -> Array:
    return np.asarray(np.cbrt(linear(srgb) @ _TO_LMS.T) @ _TO_LAB.T)


def _srgb(lab: Array) -> Array:
    return encoded((lab @ np.linalg.inv(_TO_LAB).T) ** 3 @ np.linalg.inv(_TO_LMS).T)
