"""Plots of details by level; the only module here that needs matplotlib."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import PathCollection
from matplotlib.figure import Figure

from mracad.bspline.knots import Array

PANELS = (7.0, 1.3), (3.6, 3.0)
"""Width and height of the panel of a level of a curve and of a surface, in inches."""

ABREAST = 3
"""Largest number of panels of a surface in a row."""


def figure(
    levels: Sequence[tuple[Mapping[str, tuple[Array, ...]], Mapping[str, Array]]],
    domains: Sequence[tuple[float, float]],
) -> Figure:
    """A panel for each level.

    Parameters
    ----------
    levels : sequence of (places, heights)
        By band, from the finest.
    domains : sequence of (float, float)
        One for a curve, two for a surface.
    """
    flat = len(domains) == 1
    columns = 1 if flat else min(max(len(levels), 1), ABREAST)
    rows = -(-max(len(levels), 1) // columns)
    width, height = PANELS[not flat]
    found = Figure(figsize=(width * columns, height * rows), layout="constrained")
    for number, (places, heights) in enumerate(levels):
        panel = found.add_subplot(rows, columns, number + 1, xlim=domains[0], title=f"level {number}")
        if flat:
            panel.vlines(places["HL"][0], 0.0, heights["HL"])
            panel.set(ylim=(0.0, None), ylabel="height")
        else:
            panel.set(xlabel="u", ylabel="v", ylim=domains[1])
            found.colorbar(_scattered(panel, places, heights), ax=panel)
    return found


def _scattered(panel: Axes, places: Mapping[str, tuple[Array, ...]], heights: Mapping[str, Array]) -> PathCollection:
    """Dots in the colour of their heights, the highest on top."""
    u, v = (
        np.concatenate([np.broadcast_arrays(places[n][0][:, None], places[n][1])[axis].ravel() for n in heights])
        for axis in (0, 1)
    )
    colour = np.concatenate([each.ravel() for each in heights.values()])
    order = np.argsort(colour)
    return panel.scatter(u[order], v[order], c=colour[order], s=16, vmin=0.0, cmap="viridis_r", clip_on=False)
