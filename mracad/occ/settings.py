"""The kernel's process-wide state: its printers and its exchange settings, changed only inside a ``with``.

Also how files are written: with all digits, and reproducibly.
"""

from __future__ import annotations

import ctypes
import os
import sys
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from datetime import UTC, datetime

from OCP.Interface import Interface_FloatWriter, Interface_Static
from OCP.Message import Message
from OCP.STEPCAFControl import STEPCAFControl_Controller
from OCP.XCAFDoc import XCAFDoc_ShapeTool

from mracad.errors import UsageError

_libc = ctypes.CDLL("ucrtbase" if sys.platform == "win32" else None)


_threaded = 0  # process id whose kernel has started threads


def threads() -> bool:
    """Whether the kernel may use threads: not in a forked child of a process that did, where it would wait for them."""
    global _threaded
    _threaded = _threaded or os.getpid()
    return _threaded == os.getpid()


@contextmanager
def quiet() -> Iterator[None]:
    """Keep everything that the kernel prints away from standard output.

    Its message printers are removed, and file descriptor 1, to which parts of it write directly, is redirected to null
    inside the block.  May be nested; Python's own ``sys.stdout`` must not be written to inside.
    """
    printers = Message.DefaultMessenger_s().ChangePrinters()
    removed = [printers.Value(i) for i in range(1, printers.Length() + 1)]
    if sys.stdout is not None:
        sys.stdout.flush()
    saved = os.dup(1)
    sink = os.open(os.devnull, os.O_WRONLY)
    try:
        printers.Clear()
        os.dup2(sink, 1)
        yield
    finally:
        _libc.fflush(None)
        os.dup2(saved, 1)
        os.close(saved)
        os.close(sink)
        for printer in removed:
            printers.Append(printer)


@contextmanager
def exchange(values: Mapping[str, str | int]) -> Iterator[None]:
    """Set the kernel's exchange parameters, and restore the old ones at the end.

    Products without a name are named by their kind inside the block, as the kernel does unless another library has
    told it otherwise.

    Parameters
    ----------
    values : mapping
        Values by name, such as ``"write.step.unit"``: text, or a number for numeric settings.

    Notes
    -----
    They are global to the process: use processes, not threads, to exchange several files at once.
    """
    STEPCAFControl_Controller.Init_s()
    old = {name: Interface_Static.CVal_s(name) for name in values}
    naming = XCAFDoc_ShapeTool.AutoNaming_s()
    try:
        XCAFDoc_ShapeTool.SetAutoNaming_s(True)
        for name, value in values.items():
            if not Interface_Static.SetCVal_s(name, str(value)):
                raise ValueError(f"the kernel has no setting {name} = {value}")
        yield
    finally:
        XCAFDoc_ShapeTool.SetAutoNaming_s(naming)
        for name, text in old.items():
            Interface_Static.SetCVal_s(name, text)


def all_digits(writer: Interface_FloatWriter) -> None:
    """Make a writer of reals give 17 significant digits and always the decimal point, which STEP and IGES need.

    Tiny numbers with an exponent of three digits would not fit the kernel's buffer: they are cut to two.
    """
    writer.SetFormat("%#.2G")
    writer.SetFormatForRange("%#.17G", 1e-99, 1e99)


def moment() -> datetime:
    """The time for the header of a file: SOURCE_DATE_EPOCH, else 1970; raises UsageError."""
    epoch = os.environ.get("SOURCE_DATE_EPOCH", "0")
    try:
        return datetime.fromtimestamp(int(epoch), UTC)
    except (ValueError, OverflowError) as error:
        raise UsageError(f"SOURCE_DATE_EPOCH is '{epoch}'", "give it whole seconds since 1970, or unset it") from error
