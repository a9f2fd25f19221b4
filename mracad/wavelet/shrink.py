"""Noise shrunk in wavelet space: each detail keeps the share of it that is shape.

Analysis on any knots turns white noise on control points (standard deviation σ of each coordinate) into details of
known deviation σ s, s the product of the norms of two rows of the analysis matrices.  With z = w / (σ s),

    thresholded   z where |z| > √(2 ln n), else 0         D. L. Donoho, I. M. Johnstone, Biometrika 81, 1994
    shrunk        z p² / (p² + 1)                         p the same detail of a pilot: empirical Wiener shrinkage

along the axes in which the details differ most from white noise, so rotations commute, and as the mean over ladders
that drop other knots ("spun"), so that no knot is special.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from mracad.bspline.knots import KnotVector
from mracad.bspline.surface import Net
from mracad.wavelet.ladder import rungs_by_level
from mracad.wavelet.pyramid import LevelBands
from mracad.wavelet.step import step
from mracad.wavelet.transform import decompose, reconstruct

Array = np.ndarray

Gain = Callable[[Array, Array], Array]
"""Maps details, and those of a pilot, both over their deviations, to the details that are kept."""

SPINS, FEW, LARGE = 16, 4, 400_000
"""Number of ladders over which the mean is taken, the least number, and the limit of their control points in all."""

BLOCK = 256
"""Number of columns of analysis matrices that are processed together."""


@dataclass(frozen=True, eq=False)
class Spin:
    """One pair of ladders, and the deviations that noise has in its details.

    Attributes
    ----------
    u, v : sequence of KnotVector
    deviations : sequence of mapping of str to ndarray
        Standard deviations of the details of each level and band for unit noise on control points.
    """

    u: Sequence[KnotVector]
    v: Sequence[KnotVector]
    deviations: Sequence[dict[str, Array]]


def spins(net: Net, keep: tuple[frozenset[float], frozenset[float]] = (frozenset(),) * 2) -> list[Spin]:
    """Ladders of a net that drop different knots, chosen reproducibly.

    Parameters
    ----------
    net : Net
    keep : pair of frozenset of float
        Knots in u and v that stay on every rung.
    """
    rng = np.random.default_rng(0)
    found = []
    for _ in range(int(np.clip(LARGE // (net.u.count * net.v.count), FEW, SPINS))):
        odd = rng.integers(2, size=(2, 64)) > 0
        u, v = (rungs_by_level(k, keep[a], odd=odd[a].tolist()) for a, k in enumerate((net.u, net.v)))
        found.append(Spin(u, v, deviations(u, v)))
    return found


def deviations(u: Sequence[KnotVector], v: Sequence[KnotVector]) -> list[dict[str, Array]]:
    """Standard deviations of the details of each level and band for unit white noise on control points.

    Parameters
    ----------
    u, v : sequence of KnotVector
        Ladders.
    """
    rows = [_norms(ladder) for ladder in (u, v)]
    coarse = [np.ones(ladder[0].count) for ladder in (u, v)]
    found = []
    for level in range(max(map(len, rows))):
        detail: list[Array | None] = [None, None]
        for axis, each in enumerate(rows):
            if level < len(each):
                coarse[axis], detail[axis] = each[level]
        names = {"HL": (detail[0], coarse[1]), "LH": (coarse[0], detail[1]), "HH": (detail[0], detail[1])}
        found.append({
            name: np.multiply.outer(a, b) for name, (a, b) in names.items() if a is not None and b is not None
        })  # fmt: skip
    return found


def _norms(ladder: Sequence[KnotVector]) -> list[tuple[Array, Array]]:
    """Norms of the rows of the analysis matrices of each level: of coarse control points, and of details."""
    steps = [step(coarse, fine) for fine, coarse in pairwise(ladder)]
    total = [(np.zeros(each.coarse.count), np.zeros(each.fine.count - each.coarse.count)) for each in steps]
    n = ladder[0].count
    for begin in range(0, n, BLOCK):
        c = np.eye(n, min(BLOCK, n - begin), -begin)
        for each, (coarse, detail) in zip(steps, total, strict=True):
            c, d = each.analyse(c, 0)
            coarse += (c**2).sum(axis=1)
            detail += (d**2).sum(axis=1)
    return [(np.sqrt(coarse), np.sqrt(detail)) for coarse, detail in total]


def thresholded(poles: Array, noise: float, every: Sequence[Spin]) -> Array:
    """Control points without the details that noise alone could cause.

    Parameters
    ----------
    poles : ndarray (nu, nv, 3)
    noise : float
        Standard deviation of each coordinate, mm.
    every : sequence of Spin
    """
    least = np.sqrt(2 * np.log(max(poles.shape[0] * poles.shape[1], 2)))
    return _mean(poles, noise, every, lambda z, _: z * (np.abs(z) > least), poles)


def shrunk(poles: Array, noise: float, every: Sequence[Spin], pilot: Array) -> Array:
    """Control points with each detail multiplied by its gain, near 1 where the detail of a pilot is far above the
    noise.

    Parameters
    ----------
    poles, pilot : ndarray (nu, nv, 3)
        Noisy control points, and an estimate without noise.
    noise : float
        Standard deviation of each coordinate, mm.
    every : sequence of Spin
    """
    return _mean(poles, noise, every, lambda z, p: z * p**2 / (p**2 + 1), pilot)


def _mean(poles: Array, noise: float, every: Sequence[Spin], gain: Gain, pilot: Array) -> Array:
    """The mean, over ladders, of control points whose details (over their deviations) were multiplied by gains."""
    total = np.zeros_like(poles)
    for spin in every:
        own, other = (decompose(each, spin.u, spin.v) for each in (poles, pilot))
        size = [{name: noise * s[..., None] for name, s in each.items()} for each in spin.deviations]
        both = list(zip(size, own.levels, strict=True))
        axes = _axes([band / s[name] for s, level in both for name, band in level.bands.items()])
        levels = []
        for s, level, guide in zip(size, own.levels, other.levels, strict=True):
            levels.append(_shrunk(level, guide, s, axes, gain))
        total += reconstruct(replace(own, levels=tuple(levels)))
    return total / len(every)


def _shrunk(level: LevelBands, guide: LevelBands, size: dict[str, Array], axes: Array, gain: Gain) -> LevelBands:
    bands = {}
    for name, band in level.bands.items():
        z, p = (each @ axes / size[name] for each in (band, guide.bands[name]))
        bands[name] = (gain(z, p) * size[name]) @ axes.T
    return replace(level, bands=bands, residual=None)


def _axes(z: Sequence[Array]) -> Array:
    """Orthonormal axes, as columns, in which details z over their deviations differ most from white noise."""
    flat = np.concatenate([np.zeros((0, 3)), *(each.reshape(-1, 3) for each in z)])
    return np.asarray(np.linalg.eigh(flat.T @ flat)[1])
