"""The kernel's own formats, BREP (text) and BinBREP: exact shapes and shared instances, but no names, colours,
units."""

from __future__ import annotations

import io
import os
from pathlib import Path
from typing import BinaryIO

from OCP.BinTools import BinTools, BinTools_FormatVersion
from OCP.BRep import BRep_Builder
from OCP.BRepBuilderAPI import BRepBuilderAPI_Transform
from OCP.BRepTools import BRepTools
from OCP.gp import gp_Trsf
from OCP.TCollection import TCollection_ExtendedString
from OCP.TDataStd import TDataStd_Name
from OCP.TopAbs import TopAbs_COMPOUND, TopAbs_SOLID
from OCP.TopoDS import TopoDS_Iterator, TopoDS_Shape
from OCP.TopTools import TopTools_FormatVersion
from OCP.XCAFDoc import XCAFDoc_DocumentTool

from mracad.formats import by_content
from mracad.occ.document import Document, empty, no_faces
from mracad.occ.load import load
from mracad.occ.settings import exchange, quiet
from mracad.occ.units import UNITS, Units, named


def read_brep(source: str | os.PathLike | BinaryIO, input_unit: str | None = None) -> Document:
    """Read a BREP or BinBREP file; its numbers are taken as millimetres; see :func:`mracad.occ.files.read`."""
    file = load(source)
    binary = by_content(file.getvalue(), file.name).name == "binbrep"
    unit = "mm" if input_unit is None else named(input_unit)
    shape = TopoDS_Shape()
    with quiet(), exchange({}):
        stream = io.BytesIO(file.getvalue())
        if binary:
            BinTools.Read_s(shape, stream)
        else:
            BRepTools.Read_s(shape, stream, BRep_Builder())
        if shape.IsNull():
            raise no_faces(file.name)
        if unit != "mm":
            scaled = gp_Trsf()
            scaled.SetScaleFactor(UNITS[unit][0])
            shape = BRepBuilderAPI_Transform(shape, scaled, True).Shape()
        xcaf = empty()
        label = XCAFDoc_DocumentTool.ShapeTool_s(xcaf.Main()).AddShape(shape, _is_assembly(shape))
        TDataStd_Name.Set_s(label, TCollection_ExtendedString(Path(file.name).stem, True))
    return Document(xcaf, file.name, Units(unit, UNITS[unit][0]), "BinBREP" if binary else "BREP").checked()


def brep(document: Document, binary: bool = False) -> bytes:
    """A document as BREP or BinBREP, in millimetres, without triangulations."""
    stream = io.BytesIO()
    with quiet():
        if binary:
            version = BinTools_FormatVersion.BinTools_FormatVersion_CURRENT
            BinTools.Write_s(document.shape, stream, False, False, version)
        else:
            text = TopTools_FormatVersion.TopTools_FormatVersion_CURRENT
            BRepTools.Write_s(document.shape, stream, False, False, text)
    return stream.getvalue()


def _is_assembly(shape: TopoDS_Shape) -> bool:
    """Whether a shape is a compound of solids, nested or not: then they become parts."""
    if shape.ShapeType() != TopAbs_COMPOUND:
        return False
    children = TopoDS_Iterator(shape)
    while children.More():
        if not (children.Value().ShapeType() == TopAbs_SOLID or _is_assembly(children.Value())):
            return False
        children.Next()
    return True
