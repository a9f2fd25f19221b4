"""Reading and writing STEP, with all digits and reproducible bytes."""

from __future__ import annotations

import io
import os
import re
from pathlib import Path
from typing import BinaryIO

from OCP.APIHeaderSection import APIHeaderSection_MakeHeader
from OCP.IFSelect import IFSelect_RetDone
from OCP.STEPCAFControl import STEPCAFControl_Reader, STEPCAFControl_Writer
from OCP.STEPControl import STEPControl_AsIs, STEPControl_Reader, STEPControl_Writer
from OCP.StepData import StepData_StepModel, StepData_StepWriter
from OCP.TCollection import TCollection_HAsciiString
from OCP.TopoDS import TopoDS_Shape

from mracad.errors import FileError, UsageError
from mracad.formats import by_content
from mracad.occ.document import Document, empty, no_faces, set_unit
from mracad.occ.literals import conforming
from mracad.occ.load import load
from mracad.occ.part21 import pmi, tidy
from mracad.occ.properties import restated
from mracad.occ.settings import all_digits, exchange, moment, quiet
from mracad.occ.titles import marked, marking, put_names
from mracad.occ.units import UNITS, of_file
from mracad.occ.writable import CutFace, writable
from mracad.output import put
from mracad.version import __version__

_READ_MODES = ("Name", "Color", "Layer", "GDT", "Mat", "Props", "View", "SHUO", "Meta", "ProductMeta")
_READ_SETTINGS = {"read.stepcaf.subshapes.name": "On"}
_WRITE_MODES = ("Name", "Color", "Layer", "DimTol", "Material", "Props", "SHUO")
_SCHEMAS = {"AP203": "AP203", "AP214": "AP214IS", "AP242": "AP242DIS"}


def read_step(
    source: str | os.PathLike | BinaryIO, input_unit: str | None = None, encoding: str | None = None
) -> Document:
    """Read a STEP file with all attributes of its shapes; see :func:`mracad.occ.files.read`."""
    file = load(source)
    text, name = file.getvalue(), file.name
    if by_content(text, name).name != "step":
        raise FileError(f"'{name}' is not a STEP file", "it must begin with ISO-10303-21: export it as STEP")
    if b"END-ISO-10303-21" not in text[-4096:]:
        raise FileError(f"'{name}' is truncated: its end is missing", "copy or export it again")
    text, warning = conforming(text, name, encoding)
    named, titles = marked(text)
    reader = STEPCAFControl_Reader()
    for mode in _READ_MODES:
        getattr(reader, f"Set{mode}Mode")(True)
    xcaf = empty()
    with quiet(), exchange(_READ_SETTINGS):
        if reader.ReadStream(name, io.BytesIO(named)) != IFSelect_RetDone:
            raise FileError(f"'{name}' cannot be parsed as STEP", "the file is damaged: export it again")
        units = of_file(reader.Reader().StepModel(), text, input_unit)
        set_unit(xcaf, units.kernel_mm)
        done = reader.Transfer(xcaf)
        set_unit(xcaf, 1.0)
    if not done:
        raise no_faces(name)
    document = Document(xcaf, name, units, _schema(text), pmi(text), (warning,) if warning else ())
    put_names(document, titles)
    return document.checked()


def _schema(text: bytes) -> str:
    """The application protocol that the header names."""
    match = re.search(rb"FILE_SCHEMA\s*\(\s*\(\s*'([^']*)'", text[:65536])
    schema = match[1].upper() if match else b""
    known = {b"AP242": "AP242", b"AUTOMOTIVE_DESIGN": "AP214", b"CONFIG_CONTROL_DESIGN": "AP203", b"AP203": "AP203"}
    return next((name for start, name in known.items() if schema.startswith(start)), "")


def write_step(
    document: Document, target: str | os.PathLike | BinaryIO, schema: str = "", options_text: str = ""
) -> None:
    """Write a document as STEP, in the file's own length unit.

    Parameters
    ----------
    document : Document
    target : path or binary stream
        A path is replaced only once the whole file is written.
    schema : str
        ``"AP203"``, ``"AP214"`` or ``"AP242"``.  By default AP242 for a document that was read as such, else AP214: in
        AP203 the kernel writes one body per product, so that documents with several lose their structure.
    options_text : str
        Description of the steps, for the header.

    Raises
    ------
    EditError
        For a face that the kernel cannot express.
    FileError
        When the target cannot be written.
    UsageError
        For an unknown schema, or a SOURCE_DATE_EPOCH that is not a number.
    """
    name = Path(target).name if isinstance(target, str | os.PathLike) else document.name
    put(step(document, name, schema, options_text)[0], target)


def step(document: Document, name: str, schema: str = "", options_text: str = "") -> tuple[bytes, tuple[CutFace, ...]]:
    """The whole STEP file, and the faces that are written in parts.

    ``name`` is the file name in its header; all else is as for :func:`write_step`.
    """
    schema = schema or ("AP242" if document.schema == "AP242" else "AP214")
    if schema not in _SCHEMAS:
        raise UsageError(f"unknown STEP schema '{schema}'", "use one of " + ", ".join(_SCHEMAS))
    settings = {
        "write.step.schema": _SCHEMAS[schema],
        "write.step.unit": UNITS[document.unit][1],
        "write.step.product.name": "product",
        "write.stepcaf.subshapes.name": "On",
    }
    stream = io.BytesIO()
    with (
        quiet(),
        exchange(settings),
        writable(document, _copy) as cuts,
        restated(document),
        marking(document) as titles,
    ):
        writer = STEPCAFControl_Writer()
        for mode in _WRITE_MODES:
            getattr(writer, f"Set{mode}Mode")(True)
        model = writer.Writer().Model()
        model.SetWriteLengthUnit(document.units.mm)
        if not writer.Transfer(document.xcaf, STEPControl_AsIs):
            raise FileError(f"the kernel cannot express '{document.name}' as STEP", "check its geometry")
        _head(model, name, options_text)
        _print(writer.Writer(), stream)
    return tidy(stream.getvalue(), titles), cuts


def _print(writer: STEPControl_Writer, stream: BinaryIO) -> None:
    printer = StepData_StepWriter(writer.Model())
    all_digits(printer.FloatWriter())
    printer.SendModel(writer.WS().Protocol())
    printer.Print(stream)


def _copy(shape: TopoDS_Shape) -> TopoDS_Shape:
    """A bare shape, written to STEP and read back."""
    stream = io.BytesIO()
    writer = STEPControl_Writer()
    writer.Transfer(shape, STEPControl_AsIs)
    _print(writer, stream)
    reader = STEPControl_Reader()
    reader.ReadStream("", io.BytesIO(stream.getvalue()))
    reader.TransferRoots()
    return reader.OneShape()


def _head(model: StepData_StepModel, name: str, options_text: str) -> None:
    """Fill the header so that it is the same every time."""
    header = APIHeaderSection_MakeHeader(model)
    name, options_text = (text.encode(errors="backslashreplace").decode() for text in (name, options_text))
    header.SetName(TCollection_HAsciiString(name))
    header.SetTimeStamp(TCollection_HAsciiString(moment().strftime("%Y-%m-%dT%H:%M:%S")))
    header.SetOriginatingSystem(TCollection_HAsciiString(f"mracad {__version__}"))
    header.SetPreprocessorVersion(TCollection_HAsciiString(f"mracad {__version__}"))
    header.SetDescriptionValue(1, TCollection_HAsciiString(options_text))
