"""Spectra as a picture."""

from __future__ import annotations

import io
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from mracad.inspect.scalogram import Scalogram
    from mracad.inspect.spectrum import Direction, Spectrum

DECADES = 6.0
"""Number of decades of height that a picture shows at most."""

SHADES = 3.0
"""Number of decades of height that the shades of a scalogram show at most."""


def picture(name: str, each: Sequence[Spectrum], scalograms: Mapping[str, Scalogram | None], form: str) -> bytes:
    """A picture of spectra, in one of matplotlib's formats.

    Heights by band along u and v: the model in black, with its noise floor, where its shape begins and the scale that
    leaves the shape; each face in grey.  Under them scalograms, by direction, if there are any.
    """
    from matplotlib import rc_context
    from matplotlib.figure import Figure

    from mracad.inspect.spectrum import together

    whole = together(each)
    figure = Figure(figsize=(10, 7 if scalograms else 4), layout="constrained")
    rows = 2 if scalograms else 1
    for place, way in enumerate("uv", 1):
        axes = figure.add_subplot(rows, 2, place, title=f"{name}: waves along {way}")
        faces = [getattr(one, way) for one in each] if len(each) > 1 else []
        _bands(axes, getattr(whole, way), faces, whole.scale)
        shown = scalograms.get(way)
        if shown is not None:
            _shades(figure, figure.add_subplot(rows, 2, 2 + place), way, shown)
    file = io.BytesIO()
    with rc_context({"svg.hashsalt": "mracad", "svg.fonttype": "none"}):
        meta: dict[str, Any] = {"Software": None} if form == "png" else {"Date": None, "Creator": None}
        figure.savefig(file, format=form, dpi=100, metadata=meta)
    return file.getvalue()


def _bands(axes: Any, whole: Direction, faces: Sequence[Direction], scale: float | None) -> None:
    """Heights by band."""
    axes.set(xscale="log", yscale="log", xlabel="wavelength, mm", ylabel="rms height, mm")
    axes.grid(alpha=0.3)
    for direction, style in [*((face, "0.8") for face in faces), (whole, "0")]:
        if direction.bands:
            axes.stairs([band.rms for band in direction.bands], _ends(direction), baseline=None, color=style)
    heights = [band.rms for band in whole.bands if band.rms > 0.0]
    if heights:
        least = max(max(heights) * 10**-DECADES, min(heights) / 2)
        seen = [band for each in (*faces, whole) for band in each.bands if band.rms > least]
        axes.set_ylim(least, 3.0 * max(band.rms for band in seen))
        axes.set_xlim(min(band.low for band in seen), max(band.high for band in seen))
    if any(band.floor for band in whole.bands):
        floors = [band.floor for band in whole.bands]
        axes.stairs(floors, _ends(whole), baseline=None, color="C1", label="noise")
    if whole.shape:
        axes.axvline(whole.shape, color="0", linestyle="--", label=f"shape begins at {whole.shape:.3g} mm")
    if scale is not None:
        axes.axvline(scale, color="C0", linestyle=":", label=f"--scale {scale:.3g}mm")
    if axes.get_legend_handles_labels()[0]:
        axes.legend(loc="upper left")


def _ends(direction: Direction) -> list[float]:
    return [direction.bands[0].low, *(band.high for band in direction.bands)]


def _shades(figure: Any, axes: Any, way: str, shown: Scalogram) -> None:
    """Heights by place and wavelength."""
    import numpy as np
    from matplotlib.colors import LogNorm

    most = max(float(shown.rms.max()), 1e-300)
    places = np.linspace(0.0, shown.length, shown.rms.shape[1] + 1)
    waves = np.append(shown.lows, 2.0 * shown.lows[-1])
    shades = LogNorm(most * 10**-SHADES, most, clip=True)
    drawn = axes.pcolormesh(places, waves, shown.rms, norm=shades, cmap="viridis", rasterized=True)
    axes.set(yscale="log", xlabel=f"along {way}, mm", ylabel="wavelength, mm")
    figure.colorbar(drawn, ax=axes, label="rms height, mm")
