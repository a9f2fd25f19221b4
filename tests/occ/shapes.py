"""Shapes and documents for the tests, made by the kernel itself."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from OCP.BRep import BRep_Builder
from OCP.BRepBuilderAPI import BRepBuilderAPI_MakeFace, BRepBuilderAPI_Sewing
from OCP.Geom import Geom_BezierSurface, Geom_BSplineSurface
from OCP.gp import gp_Pnt
from OCP.Quantity import Quantity_Color, Quantity_TOC_sRGB
from OCP.STEPControl import STEPControl_AsIs, STEPControl_Writer
from OCP.TColgp import TColgp_Array2OfPnt
from OCP.TCollection import TCollection_ExtendedString
from OCP.TColStd import TColStd_Array1OfInteger, TColStd_Array1OfReal, TColStd_Array2OfReal
from OCP.TDataStd import TDataStd_Name
from OCP.TDocStd import TDocStd_Document
from OCP.TopLoc import TopLoc_Location
from OCP.TopoDS import TopoDS_Compound, TopoDS_Face, TopoDS_Shape
from OCP.XCAFDoc import XCAFDoc_ColorType, XCAFDoc_DocumentTool

from mracad.occ.document import Document
from mracad.occ.settings import exchange, quiet


def wavy_poles(nu: int, nv: int, seed: int = 1) -> np.ndarray:
    """A net over ``[0, 10]²`` with heights and a jitter whose decimals fill a double."""
    rng = np.random.default_rng(seed)
    x, y = np.meshgrid(np.linspace(0, 10, nu), np.linspace(0, 10, nv), indexing="ij")
    return np.stack([x, y, np.sin(x) * np.cos(y)], axis=-1) + rng.normal(0, 0.05, (nu, nv, 3))


def bspline(poles: np.ndarray, degree: int = 3, weights: np.ndarray | None = None) -> Geom_BSplineSurface:
    """A clamped, uniform B-spline surface."""
    net = _net(poles)
    flats = []
    for count in poles.shape[:2]:
        spans = count - degree
        knots, mults = TColStd_Array1OfReal(1, spans + 1), TColStd_Array1OfInteger(1, spans + 1)
        for i in range(spans + 1):
            knots.SetValue(i + 1, i / spans)
            mults.SetValue(i + 1, degree + 1 if i in (0, spans) else 1)
        flats.append((knots, mults))
    (u, mu), (v, mv) = flats
    if weights is None:
        return Geom_BSplineSurface(net, u, v, mu, mv, degree, degree)
    table = TColStd_Array2OfReal(1, poles.shape[0], 1, poles.shape[1])
    for i, j in np.ndindex(*weights.shape):
        table.SetValue(i + 1, j + 1, float(weights[i, j]))
    return Geom_BSplineSurface(net, table, u, v, mu, mv, degree, degree)


def bezier(poles: np.ndarray) -> Geom_BezierSurface:
    return Geom_BezierSurface(_net(poles))


def face_on(surface: Geom_BSplineSurface | Geom_BezierSurface, *bounds: float) -> TopoDS_Face:
    """A face on the whole of a surface, or on ``u0, u1, v0, v1``."""
    return BRepBuilderAPI_MakeFace(surface, *bounds, 1e-7).Face()


def compound(*shapes: TopoDS_Shape) -> TopoDS_Compound:
    whole = TopoDS_Compound()
    builder = BRep_Builder()
    builder.MakeCompound(whole)
    for shape in shapes:
        builder.Add(whole, shape)
    return whole


def sewn(*shapes: TopoDS_Shape) -> TopoDS_Shape:
    sewing = BRepBuilderAPI_Sewing(1e-6)
    for shape in shapes:
        sewing.Add(shape)
    sewing.Perform()
    return sewing.SewedShape()


def save(shape: TopoDS_Shape, path: Path, unit: str = "MM") -> Path:
    """A plain STEP file, as the kernel writes it."""
    with quiet(), exchange({"write.step.unit": unit}):
        writer = STEPControl_Writer()
        writer.Transfer(shape, STEPControl_AsIs)
        writer.Write(str(path))
    return path


def document(
    *shapes: TopoDS_Shape, colours: dict[int, str] | None = None, names: dict[int, str] | None = None
) -> Document:
    """An open document with one part per shape; names and colours by part."""
    xcaf = TDocStd_Document(TCollection_ExtendedString("BinXCAF"))
    tool = XCAFDoc_DocumentTool.ShapeTool_s(xcaf.Main())
    XCAFDoc_DocumentTool.SetLengthUnit_s(xcaf, 0.001)
    for number, shape in enumerate(shapes):
        label = tool.AddShape(shape, False)
        TDataStd_Name.Set_s(label, TCollection_ExtendedString((names or {}).get(number, ""), True))
        if number in (colours or {}):
            red, green, blue = (int(colours[number][i : i + 2], 16) / 255 for i in (1, 3, 5))
            colour = Quantity_Color(red, green, blue, Quantity_TOC_sRGB)
            XCAFDoc_DocumentTool.ColorTool_s(xcaf.Main()).SetColor(label, colour, XCAFDoc_ColorType.XCAFDoc_ColorSurf)
    return Document(xcaf, "made.step")


def assembly(shape: TopoDS_Shape, *places: TopLoc_Location) -> Document:
    """A document with one part that stands in several places."""
    xcaf = TDocStd_Document(TCollection_ExtendedString("BinXCAF"))
    tool = XCAFDoc_DocumentTool.ShapeTool_s(xcaf.Main())
    XCAFDoc_DocumentTool.SetLengthUnit_s(xcaf, 0.001)
    tool.AddShape(compound(*(shape.Moved(place) for place in places)), True)
    tool.UpdateAssemblies()
    return Document(xcaf, "assembly.step")


def _net(poles: np.ndarray) -> TColgp_Array2OfPnt:
    net = TColgp_Array2OfPnt(1, poles.shape[0], 1, poles.shape[1])
    for i, j in np.ndindex(*poles.shape[:2]):
        net.SetValue(i + 1, j + 1, gp_Pnt(*poles[i, j].tolist()))
    return net


def zigzag_strips(*rows: int) -> TopoDS_Shape:
    """Strips of 60 mm × 12 mm side by side under one zigzag profile, each of so many rows of control points.

    As smooth as the seams are, they take all points of a strip of few rows.
    """
    nets = []
    for place, count in enumerate(rows):
        x, y = np.meshgrid(np.linspace(0, 60, 33), 12 * place + np.linspace(0, 12, count), indexing="ij")
        nets.append(np.stack([x, y, np.broadcast_to(0.4 * (-1.0) ** np.arange(33)[:, None], x.shape)], axis=-1))
    return sewn(*(face_on(bspline(net)) for net in nets))
