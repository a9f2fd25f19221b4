"""Spectra as a picture."""

from __future__ import annotations

import io
from collections.abc import Sequence
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from mracad.inspect.spectrum import Spectrum

DECADES = 6.0
"""Number of decades of height that a picture shows at most."""


def png(name: str, each: Sequence[Spectrum]) -> bytes:
    """Heights by band along u and v: the model in black with where its shape begins, each face in grey."""
    from matplotlib.figure import Figure

    from mracad.inspect.spectrum import together

    figure = Figure(figsize=(10, 4), layout="constrained")
    for place, way in enumerate("uv", 1):
        axes = figure.add_subplot(1, 2, place, title=f"{name}: waves along {way}")
        axes.set(xscale="log", yscale="log", xlabel="wavelength, mm", ylabel="rms height, mm")
        axes.grid(alpha=0.3)
        whole = getattr(together(each), way)
        for direction, style in [*((getattr(s, way), "0.8") for s in each if len(each) > 1), (whole, "0")]:
            if not direction.bands:
                continue
            ends = [direction.bands[0].low, *(band.high for band in direction.bands)]
            axes.stairs([band.rms for band in direction.bands], ends, baseline=None, color=style)
        seen = [band.rms for band in whole.bands if band.rms > 0.0]
        if seen:
            axes.set_ylim(bottom=max(max(seen) * 10**-DECADES, min(seen) / 2))
        if whole.shape:
            axes.axvline(whole.shape, color="0", linestyle="--", label=f"shape begins at {whole.shape:.3g} mm")
            axes.legend()
    picture = io.BytesIO()
    figure.savefig(picture, format="png", dpi=100, metadata={"Software": None})
    return picture.getvalue()
