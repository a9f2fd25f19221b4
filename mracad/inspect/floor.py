"""The noise floor of a spectrum: the waves that independent noise of control points makes.

On even spans h the white noise σ of coefficients has the density σ² h per frequency, and the B-spline of degree p
multiplies it by sinc²ᵖ⁺²(h f).  The other direction, of degree q, leaves the mean square c of its B-splines.  An octave
from the wavelength Λ then has the mean square height

    2 σ² c Σ_i h_i² / L ∫ sinc²ᵖ⁺²(h_i f) df,    f from 1 / 2Λ to 1 / Λ,    c = ∫ sinc²ᑫ⁺²(t) dt,

for spans h_i of the length L, each taken as one of many of its kind.
"""

from __future__ import annotations

from functools import cache

import numpy as np

from mracad.bspline.basis import legendre
from mracad.bspline.surface import Net
from mracad.wavelet.ladder import arc_lengths

Array = np.ndarray

POINTS = 8
"""Gauss points in an octave."""


def floor(net: Net, axis: int, noise: float, lows: Array) -> Array:
    """Root mean square heights in octaves.

    Parameters
    ----------
    net : Net
    axis : {0, 1}
        Direction of the waves.
    noise : float
        Standard deviation of the coordinates of control points, mm.
    lows : ndarray (b,)
        Shortest wavelengths of the octaves, mm.

    Returns
    -------
    ndarray (b,)
        mm.
    """
    own, other = (net.u, net.v)[:: 1 - 2 * axis]
    spans = arc_lengths(net, axis)
    nodes, weights = legendre(POINTS)
    high = 1.0 / lows
    frequency = high[:, None] * (0.75 + 0.25 * nodes)
    gain = np.sinc(spans[:, None, None] * frequency) ** (2 * own.degree + 2)
    integral = 0.25 * high * (gain @ weights)
    mean = (spans**2) @ integral / max(float(spans.sum()), 1e-300)
    return np.asarray(noise * np.sqrt(2.0 * _energy(other.degree) * mean))


@cache
def _energy(degree: int) -> float:
    """The integral of the square of a B-spline on spans of length 1."""
    t = (np.arange(4000) + 0.5) / 100.0
    return float(2.0 * (np.sinc(t) ** (2 * degree + 2)).sum() / 100.0)
