"""A task that does what it is told."""

from __future__ import annotations

import os
import signal
import time
from collections.abc import Callable
from functools import partial

from mracad.errors import UsageError
from mracad.job import guard
from mracad.job.batch.work import Product
from mracad.note import doing

MB = 1_000_000


class Trap:
    """What would do harm were it unpickled."""

    def __reduce__(self) -> tuple[object, ...]:
        return os.kill, (os.getppid(), signal.SIGKILL)


def hold(count: int) -> None:
    """Hold so many bytes for a minute."""
    held = b"x" * count
    time.sleep(60)
    assert held


def threads() -> str:
    return os.environ["OPENBLAS_NUM_THREADS"]


def hang() -> None:
    time.sleep(60)


def note() -> None:
    doing("looking", "part.step")


def eat() -> None:
    eaten = []
    while True:
        eaten.append(b"x" * MB * 10)


def fail(error: Exception) -> None:
    raise error


def end(how: signal.Signals) -> None:
    os.kill(os.getpid(), how)


DEEDS: dict[str, Callable[[], object]] = {
    "crash": partial(end, signal.SIGSEGV),
    "kill": partial(end, signal.SIGKILL),
    "exit": partial(os._exit, 3),
    "hang": hang,
    "hang at a stage": lambda: (note(), hang()),
    "crash at a stage": lambda: (note(), end(signal.SIGSEGV)),
    "note": note,
    "eat": eat,
    "eat in a child": lambda: guard.run(lambda: hold(600 * MB), type(None)),
    "wrong": partial(fail, UsageError("no", "do better")),
    "bug": partial(fail, EOFError("of a file")),
    "print": partial(os.write, 1, b"kernel chatter"),
}


def work(what: str) -> object:
    """Do a deed, and give back what was asked for; only a trap is given as itself."""
    if what in DEEDS:
        DEEDS[what]()
    return Trap() if what == "trap" else what


def made(count: int) -> Product:
    return Product(b"\xff\x00data", ({"edited": count, "valid": True},), ("lost",), 0.5)
