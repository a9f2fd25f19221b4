"""Small STEP files made for one test."""

from pathlib import Path

import numpy as np


def ruled_strip(path: Path) -> Path:
    """One bare face, 60 mm × 12 mm, ruled between two wavy cubic curves: every control point lies on an edge."""
    from OCP.BRepBuilderAPI import BRepBuilderAPI_MakeFace
    from OCP.Geom import Geom_BSplineSurface
    from OCP.gp import gp_Pnt
    from OCP.STEPControl import STEPControl_AsIs, STEPControl_Writer
    from OCP.TColgp import TColgp_Array2OfPnt
    from OCP.TColStd import TColStd_Array1OfInteger, TColStd_Array1OfReal

    from mracad.occ.settings import quiet

    count = 33
    poles = TColgp_Array2OfPnt(1, count, 1, 2)
    for i, x in enumerate(np.linspace(0, 60, count)):
        for j, y in enumerate((0.0, 12.0)):
            poles.SetValue(i + 1, j + 1, gp_Pnt(x, y, 0.4 * (-1) ** i))
    spans = count - 3
    knots, mults = TColStd_Array1OfReal(1, spans + 1), TColStd_Array1OfInteger(1, spans + 1)
    for k in range(spans + 1):
        knots.SetValue(k + 1, 60.0 * k / spans)
        mults.SetValue(k + 1, 4 if k in (0, spans) else 1)
    ends, twos = TColStd_Array1OfReal(1, 2), TColStd_Array1OfInteger(1, 2)
    for k, value in ((1, 0.0), (2, 12.0)):
        ends.SetValue(k, value)
        twos.SetValue(k, 2)
    surface = Geom_BSplineSurface(poles, knots, ends, mults, twos, 3, 1)
    with quiet():
        writer = STEPControl_Writer()
        writer.Transfer(BRepBuilderAPI_MakeFace(surface, 1e-7).Face(), STEPControl_AsIs)
        writer.Write(str(path))
    return path
