"""Options as they are written, in TOML and on lines: values from texts, texts from values, places for messages."""

from __future__ import annotations

import json
import math
import re
import typing
from collections.abc import Callable, Iterable, Mapping
from typing import Any, Literal, TypeVar

import msgspec

from mracad.errors import UsageError
from mracad.spec.steps import Options
from mracad.spec.steps.base import dashed, lengths, plain_types

Given = TypeVar("Given", bound=Options)


def options(struct: type[Given], values: Mapping[str, Any], place: Callable[[str], str] | None = None) -> Given:
    """The options of a step from plain values, by their names on the command line or in Python.

    Parameters
    ----------
    struct : type
        One of :data:`mracad.spec.steps.STEPS`.
    values : mapping
    place : callable, optional
        Says where the value of a name stands, for messages.

    Raises
    ------
    UsageError
        For a value that an option does not take.
    """
    kinds, in_mm = plain_types(struct), lengths(struct)
    plain: dict[str, Any] = {}
    for key, value in values.items():
        name = key.replace("-", "_")
        name = f"{name}_" if f"{name}_" in kinds else name
        if typing.get_origin(kinds.get(name)) is tuple and isinstance(value, str):
            value = [value]
        elif name in in_mm and isinstance(value, int | float) and not isinstance(value, bool):
            value = str(value)
        plain[name] = value
    try:
        return msgspec.convert(plain, struct, strict=False)
    except msgspec.ValidationError as error:
        where = re.search(r"`\$\.(\w+)", str(error))
        cause = error.__cause__ if isinstance(error.__cause__, UsageError) else None
        name = where[1] if where else cause.message.partition(":")[0].replace("-", "_") if cause else ""
        at = f"{place(dashed(name))}: " if place else ""
        if cause:
            raise UsageError(f"{at}{cause.message}", cause.hint) from error
        raise _refused(at, struct, name, plain.get(name), kinds.get(name), str(error)) from error


def _refused(at: str, struct: type[Options], name: str, value: Any, kind: Any, reason: str) -> UsageError:
    """The error for a value that is not of its option's type."""
    if typing.get_origin(kind) is tuple:
        kind = typing.get_args(kind)[0]
    if typing.get_origin(kind) is Literal:
        choices = [str(choice) for choice in typing.get_args(kind)]
        wrong = next((v for v in (value if isinstance(value, list) else [value]) if v not in choices), value)
        hint = nearest(str(wrong), choices, "use one of " + ", ".join(choices))
        return UsageError(f"{at}{dashed(name)}: {wrong!r} is not known", hint)
    said = reason.split(" - at")[0].replace("`", "").replace(" | null", "").lower()
    return UsageError(
        f"{at}{dashed(name)}: {value!r} is not right, {said}", f"see mracad {struct.__name__.lower()} --help"
    )


def nearest(word: str, known: Iterable[str], otherwise: str = "") -> str:
    """``did you mean 'scale'?``, or what else to do."""
    import difflib

    names = list(known)
    near = difflib.get_close_matches(word, names, n=1)
    return f"did you mean {near[0]!r}?" if near else otherwise or "use one of " + ", ".join(names)


def filled(value: Any, variables: Mapping[str, str], place: str) -> Any:
    """A value with its variables replaced, and double braces by single ones."""
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
    """A value that :func:`filled` leaves as it is."""
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
    """A text as the TOML value that it is, or as itself."""
    import tomllib

    try:
        return tomllib.loads(f"value = {text}")["value"]
    except tomllib.TOMLDecodeError:
        return text.strip()


def places_of_steps(text: str, name: str) -> list[dict[str, str]]:
    """For each ``[[step]]``, the place of the step and of each of its keys."""
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


def place_of(text: str, key: str, name: str) -> str:
    """The place of a key or table at the top of a recipe."""
    lines = _without_long_strings(text).splitlines()
    pattern = rf"\s*\[?\[?\s*[\"']?{re.escape(key)}[\"']?\s*(=|\]|\.)"
    return f"{name}:{next((i for i, line in enumerate(lines, 1) if re.match(pattern, line)), 1)}"


def _without_long_strings(text: str) -> str:
    """A TOML text whose strings of several lines are only their line ends."""
    return re.sub(r'"""[\s\S]*?"""|\'\'\'[\s\S]*?\'\'\'', lambda match: "\n" * match[0].count("\n"), text)
