"""The kernel's process-wide state: its printers and its exchange settings, changed only inside a ``with``."""

from __future__ import annotations

import ctypes
import os
import sys
from collections.abc import Iterator, Mapping
from contextlib import contextmanager

from OCP.Interface import Interface_Static
from OCP.Message import Message
from OCP.STEPCAFControl import STEPCAFControl_Controller

_libc = ctypes.CDLL("ucrtbase" if sys.platform == "win32" else None)


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
