"""Draw the picture of the README: reflection lines on the sample panel before and after smoothing.

Usage: python docs/picture.py OUT.png
"""

from __future__ import annotations

import sys
from pathlib import Path

import matplotlib
import numpy as np

import mracad

matplotlib.use("Agg")
import matplotlib.pyplot as plt

SAMPLE = Path(__file__).parents[1] / "samples" / "panel.step"
LIGHT = np.array([0.25, 1.0, 0.35]) / np.linalg.norm([0.25, 1.0, 0.35])
STRIPES = 60


def zebra(axes: plt.Axes, model: mracad.Model) -> None:
    """Stripes of the angle between the mirrored view direction and a light, seen from above."""
    for surface in model.surfaces:
        net = surface.net
        points, along_u, along_v = net.grid(*(np.linspace(*k.domain, 420) for k in (net.u, net.v)), derivatives=1)
        normals = np.cross(along_u, along_v)
        normals /= np.linalg.norm(normals, axis=-1, keepdims=True)
        mirrored = 2 * normals[..., 2:] * normals - np.array([0.0, 0.0, 1.0])
        stripes = 0.5 + 0.5 * np.tanh(3 * np.sin(STRIPES * (mirrored @ LIGHT)))
        axes.pcolormesh(points[..., 0], points[..., 1], stripes, cmap="gray", shading="gouraud", rasterized=True)
    axes.set_aspect("equal")
    axes.axis("off")


def main(target: str) -> None:
    """Smooth the panel with its seams frozen and with its seams moving, and draw all three."""
    document = mracad.read(SAMPLE)
    before = mracad.snapshot(document)
    frozen, coupled = (
        mracad.smooth(before, mracad.Smooth(scale="25mm", edges=edges)).displacement.applied(before)
        for edges in ("frozen", "coupled")
    )
    figure, panels = plt.subplots(1, 3, figsize=(18, 4.8))
    titles = ("as it came", "smoothed at 25 mm, seams frozen", "smoothed at 25 mm, seams moving")
    for axes, model, title in zip(panels, (before, frozen, coupled), titles, strict=True):
        zebra(axes, model)
        axes.set_title(title)
    figure.tight_layout()
    figure.savefig(target, dpi=80, metadata={"Software": None})


if __name__ == "__main__":
    main(sys.argv[1])
