"""Why a process of ours ended without an answer: the kernel crashed, or the system ended it."""

from __future__ import annotations

import contextlib
import signal
from pathlib import Path

from mracad.errors import CrashError, LimitError, MracadError
from mracad.note import Note

_COUNTS = Path("/proc/vmstat")  # of Linux


class Loss:
    """The error of a process that ends without an answer; made when the process starts."""

    def __init__(self) -> None:
        self._before = _ended_for_memory()

    def error(self, status: int, note: Note, hint: str) -> MracadError:
        """What happened to the process.

        Parameters
        ----------
        status : int
            Exit code, or the number of the signal that ended it, times -1.
        note : Note
            What it was at.
        hint : str
            What to do when memory ran out.
        """
        name = f"exit code {status}" if status >= 0 else signal.Signals(-status).name
        if name == "SIGKILL" and _ended_for_memory() > self._before:
            return LimitError(f"the system ended the process{note}: memory ran out", hint)
        if name == "SIGKILL" and (seconds := _cpu_limit()):
            return LimitError(
                f"the process was killed{note}, by a limit of {seconds} s of CPU time or for lack of memory",
                f"raise the limit (ulimit -t), or {hint}",
            )
        if name == "SIGKILL":  # the kernel cannot do that
            return LimitError(f"the process was killed{note}, most likely for lack of memory", hint)
        if name == "SIGXCPU":
            return LimitError(f"limit of {_cpu_limit()} s of CPU time exceeded{note}", "raise it (ulimit -t)")
        return CrashError(f"the CAD kernel crashed ({name}){note}", "the model may be damaged: see mracad check")


def _ended_for_memory() -> int:
    """How many processes the system has ended for lack of memory; 0 where it does not tell."""
    with contextlib.suppress(OSError, ValueError):
        for line in _COUNTS.read_text().splitlines():
            if line.startswith("oom_kill "):
                return int(line.split()[1])
    return 0


def _cpu_limit() -> int:
    """The system's limit of CPU time for this process and its children, seconds; 0 without one."""
    try:
        import resource
    except ModuleNotFoundError:
        return 0
    limits = [limit for limit in resource.getrlimit(resource.RLIMIT_CPU) if limit != resource.RLIM_INFINITY]
    return min(limits, default=0)
