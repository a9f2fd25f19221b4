"""Lines on a terminal, and JSON; nothing here loads a numerical library."""

from __future__ import annotations

import json
import math
import os
import re
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

from mracad.errors import FileError

_CONTROL = re.compile("[\x00-\x1f\x7f-\x9f\u2028\u2029]")


def printable(line: str) -> str:
    """A line for a terminal, with control characters (names may hold them) written as in JSON (``\\u001b``)."""
    return _CONTROL.sub(lambda match: f"\\u{ord(match[0]):04x}", line)


@dataclass
class Voice:
    """How results are told.

    Attributes
    ----------
    quiet : bool
        They are not printed.
    as_json : bool
        Errors are, too, printed as JSON.
    debug : bool
        Errors are printed with their tracebacks.
    listener : callable or None
        Gets every line of them, and with True every warning.
    """

    quiet: bool = False
    as_json: bool = False
    debug: bool = False
    listener: Callable[[str, bool], None] | None = None


voice = Voice()
"""That of this process."""


def say(*lines: str, aside: bool = False) -> None:
    """Print lines of a result, on standard output, or on standard error where that holds something else."""
    for line in lines:
        if voice.listener:
            voice.listener(line, False)
        if voice.quiet:
            continue
        if aside:
            print(printable(line), file=sys.stderr)
        else:
            with printing():
                print(printable(line))


@contextmanager
def printing() -> Iterator[None]:
    """For output in the block, which has left this process at its end.

    Raises
    ------
    FileError
        When standard output does not take it: the rest is discarded.
    """
    try:
        yield
        sys.stdout.flush()
    except OSError as error:
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        closed = isinstance(error, BrokenPipeError)
        what = "standard output was closed" if closed else f"cannot write to standard output: {error.strerror}"
        raise FileError(what, "" if closed else "send it elsewhere") from error


def warn(*lines: str) -> None:
    """Print warnings on standard error."""
    for line in lines:
        if voice.listener:
            voice.listener(line, True)
        print(f"warning: {printable(line)}", file=sys.stderr)


def size(count: int) -> str:
    """A number of bytes."""
    return f"{count / 1e6:.1f} MB" if count >= 1e5 else f"{count / 1e3:.1f} kB"


def json_text(value: Any, indent: int | None = None) -> str:
    """JSON that any parser accepts: null for numbers that are not finite, escapes for text that UTF-8 cannot hold."""
    body = _finite(value)
    text = json.dumps(body, indent=indent, ensure_ascii=False)
    try:
        for encoding in {"utf-8", sys.stdout.encoding or "utf-8"}:
            text.encode(encoding)
    except UnicodeEncodeError:
        return json.dumps(body, indent=indent)
    return text


def _finite(value: Any) -> Any:
    if isinstance(value, dict):
        return {key: _finite(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [_finite(item) for item in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value
