"""Progress on a terminal for anything that takes over a second, silent elsewhere; and why a first run takes longer."""

from __future__ import annotations

import mmap
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from types import TracebackType
from typing import Any

from mracad import note
from mracad_cli.say import voice

PATIENCE = 1.0
"""Seconds before a bar appears."""


class Progress:
    """A context manager whose instances are called with a stage, the steps done and the steps in all.

    Parameters
    ----------
    rate : bool
        Show steps per second and the remaining time, and show the bar at once.
    """

    def __init__(self, rate: bool = False) -> None:
        self._rate = rate
        self._start = time.monotonic()
        self._bar: Any = None
        self._task: Any = None

    def __enter__(self) -> Progress:
        note.watch(self._begun)
        return self

    def __exit__(
        self, kind: type[BaseException] | None, value: BaseException | None, trace: TracebackType | None
    ) -> None:
        note.unwatch(self._begun)
        if self._bar is not None:
            self._bar.stop()

    def _begun(self, stage: str, _: str) -> None:
        """Show a stage that begins within the one that was told."""
        if stage and self._bar is not None:
            self._bar.update(self._task, description=stage)

    def __call__(self, stage: str, done: int, total: int) -> None:
        note.doing(stage)
        if not sys.stderr.isatty() or voice.quiet or (time.monotonic() - self._start < PATIENCE and not self._rate):
            return
        if self._bar is None:
            from rich.console import Console
            from rich.progress import BarColumn, TextColumn, TimeElapsedColumn, TimeRemainingColumn
            from rich.progress import Progress as Bar

            columns = TextColumn("{task.description}"), BarColumn(), TextColumn("{task.completed}/{task.total}")
            times = (TextColumn("{task.fields[rate]}"), TimeRemainingColumn()) if self._rate else (TimeElapsedColumn(),)
            self._bar = Bar(*columns, *times, console=Console(stderr=True), transient=True)
            self._bar.start()
            self._task = self._bar.add_task(stage, total=total, rate="")
        rate = f"{done / max(time.monotonic() - self._start, 1e-3):.1f}/s, left"
        self._bar.update(self._task, description=stage, completed=done, total=total, rate=rate)


@contextmanager
def compiling() -> Iterator[None]:
    """Say once, whichever process of the command begins, that code is being compiled; nothing if quiet."""
    said = mmap.mmap(-1, 1)

    def say(stage: str, _: str) -> None:
        if stage == note.COMPILING and not voice.quiet and not said[0]:
            said[0] = 1
            print(f"mracad: {note.COMPILING}, once; later runs find it on disk", file=sys.stderr, flush=True)

    note.watch(say)
    try:
        yield
    finally:
        note.unwatch(say)
