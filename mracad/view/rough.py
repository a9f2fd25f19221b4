"""Roughness place by place: how much the waves of a surface bend it, as edits are judged by.

Edits may not make bending ∫ κ₁² + κ₂² dA worse, and place by place not that beyond a base, ∫ |S − S₀|² dA with the
shape operators of surface and base (:mod:`mracad.inspect.places`).  Here the base is the surface without waves shorter
than a wavelength Λ, and roughness is the root of the mean of |S − S₀|² around a place: that of a wave z = a sin kx is
a k² / √2.  The mean is weighted by a Gaussian whose standard deviation is Λ / 4, half the side of a place.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mracad.bspline.fit import interpolated
from mracad.bspline.knots import KnotVector
from mracad.bspline.surface import Net, pairs
from mracad.model.facets import Closed, Facets, Ground, Spline
from mracad.seam.metric import creases
from mracad.seam.stretch import Limit
from mracad.view.raster import Triangles, rasterised
from mracad.view.spots import cross, dot, shape
from mracad.wavelet.project import at_scale

Array = np.ndarray

_WIDTH = 0.25  # wavelengths: standard deviation of the weights
_FINE, _SPAN = 8, 3  # samples per wavelength, and per span
_COUNTS = 16, 512  # least and largest number of samples along a direction
_LINES = 33  # lines along which lengths are measured
_DEGREE = 3  # of the base at least: those of a lower one bend in steps
_CLOSED = 1e-6  # share of its length within which the ends of a closed face meet
_REACH = 6.0  # widths: where the weights end
_THIN = 1e-6  # sine of the angle between S_u and S_v up to which a place does not count


@dataclass(frozen=True, eq=False)
class Rough:
    """The roughness of a face.

    Attributes
    ----------
    at : (ndarray (nu,), ndarray (nv,))
        Parameters at even steps of length, along u and v.
    square : ndarray (nu, nv)
        The square of the roughness there, 1/mm².
    """

    at: tuple[Array, Array]
    square: Array

    @classmethod
    def of(cls, facets: Facets, wavelength: float) -> Rough | None:
        """The roughness of a face by waves up to a length (mm); None where it has none."""
        if isinstance(facets.ground, Closed):
            return None
        low, high = facets.uv.min(axis=0), facets.uv.max(axis=0)
        walks = [_walk(facets.ground, low, high, axis) for axis in (0, 1)]
        rings = [_closes(facets.ground, low, high, axis, walks[axis][1][-1]) for axis in (0, 1)]
        net, frame = (
            (facets.ground.net, facets.ground.frame) if isinstance(facets.ground, Spline) else (None, np.eye(4))
        )
        counts = [
            int(np.clip(max(_FINE * far[-1] / wavelength, _SPAN * _spans(net, axis, low, high)), *_COUNTS))
            for axis, (_, far) in enumerate(walks)
        ]
        at = [np.interp((np.arange(n) + 0.5) / n * far[-1], far, x) for n, (x, far) in zip(counts, walks, strict=True)]
        base = _base(net or _fitted(facets.ground, low, high, counts), wavelength)
        if base is None:
            return None
        off, areas = _beyond(facets.ground, Spline(base, frame), pairs(*at))
        inside = _inside(facets, at, walks, counts)
        steps = [far[-1] / n for n, (_, far) in zip(counts, walks, strict=True)]
        weights = areas.reshape(counts) * inside
        return cls(
            (at[0], at[1]), _meant(off.reshape(counts), weights, [_WIDTH * wavelength / s for s in steps], rings)
        )

    def __call__(self, uv: Array) -> Array:
        """Roughness at parameters ``(q, 2)``, 1/mm."""
        from scipy.ndimage import map_coordinates

        place = [np.interp(x, at, np.arange(len(at))) for x, at in zip(uv.T, self.at, strict=True)]
        return np.asarray(np.sqrt(np.maximum(map_coordinates(self.square, place, order=1, mode="nearest"), 0.0)))


def _walk(ground: Ground, low: Array, high: Array, axis: int) -> tuple[Array, Array]:
    """Parameters along an axis, and lengths up to there (mm), in the middle of all lines."""
    along, across = np.linspace(low[axis], high[axis], _COUNTS[1]), np.linspace(low[1 - axis], high[1 - axis], _LINES)
    uv = pairs(across, along)[:, ::-1] if axis == 0 else pairs(across, along)
    slopes = ground.jets(uv, 1)[1 + axis]
    speed = np.median(np.linalg.norm(slopes, axis=1).reshape(_LINES, -1), axis=0)
    steps = 0.5 * (speed[1:] + speed[:-1]) * np.diff(along)
    return along, np.append(0.0, np.cumsum(np.maximum(steps, 1e-300)))


def _closes(ground: Ground, low: Array, high: Array, axis: int, length: float) -> bool:
    """Whether the lines along an axis, of about a length (mm), end where they begin."""
    uv = np.linspace(low, high, _LINES)
    ends = [np.where(np.arange(2) == axis, end, uv) for end in (low, high)]
    one, other = (ground.jets(each, 1)[0] for each in ends)
    return bool(np.linalg.norm(one - other, axis=1).max() <= _CLOSED * length)


def _spans(net: Net | None, axis: int, low: Array, high: Array) -> int:
    """The spans of a net between limits."""
    if net is None:
        return 0
    breaks = (net.u, net.v)[axis].breaks
    return int(np.count_nonzero((breaks > low[axis]) & (breaks < high[axis]))) + 1


def _fitted(ground: Ground, low: Array, high: Array, counts: list[int]) -> Net:
    """A bicubic net through a surface of any other kind."""
    u, v = (
        KnotVector(np.concatenate([[a] * 3, np.linspace(a, b, n - 2), [b] * 3]), 3)
        for a, b, n in zip(low, high, counts, strict=True)
    )
    points = ground.jets(pairs(u.greville(), v.greville()), 1)[0]
    return Net(u, v, interpolated(u, v, points.reshape(u.count, v.count, 3)))


def _base(net: Net, wavelength: float) -> Net | None:
    """A net without waves shorter than a length, but with its rounds; None if it has no such waves."""
    net = net.over(net.u.elevated(_DEGREE), net.v.elevated(_DEGREE))
    sharp, both = creases(net, np.ones(net.poles.shape[:2], bool)), (wavelength, wavelength)
    found = at_scale(net, both, sharp, Limit.of(net, both, sharp).finer(net, both))
    return None if found.poles is net.poles else found


def _beyond(ground: Ground, base: Ground, uv: Array) -> tuple[Array, Array]:
    """|S − S₀|² and the area per parameters at places, ``(q,)``; no area where the surface is degenerate."""
    jet, smooth = (np.array(each.jets(uv, 2)).swapaxes(1, 2) for each in (ground, base))
    cut = cross(jet[1], jet[2])
    area2 = dot(cut, cut)
    regular = area2 > _THIN**2 * dot(jet[1], jet[1]) * dot(jet[2], jet[2])
    a, b, c = shape(jet)[1] - shape(smooth)[1]
    areas = np.where(regular, np.sqrt(area2), 0.0)
    return np.where(regular, a * a + 2.0 * b * b + c * c, 0.0), areas


def _inside(facets: Facets, at: list[Array], walks: list[tuple[Array, Array]], counts: list[int]) -> Array:
    """Whether places lie on the face, ``(nu, nv)``."""
    places = [np.interp(x, *walk) / walk[1][-1] * n for x, walk, n in zip(facets.uv.T, walks, counts, strict=True)]
    corners = np.stack(places[::-1], axis=1)[facets.corners]
    found, _ = rasterised(Triangles.of(corners, np.zeros((*corners.shape[:2], 3))), (0, counts[0]), counts[1])
    return np.asarray(found >= 0)


def _meant(values: Array, weights: Array, widths: list[float], rings: list[bool]) -> Array:
    """Means of values, by weights and a Gaussian of widths (in samples); ``rings`` tells which axes close."""
    from scipy.ndimage import gaussian_filter

    how = {"mode": ["wrap" if ring else "constant" for ring in rings], "truncate": _REACH}
    total, sums = (gaussian_filter(each, widths, **how) for each in (weights, weights * values))
    return np.asarray(sums / np.maximum(total, 1e-300))
