"""What a command does: told on standard error (-v), kept in a log (--log) and in a report for CI (--junit)."""

from __future__ import annotations

import json
import os
import sys
import time
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import click
from msgspec import Struct

from mracad import note
from mracad.errors import FileError, MracadError
from mracad_cli.defaults import Default
from mracad_cli.say import printable, voice


class Ended(Struct):
    """How the work of a command ended: its exit code, and what it said if that is kept."""

    code: int
    said: list[str]


class Journal:
    """The journal of one command.

    Parameters
    ----------
    command : str
        Its words.
    log : str or None
        File to which events are added, one JSON object per line.
    verbose : bool
    keeps : bool
        Whether what is said is kept.
    """

    def __init__(self, command: str, log: str | None, *, verbose: bool, keeps: bool) -> None:
        self.command, self.verbose, self.keeps = command, verbose, keeps
        self.said: list[str] = []
        self._log = _opened(log) if log else None
        self._start = time.time()
        self._own = os.getpid()
        self._phase: tuple[str, float] = "", 0.0
        self._subject = ""

    def began(self, arguments: Iterable[str], defaults: Mapping[str, Default]) -> None:
        """Tell what is asked for."""
        if self._log is not None:
            from mracad.spec.recipe import versions

            told = [{"option": d.key, "value": d.value, "from": d.place} for d in defaults.values()]
            self._event("began", arguments=list(arguments), defaults=told, versions=versions(), folder=os.getcwd())
        for default in defaults.values():
            self._tell(f"default: {default.key} = {default.text} from {default.place}")

    def doing(self, stage: str, subject: str) -> None:
        """Note an activity; see :func:`mracad.note.doing`."""
        self._subject = subject or self._subject
        if stage and stage != self._phase[0]:
            self.leave()
            self._phase = stage, time.time()

    def leave(self) -> None:
        """End the current phase."""
        stage, start = self._phase
        if stage:
            seconds = time.time() - start
            self._event("phase", phase=stage, model=self._subject, seconds=round(seconds, 4))
            self._tell(f"{f'{stage} {self._subject}'.strip()}: {seconds:.3f} s")
        self._phase = "", 0.0

    def heard(self, line: str, warning: bool) -> None:
        """Note a line that is printed."""
        if warning:
            self._event("warning", text=line)
        elif self.keeps:
            self.said.append(line)

    def ended(self, code: int, error: MracadError | None = None) -> None:
        """Tell how it ended."""
        why = {"message": error.message, "hint": error.hint} if error else {}
        self._event("ended", code=code, seconds=round(self.seconds, 4), said=self.said, **why)
        self._tell(f"mracad {self.command} took {self.seconds:.3f} s, exit code {code}")

    @property
    def seconds(self) -> float:
        """Time since the command began."""
        return time.time() - self._start

    def junit(self, subject: str, code: int, error: MracadError | None = None) -> str:
        """The end of the command as JUnit: one case, for its ``subject``."""
        from mracad_cli.render import junit

        name = f"mracad {self.command}"
        lines = "\n".join(self.said)
        if code == 0:
            case = junit.Case(name, subject, line=lines, seconds=self.seconds)
        else:
            line = error.message if error else next((x for x in self.said if "failed" in x), f"exit code {code}")
            more = error.hint if error else lines
            case = junit.Case(name, subject, junit.became(code), line, more, str(code), self.seconds)
        return junit.text(name, [case], self.seconds)

    @contextmanager
    def listening(self) -> Iterator[None]:
        """Listen to what is done and said in the block, in this process or a child of it."""
        note.watch(self.doing)
        voice.listener = self.heard
        try:
            yield
        finally:
            note.unwatch(self.doing)
            voice.listener = None

    def _event(self, event: str, **facts: Any) -> None:
        if self._log is None:
            return
        now = time.time()
        moment = time.strftime("%Y-%m-%dT%H:%M:%S", time.gmtime(now)) + f".{int(now % 1 * 1000):03d}Z"
        body = {"time": moment, "process": self._own, "command": self.command, "event": event, **facts}
        os.write(self._log, (json.dumps(body, default=str) + "\n").encode())

    def _tell(self, line: str) -> None:
        if self.verbose:
            print(printable(line), file=sys.stderr)


def subject_of(ctx: click.Context) -> str:
    """The first argument of a command, which is its model or its recipe."""
    given = (ctx.params.get(str(param.name)) for param in ctx.command.params if isinstance(param, click.Argument))
    first = next((value for value in given if value), ctx.command_path)
    return first if isinstance(first, str) else first[0]


def _opened(path: str) -> int:
    try:
        return os.open(path, os.O_WRONLY | os.O_APPEND | os.O_CREAT, 0o666)
    except OSError as error:
        raise FileError(f"cannot write {Path(path)}: {error.strerror}", "name another file with --log") from error
