"""Documents with one part, and writing them."""

from __future__ import annotations

import io
import re
from pathlib import Path

from OCP.TCollection import TCollection_ExtendedString
from OCP.TDataStd import TDataStd_Name
from OCP.TDF import TDF_Label
from OCP.TDocStd import TDocStd_Document
from OCP.TopoDS import TopoDS_Shape
from OCP.XCAFDoc import XCAFDoc_DocumentTool

from mracad.occ.document import Document
from mracad.occ.step import write_step
from mracad.occ.units import Units, metres


def name(label: TDF_Label, text: str) -> None:
    """Name a label."""
    TDataStd_Name.Set_s(label, TCollection_ExtendedString(text))


def blank(text: str, units: Units | None = None) -> Document:
    """Return an empty document, held in millimetres, for a file in some unit, millimetres by default."""
    units = units or Units()
    xcaf = TDocStd_Document(TCollection_ExtendedString("BinXCAF"))
    XCAFDoc_DocumentTool.SetLengthUnit_s(xcaf, metres(1.0))
    return Document(xcaf, text, units)


def single(shape: TopoDS_Shape, text: str) -> Document:
    """Return a document with one named part."""
    made = blank(text)
    name(made.shape_tool.AddShape(shape, False), text)
    return made


def write(document: Document, path: Path) -> None:
    """Write a document, with a header that changes neither with the date nor with mracad's version."""
    stream = io.BytesIO()
    write_step(document, stream, schema="AP214")
    header = f"FILE_NAME('{path.name}','1970-01-01T00:00:00',(''),(''),'','mracad samples','');"
    path.write_bytes(re.sub(rb"FILE_NAME\(.*?\);", header.encode(), stream.getvalue(), count=1, flags=re.DOTALL))
