"""Semi-orthogonal spline wavelets on any knots: curves, surfaces and joined patches on levels, and back.

>>> import numpy as np
>>> from scipy.interpolate import make_interp_spline
>>> from mracad.wavelet import wavedec, waverec
>>> x = np.linspace(0, 10, 41)
>>> pyramid = wavedec(make_interp_spline(x, np.sin(x) + 0.1 * np.cos(20 * x)))
>>> coarse = waverec(pyramid, level=2)

It needs only numpy and scipy, and matplotlib for plots.  Names are loaded on first use.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from mracad.wavelet.filters import wavelets as wavelets
    from mracad.wavelet.ladder import ladder_for_scale as ladder_for_scale
    from mracad.wavelet.ladder import rungs_by_level as rungs_by_level
    from mracad.wavelet.project import projection as projection
    from mracad.wavelet.pyramid import Pyramid as Pyramid
    from mracad.wavelet.splines import wavedec as wavedec
    from mracad.wavelet.splines import wavedec_patches as wavedec_patches
    from mracad.wavelet.splines import waverec as waverec
    from mracad.wavelet.splines import waverec_patches as waverec_patches
    from mracad.wavelet.transform import decompose as decompose
    from mracad.wavelet.transform import reconstruct as reconstruct

_HOMES = {
    "Pyramid": "pyramid",
    "decompose": "transform",
    "ladder_for_scale": "ladder",
    "projection": "project",
    "reconstruct": "transform",
    "rungs_by_level": "ladder",
    "wavedec": "splines",
    "wavedec_patches": "splines",
    "wavelets": "filters",
    "waverec": "splines",
    "waverec_patches": "splines",
}

__all__ = list(_HOMES)


def __getattr__(name: str) -> Any:
    if name not in _HOMES:
        raise AttributeError(f"module 'mracad.wavelet' has no attribute {name!r}")
    value = getattr(import_module(f"mracad.wavelet.{_HOMES[name]}"), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
