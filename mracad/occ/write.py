"""STEP files out: every digit kept, the same bytes every time."""

from __future__ import annotations

import io
import os
import re
from datetime import UTC, datetime
from pathlib import Path
from typing import BinaryIO

from OCP.APIHeaderSection import APIHeaderSection_MakeHeader
from OCP.STEPCAFControl import STEPCAFControl_Writer
from OCP.STEPControl import STEPControl_AsIs
from OCP.StepData import StepData_StepModel, StepData_StepWriter
from OCP.TCollection import TCollection_HAsciiString

from mracad import __version__
from mracad.errors import FileError, UsageError
from mracad.occ.document import Document
from mracad.occ.part21 import UNNAMED, tidy
from mracad.occ.settings import exchange, quiet
from mracad.occ.units import UNITS
from mracad.output import put

_MODES = ("Name", "Color", "Layer", "DimTol", "Material", "Props", "SHUO")
_SCHEMAS = {"AP203": "AP203", "AP214": "AP214IS", "AP242": "AP242DIS"}


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
        ``"AP203"``, ``"AP214"`` or ``"AP242"``.  By default AP242 for a document that was, otherwise AP214: written
        as AP203, which the kernel takes to hold one body per product, a document of several loses its structure.
    options_text : str
        What was done, for the header.

    Raises
    ------
    FileError
        When the target cannot be written.
    UsageError
        For an unknown schema, or a SOURCE_DATE_EPOCH that is no number.
    """
    schema = schema or ("AP242" if document.schema == "AP242" else "AP214")
    if schema not in _SCHEMAS:
        raise UsageError(f"unknown STEP schema '{schema}'", "use one of " + ", ".join(_SCHEMAS))
    name = Path(target).name if isinstance(target, str | os.PathLike) else document.name
    put(_text(document, _SCHEMAS[schema], name, options_text), target)


def _text(document: Document, schema: str, name: str, options_text: str) -> bytes:
    """The whole STEP file."""
    settings = {
        "write.step.schema": schema,
        "write.step.unit": UNITS[document.unit][1],
        "write.step.product.name": UNNAMED.decode(),
        "write.stepcaf.subshapes.name": "On",
    }
    stream = io.BytesIO()
    with quiet(), exchange(settings):
        writer = STEPCAFControl_Writer()
        for mode in _MODES:
            getattr(writer, f"Set{mode}Mode")(True)
        model = writer.Writer().Model()
        model.SetWriteLengthUnit(document.units.mm)
        if not writer.Transfer(document.xcaf, STEPControl_AsIs):
            raise FileError(f"the kernel cannot express '{document.name}' as STEP", "check its geometry")
        _head(model, name, options_text)
        printer = StepData_StepWriter(model)
        # 17 significant digits, the point always there (a STEP real needs it); what is nearest to zero would not fit
        # the kernel's buffer with an exponent of three digits, and is cut to two digits
        printer.FloatWriter().SetFormat("%#.2G")
        printer.FloatWriter().SetFormatForRange("%#.17G", 1e-99, 1e99)
        printer.SendModel(writer.Writer().WS().Protocol())
        printer.Print(stream)
    return tidy(stream.getvalue())


def _head(model: StepData_StepModel, name: str, options_text: str) -> None:
    """Fill the header: nothing in it depends on where, when or how often it is written."""
    header = APIHeaderSection_MakeHeader(model)
    epoch = os.environ.get("SOURCE_DATE_EPOCH", "0")
    try:
        moment = datetime.fromtimestamp(int(epoch), UTC)
    except (ValueError, OverflowError) as error:
        raise UsageError(f"SOURCE_DATE_EPOCH is '{epoch}'", "give it whole seconds since 1970, or unset it") from error
    header.SetName(TCollection_HAsciiString(_ascii(name)))
    header.SetTimeStamp(TCollection_HAsciiString(moment.strftime("%Y-%m-%dT%H:%M:%S")))
    header.SetOriginatingSystem(TCollection_HAsciiString(f"mracad {__version__}"))
    header.SetPreprocessorVersion(TCollection_HAsciiString(f"mracad {__version__}"))
    header.SetDescriptionValue(1, TCollection_HAsciiString(_ascii(options_text)))


def _ascii(text: str) -> str:
    """A text as STEP encodes it: what is not plain ASCII as ``\\X2\\…\\X0\\``."""
    return re.sub(r"[^\x20-\x7e]+", lambda run: "\\X2\\" + run[0].encode("utf-16-be").hex().upper() + "\\X0\\", text)
