"""The current activity of this process, for the message of a crash or an exceeded limit, and for those who watch."""

from __future__ import annotations

import mmap
from collections.abc import Callable

Watcher = Callable[[str, str], object]

COMPILING = "compiling the code for large models"
"""The stage of a first run that has to compile."""


class Note:
    """A short text from a child to its parent, which survives the child.

    Parameters
    ----------
    file : int
        Descriptor of a shared file of one page, where the child is not a fork.
    """

    def __init__(self, file: int = -1) -> None:
        self._memory = mmap.mmap(file, mmap.PAGESIZE)
        self.stage = self.subject = ""

    def write(self, stage: str, subject: str, ending: bool = False) -> None:
        self.stage, self.subject = stage, subject
        text = f"{stage} {subject!r}".encode(errors="replace")[: mmap.PAGESIZE - 2] if subject else stage.encode()
        self._memory[: len(text) + 2] = bytes([ending or self.ending]) + text + b"\0"

    @property
    def ending(self) -> bool:
        return bool(self._memory[0])

    def __str__(self) -> str:
        text = self._memory[1:].partition(b"\0")[0].decode(errors="replace")
        return f" while {text}" if text else ""


_note: Note | None = None  # of this process, when it is a child
_watchers: list[Watcher] = []


def set_note(note: Note) -> None:
    """Make :func:`doing` write to a note, as in a child process."""
    global _note
    _note = note


def doing(stage: str = "", subject: str = "") -> None:
    """Note the current activity of this process, for the error message should it crash or exceed a limit.

    Parameters
    ----------
    stage : str
        Such as ``"reading"``; by default unchanged.
    subject : str
        The name of the model; by default unchanged.
    """
    if _note:
        _note.write(stage or _note.stage, subject or _note.subject)
    for watcher in _watchers:
        watcher(stage, subject)


def watch(watcher: Watcher) -> None:
    """Have a function called with the stage and the subject of every activity in this process and its children."""
    _watchers.append(watcher)


def unwatch(watcher: Watcher) -> None:
    """Call a function no longer."""
    _watchers.remove(watcher)


def now() -> str:
    """The current activity, such as ``" while reading 'part.step'"``; ``""`` if unknown."""
    return str(_note or "")


def ending() -> None:
    """Note that outputs are being moved into place: the time limit does not interrupt that."""
    if _note:
        _note.write(_note.stage, _note.subject, ending=True)
