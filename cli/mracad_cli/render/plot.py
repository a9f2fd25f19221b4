"""Spectra as a picture."""

from __future__ import annotations

import io
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from mracad.errors import needing

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
    with needing("view", "cannot plot spectra"):
        from matplotlib.figure import Figure

    from mracad.inspect.spectrum import together

    whole = together(each)
    figure = Figure(figsize=(10, 7 if scalograms else 4), layout="constrained")
    rows = 2 if scalograms else 1
    marks = {f"--scale {whole.scale:.3g}mm": whole.scale} if whole.scale is not None else {}
    for place, way in enumerate("uv", 1):
        axes = figure.add_subplot(rows, 2, place, title=f"{name}: waves along {way}")
        faces = [_Curve(getattr(one, way), "0.8") for one in each] if len(each) > 1 else []
        _bands(axes, [*faces, _Curve(getattr(whole, way), "0")], getattr(whole, way), marks)
        shown = scalograms.get(way)
        if shown is not None:
            _shades(figure, figure.add_subplot(rows, 2, 2 + place), way, shown)
    return _packed(figure, form)


def compared(name: str, before: Sequence[Spectrum], after: Sequence[Spectrum], scales: Mapping[str, float]) -> bytes:
    """Spectra of the same faces before and after an edit as SVG; noise and shape are those before; scales in mm."""
    with needing("view", "cannot plot spectra"):
        from matplotlib.figure import Figure

    from mracad.inspect.spectrum import together

    figure = Figure(figsize=(10, 4), layout="constrained")
    both = together(before), together(after)
    for place, way in enumerate("uv", 1):
        axes = figure.add_subplot(1, 2, place, title=f"{name}: waves along {way}")
        old, new = (getattr(each, way) for each in both)
        _bands(axes, [_Curve(old, "0.6", "before"), _Curve(new, "0", "after")], old, scales)
    return _packed(figure, "svg")


@dataclass(frozen=True)
class _Curve:
    """Heights by band, and how they are drawn."""

    heights: Direction
    colour: str
    label: str | None = None


def _packed(figure: Any, form: str) -> bytes:
    """A figure in one of matplotlib's formats, the same bytes each time."""
    from matplotlib import rc_context

    file = io.BytesIO()
    with rc_context({"svg.hashsalt": "mracad", "svg.fonttype": "none"}):
        meta: dict[str, Any] = {"Software": None} if form == "png" else {"Date": None, "Creator": None}
        figure.savefig(file, format=form, dpi=100, metadata=meta)
    return file.getvalue()


def _bands(axes: Any, curves: Sequence[_Curve], whole: Direction, scales: Mapping[str, float]) -> None:
    """Heights by band; with the noise and the shape of the ``whole``, and scales, mm."""
    axes.set(xscale="log", yscale="log", xlabel="wavelength, mm", ylabel="rms height, mm")
    axes.grid(alpha=0.3)
    for each in curves:
        if each.heights.bands:
            heights = [band.rms for band in each.heights.bands]
            axes.stairs(heights, _ends(each.heights), baseline=None, color=each.colour, label=each.label)
    heights = [band.rms for band in whole.bands if band.rms > 0.0]
    if heights:
        least = max(max(heights) * 10**-DECADES, min(heights) / 2)
        seen = [band for each in curves for band in each.heights.bands if band.rms > least]
        axes.set_ylim(least, 3.0 * max(band.rms for band in seen))
        axes.set_xlim(min(band.low for band in seen), max(band.high for band in seen))
    if any(band.floor for band in whole.bands):
        floors = [band.floor for band in whole.bands]
        axes.stairs(floors, _ends(whole), baseline=None, color="C1", label="noise")
    if whole.shape:
        axes.axvline(whole.shape, color="0", linestyle="--", label=f"shape begins at {whole.shape:.3g} mm")
    for label, scale in scales.items():
        axes.axvline(scale, color="C0", linestyle=":", label=label)
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
