"""Workers in processes of their own: a task that crashes, hangs or needs too much memory fails alone.

The pool is a :class:`concurrent.futures.Executor`.  Each worker is a process that imports what it needs once and then
does one task after another, sent over a pipe.  One thread of the pool waits for each worker, and one more watches
the time and memory of all of them.
"""

from __future__ import annotations

import contextlib
import math
import mmap
import os
import pickle
import queue
import signal
import struct
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Callable
from concurrent.futures import Executor, Future
from functools import partial
from pathlib import Path
from typing import Any

import psutil

from mracad.errors import CrashError, LimitError, MracadError
from mracad.job import wire
from mracad.job.batch.settings import Limits
from mracad.job.loss import Loss
from mracad.note import Note, set_note
from mracad.processes import WORKERS, end_with_parent

TICK = 0.05
"""Seconds between two checks of the workers."""

GRACE = 5
"""Seconds beyond its time limit after which a worker that is no longer watched ends itself."""

_SIZE = struct.Struct(">Q")  # length of an answer, sent before it

READY = 120.0
"""Seconds within which a worker must have started."""


class Pool(Executor):
    """Processes that do tasks, each within limits.

    Tasks are sent as pickles; results come back as MessagePack of the function's declared return type.

    Parameters
    ----------
    workers : int
        Largest number of tasks done at a time.
    limits : Limits
    warm : callable, optional
        Called once in each worker before its first task; must be importable.
    """

    def __init__(self, workers: int, limits: Limits | None = None, warm: Callable[[], object] | None = None) -> None:
        self.workers = workers
        limits = limits or Limits()
        self._seconds = limits.seconds
        self._memory = limits.memory or int(0.8 * psutil.virtual_memory().total / workers)
        self._warm = warm
        self._tasks: queue.SimpleQueue[_Task | None] = queue.SimpleQueue()
        self._slots: list[threading.Thread] = []
        self._workers: list[_Worker] = []
        self._open = 0  # unfinished tasks
        self._lock = threading.Lock()
        self._closing = self._stopped = False

    def submit(self, fn: Callable[..., Any], /, *args: Any, **kwargs: Any) -> Future[Any]:
        if self._closing:
            raise RuntimeError("the pool is closed")
        task = _Task(pickle.dumps((fn, args, kwargs), protocol=5), wire.returned(fn))
        self._tasks.put(task)
        with self._lock:
            self._open += 1
            if self._open > len(self._slots) < self.workers:
                self._slots.append(threading.Thread(target=self._slot, daemon=True))
                self._slots[-1].start()
                if len(self._slots) == 1:
                    threading.Thread(target=self._watch, daemon=True).start()
        return task.future

    def shutdown(self, wait: bool = True, *, cancel_futures: bool = False) -> None:
        """Finish what was submitted; with ``cancel_futures`` end the workers at once."""
        self._closing = True
        if cancel_futures:
            self._stopped = True
            for worker in list(self._workers):
                worker.kill(CrashError("stopped"))
        for _ in self._slots:
            self._tasks.put(None)
        if wait:
            for slot in self._slots:
                slot.join()

    def _slot(self) -> None:
        """Do tasks in a worker, which is replaced when it is lost or has grown too much."""
        worker: _Worker | None = None
        while (task := self._tasks.get()) is not None:
            tell: Callable[[], object] = bool
            if not self._stopped and task.future.set_running_or_notify_cancel():
                worker = self._usable(worker)
                try:
                    worker = worker or self._started()
                    tell = partial(task.future.set_result, worker.call(self._seconds, task.payload, task.returns))
                except BaseException as error:
                    tell = partial(task.future.set_exception, error)
                worker = self._usable(worker)
            else:
                task.future.cancel()
            with self._lock:
                self._open -= 1
            tell()
        if worker:
            self._retire(worker)

    def _usable(self, worker: _Worker | None) -> _Worker | None:
        """The worker, unless it is lost or has grown halfway from its size when ready to its limit."""
        if worker and (worker.lost() or worker.memory() > (worker.ready + self._memory) / 2):
            self._retire(worker)
            return None
        return worker

    def _started(self) -> _Worker:
        """A new worker that has loaded what it needs."""
        worker = _Worker()
        self._workers.append(worker)
        try:
            worker.call(READY, pickle.dumps((self._warm or bool, (), {})), Any)
        except BaseException:
            self._retire(worker)
            raise
        worker.ready = worker.memory()
        return worker

    def _retire(self, worker: _Worker) -> None:
        self._workers.remove(worker)
        worker.close()

    def _watch(self) -> None:
        """End the workers that exceed a limit."""
        while any(slot.is_alive() for slot in self._slots):
            time.sleep(TICK)
            for worker in list(self._workers):
                if time.monotonic() > worker.deadline:
                    hint = "raise --time-limit, or look into the file"
                    worker.kill(LimitError(f"exceeded the time limit of {worker.seconds:g} s{worker.note}", hint))
                elif (used := worker.used()) > self._memory:
                    text = f"exceeded the memory limit of {self._memory / 1e6:.0f} MB (used {used / 1e6:.0f} MB)"
                    worker.kill(LimitError(text, "raise --memory-limit, or use fewer workers"))


