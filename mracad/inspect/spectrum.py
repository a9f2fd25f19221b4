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
from collections import defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from mracad.bspline.surface import Net
from mracad.inspect.evidence import noises
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
    rms : float
        Root mean square height, mm: A / √2 for a wave of amplitude A.
    energy : float
        Integral of the squared height over the area, mm⁴.
    share : float
        Share of the energy of all bands.
    """

    low: float
    high: float
    rms: float
    energy: float
    share: float


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

    @property
    def detail(self) -> float:
        """Root mean square height of the waves shorter than the shape, mm."""
        return float(np.sqrt(sum(band.rms**2 for band in self.bands if band.low < self.shape)))


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

    @property
    def scale(self) -> float | None:
        """A scale that removes waves shorter than the shape and keeps the shape, mm; None if there are none."""
        found = [way.shape for way in (self.u, self.v) if way.shape]
        return min(found) / KEPT if found else None


@dataclass(frozen=True, eq=False)
class _Modes:
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
def _modes(count: int) -> _Modes:
    second = np.diff(np.eye(count), 2, axis=0)
    values, shapes = np.linalg.eigh(second.T @ second)
    angle = 2.0 * np.arcsin(np.clip(np.sqrt(np.sqrt(np.maximum(values, 0.0))) / 2.0, 0.0, 1.0))
    lengths = np.full(count, np.inf)
    lengths[2:] = 2.0 * np.pi / (angle[2:] * (count - 1))
    octaves = np.log2(LONGEST * (count - 1) / LEAST)
    waves = LONGEST * 2.0 ** (-np.arange(0.0, octaves, 1.0 / FINE))
    at = np.linspace(0.0, 1.0, count)
    table = np.abs(shapes.T @ np.exp(2j * np.pi * at[:, None] / waves)) ** 2
    return _Modes(shapes, lengths, waves, table[2:] / table[2:].sum(axis=0))


def spectra(model: Model, faces: Sequence[int]) -> list[Spectrum]:
    """The spectra of NURBS faces of a model."""
    every = [face for face in (model.faces[i] for i in faces) if face.surface is not None]
    nets = {face.index: model.surfaces[face.surface].net for face in every if face.surface is not None}
    noise = noises({face.index: (nets[face.index], [face]) for face in every})
    sizes = {i: each.size if each else 0.0 for i, each in noise.items()}
    return [_of_face(nets[face.index], face, sizes[face.index]) for face in every]


def together(each: Sequence[Spectrum]) -> Spectrum:
    """The spectrum of several faces as one, from those of each; the shape begins where it does on half of the area."""
    area = sum(spectrum.area for spectrum in each)
    ways = []
    for name in ("u", "v"):
        energies: defaultdict[int, float] = defaultdict(float)
        for spectrum in each:
            for band in getattr(spectrum, name).bands:
                energies[_band(band.low * 1.5)] += band.energy
        whole = _direction({k: energy / area for k, energy in energies.items()}, area)
        ways.append(replace(whole, shape=_middle([(getattr(s, name).shape, s.area) for s in each])))
    noises = [(spectrum.area, spectrum.noise) for spectrum in each]
    size = float(np.sqrt(sum(a * s**2 for a, s in noises) / area)) if area else 0.0
    return Spectrum(tuple(face for spectrum in each for face in spectrum.faces), area, ways[0], ways[1], size)


def _middle(values: Sequence[tuple[float, float]]) -> float:
    """The median of values with weights."""
    ordered = sorted(values)
    weights = np.cumsum([weight for _, weight in ordered])
    return ordered[int(np.searchsorted(weights, weights[-1] / 2))][0]


def _of_face(net: Net, face: Face, noise: float) -> Spectrum:
    ways = [_along(net, face, axis) for axis in (0, 1)]
    area = max(each for _, each in ways)
    u, v = (_direction(energies, area) for energies, _ in ways)
    return Spectrum((face.index,), area, u, v, noise)


def _along(net: Net, face: Face, axis: int) -> tuple[dict[int, float], float]:
    """The mean square height by band along one direction, mm², and the area of the face, mm²."""
    groups: dict[tuple[int, bool, int], list[Array]] = defaultdict(list)
    lengths: dict[tuple[int, bool, int], list[float]] = defaultdict(list)
    for points, normals, length, closed in profiles(net, face, axis):
        key = len(points), closed, round(np.log(length) / np.log(ALIKE))
        groups[key].append(length * (_of_ring if closed else _of_beam)(points, normals))
        lengths[key].append(length)
    total = sum(sum(each) for each in lengths.values())
    energies: defaultdict[int, float] = defaultdict(float)
    for key, each in groups.items():
        count, closed, _ = key
        energy, length = np.sum(each, axis=0), float(np.mean(lengths[key]))
        waves, explained = (1.0 / np.arange(1, len(energy) + 1), energy) if closed else _explained(energy, count)
        for wave, part in zip(length * waves, explained.tolist(), strict=True):
            energies[_band(wave)] += part / total
    return dict(energies), total * lines(net, face, 1 - axis)[1]


def _explained(energy: Array, count: int) -> tuple[Array, Array]:
    """Wavelengths over the length, and the energies of such waves that explain those of modes."""
    modes = _modes(count)
    found = np.full(len(modes.waves), energy.sum() / len(modes.waves))
    for _ in range(PASSES):
        found *= modes.table.T @ (energy / np.maximum(modes.table @ found, 1e-300))
    return modes.waves, found


def _of_beam(points: Array, normals: Array) -> Array:
    """Energies of the modes of a profile other than rigid motions, mm²."""
    modes = _modes(len(points))
    slow = int((modes.lengths > SLOW).sum())
    shapes = modes.shapes[:, :slow]
    found = modes.shapes.T @ points
    calm = shapes @ (shapes.T @ normals)
    calm /= np.maximum(np.linalg.norm(calm, axis=1, keepdims=True), 1e-300)
    heights = ((points - shapes @ found[:slow]) * calm).sum(axis=1)
    energy = (modes.shapes.T @ heights) ** 2
    energy[:slow] = (found[:slow] ** 2).sum(axis=1)
    return np.asarray(energy[2:] / len(points))


def _of_ring(points: Array, normals: Array) -> Array:
    """Energies of the waves of a closed profile, with one, two, three … periods, mm²."""
    count = len(points)
    found = np.fft.rfft(points, axis=0)
    slow = np.where(np.arange(len(found))[:, None] <= 1.0 / SLOW, found, 0.0)
    calm = np.where(np.arange(len(found))[:, None] <= 1.0 / SLOW, np.fft.rfft(normals, axis=0), 0.0)
    calm = np.fft.irfft(calm, count, axis=0)
    calm /= np.maximum(np.linalg.norm(calm, axis=1, keepdims=True), 1e-300)
    heights = np.fft.rfft(((points - np.fft.irfft(slow, count, axis=0)) * calm).sum(axis=1))
    energy = np.abs(heights) ** 2
    low = np.arange(len(found)) <= 1.0 / SLOW
    energy[low] = (np.abs(found[low]) ** 2).sum(axis=1)
    return np.asarray(2.0 * energy[1:] / count**2)


def _band(wavelength: float) -> int:
    """The number of the octave in which a wavelength lies."""
    return int(np.floor(np.log2(wavelength / EDGE)))


def _direction(energies: Mapping[int, float], area: float) -> Direction:
    """Bands without gaps, from their mean squares (mm²), and where the shape begins."""
    if not energies:
        return Direction((), 0.0)
    numbers = range(min(energies), max(energies) + 1)
    total = sum(energies.values())
    bands = []
    for k in numbers:
        mean = energies.get(k, 0.0)
        share = mean / total if total > 0.0 else 0.0
        bands.append(Band(EDGE * 2.0**k, EDGE * 2.0 ** (k + 1), float(np.sqrt(mean)), mean * area, share))
    return Direction(tuple(bands), _begin(bands))


def _begin(bands: Sequence[Band]) -> float:
    """The wavelength at which the shape begins: the middle of the band from which energy rises to the longest waves, if
    it also rises to shorter ones."""
    energy, longest = [band.rms**2 for band in bands], bands[-1].high
    first = max((k for k, band in enumerate(bands) if FORM * band.low <= longest), default=0)
    while first and energy[first - 1] < energy[first]:
        first -= 1
    least = max(NOTHING[0], NOTHING[1] * longest)
    return math.sqrt(bands[first].low * bands[first].high) if sum(energy[:first]) > least**2 else 0.0
