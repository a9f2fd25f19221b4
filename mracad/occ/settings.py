"""The kernel's process-wide state: its printers and its exchange settings, changed only inside a ``with``.

And how files are written: with all digits, and the same whenever that is.
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

from mracad.errors import UsageError

_libc = ctypes.CDLL("ucrtbase" if sys.platform == "win32" else None)


_threaded = 0  # the process whose kernel has started threads


def threads() -> bool:
    """Whether the kernel may use its threads: not in a child of a process where it has, which would wait for those."""
    global _threaded
    _threaded = _threaded or os.getpid()
    return _threaded == os.getpid()


@contextmanager
def quiet() -> Iterator[None]:
    """Keep whatever the kernel prints away from standard output.

    Its message printers are taken out, and file descriptor 1, which parts of it write to directly, leads nowhere
    for the duration.  May be nested; Python's own ``sys.stdout`` must not be written to inside.
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
    """Set the kernel's exchange parameters, and put the old ones back.

    Parameters
    ----------
    values : mapping
        Name (as ``"write.step.unit"``) to value: text, or a number for those that are numbers.

    Notes
    -----
    They are global to the process: use processes, not threads, to exchange several files at once.
    """
    STEPCAFControl_Controller.Init_s()
    old = {name: Interface_Static.CVal_s(name) for name in values}
    try:
        for name, value in values.items():
            if not Interface_Static.SetCVal_s(name, str(value)):
                raise ValueError(f"the kernel has no setting {name} = {value}")
        yield
    finally:
        for name, text in old.items():
            Interface_Static.SetCVal_s(name, text)


def all_digits(writer: Interface_FloatWriter) -> None:
    """Let a writer of reals give 17 significant digits and always the point, which STEP and IGES need.

    What is nearest to zero would not fit the kernel's buffer with an exponent of three digits: it is cut to two.
    """
    writer.SetFormat("%#.2G")
    writer.SetFormatForRange("%#.17G", 1e-99, 1e99)


def moment() -> datetime:
    """The time that a file's header states: SOURCE_DATE_EPOCH, else 1970; raises UsageError."""
    epoch = os.environ.get("SOURCE_DATE_EPOCH", "0")
    try:
        return datetime.fromtimestamp(int(epoch), UTC)
    except (ValueError, OverflowError) as error:
        raise UsageError(f"SOURCE_DATE_EPOCH is '{epoch}'", "give it whole seconds since 1970, or unset it") from error