class _Task:
    """A pickled call, with the type and the future of its result."""

    def __init__(self, payload: bytes, returns: Any) -> None:
        self.payload, self.returns = payload, returns
        self.future: Future[Any] = Future()


class _Worker:
    """One process that does tasks."""

    def __init__(self) -> None:
        environment = {**os.environ, "PYTHONPATH": os.pathsep.join(path for path in sys.path if path)}
        for name in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS", WORKERS):
            environment[name] = "1"  # the other cores have workers of their own
        self._lost = Loss()
        with tempfile.TemporaryFile() as page:
            page.truncate(mmap.PAGESIZE)
            self.note = Note(page.fileno())
            shared = [] if sys.platform == "win32" else [page.fileno()]
            self.process = subprocess.Popen(
                [sys.executable, "-P", "-c", f"from mracad.job.batch.pool import serve; serve(*{shared})"],
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                stderr=subprocess.DEVNULL,
                env=environment,
                pass_fds=shared,
                process_group=None if sys.platform == "win32" else 0,  # only the client acts on an interrupt
            )
        self.reason: MracadError | None = None
        self.seconds, self.deadline = 0.0, math.inf
        self.ready = 0  # bytes occupied before the first task
        self._process = psutil.Process(self.process.pid)

    def call(self, seconds: float, payload: bytes, returns: Any) -> Any:
        """Do a task and return its result, or raise its error."""
        assert self.process.stdin and self.process.stdout
        self.note.write("", "")
        self.seconds, self.deadline = seconds, time.monotonic() + seconds
        try:
            pickle.dump((seconds, payload), self.process.stdin, protocol=5)
            self.process.stdin.flush()
            (size,) = _SIZE.unpack(self.process.stdout.read(_SIZE.size))
            answer = self.process.stdout.read(size)
        except (OSError, struct.error) as error:
            raise self._loss() from error
        finally:
            self.deadline = math.inf
        if len(answer) < size:
            raise self._loss()
        return wire.unpacked(answer, returns)

    def lost(self) -> bool:
        return self.process.poll() is not None

    def memory(self) -> int:
        """Bytes that the process occupies; 0 once it has ended."""
        return _occupied(self._process)

    def used(self) -> int:
        """Bytes that the process or one of its children occupies, whichever is more.

        A child shares all pages of the process at first, and the process waits for it: the sum would count them twice.
        """
        return max(_occupied(process) for process in (self._process, *_children(self._process)))

    def kill(self, reason: MracadError) -> None:
        self.reason = self.reason or reason
        self.process.kill()

    def close(self) -> None:
        """Let the process end, when there are no more tasks."""
        assert self.process.stdin and self.process.stdout
        with contextlib.suppress(OSError):
            self.process.stdin.close()
        self.process.wait()
        self.process.stdout.close()

    def _loss(self) -> MracadError:
        """The error that tells why the process ended."""
        code = self.process.wait()
        if self.reason:
            return self.reason
        return self._lost.error(code, self.note, "use fewer workers, or a machine with more memory")


def _occupied(process: psutil.Process) -> int:
    try:
        return int(process.memory_info().rss)
    except psutil.Error:
        return 0


def _children(process: psutil.Process) -> list[psutil.Process]:
    """The children of a process; on Linux without listing all processes of the machine."""
    listed = Path(f"/proc/{process.pid}/task/{process.pid}/children")
    try:
        if listed.exists():
            return [psutil.Process(int(pid)) for pid in listed.read_text().split()]
        return list(process.children())
    except (OSError, psutil.Error):
        return []


def serve(page: int | None = None) -> None:
    """Main loop of a worker process: tasks from standard input, results to standard output, until it is closed.

    Its current activity is noted in the file with the descriptor ``page``, where descriptors can be inherited.
    """
    end_with_parent()
    if page is not None:
        set_note(Note(page))
    requests, replies = os.fdopen(os.dup(0), "rb"), os.fdopen(os.dup(1), "wb")
    os.dup2(os.open(os.devnull, os.O_RDONLY), 0)
    os.dup2(2, 1)
    with contextlib.suppress(EOFError, BrokenPipeError):
        while True:
            seconds, payload = pickle.load(requests)
            _alarm(seconds + GRACE)
            answer = wire.answer(partial(_done, payload))
            _alarm(0)
            replies.write(_SIZE.pack(len(answer)) + answer)
            replies.flush()


def _done(payload: bytes) -> Any:
    """Do a task."""
    fn, args, kwargs = pickle.loads(payload)
    return fn(*args, **kwargs)


def _alarm(seconds: float) -> None:
    """End the process after some seconds, whatever it is doing: Python code cannot run while the kernel works."""
    if hasattr(signal, "setitimer"):
        signal.setitimer(signal.ITIMER_REAL, seconds)
