"""Processes that work for this one, and end with it."""

from __future__ import annotations

import ctypes
import os
import signal
import sys
import threading
import time
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from types import TracebackType
from typing import TYPE_CHECKING, Any, Generic, TypeVar

from mracad.errors import UsageError

if TYPE_CHECKING:
    from multiprocessing.connection import Connection

Result = TypeVar("Result")

WORKERS = "MRACAD_WORKERS"
"""Variable with the largest number of processes of an edit; by default there is one for each processor."""

PATIENCE = 0.5
"""Seconds of work before processes are started."""

_DEATH_SIGNAL = 1  # PR_SET_PDEATHSIG


def end_with_parent() -> None:
    """Have this process killed when the thread that started it ends, where the system can do that."""
    if sys.platform == "linux":
        ctypes.CDLL(None).prctl(_DEATH_SIGNAL, signal.SIGKILL)


def workers() -> int:
    """The largest number of processes of an edit.

    Raises
    ------
    UsageError
        When the variable is not a whole number from 1 on.
    """
    said = os.environ.get(WORKERS, "")
    if said and not (said.isdecimal() and int(said)):
        raise UsageError(f"{WORKERS} is {said!r}, not a number of processes", f"unset it, or say {WORKERS}=1")
    return int(said) if said else len(os.sched_getaffinity(0)) if sys.platform == "linux" else os.cpu_count() or 1


class Ahead(Generic[Result]):
    """Results of a function by key, computed ahead by forked processes once that takes long; for a ``with`` statement.

    Each process has a copy of all that the function needs, which must not change.  So results are the same for every
    number of processes; what a process fails to send is computed here.

    Parameters
    ----------
    work : callable
        Gives the result for a key, which is sent as a pickle.
    """

    def __init__(self, work: Callable[[int], Result]) -> None:
        self._work = work
        self._named: set[int] = set()
        self._waiting: list[int] = []
        self._done: dict[int, Result] = {}
        self._staff: list[_Worker] = []
        most = workers()
        self._most = most if _can_fork() else 1
        self._spent = 0.0

    def __enter__(self) -> Ahead[Result]:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None) -> None:
        while self._staff:
            self._dismiss(self._staff[0])

    def expect(self, keys: Iterable[int]) -> None:
        """Tell keys of results that will probably be asked for, in their order."""
        for key in keys:
            if key not in self._named:
                self._named.add(key)
                self._waiting.append(key)

    def __call__(self, key: int) -> Result:
        """The result for a key, which is asked for once."""
        self._named.add(key)
        self._waiting = [each for each in self._waiting if each != key]
        if not self._staff and self._waiting and self._most > 1 and self._spent > PATIENCE:
            self._start(min(self._most, 1 + len(self._waiting)))
        if self._staff and not self._known(key):
            self._waiting.insert(0, key)
        while self._staff and key not in self._done and self._known(key):
            self._pass_on()
        if key in self._done:
            return self._done.pop(key)
        self._waiting = [each for each in self._waiting if each != key]
        start = time.perf_counter()
        try:
            return self._work(key)
        finally:
            self._spent += time.perf_counter() - start

    def _known(self, key: int) -> bool:
        """Whether the result for a key is there or to come."""
        return key in self._done or key in self._waiting or any(each.key == key for each in self._staff)

    def _start(self, count: int) -> None:
        from multiprocessing import get_context

        context = get_context("fork")
        for _ in range(count):
            own, theirs = context.Pipe()
            others = [own, *(each.pipe for each in self._staff)]
            process = context.Process(target=_serve, args=(self._work, theirs, others), daemon=True)
            process.start()
            theirs.close()
            self._staff.append(_Worker(process, own))

    def _pass_on(self) -> None:
        """Give keys to the processes without one, and take results, once there are any."""
        from multiprocessing.connection import wait

        for worker in [each for each in self._staff if each.key is None]:
            if self._waiting:
                worker.key = self._waiting.pop(0)
                worker.pipe.send(worker.key)
        ready = wait([each.pipe for each in self._staff if each.key is not None])
        for worker in [each for each in self._staff if each.pipe in ready]:
            assert worker.key is not None
            try:
                self._done[worker.key], worker.key = worker.pipe.recv(), None
            except (EOFError, OSError):
                self._dismiss(worker)

    def _dismiss(self, worker: _Worker) -> None:
        self._staff.remove(worker)
        worker.process.kill()
        worker.process.join()
        worker.pipe.close()


@dataclass
class _Worker:
    """A process, the pipe to it, and the key that it works on."""

    process: Any
    pipe: Connection
    key: int | None = None


def _can_fork() -> bool:
    """Whether this process may have copies: it must have no other threads, must not be one that may have no children,
    and its memory must not be limited."""
    if not hasattr(os, "fork") or threading.active_count() > 1:
        return False
    import resource
    from multiprocessing import current_process

    return not current_process().daemon and resource.getrlimit(resource.RLIMIT_DATA)[0] == resource.RLIM_INFINITY


def _serve(work: Callable[[int], Any], pipe: Connection, others: Iterable[Connection]) -> None:
    """Send results for the keys that come in, until one fails."""
    end_with_parent()
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    for other in others:
        other.close()
    try:
        while True:
            pipe.send(work(pipe.recv()))
    except BaseException:
        os._exit(0)
