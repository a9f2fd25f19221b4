"""Reading and writing IGES: bodies and surfaces with names, colours and levels; the kernel flattens assemblies."""

from __future__ import annotations

import io
import os
import tempfile
from collections import Counter
from pathlib import Path
from typing import BinaryIO

from OCP.IFSelect import IFSelect_RetDone
from OCP.IGESBasic import IGESBasic_Name
from OCP.IGESCAFControl import IGESCAFControl_Reader, IGESCAFControl_Writer
from OCP.IGESControl import IGESControl_Controller, IGESControl_Reader, IGESControl_Writer
from OCP.IGESData import IGESData_IGESEntity, IGESData_IGESModel, IGESData_IGESWriter
from OCP.IGESSelect import IGESSelect_WorkLibrary
from OCP.TCollection import TCollection_HAsciiString
from OCP.TopoDS import TopoDS_Shape

from mracad.errors import FileError
from mracad.occ.document import Document, empty, named_labels, no_faces
from mracad.occ.iges_text import prepared
from mracad.occ.labels import label_name, name_label
from mracad.occ.load import load
from mracad.occ.settings import all_digits, exchange, moment, quiet
from mracad.occ.units import UNITS, Units, named
from mracad.occ.writable import CutFace, writable
from mracad.version import __version__

_FLAGS = {1: "in", 2: "mm", 4: "ft", 5: "mi", 6: "m", 7: "km", 8: "mil", 9: "um", 10: "cm", 11: "uin"}
_MODES = ("Name", "Color", "Layer")


def read_iges(
    source: str | os.PathLike | BinaryIO, input_unit: str | None = None, encoding: str | None = None
) -> Document:
    """Read an IGES file; see :func:`mracad.occ.files.read`."""
    file = load(source)
    _refuse_torn(file.getvalue(), file.name)
    unit = None if input_unit is None else named(input_unit)
    ready = prepared(file.getvalue(), file.name, encoding)
    IGESControl_Controller.Init_s()
    xcaf = empty()
    with quiet(), exchange({}), tempfile.TemporaryDirectory() as folder:
        path = Path(folder, "model.igs")  # the kernel reads no IGES from a stream
        path.write_bytes(ready.text)
        reader = IGESCAFControl_Reader()
        for mode in _MODES:
            getattr(reader, f"Set{mode}Mode")(True)
        if reader.ReadFile(str(path)) != IFSelect_RetDone:
            raise FileError(f"'{file.name}' cannot be parsed as IGES", "the file is damaged: export it again")
        model = reader.IGESModel()
        section = model.GlobalSection()
        if unit:
            section.SetUnitFlag(next(flag for flag, key in _FLAGS.items() if key == unit))
            model.SetGlobalSection(section)
        unit = _FLAGS.get(section.UnitFlag())
        if not reader.Transfer(xcaf):
            raise no_faces(file.name)
    units = Units(unit, UNITS[unit][0]) if unit else Units()
    document = Document(xcaf, file.name, units, "IGES", warnings=ready.warnings)
    if ready.names:
        _put_names(document, ready.names)
    return document.checked()


def _put_names(document: Document, names: dict[str, str]) -> None:
    """Give labels their names instead of marks."""
    for label in named_labels(document):
        if (mark := label_name(label)) in names:
            name_label(label, names[mark])


def iges(document: Document, name: str, options_text: str = "") -> tuple[bytes, tuple[CutFace, ...]]:
    """A document as IGES 5.3 in its own unit, with solids, and the faces that are written in parts.

    Parameters
    ----------
    document : Document
    name : str
        Name of the file, for its header.
    options_text : str
        Description of the steps, for the header.

    Raises
    ------
    EditError
        For a face that the kernel cannot express.
    FileError
        When the kernel cannot express anything.
    """
    IGESControl_Controller.Init_s()
    stream = io.BytesIO()
    settings: dict[str, str | int] = {"write.iges.brep.mode": 1, "write.iges.unit": UNITS[document.unit][1]}
    with quiet(), exchange(settings), writable(document, _copy) as cuts:
        writer = IGESCAFControl_Writer()
        for mode in _MODES:
            getattr(writer, f"Set{mode}Mode")(True)
        if not writer.Transfer(document.xcaf):
            raise FileError(f"the kernel cannot express '{document.name}' as IGES", "check its geometry")
        writer.ComputeModel()
        model = writer.Model()
        _names_in_order(model)
        _head(model, name, options_text)
        _print(model, stream)
    return stream.getvalue(), cuts


