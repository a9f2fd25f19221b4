"""What this process is at, told to the process that watches it: for the message should it crash or come to a limit."""

from __future__ import annotations

import mmap


class Note:
    """A few words from a child to its parent, which remain when the child is lost.

    Parameters
    ----------
    file : int
        Descriptor of a file of a page that both have, where the child is no fork.
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


def noting(note: Note) -> None:
    """Let :func:`doing` write to a note, as in a child."""
    global _note
    _note = note


def doing(stage: str = "", subject: str = "") -> None:
    """Note what this process is at, for the message should it crash or come to a limit.

    Parameters
    ----------
    stage : str
        As ``"reading"``; by default what it was.
    subject : str
        The name of the model; by default what it was.
    """
    if _note:
        _note.write(stage or _note.stage, subject or _note.subject)


def now() -> str:
    """What this process is at, as ``" while reading 'part.step'"``; ``""`` where that is not known."""
    return str(_note or "")


def ending() -> None:
    """Say that the outputs are taking their places now: the time limit does not cut that off."""
    if _note:
        _note.write(_note.stage, _note.subject, ending=True)
