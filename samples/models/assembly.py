"""The assembly: a fixture in inches."""

from __future__ import annotations

from collections.abc import Sequence

from OCP.BRepPrimAPI import BRepPrimAPI_MakeBox, BRepPrimAPI_MakeCylinder
from OCP.gp import gp_Ax2, gp_Dir, gp_Pnt, gp_Trsf, gp_Vec
from OCP.Quantity import Quantity_Color, Quantity_TOC_sRGB
from OCP.TCollection import TCollection_ExtendedString
from OCP.TDF import TDF_Label
from OCP.TopAbs import TopAbs_FACE
from OCP.TopExp import TopExp_Explorer
from OCP.TopLoc import TopLoc_Location
from OCP.TopoDS import TopoDS_Shape
from OCP.XCAFDoc import XCAFDoc_ColorSurf, XCAFDoc_DocumentTool

from mracad.occ.document import Document
from mracad.occ.units import Units

from .documents import blank, name
from .geometry import surface
from .parts import natural_rims, rough_top
from .topology import block

INCH = 25.4


def placed(x: float, y: float, z: float) -> TopLoc_Location:
    """Return a shift by inches."""
    move = gp_Trsf()
    move.SetTranslation(gp_Vec(x * INCH, y * INCH, z * INCH))
    return TopLoc_Location(move)


def assembly() -> Document:
    """A fixture in inches: a base plate, a pin, and two pairs of one rough pad (a nested subassembly placed twice).

    Parts and instances have names; each part has a colour, the top of the pad its own; the base plate is on a layer.
    """
    made = blank("fixture", Units("in", INCH))
    shapes = made.shape_tool
    colours = XCAFDoc_DocumentTool.ColorTool_s(made.xcaf.Main())
    layers = XCAFDoc_DocumentTool.LayerTool_s(made.xcaf.Main())

    def paint(label: TDF_Label, *rgb: float) -> None:
        colours.SetColor(label, Quantity_Color(*rgb, Quantity_TOC_sRGB), XCAFDoc_ColorSurf)

    def part(shape: TopoDS_Shape, text: str, *rgb: float) -> TDF_Label:
        label = shapes.AddShape(shape, False)
        name(label, text)
        paint(label, *rgb)
        return label

    def group(text: str, items: Sequence[tuple[TDF_Label, str, tuple[float, float, float]]]) -> TDF_Label:
        label = shapes.NewShape()
        name(label, text)
        for item, instance, place in items:
            name(shapes.AddComponent(label, item, placed(*place)), instance)
        return label

    net = rough_top(501, (50.75, 25.5), (26, 14), 10.0, 0.075)
    body = block(surface(net[2], net[0], net[1]), [list(natural_rims(net).values())])
    axis = gp_Ax2(gp_Pnt(0, 0, 0), gp_Dir(0, 0, 1))
    box = BRepPrimAPI_MakeBox(gp_Pnt(0, 0, 0), 7.0 * INCH, 4.0 * INCH, 0.5 * INCH)
    plate = part(box.Shape(), "base plate", 0.0, 1.0, 0.0)
    pad = part(body, "pad", 0.0, 0.0, 1.0)
    pin = part(BRepPrimAPI_MakeCylinder(axis, 0.25 * INCH, 1.5 * INCH).Shape(), "pin", 1.0, 1.0, 0.0)
    paint(shapes.AddSubShape(pad, TopExp_Explorer(body, TopAbs_FACE).Current()), 1.0, 0.0, 0.0)
    layers.SetLayer(plate, TCollection_ExtendedString("tooling"))
    pair = group("pad pair", [(pad, "pad left", (0.0, 0.0, 0.0)), (pad, "pad right", (3.0, 0.0, 0.0))])
    group(
        "fixture",
        [
            (plate, "base", (0.0, 0.0, 0.0)),
            (pair, "front pair", (1.0, 0.5, 0.5)),
            (pair, "back pair", (1.0, 2.5, 0.5)),
            (pin, "locating pin", (3.5, 2.0, 0.5)),
        ],
    )
    shapes.UpdateAssemblies()
    return made
