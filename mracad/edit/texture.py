"""Textures: fields of heights of any size, with the spectrum of the detail of a face, that do not repeat it.

The heights h of the detail, on a grid of arc lengths, have the spectrum |F(w h)|² / Σ w², w a window that fades out
towards the outline.  A field with this spectrum and random phases is as smooth, as high and as regular as the detail,
but has its waves elsewhere, and its autocorrelation beyond the size of the detail is that of noise.  In the part of it
that is used, the energy of each octave along u and v is then set to that of the detail.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from mracad.bspline.surface import pairs
from mracad.bspline.vectors import cross, unit
from mracad.edit.character import Character
from mracad.edit.feature.ideal import Way
from mracad.errors import EditError
from mracad.inspect.spectrum import EDGE
from mracad.seam.zones import faded

Array = np.ndarray

SAMPLES = 2.5
"""Least number of samples in a knot span of the source."""

WIDE, NARROW = 0.5, 0.5
"""Width within which the window of the spectrum fades out, as a share of the source, and that within which heights fade
out towards holes and trims, in wavelengths, where their energies are measured."""

MOST = 1 << 24
"""Largest number of samples of a texture."""

PASSES = 4
"""How often the energies of octaves are set."""

CHANCE = 2.0
"""Largest factor by which the heights of an octave are changed: a part that is used may be too small for its waves."""

FAINT = 1e-5
"""Share of the energy up to which that of octaves is left to chance."""


@dataclass(frozen=True, eq=False)
class Texture:
    """A periodic field of heights.

    Attributes
    ----------
    heights : ndarray (m, n)
        mm.
    low : ndarray (2,)
        Place of the first sample, mm.
    step : float
        Distance between samples, mm.
    """

    heights: Array
    low: Array
    step: float

    @cached_property
    def _spline(self) -> Array:
        from scipy.ndimage import spline_filter

        return np.asarray(spline_filter(self.heights, order=3, mode="grid-wrap"))

    def __call__(self, xy: Array) -> Array:
        """The heights ``(q,)`` at places ``(q, 2)``, mm."""
        from scipy.ndimage import map_coordinates

        at = ((xy - self.low) / self.step).T
        return np.asarray(map_coordinates(self._spline, at, order=3, mode="grid-wrap", prefilter=False))


@dataclass(frozen=True, eq=False)
class Chart:
    """Where the arc lengths of a face lie in the plane of a texture: ``matrix @ lengths + shift``."""

    matrix: Array
    shift: Array

    def __call__(self, lengths: Array) -> Array:
        """Places ``(q, 2)`` for arc lengths ``(q, 2)``, mm."""
        return np.asarray(lengths @ self.matrix.T + self.shift)


@dataclass(frozen=True, eq=False)
class Grown:
    """A texture on a surface, along its normals."""

    own: Character
    chart: Chart
    way: Way
    texture: Texture

    def __call__(self, uv: Array) -> Array:
        """The displacement ``(q, 3)`` at parameters, in the part's frame."""
        heights = self.way.height * self.texture(self.way.back(self.chart(self.own.lengths(uv))))
        return np.asarray(heights[:, None] * self.own.coarse.evaluate(uv)[3])


