"""Draw the curves on the page of the mathematics.

Usage: python docs/curves.py
"""

from __future__ import annotations

from pathlib import Path

import matplotlib
import numpy as np
from matplotlib.figure import Figure

from mracad.bspline.curve import Curve
from mracad.bspline.knots import KnotVector
from mracad.wavelet.filters import wavelets
from mracad.wavelet.ladder import rungs_by_level

HERE = Path(__file__).parent
BREAKS = (0.0, 0.5, 2.0, 2.6, 4.0, 4.3, 6.0, 7.2, 8.0, 9.5, 9.8, 11.0, 12.0)
"""Of the wavelets that are drawn; every second one is left out on the coarse level."""


def on_uneven_knots() -> Figure:
    """All cubic wavelets between two levels."""
    fine = KnotVector([0.0] * 3 + list(BREAKS) + [BREAKS[-1]] * 3, 3)
    coarse = rungs_by_level(fine)[1]
    figure = Figure(figsize=(8, 2.8), layout="constrained")
    axes = figure.subplots()
    t = np.linspace(fine.breaks[0], fine.breaks[-1], 1001)
    for column in wavelets(coarse, fine).toarray().T:
        values = Curve(fine, column[:, None] / np.abs(column).max()).evaluate(t)[0, :, 0]
        axes.plot(t, np.where(np.abs(values) < 1e-9, np.nan, values), linewidth=1.4)
    axes.set_xticks(fine.breaks, labels=["" if knot in coarse.breaks else "×" for knot in fine.breaks])
    axes.set_yticks([])
    axes.grid(axis="x", linewidth=0.4)
    axes.set_xlabel("knots (× those that the coarse level lacks)")
    return figure


def gains() -> Figure:
    """What smoothing keeps of waves, and a band of an octave."""
    figure = Figure(figsize=(8, 2.8), layout="constrained")
    axes = figure.subplots()
    ratio = np.geomspace(1 / 8, 8, 600)
    band = 1 / (1 + (1 / ratio) ** 16) - 1 / (1 + (2 / ratio) ** 16)
    axes.plot(ratio, 1 / (1 + (1 / ratio) ** 8), label="smooth")
    axes.plot(ratio, band, label="a band of an octave (equalize)")
    axes.plot([0.5, 3.0], [0.004, 1 - 2e-4], "o", color="black", markersize=4)
    axes.set_xscale("log", base=2)
    axes.set_xticks(
        [1 / 8, 1 / 4, 1 / 2, 1, 2, 3, 4, 8], labels=["1/8", "1/4", "1/2", "1", "2", "3", "4", "8"], minor=False
    )
    axes.set_xlabel("wavelength / scale")
    axes.set_ylabel("share of the height")
    axes.grid(linewidth=0.4)
    axes.legend(frameon=False)
    return figure


if __name__ == "__main__":
    matplotlib.rcParams |= {"svg.hashsalt": "mracad", "svg.fonttype": "none", "font.size": 9}
    for name, figure in (("wavelets", on_uneven_knots()), ("gain", gains())):
        figure.savefig(HERE / f"{name}.svg", metadata={"Date": None})
