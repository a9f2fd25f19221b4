"""Write details.step: a plate with an emboss (#1) and one with a ripple (#2), for the recipe beside it.

Usage: python samples/example/make.py [OUTDIR]
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
from OCP.BRep import BRep_Builder
from OCP.BRepBuilderAPI import BRepBuilderAPI_MakeFace
from OCP.TopoDS import TopoDS_Compound

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))
from samples.models import documents, geometry, splines, topology

SIDE, SPANS = 60.0, 40


def emboss(x: np.ndarray, y: np.ndarray) -> np.ndarray:
    """An oval of 1.5 mm with a notch."""
    oval = np.exp(-(((x - 30) / 6) ** 2) - ((y - 30) / 4) ** 2)
    return 1.5 * oval - 0.6 * np.exp(-((x - 34) ** 2 + (y - 30) ** 2) / 9)


def ripple(x: np.ndarray, y: np.ndarray) -> np.ndarray:
    """A knurl of 0.15 mm, 10 mm long, symmetric at the borders, where it continues mirrored."""
    return 0.15 * np.cos(2 * np.pi * x / 10) * np.cos(2 * np.pi * y / 10)


def main(folder: Path) -> None:
    """Write the file."""
    breaks = np.linspace(0.0, SIDE, SPANS + 1)
    knots = splines.clamped(breaks, 3)
    x, y = np.meshgrid(splines.greville(knots, 3), splines.greville(knots, 3), indexing="ij")
    plates, builder = TopoDS_Compound(), BRep_Builder()
    builder.MakeCompound(plates)
    for shape, shift in ((emboss, 0.0), (ripple, 100.0)):
        poles = splines.settle(np.stack([x + shift, y, shape(x, y)], axis=-1), geometry.FINE)
        builder.Add(plates, BRepBuilderAPI_MakeFace(geometry.surface(poles, knots, knots), topology.TOL).Face())
    documents.write(documents.single(plates, "details"), folder / "details.step")


if __name__ == "__main__":
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else Path(__file__).parent)
