"""Messages in the words of Python: they are written in those of the command line, and translated here alone."""

from __future__ import annotations

import re
from collections.abc import Iterator
from contextlib import contextmanager
from functools import cache
from keyword import iskeyword

from mracad.errors import CrashError, MracadError
from mracad.spec.fields import Field, dashed, fields
from mracad.spec.pictures import Picture
from mracad.spec.steps import STEPS

FUNCTIONS = frozenset({"check", "compare", "info", "render", "spectrum"})
"""Commands that are functions, besides the steps."""

_NUMBER = r"[-+]?\d*\.?\d+"
_OPTION = re.compile(r"--(no-)?([a-z]\w*(?:-[a-z]+)*)(?: ('[^']*'|[^\s;()']*[^\s;()',.]))?")
_COMMAND = re.compile(r"\b(see )?mracad ([a-z]+)( --help| --all|(?= --))?")
_START = re.compile(r"(?:^|(?<=: ))([a-z]+(?:-[a-z]+)*)(?=: )")


def spoken(text: str) -> str:
    """A message as Python says it: ``give --scale 5mm`` becomes ``give scale='5mm'``.

    >>> spoken("leave faces out with --faces '!#3', or use --amount 0.5")
    "leave faces out with faces='!#3', or use amount=0.5"
    """
    return _START.sub(_named, _OPTION.sub(_argument, _COMMAND.sub(_function, text)))


def explained(text: str) -> str:
    """A description of an option, which names others, as docstrings say it."""
    return _OPTION.sub(lambda match: f"``{_python(match[2])}``{_rest(match)}", _COMMAND.sub(_function, text))


@contextmanager
def speaking() -> Iterator[None]:
    """Raise errors of the block in the words of Python; those of the kernel become a CrashError."""
    try:
        yield
    except MracadError as error:
        error.message, error.hint = spoken(error.message), spoken(error.hint)
        error.args = (str(error),)
        raise
    except Exception as error:
        if not type(error).__module__.startswith("OCP"):
            raise
        hint = "the model may be damaged: see mracad.check"
        raise CrashError(f"the CAD kernel failed ({type(error).__name__}: {error})", hint) from error


@cache
def _known() -> dict[str, Field]:
    """Options by their names on the command line."""
    structs = [*STEPS.values(), Picture]
    return {dashed(name): field for struct in structs for name, field in fields(struct).items()}


def _python(name: str) -> str:
    name = name.replace("-", "_")
    return f"{name}_" if iskeyword(name) else name


def _function(match: re.Match[str]) -> str:
    see, name, rest = match.groups()
    if name not in FUNCTIONS and name not in STEPS:
        return match[0]
    return f"{see or ''}help(mracad.{name})" if rest == " --help" else f"{see or ''}mracad.{name}"


def _argument(match: re.Match[str]) -> str:
    off, name, value = match.groups()
    field = _known().get(name)
    if field is not None and field.type is bool:
        return f"{_python(name)}={not off}{_rest(match)}"
    if not _valued(match):
        return f"{_python(name)}={_rest(match)}"
    bare = value.strip("'")
    number = field is not None and field.type in (float, int) and re.fullmatch(_NUMBER, bare)
    return f"{_python(name)}={bare if number else repr(bare)}"


def _valued(match: re.Match[str]) -> bool:
    """Whether the word after an option is its value."""
    value, field = match[3] or "", _known().get(match[2])
    if field is not None and field.type is bool:
        return False
    return value in (field.choices if field else ()) or bool(re.search(r"^['A-Z]|\d", value))


def _rest(match: re.Match[str]) -> str:
    """The word after an option that is not its value."""
    return "" if match[3] is None or _valued(match) else f" {match[3]}"


def _named(match: re.Match[str]) -> str:
    return _python(match[1]) if match[1] in _known() else match[1]
