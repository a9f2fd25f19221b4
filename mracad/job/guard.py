"""Work in a child process, so that a crash or an endless loop in the CAD kernel becomes an error."""

from __future__ import annotations

import contextlib
import gc
import math
import os
import select
import signal
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from typing import Any, TypeVar

from mracad.errors import LimitError, UsageError
from mracad.job import wire
from mracad.job.loss import Loss
from mracad.note import Note, set_note
from mracad.processes import end_with_parent

Result = TypeVar("Result")

_GRACE = 1.0  # seconds for a child to clean up once its time is over
_SOON, _TICK = 5.0, 0.5  # seconds for a child that was asked to end, and between looks whether it was
_ENDING = 10.0  # seconds more for a child that is already moving its outputs into place


class TimeLimitError(LimitError):
    """Work that exceeded its time limit."""


_memory: int | None = None  # bytes that this process may hold, when it is a child with a limit


def run(
    work: Callable[[], Result], returns: type[Result], seconds: float | None = None, memory: int | None = None
) -> Result:
    """The result of ``work()``, computed in a child process; a MracadError that it raises is raised here.

    Parameters
    ----------
    work : callable
    returns : type
        Type of the result, which is sent as MessagePack.
    seconds : float, optional
        Time limit.
    memory : int, optional
        Memory limit, bytes; by default that of this process, if it is such a child itself.

    Raises
    ------
    MracadError
        With the code of a limit when one was exceeded or the system killed the child, and of an internal error when
        the child crashed or raised anything else.
    """
    global _memory
    if not hasattr(os, "fork"):
        if seconds is None and memory is None:
            return work()
        raise UsageError("this system cannot limit time and memory", "leave the limits out")
    memory = memory or _memory
    sys.stdout.flush()
    sys.stderr.flush()
    reader, writer = os.pipe()
    note, loss = Note(), Loss()
    child = os.fork()
    if not child:
        set_note(note)
        _memory = memory
        os.close(reader)
        _child(work, writer, memory)
    os.close(writer)
    try:
        with _passing_on(child) as asked:
            data, finished = _received(reader, seconds, note, asked)
    except BaseException:
        _end(child)
        raise
    finally:
        os.close(reader)
    if not finished:
        _end(child)
        if asked:
            _terminated()
        raise TimeLimitError(f"time limit of {seconds:g} s exceeded{note}", "raise --time-limit")
    _, status, usage = os.wait4(child, 0)
    if asked and not data.startswith(wire.DONE):
        _terminated()
    if data:
        return wire.unpacked(data, returns)
    if memory and _peak(usage.ru_maxrss) > 0.7 * memory:
        raise _out_of_memory(memory)
    raise loss.error(os.waitstatus_to_exitcode(status), note, "free memory, or use a machine with more")


def _child(work: Callable[[], Any], writer: int, memory: int | None) -> None:
    """Run the work, send its result or error, and end the process in any case.

    It ends too soon to gain from searching for cycles, which takes long among the classes of the kernel.
    """
    gc.disable()
    try:
        end_with_parent()
        signal.signal(signal.SIGTERM, _terminated)
        answer = _answer(work, memory)
        with contextlib.suppress(OSError, ValueError):
            sys.stdout.flush()
            sys.stderr.flush()
        with os.fdopen(writer, "wb") as pipe:
            pipe.write(answer)
    finally:
        os._exit(0)


def _answer(work: Callable[[], Any], memory: int | None) -> bytes:
    """The packed result or error of the work."""
    if not memory:
        return wire.answer(work)
    import resource

    _take_buffers()
    hard = resource.getrlimit(resource.RLIMIT_DATA)[1]
    resource.setrlimit(resource.RLIMIT_DATA, (memory if hard < 0 else min(memory, hard), hard))

    def starved() -> Any:
        try:
            return work()
        except BaseException as error:
            resource.setrlimit(resource.RLIMIT_DATA, (hard, hard))  # memory to report it
            if _starved(error):
                raise _out_of_memory(memory) from error
            raise

    return wire.answer(starved)


def _take_buffers() -> None:
    """Let the BLAS of numpy and of scipy allocate their buffers: short of memory they would retry for ever or abort."""
    import numpy as np
    from scipy.linalg.lapack import dpbtrf

    square = np.eye(256)
    np.matmul(square, square)
    dpbtrf(square[:128])


def _starved(error: BaseException) -> bool:
    """Whether an error under a limit means that memory ran out; a library that does not load for it may not say so."""
    unloaded = isinstance(error, ImportError) and not isinstance(error, ModuleNotFoundError)
    return unloaded or wire.out_of_memory(error)


def _terminated(*_: object) -> None:
    raise SystemExit(128 + signal.SIGTERM)


def _received(reader: int, seconds: float | None, note: Note, asked: Sequence[float]) -> tuple[bytes, bool]:
    """Everything that the child sends, and whether it ended in time: before a limit, and soon when it was asked to."""
    late = False
    end = math.inf if seconds is None else time.monotonic() + seconds
    pieces: list[bytes] = []
    while True:
        end = min(end, asked[0] + _SOON) if asked and not late else end
        rest = max(end - time.monotonic(), 0.0)
        if not select.select([reader], [], [], min(rest, _TICK))[0]:
            if rest > _TICK:
                continue
            if late or not note.ending:
                return b"", False
            late, end = True, time.monotonic() + _ENDING
            continue
        piece = os.read(reader, 1 << 20)
        if not piece:
            return b"".join(pieces), True
        pieces.append(piece)


@contextlib.contextmanager
def _passing_on(child: int) -> Iterator[list[float]]:
    """Pass requests to end on to the child; yields the list of the times when they came."""
    asked: list[float] = []

    def end(*_: object) -> None:
        asked.append(time.monotonic())
        os.kill(child, signal.SIGTERM)

    try:
        old = signal.signal(signal.SIGTERM, end)
    except ValueError:  # not the main thread
        yield asked
        return
    try:
        yield asked
    finally:
        signal.signal(signal.SIGTERM, old)


def _end(child: int) -> None:
    """Ask a child to end, and kill it if it does not."""
    deadline = time.monotonic() + _GRACE
    with contextlib.suppress(ProcessLookupError):
        os.kill(child, signal.SIGTERM)
    while time.monotonic() < deadline:
        if os.waitpid(child, os.WNOHANG)[0]:
            return
        time.sleep(0.01)
    os.kill(child, signal.SIGKILL)
    os.waitpid(child, 0)


def _peak(value: int) -> int:
    """Peak memory in bytes, from the number that the operating system gives."""
    return value if sys.platform == "darwin" else value * 1024


def _out_of_memory(memory: int) -> LimitError:
    return LimitError(f"memory limit of {memory / 1e6:g} MB exceeded", "raise --memory-limit")