def _print(model: IGESData_IGESModel, stream: BinaryIO) -> None:
    printer = IGESData_IGESWriter(model)
    all_digits(printer.FloatWriter())
    printer.SendModel(IGESSelect_WorkLibrary.DefineProtocol_s())
    printer.Print(stream)


def _copy(shape: TopoDS_Shape) -> TopoDS_Shape:
    """A bare shape, written to IGES and read back."""
    writer = IGESControl_Writer()
    writer.AddShape(shape)
    writer.ComputeModel()
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder, "shape.igs")
        with path.open("wb") as stream:
            _print(writer.Model(), stream)
        reader = IGESControl_Reader()
        reader.ReadFile(str(path))
    reader.TransferRoots()
    return reader.OneShape()


def _refuse_torn(text: bytes, name: str) -> None:
    """Raise FileError if the sections of a file do not have as many lines as its last line states."""
    lines = text.splitlines()
    counts = Counter(line[72:73] for line in lines)
    last = next((line for line in reversed(lines) if line.strip()), b"")
    stated = {last[i : i + 1]: last[i + 1 : i + 8].strip() for i in range(0, 32, 8)}
    if last[72:73] != b"T" or any(b"%d" % counts[key] != count.lstrip(b"0") for key, count in stated.items()):
        raise FileError(f"'{name}' is truncated: it lacks lines", "copy or export it again")


def _names_in_order(model: IGESData_IGESModel) -> None:
    """Sort names by the entities that they name: the kernel adds them by address, in a different order every time."""
    owners: dict[IGESBasic_Name, list[IGESData_IGESEntity]] = {}
    names = []
    for number in range(1, model.NbEntities() + 1):
        entity = model.Value(number)
        if isinstance(entity, IGESBasic_Name):
            names.append(entity)
        properties = entity.Properties()
        while properties.More():
            if isinstance(properties.Value(), IGESBasic_Name):
                owners.setdefault(properties.Value(), []).append(entity)
            properties.Next()
    groups = [(name.Value(), owned) for name, owned in owners.items()]
    for name, owned in owners.items():
        for entity in owned:
            entity.RemoveProperty(name)
    for name, (text, owned) in zip([name for name in names if name in owners], groups, strict=True):
        name.Init(1, text)
        for entity in owned:
            entity.AddProperty(name)


def _head(model: IGESData_IGESModel, name: str, options_text: str) -> None:
    """Fill the start and global sections so that they are the same every time."""
    section = model.GlobalSection()
    date = TCollection_HAsciiString(moment().strftime("%Y%m%d.%H%M%S"))
    section.SetDate(date)
    section.SetLastChangeDate(date)
    maker = TCollection_HAsciiString(f"mracad {__version__}")
    section.SetSystemId(maker)
    section.SetInterfaceVersion(maker)
    section.SetSendName(TCollection_HAsciiString(_ascii(Path(name).stem)))
    section.SetFileName(TCollection_HAsciiString(_ascii(name)))
    section.SetAuthorName(TCollection_HAsciiString(""))
    model.SetGlobalSection(section)
    model.ClearStartSection()
    text = _ascii(options_text)
    for start in range(0, len(text), 72):
        model.AddStartLine(text[start : start + 72])


def _ascii(text: str) -> str:
    return text.encode("ascii", errors="replace").decode()
