"""A task that does what it is told."""

from __future__ import annotations

import os
import signal
import time

from mracad import guard
from mracad.batch.work import Product
from mracad.errors import UsageError

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


def work(what: str) -> object:
    if what == "crash":
        os.kill(os.getpid(), signal.SIGSEGV)
    elif what == "kill":
        os.kill(os.getpid(), signal.SIGKILL)
    elif what == "exit":
        os._exit(3)
    elif what == "hang":
        time.sleep(60)
    elif what == "hang at a stage":
        guard.doing("looking", "part.step")
        time.sleep(60)
    elif what == "crash at a stage":
        guard.doing("looking", "part.step")
        os.kill(os.getpid(), signal.SIGSEGV)
    elif what == "note":
        guard.doing("looking", "part.step")
    elif what == "eat":
        eaten = []
        while True:
            eaten.append(b"x" * MB * 10)
    elif what == "eat in a child":
        guard.run(lambda: hold(600 * MB), type(None))
    elif what == "wrong":
        raise UsageError("no", "do better")
    elif what == "bug":
        raise EOFError("of a file")
    elif what == "trap":
        return Trap()
    elif what == "print":
        os.write(1, b"kernel chatter")
    return what


def made(count: int) -> Product:
    return Product(b"\xff\x00data", ({"edited": count, "valid": True},), ("lost",), 0.5)
