"""The spectrum of faces: how high their waves are, by wavelength, along u and along v.

Profiles are taken along parameter lines, inside the trims, at even steps of arc length.  The height of a profile above
its slow part, along the normals of that part, is expanded in the modes of a free beam: eigenfunctions of the bending
energy of the solver's filters, whose wavelength is 2π over the fourth root of their energy.  They are orthonormal, so
the squares of the coefficients add up to the mean square of the profile.

A wave whose length differs from that of all modes, or that ends within the profile, also excites neighbouring modes.
The amount is known on average over its phases: with P[k, j] the share that a wave of length λ_j leaves in mode k, the
energies E of the modes are explained by energies p ≥ 0 of waves with the largest likelihood,

    p ← p · Pᵀ(E / P p),        Σ p = Σ E in every pass,

so that short profiles, and those with a shape under their waves, also have sharp bands.  Closed profiles have the modes
of a ring, which do not need this.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from mracad.brief import line
from mracad.bspline.surface import Net
from mracad.inspect.evidence import noises
from mracad.inspect.floor import floor
from mracad.inspect.profiles import SIZES, lines, profiles
from mracad.memo import kept
from mracad.model.brep import Face, Model

Array = np.ndarray

EDGE = 10.0
"""A boundary between bands, mm; all others are its multiples by powers of two."""

SLOW = 0.5
"""Waves longer than this share of a profile are slow; normals are those of the slow part."""

FINE, PASSES = 12, 60
"""Number of waves per octave that explain the modes, and number of passes."""

LONGEST, LEAST = 2.0, 2.5
"""Length of the longest of these waves, in lengths of a profile, and of the shortest, in steps."""

ALIKE = 1.04
"""Factor within which lengths of profiles count as one."""

KEPT = 2.0
"""Number of scales in a wave of which smoothing keeps all but 0.4 %."""

NOTHING = 1e-7, 1e-6
"""Largest heights that count as zero: mm, and share of the longest wavelength."""

FORM = 8.0
"""Waves longer than the longest wavelength over this are shape: few of them fit on a profile."""


@dataclass(frozen=True)
class Band:
    """The waves in a range of lengths, in one direction.

    Attributes
    ----------
    low, high : float
        Wavelengths, mm.
    middle : float
        Mean wavelength of the energy, on a logarithmic scale, mm.
    rms : float
        Root mean square height, mm: A / √2 for a wave of amplitude A.
    energy : float
        Integral of the squared height over the area, mm⁴.
    share : float
        Share of the energy of all bands.
    floor : float
        Root mean square height that the noise makes in this band, mm.
    """

    low: float
    high: float
    middle: float
    rms: float
    energy: float
    share: float
    floor: float = 0.0


@dataclass(frozen=True)
class Direction:
    """The waves along u or along v.

    Attributes
    ----------
    bands : tuple of Band
        Octaves, from the shortest waves to the longest.
    shape : float
        Wavelength at which the shape begins, mm; 0 if nothing shorter stands out.
    """

    bands: tuple[Band, ...]
    shape: float

    __repr__ = line

    @property
    def waves(self) -> tuple[Band, ...]:
        """The bands of waves shorter than the shape."""
        return tuple(band for band in self.bands if band.low < self.shape)

    @property
    def detail(self) -> float:
        """Root mean square height of the waves shorter than the shape, mm."""
        return float(np.sqrt(sum(band.rms**2 for band in self.waves)))

    @property
    def first(self) -> float:
        """Wavelength from which there are waves shorter than the shape, mm; 0 if there are none."""
        least = _least(self.bands[-1].high) if self.bands else 0.0
        return next((band.low for band in self.waves if band.rms > least), 0.0)

    def below(self, scale: float) -> float:
        """Root mean square height of waves shorter than the shape that smoothing at a scale (mm) would remove, mm."""
        return float(np.sqrt(sum((band.rms * _removed(band.middle / scale)) ** 2 for band in self.waves)))


@dataclass(frozen=True)
class Spectrum:
    """The spectrum of a face, or of several.

    Attributes
    ----------
    faces : tuple of int
        Indices in ``Model.faces``.
    area : float
        Area, mm².
    u, v : Direction
    noise : float
        Standard deviation of the coordinates of control points, mm; 0 if none is found.
    """

    faces: tuple[int, ...]
    area: float
    u: Direction
    v: Direction
    noise: float

    __repr__ = line

    @property
    def scale(self) -> float | None:
        """A scale that removes waves shorter than the shape and keeps the shape, mm; None if there are none."""
        found = [way.shape for way in (self.u, self.v) if way.shape]
        return min(found) / KEPT if found else None

    @property
    def first(self) -> float:
        """Wavelength from which there are waves shorter than the shape, mm; 0 if there are none."""
        return min((way.first for way in (self.u, self.v) if way.first), default=0.0)

    def below(self, scale: float) -> float:
        """Root mean square height of waves shorter than the shape that smoothing at a scale (mm) would remove, mm."""
        return max(self.u.below(scale), self.v.below(scale))


@dataclass(frozen=True, eq=False)
class Modes:
    """The modes of a free beam over even steps.

    Attributes
    ----------
    shapes : ndarray (n, n)
        Orthonormal columns, from the slowest.
    lengths : ndarray (n,)
        Wavelengths of the modes, over the length of the beam; infinite for rigid motions.
    waves : ndarray (j,)
        Lengths of the waves that explain them, over the length of the beam.
    table : ndarray (n - 2, j)
        The shares that these leave in the modes other than rigid motions; columns add up to 1.
    """

    shapes: Array
    lengths: Array
    waves: Array
    table: Array


@kept(len(SIZES))
def modes(count: int) -> Modes:
    second = np.diff(np.eye(count), 2, axis=0)
    values, shapes = np.linalg.eigh(second.T @ second)
    angle = 2.0 * np.arcsin(np.clip(np.sqrt(np.sqrt(np.maximum(values, 0.0))) / 2.0, 0.0, 1.0))
    lengths = np.full(count, np.inf)
    lengths[2:] = 2.0 * np.pi / (angle[2:] * (count - 1))
    octaves = np.log2(LONGEST * (count - 1) / LEAST)
    waves = LONGEST * 2.0 ** (-np.arange(0.0, octaves, 1.0 / FINE))
    at = np.linspace(0.0, 1.0, count)
    table = np.abs(shapes.T @ np.exp(2j * np.pi * at[:, None] / waves)) ** 2
    return Modes(shapes, lengths, waves, table[2:] / table[2:].sum(axis=0))


def spectra(model: Model, faces: Sequence[int]) -> list[Spectrum]:
    """The spectra of NURBS faces of a model."""
    every = [face for face in (model.faces[i] for i in faces) if face.surface is not None]
    nets = {face.index: model.surfaces[face.surface].net for face in every if face.surface is not None}
    noise = noises({face.index: (nets[face.index], [face]) for face in every})
    sizes = {i: each.size if each else 0.0 for i, each in noise.items()}
    return [spectrum(nets[face.index], face, sizes[face.index]) for face in every]


def together(each: Sequence[Spectrum]) -> Spectrum:
    """The spectrum of several faces as one, from those of each; the shape begins where it does on half of the area."""
    area = sum(one.area for one in each)
    ways = []
    for name in ("u", "v"):
        bands = [band for one in each for band in getattr(one, name).bands]
        waves, energies = np.array([[band.middle, band.energy] for band in bands]).reshape(-1, 2).T
        whole = _direction(waves, energies / max(area, 1e-300), area)
        floors = {band.low: 0.0 for band in whole.bands}
        for one in each:
            for band in getattr(one, name).bands:
                floors[band.low] += one.area / area * band.floor**2
        whole = _over(whole, [math.sqrt(floors[band.low]) for band in whole.bands])
        ways.append(replace(whole, shape=_middle([(getattr(s, name).shape, s.area) for s in each])))
    noises = [(one.area, one.noise) for one in each]
    size = float(np.sqrt(sum(a * s**2 for a, s in noises) / area)) if area else 0.0
    return Spectrum(tuple(face for one in each for face in one.faces), area, ways[0], ways[1], size)


def _middle(values: Sequence[tuple[float, float]]) -> float:
    """The median of values with weights."""
    ordered = sorted(values)
    weights = np.cumsum([weight for _, weight in ordered])
    return ordered[int(np.searchsorted(weights, weights[-1] / 2))][0]


def spectrum(net: Net, face: Face, noise: float = 0.0) -> Spectrum:
    """The spectrum of a face on a net, with a noise that is known."""
    ways = [_along(net, face, axis) for axis in (0, 1)]
    area = max(each for _, each in ways)
    u, v = (_direction(*waves, area) for waves, _ in ways)
    if noise:
        u, v = (
            _over(way, floor(net, k, noise, np.array([band.low for band in way.bands]))) for k, way in ((0, u), (1, v))
        )
    return Spectrum((face.index,), area, u, v, noise)


def _over(way: Direction, floors: Sequence[float] | Array) -> Direction:
    """A direction with the noise floors of its bands."""
    bands = (replace(band, floor=float(each)) for band, each in zip(way.bands, floors, strict=True))
    return replace(way, bands=tuple(bands))


def _along(net: Net, face: Face, axis: int) -> tuple[tuple[Array, Array], float]:
    """Wavelengths (mm) and mean square heights (mm²) of waves along one direction, and the area of the face, mm²."""
    waves, energies, total = np.zeros(0), np.zeros(0), 0.0
    for group in profiles(net, face, axis):
        found = (_of_rings if group.closed else _of_beams)(group.points, group.normals)
        alike, which = np.unique(np.round(np.log(group.lengths) / np.log(ALIKE)), return_inverse=True)
        share = (np.arange(len(alike))[:, None] == which).astype(float)
        energy, length = (share * group.lengths) @ found, (share @ group.lengths) / share.sum(axis=1)
        if group.closed:
            relative = 1.0 / np.arange(1, energy.shape[1] + 1)
        else:
            relative, energy = _explained(energy, group.points.shape[1])
        waves = np.append(waves, np.multiply.outer(length, relative))
        energies = np.append(energies, energy)
        total += float(group.lengths.sum())
    return (waves, energies / max(total, 1e-300)), total * lines(net, face, 1 - axis)[1]


def _explained(energy: Array, count: int) -> tuple[Array, Array]:
    """Wavelengths over the length, and the energies ``(r, j)`` of such waves that explain the modes of each row."""
    beam = modes(count)
    found = np.repeat(energy.sum(axis=1, keepdims=True) / len(beam.waves), len(beam.waves), axis=1)
    for _ in range(PASSES):
        found *= (energy / np.maximum(found @ beam.table.T, 1e-300)) @ beam.table
    return beam.waves, found


def heights(points: Array, normals: Array) -> Array:
    """Heights of profiles ``(p, n)`` above their slow part, along its normals, mm; arguments ``(p, n, 3)`` each."""
    beam = modes(points.shape[1])
    shapes = beam.shapes[:, beam.lengths > SLOW]
    above = points - shapes @ (shapes.T @ points)
    return np.asarray((above * _unit(shapes @ (shapes.T @ normals))).sum(axis=2))


def _of_beams(points: Array, normals: Array) -> Array:
    """Energies of the modes of profiles other than rigid motions ``(p, n - 2)``, mm²."""
    beam = modes(points.shape[1])
    slow = beam.lengths > SLOW
    energy = (heights(points, normals) @ beam.shapes) ** 2
    energy[:, slow] = ((beam.shapes[:, slow].T @ points) ** 2).sum(axis=2)
    return np.asarray(energy[:, 2:] / points.shape[1])


def _of_rings(points: Array, normals: Array) -> Array:
    """Energies of the waves of closed profiles, with one, two, three … periods, ``(p, m)``, mm²."""
    count = points.shape[1]
    found, calm = np.fft.rfft(points, axis=1), np.fft.rfft(normals, axis=1)
    slow = np.arange(found.shape[1]) <= 1.0 / SLOW
    calm = _unit(np.fft.irfft(np.where(slow[:, None], calm, 0.0), count, axis=1))
    low = np.fft.irfft(np.where(slow[:, None], found, 0.0), count, axis=1)
    energy = np.abs(np.fft.rfft(((points - low) * calm).sum(axis=2), axis=1)) ** 2
    energy[:, slow] = (np.abs(found[:, slow]) ** 2).sum(axis=2)
    return np.asarray(2.0 * energy[:, 1:] / count**2)


def _unit(vectors: Array) -> Array:
    return np.asarray(vectors / np.maximum(np.linalg.norm(vectors, axis=-1, keepdims=True), 1e-300))


def _direction(waves: Array, energies: Array, area: float) -> Direction:
    """Bands without gaps, from wavelengths (mm) and mean squares (mm²), and where the shape begins."""
    if not len(waves):
        return Direction((), 0.0)
    octaves = np.log2(waves / EDGE)
    numbers = np.floor(octaves).astype(int)
    least = int(numbers.min())
    means, moments = (np.bincount(numbers - least, weights) for weights in (energies, energies * octaves))
    total = float(means.sum())
    bands = []
    for k, (mean, moment) in enumerate(zip(means.tolist(), moments.tolist(), strict=True), least):
        middle = moment / mean if mean > 0.0 else k + 0.5
        limits = EDGE * 2.0**k, EDGE * 2.0 ** (k + 1), EDGE * 2.0**middle
        bands.append(Band(*limits, math.sqrt(mean), mean * area, mean / total if total > 0.0 else 0.0))
    return Direction(tuple(bands), _begin(bands))


def _begin(bands: Sequence[Band]) -> float:
    """The wavelength at which the shape begins: the middle of the band from which energy rises to the longest waves, if
    it also rises to shorter ones."""
    energy, longest = [band.rms**2 for band in bands], bands[-1].high
    first = max((k for k, band in enumerate(bands) if FORM * band.low <= longest), default=0)
    while first and energy[first - 1] < energy[first]:
        first -= 1
    return math.sqrt(bands[first].low * bands[first].high) if sum(energy[:first]) > _least(longest) ** 2 else 0.0


def _least(longest: float) -> float:
    """The largest root mean square height that counts as zero, mm, where waves have at most this length, mm."""
    return max(NOTHING[0], NOTHING[1] * longest)


def _removed(scales: float) -> float:
    """Share of its height that smoothing removes from a wave of this many scales."""
    return 1.0 / (1.0 + scales**8)
