"""Built-in textures: height functions of a pitch and a seed, the same for the same seed anywhere."""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np

from mracad.edit.feature.source.relief import CELLS, Relief, bordered
from mracad.errors import UsageError
from mracad.spec.sources import Texture

Array = np.ndarray

SHARE = 16
"""A pitch is this share of the side by default."""

MOST = 60
"""Largest number of pitches across."""

FINE = 32
"""Cells of a pitch, where there are enough."""


def relief(given: Texture, width: float | None) -> Relief:
    """The relief of a texture; ``width`` (mm) as in :func:`~mracad.edit.feature.source.relief.bordered`.

    Raises
    ------
    UsageError
        For a pitch that does not fit the side.
    """
    pitch = given.width / SHARE if given.pitch is None else given.pitch
    if not given.width / MOST <= pitch <= given.width / 2:
        low, high = given.width / MOST, given.width / 2
        message = f"texture:{given.name}: pitch {pitch:g} mm is not between {low:.3g} and {high:.3g} mm"
        raise UsageError(message, "give another pitch, or another width")
    count = int(np.clip(FINE * given.width / pitch, 256, CELLS))
    cell = given.width / count
    at = (cell * (np.arange(count) + 0.5) - given.width / 2) / pitch
    x, y = np.meshgrid(at, at, indexing="ij")
    heights = TEXTURES[given.name](x, y, np.random.default_rng(given.seed))
    return bordered(given.height * heights, cell, width)


def _knurl(x: Array, y: Array, rng: np.random.Generator) -> Array:
    """Rounded pyramids between two families of grooves at 30° to y."""
    lean = np.radians(30)
    a, b = (x * np.cos(lean) + sign * y * np.sin(lean) for sign in (1, -1))
    return np.asarray((_tooth(a) + _tooth(b)) / 2)


def _tooth(t: Array) -> Array:
    """A triangular wave of period and height 1, rounded."""
    sharp = 0.97
    return np.asarray(0.5 + np.arcsin(sharp * np.sin(2 * np.pi * t)) / (2 * np.arcsin(sharp)))


def _hexagons(x: Array, y: Array, rng: np.random.Generator) -> Array:
    """Flat hexagons with grooves between them."""
    first, second = _nearest(x, y, _honeycomb(x))[:2]
    gap = _blurred(second - first, 0.06 / (x[1, 0] - x[0, 0]))  # its creases would be edges of the grooves
    return _smooth((gap - 0.08) / 0.42)


def _dimples(x: Array, y: Array, rng: np.random.Generator) -> Array:
    """Round dents with smooth rims, close together."""
    first = _nearest(x, y, _honeycomb(x))[0]
    return np.asarray(-(np.maximum(1 - (first / 0.5) ** 2, 0.0) ** 3))


def _hammered(x: Array, y: Array, rng: np.random.Generator) -> Array:
    """Shallow dents, each as deep as the hammer met it, and the ridges that they leave."""
    points = _scattered(x, rng, 0.55)
    near, which = _query(x, y, points, 6)
    floor = 0.35 * rng.random(len(points))[which]
    low = near**2 + floor
    return _ranged(-np.log(np.exp(-12 * low).sum(axis=-1)) / 12)


def _leather(x: Array, y: Array, rng: np.random.Generator) -> Array:
    """Pebbles of uneven size and height, with creases between them."""
    points = _scattered(x, rng, 0.75)
    bend = _noise(x.shape, rng, x[1, 0] - x[0, 0], (0.5, 0.5)), _noise(x.shape, rng, x[1, 0] - x[0, 0], (0.5, 0.5))
    near, which = _query(x + 0.08 * bend[0], y + 0.08 * bend[1], points, 2)
    tall = 0.75 + 0.25 * rng.random(len(points))[which[..., 0]]
    edge = _smooth((near[..., 1] - near[..., 0]) / 0.45)
    dome = 0.85 + 0.15 * np.cos(np.minimum(2 * near[..., 0], np.pi / 2))
    fine = 0.03 * _noise(x.shape, rng, x[1, 0] - x[0, 0], (0.12, 0.12))
    body = edge * (1 + tall * dome) / 2
    return _ranged(_blurred(body + fine * edge, 0.05 / (x[1, 0] - x[0, 0])))


def _brushed(x: Array, y: Array, rng: np.random.Generator) -> Array:
    """Fine grooves along x, each of its own length and depth."""
    step = x[1, 0] - x[0, 0]
    coarse, fine = _noise(x.shape, rng, step, (8.0, 0.22)), _noise(x.shape, rng, step, (4.0, 0.11))
    return np.asarray(0.5 + 0.5 * np.tanh(0.5 * coarse + 0.35 * fine))


TEXTURES: Mapping[str, Callable[[Array, Array, np.random.Generator], Array]] = {
    "leather": _leather,
    "knurl": _knurl,
    "hammered": _hammered,
    "brushed": _brushed,
    "hexagons": _hexagons,
    "dimples": _dimples,
}
"""Heights of about 0 to 1, or -1 to 0, at places in units of the pitch."""


def _smooth(share: Array) -> Array:
    """0 up to 1 as ``share`` goes from 0 to 1, with two vanishing derivatives at both ends."""
    t = np.clip(share, 0.0, 1.0)
    return np.asarray(t**3 * (10.0 - 15.0 * t + 6.0 * t**2))


def _ranged(heights: Array) -> Array:
    return np.asarray((heights - heights.min()) / np.ptp(heights))


def _blurred(values: Array, cells: float) -> Array:
    from scipy.ndimage import gaussian_filter

    return np.asarray(gaussian_filter(values, cells, mode="reflect"))


def _noise(shape: tuple[int, ...], rng: np.random.Generator, step: float, size: tuple[float, float]) -> Array:
    """Smooth noise of unit variance, of a size along x and y in units of the pitch."""
    from scipy.ndimage import gaussian_filter

    raw = gaussian_filter(rng.standard_normal(shape), [s / step for s in size], mode="wrap", truncate=3.0)
    return np.asarray((raw - raw.mean()) / raw.std())


def _honeycomb(x: Array) -> Array:
    """Middles ``(m, 2)`` of hexagons a unit apart that cover a square."""
    half = int(np.ceil(np.abs(x).max())) + 2
    i, j = np.meshgrid(np.arange(-half, half + 1), np.arange(-2 * half, 2 * half + 1), indexing="ij")
    return np.stack([(i + 0.5 * (j % 2)).ravel(), (j * np.sqrt(3) / 2).ravel()], axis=1)


def _scattered(x: Array, rng: np.random.Generator, spread: float) -> Array:
    """Points ``(m, 2)`` about a unit apart without order."""
    points = _honeycomb(x)
    return np.asarray(points + spread * (rng.random(points.shape) - 0.5))


def _query(x: Array, y: Array, points: Array, count: int) -> tuple[Array, Array]:
    """Distances ``(nx, ny, count)`` of the nearest points, and which they are."""
    from scipy.spatial import cKDTree

    near, which = cKDTree(points).query(np.stack([x, y], axis=-1), k=count)
    return near, which


def _nearest(x: Array, y: Array, points: Array) -> tuple[Array, Array]:
    near, _ = _query(x, y, points, 2)
    return near[..., 0], near[..., 1]