def grown(other: Character, wavelength: float, low: Array, high: Array, seed: int) -> Texture:
    """A texture like the detail of a surface.

    Parameters
    ----------
    other : Character
    wavelength : float
        Of the longest waves in it, mm.
    low, high : ndarray (2,)
        Places between which it is used, mm.
    seed : int

    Raises
    ------
    EditError
        For one that would have too many samples, or none to start from.
    """
    from scipy.fft import irfft2, next_fast_len, rfft2

    step = EDGE / 2.0 ** np.ceil(np.log2(SAMPLES * EDGE / other.spacing))  # octaves then end where those of spectra do
    counts = [int(size / step) + 1 for size in other.sizes]
    shape = [next_fast_len(int(x / step) + 1 + count, True) for x, count in zip(high - low, counts, strict=True)]
    if max(np.prod(shape, dtype=float), np.prod(counts, dtype=float)) > MOST:
        raise EditError(f"grow: {shape[0]} × {shape[1]} samples are too many", "use a larger --size, or fewer faces")
    heights, away = _sampled(other, step, counts)
    if not away.any():
        raise EditError("grow: the face to take detail from is too narrow for it", "leave out --grow, or take another")
    window = faded(away, WIDE * min(other.sizes) / step)
    narrow = np.ones(away.shape) if away.all() else faded(away, NARROW * wavelength / step)
    wanted = _energies(heights, narrow)
    spectrum = np.abs(rfft2(_above(heights, window), shape))
    noise = rfft2(np.random.default_rng(seed).standard_normal(shape))
    field = np.sqrt(np.prod(shape, dtype=float) / (window**2).sum()) * spectrum * noise / np.abs(noise)
    bands = _octaves(np.fft.fftfreq(shape[0]), np.fft.rfftfreq(shape[1]), wanted.shape)
    used = [int(x / step) + 1 for x in high - low]
    gains = np.ones(wanted.shape)
    for _ in range(PASSES):
        got = _energies(irfft2(gains[bands] * field, shape)[: used[0], : used[1]], None, wanted.shape)
        strong = (wanted > FAINT * wanted.sum()) & (got > 0)
        change = np.sqrt(np.where(strong, wanted / np.where(strong, got, 1.0), 1.0))
        gains = np.clip(gains * change, 1.0 / CHANCE, CHANCE)
    return Texture(irfft2(gains[bands] * field, shape), low, step)


def _sampled(other: Character, step: float, counts: Sequence[int]) -> tuple[Array, Array]:
    """Heights of the detail on a grid of arc lengths, and distances from the outline of the faces, in samples."""
    from scipy.ndimage import distance_transform_edt

    lines = [step * np.arange(count) for count in counts]
    us, vs = (np.interp(at, table[1], table[0]) for at, table in zip(lines, other.tables, strict=True))
    patch = other.coarse
    _, su, sv = patch.net.grid(us, vs, 1)
    uv = pairs(us, vs)
    normals = unit(cross(su, sv)) * patch.signs(uv).reshape(*su.shape[:2], 1)
    heights = (np.asarray(other.detail.grid(us, vs)) * normals).sum(axis=-1)
    inside = np.any([patch.inside(face, uv) for face in patch.faces], axis=0).reshape(heights.shape)
    inside &= np.isfinite(heights)
    return np.where(inside, heights, 0.0), distance_transform_edt(np.pad(inside, 1))[1:-1, 1:-1]


def _above(heights: Array, window: Array) -> Array:
    """Heights above their mean, in a window."""
    return np.asarray(window * (heights - np.average(heights, weights=window**2)))


def _octaves(u: Array, v: Array, most: Sequence[int]) -> tuple[Array, Array]:
    """The octaves, from the shortest waves, along both axes in which pairs of frequencies (per sample) lie; all longer
    waves count as the last."""
    each = []
    for found, count in zip((u, v), most, strict=True):
        octave = -np.log2(2.0 * np.maximum(np.abs(found), 2.0**-count))
        each.append(np.clip(np.ceil(octave), 0, count - 1).astype(int))
    rows, columns = np.meshgrid(*each, indexing="ij")
    return rows, columns


def _energies(heights: Array, window: Array | None = None, most: Sequence[int] = ()) -> Array:
    """Mean square heights of waves by octave along u and v, mm²: of the even continuation, which has no steps."""
    from scipy.fft import dctn

    window = np.ones(heights.shape) if window is None else window
    found = dctn(_above(heights, window), norm="ortho") ** 2 / (window**2).sum()
    most = most or [int(np.log2(count)) + 1 for count in heights.shape]
    u, v = (np.arange(count) / (2 * count) for count in heights.shape)
    bands = _octaves(u, v, most)
    total = np.zeros(most)
    np.add.at(total, bands, found)
    return total
