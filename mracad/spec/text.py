"""Options as text, in TOML and on the command line: values from text, text from values, places for messages."""

from __future__ import annotations

import json
import math
import re
from collections.abc import Callable, Mapping
from typing import Any, TypeVar

import msgspec

from mracad.errors import UsageError
from mracad.spec.fields import dashed, fields, named, nearest
from mracad.spec.steps import Options

_NAME = r"""(?:"[^"]*"|'[^']*'|[\w-]+)"""
Given = TypeVar("Given", bound=Options)


def options(struct: type[Given], values: Mapping[str, Any], place: Callable[[str], str] | None = None) -> Given:
    """The options of a step from plain values, by their names on the command line or in Python.

    Parameters
    ----------
    struct : type
        One of :data:`mracad.spec.steps.STEPS`.
    values : mapping
    place : callable, optional
        Tells the place of an option's value, for messages.

    Raises
    ------
    UsageError
        For a value that an option does not take.
    """
    known, plain, key = fields(struct), {}, ""
    try:
        for key, value in values.items():
            field = named(known, key)
            if field is None:
                raise UsageError(f"{key}: there is no such option", nearest(key, map(dashed, known)))
            plain[field.name] = field.read(value)
        key = ""
        missing = {name: None for name, field in known.items() if field.default is msgspec.NODEFAULT}
        return struct(**(missing | plain))
    except UsageError as error:
        if not place:
            raise
        raise UsageError(f"{place(dashed(key or error.option))}: {error.message}", error.hint) from error


def filled(value: Any, variables: Mapping[str, str], place: str) -> Any:
    """A value with variables filled in and double braces replaced by single ones."""
    if isinstance(value, list):
        return [filled(member, variables, place) for member in value]
    if not isinstance(value, str):
        return value

    def replacement(match: re.Match[str]) -> str:
        if match[1] is None:
            return match[0][0]
        if match[1] not in variables:
            raise UsageError(f"{place}: no variable {match[0]}", nearest(match[1], variables))
        return variables[match[1]]

    return re.sub(r"\{\{|\}\}|\{(\w+)\}", replacement, value)


def braced(value: Any) -> Any:
    """A value with its braces doubled, so that :func:`filled` gives it back."""
    if isinstance(value, list | tuple):
        return [braced(member) for member in value]
    return value.replace("{", "{{").replace("}", "}}") if isinstance(value, str) else value


def toml(value: Any) -> str:
    """A value as TOML."""
    if isinstance(value, list | tuple):
        return f"[{', '.join(map(toml, value))}]"
    if isinstance(value, float) and not math.isfinite(value):
        return str(value)
    text = json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007f")
    if not text.isascii():
        try:
            text.encode()
        except UnicodeEncodeError as error:
            raise UsageError(f"record: {value!r} is not Unicode", "rename it, or leave out --record") from error
    return text


def toml_value(text: str) -> Any:
    """The TOML value that a text is, or else the text itself."""
    import tomllib

    try:
        return tomllib.loads(f"value = {text}")["value"]
    except tomllib.TOMLDecodeError:
        return text.strip()


def places_of_steps(text: str, name: str) -> list[dict[str, str]]:
    """For each ``[[step]]``, the places (``file:line``) of the step and of each of its keys."""
    found: list[dict[str, str]] = []
    inside = False
    for number, line in enumerate(_without_long_strings(text).splitlines(), 1):
        if line.lstrip().startswith("["):
            inside = bool(re.match(r"\s*\[\[\s*[\"']?step[\"']?\s*\]\]", line))
            if inside:
                found.append({"": f"{name}:{number}"})
        elif inside and (match := re.match(r"\s*[\"']?([\w-]+)[\"']?\s*=", line)):
            found[-1].setdefault(dashed(match[1]), f"{name}:{number}")
    return found


def places_of_keys(text: str) -> dict[tuple[str, ...], int]:
    """The lines of the keys of a TOML text, with the names of the tables that they are in."""
    found: dict[tuple[str, ...], int] = {}
    table: tuple[str, ...] = ()
    for number, line in enumerate(_without_long_strings(text).splitlines(), 1):
        if match := re.match(r"\s*\[([^\[\]]+)\]", line):
            table = _names(match[1])
        elif match := re.match(rf"\s*({_NAME}(?:\s*\.\s*{_NAME})*)\s*=", line):
            found[(*table, *_names(match[1]))] = number
    return found


def _names(text: str) -> tuple[str, ...]:
    """The parts of a dotted key of TOML."""
    return tuple(name.strip("\"'") for name in re.findall(_NAME, text))


def place_of(text: str, key: str, name: str) -> str:
    """The place of a key or table at the top of a recipe."""
    lines = _without_long_strings(text).splitlines()
    pattern = rf"\s*\[?\[?\s*[\"']?{re.escape(key)}[\"']?\s*(=|\]|\.)"
    return f"{name}:{next((i for i, line in enumerate(lines, 1) if re.match(pattern, line)), 1)}"


def _without_long_strings(text: str) -> str:
    """A TOML text with multi-line strings reduced to their line ends."""
    return re.sub(r'"""[\s\S]*?"""|\'\'\'[\s\S]*?\'\'\'', lambda match: "\n" * match[0].count("\n"), text)
