"""Write knurl.step, a knurled plate, for the recipe beside it.

Usage: python samples/example/make.py [OUTDIR]
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
from OCP.BRepBuilderAPI import BRepBuilderAPI_MakeFace

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))
from samples.models import documents, geometry, splines, topology

SIDE, SPANS = 60.0, 40
HEIGHT, PERIOD = 0.15, 10.0


def main(folder: Path) -> None:
    """Write the file: at its borders, where it continues mirrored, the knurl is symmetric."""
    knots = splines.clamped(np.linspace(0.0, SIDE, SPANS + 1), 3)
    x, y = np.meshgrid(splines.greville(knots, 3), splines.greville(knots, 3), indexing="ij")
    lower = (2 + np.cos(2 * np.pi * SIDE / SPANS / PERIOD)) / 3  # waves of a spline are lower than those of its points
    z = HEIGHT / lower**2 * np.cos(2 * np.pi * x / PERIOD) * np.cos(2 * np.pi * y / PERIOD)
    poles = splines.settle(np.stack([x, y, z], axis=-1), geometry.FINE)
    plate = BRepBuilderAPI_MakeFace(geometry.surface(poles, knots, knots), topology.TOL).Face()
    documents.write(documents.single(plate, "knurl"), folder / "knurl.step")


if __name__ == "__main__":
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else Path(__file__).parent)
