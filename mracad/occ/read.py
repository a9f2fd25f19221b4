"""STEP files in."""

from __future__ import annotations

import io
import os
import re
from pathlib import Path
from typing import BinaryIO

from OCP.IFSelect import IFSelect_RetDone
from OCP.STEPCAFControl import STEPCAFControl_Reader
from OCP.TCollection import TCollection_ExtendedString
from OCP.TDocStd import TDocStd_Document
from OCP.XCAFDoc import XCAFDoc_DocumentTool

from mracad.errors import FileError
from mracad.occ.document import Document
from mracad.occ.settings import exchange, quiet
from mracad.occ.units import metres, of_file

_MODES = ("Name", "Color", "Layer", "GDT", "Mat", "Props", "View", "SHUO", "Meta", "ProductMeta")
_SETTINGS = {"read.stepcaf.subshapes.name": "On"}


def read_step(source: str | os.PathLike | BinaryIO, input_unit: str | None = None) -> Document:
    """Read a STEP file with its names, colours, layers, tolerances and properties.

    Parameters
    ----------
    source : path or binary stream
    input_unit : str, optional
        The length unit that the file's numbers are in, whatever it says itself; also that of the output.

    Returns
    -------
    Document

    Raises
    ------
    FileError
        For a file that is missing, unreadable, truncated, not STEP, or without geometry.
    UsageError
        For an unknown unit.
    """
    text, name = load(source)
    reader = STEPCAFControl_Reader()
    for mode in _MODES:
        getattr(reader, f"Set{mode}Mode")(True)
    xcaf = TDocStd_Document(TCollection_ExtendedString("BinXCAF"))
    with quiet(), exchange(_SETTINGS):
        if reader.ReadStream(name, io.BytesIO(text)) != IFSelect_RetDone:
            raise FileError(f"'{name}' cannot be parsed as STEP", "the file is damaged: export it again")
        units = of_file(reader.Reader().StepModel(), text, input_unit)
        _set_unit(xcaf, units.kernel_mm)
        done = reader.Transfer(xcaf)
        _set_unit(xcaf, 1.0)
    document = Document(xcaf, name, units, _schema(text))
    if not done or not any(part.faces.Extent() for part in document.parts):
        raise FileError(f"'{name}' holds no faces", "the file needs surfaces or solids, not only curves or meshes")
    return document


def load(source: str | os.PathLike | BinaryIO) -> tuple[bytes, str]:
    """The text of a STEP file and its name without folder; raises FileError."""
    if isinstance(source, str | os.PathLike):
        path = Path(source)
        name = path.name
        try:
            text = path.read_bytes()
        except OSError as error:
            reason = {IsADirectoryError: "it is a folder", FileNotFoundError: "there is no such file"}
            why = reason.get(type(error), error.strerror or str(error))
            raise FileError(f"cannot read '{path}': {why}", "give the path of a STEP file") from error
    else:
        name = Path(str(getattr(source, "name", "stdin"))).name.strip("<>")
        text = source.read()
    if not text.strip():
        raise FileError(f"'{name}' is empty", "export it again")
    if b"ISO-10303-21" not in text[:4096]:
        raise FileError(f"'{name}' is not a STEP file", "it must begin with ISO-10303-21: export it as STEP")
    if b"END-ISO-10303-21" not in text[-4096:]:
        raise FileError(f"'{name}' is truncated: its end is missing", "copy or export it again")
    return text, name.encode(errors="replace").decode()  # the kernel takes no name that is not Unicode


def _schema(text: bytes) -> str:
    """Which application protocol the header names."""
    match = re.search(rb"FILE_SCHEMA\s*\(\s*\(\s*'([^']*)'", text[:65536])
    schema = match[1].upper() if match else b""
    known = {b"AP242": "AP242", b"AUTOMOTIVE_DESIGN": "AP214", b"CONFIG_CONTROL_DESIGN": "AP203", b"AP203": "AP203"}
    return next((name for start, name in known.items() if schema.startswith(start)), "")


def _set_unit(xcaf: TDocStd_Document, mm: float) -> None:
    """Tell the document what its numbers are."""
    XCAFDoc_DocumentTool.SetLengthUnit_s(xcaf, metres(mm))
