"""STEP files out: every digit kept, the same bytes every time."""

from __future__ import annotations

import io
import math
import os
import re
from datetime import UTC, datetime
from pathlib import Path
from typing import BinaryIO

from OCP.APIHeaderSection import APIHeaderSection_MakeHeader
from OCP.StepBasic import StepBasic_Product
from OCP.STEPCAFControl import STEPCAFControl_Writer
from OCP.STEPControl import STEPControl_AsIs
from OCP.StepData import StepData_StepModel, StepData_StepWriter
from OCP.StepRepr import StepRepr_NextAssemblyUsageOccurrence
from OCP.TCollection import TCollection_HAsciiString

from mracad import __version__
from mracad.errors import FileError, UsageError
from mracad.occ.document import Document
from mracad.occ.output import put
from mracad.occ.settings import exchange, quiet
from mracad.occ.units import UNITS, metres

_MODES = ("Name", "Color", "Layer", "DimTol", "Material", "Props", "SHUO")
_SCHEMAS = {"AP203": "AP203", "AP214": "AP214IS", "AP242": "AP242DIS"}
_UNNAMED = "mracad unnamed product"  # what the kernel calls a product without a name, followed by a count


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
        ``"AP203"``, ``"AP214"`` or ``"AP242"``; by default that of the file that was read, or AP214.
    options_text : str
        What was done, for the header.

    Raises
    ------
    FileError
        When the target cannot be written.
    UsageError
        For an unknown schema.
    """
    schema = schema or document.schema or "AP214"
    if schema not in _SCHEMAS:
        raise UsageError(f"unknown STEP schema '{schema}'", "use one of " + ", ".join(_SCHEMAS))
    name = Path(target).name if isinstance(target, str | os.PathLike) else document.name
    put(_text(document, _SCHEMAS[schema], name, options_text), target)


def _text(document: Document, schema: str, name: str, options_text: str) -> bytes:
    """The whole STEP file."""
    settings = {
        "write.step.schema": schema,
        "write.step.unit": UNITS[document.unit][1],
        "write.step.product.name": _UNNAMED,
        "write.stepcaf.subshapes.name": "On",
    }
    stream = io.BytesIO()
    with quiet(), exchange(settings):
        writer = STEPCAFControl_Writer()
        for mode in _MODES:
            getattr(writer, f"Set{mode}Mode")(True)
        model = writer.Writer().Model()
        model.SetWriteLengthUnit(math.ldexp(metres(document.unit_mm) * 1000.0, document.units.exponent))
        if not writer.Transfer(document.xcaf, STEPControl_AsIs):
            raise FileError(f"the kernel cannot express '{document.name}' as STEP", "check its geometry")
        _number_anew(model)
        _head(model, name, options_text)
        printer = StepData_StepWriter(model)
        # 17 significant digits, the point always there (a STEP real needs it); what is nearest to zero would not fit
        # the kernel's buffer with an exponent of three digits, and is cut to two digits
        printer.FloatWriter().SetFormat("%#.2G")
        printer.FloatWriter().SetFormatForRange("%#.17G", 1e-99, 1e99)
        printer.SendModel(writer.Writer().WS().Protocol())
        printer.Print(stream)
    return _without_trailing_zeros(stream.getvalue())


def _number_anew(model: StepData_StepModel) -> None:
    """Count unnamed products and assembly usages from 1; the kernel counts on through the life of the process."""
    products = usages = 0
    for i in range(1, model.NbEntities() + 1):
        entity = model.Value(i)
        if isinstance(entity, StepBasic_Product):
            if entity.Name().ToCString().startswith(_UNNAMED):
                products += 1
                text = TCollection_HAsciiString(f"part {products}")
                entity.SetName(text)
                entity.SetId(text)
        elif isinstance(entity, StepRepr_NextAssemblyUsageOccurrence):
            usages += 1
            entity.SetId(TCollection_HAsciiString(str(usages)))


def _head(model: StepData_StepModel, name: str, options_text: str) -> None:
    """Fill the header: nothing in it depends on where, when or how often it is written."""
    header = APIHeaderSection_MakeHeader(model)
    moment = datetime.fromtimestamp(int(os.environ.get("SOURCE_DATE_EPOCH", "0")), UTC)
    header.SetName(TCollection_HAsciiString(_ascii(name)))
    header.SetTimeStamp(TCollection_HAsciiString(moment.strftime("%Y-%m-%dT%H:%M:%S")))
    header.SetOriginatingSystem(TCollection_HAsciiString(f"mracad {__version__}"))
    header.SetPreprocessorVersion(TCollection_HAsciiString(f"mracad {__version__}"))
    header.SetDescriptionValue(1, TCollection_HAsciiString(_ascii(options_text)))


def _ascii(text: str) -> str:
    """A text as STEP encodes it: what is not plain ASCII as ``\\X2\\…\\X0\\``."""
    coded = re.sub(r"[^\x20-\x7e]+", lambda run: "\\X2\\" + run[0].encode("utf-16-be").hex().upper() + "\\X0\\", text)
    return coded


def _without_trailing_zeros(text: bytes) -> bytes:
    """Shorten reals as ``1.5000`` to ``1.5``, outside quoted strings."""
    pieces = text.split(b"'")
    plain = b"'".join(pieces[::2])
    pieces[::2] = re.sub(rb"(\.(?:[0-9]*[1-9])?)0+(?=[,)E])", rb"\1", plain).split(b"'")
    return b"'".join(pieces)
