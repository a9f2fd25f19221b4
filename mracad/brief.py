"""Objects in one line, for ``repr``: arrays by their shapes, containers by their lengths."""

from __future__ import annotations

from collections.abc import Sized
from dataclasses import fields
from enum import Enum
from typing import Any

LONGEST = 140
"""Of what is said of an object, characters."""

NAME = 60
"""Longest name, characters."""

_FEW = 3
_PLAIN = str, bool, int, float, type(None), Enum


def line(thing: Any) -> str:
    """The ``repr`` of a dataclass in one line, however large its members are."""
    told = ", ".join(f"{each.name}={_value(getattr(thing, each.name))}" for each in fields(thing) if each.repr)
    return f"{type(thing).__name__}({shortened(told, LONGEST)})"


def model_line(kind: str, name: str, faces: tuple[int, int], *more: str) -> str:
    """A model in one line: its name, its NURBS faces and all faces, and what is not empty of what more is said."""
    nurbs, every = faces
    told = ", ".join(filter(None, [f"{nurbs} NURBS face{'s' * (nurbs != 1)} of {every}", *more]))
    return named_line(kind, name, told)


def named_line(kind: str, name: str, told: str) -> str:
    """What is said of a thing with a name from a file."""
    return f"{kind}({shortened(repr(name)[1:-1], NAME)}: {shortened(told, LONGEST - NAME)})"


def shortened(text: str, most: int) -> str:
    """A text of at most so many characters."""
    return text if len(text) <= most else f"{text[: most - 1]}…"


def _value(value: Any) -> str:
    shape = getattr(value, "shape", None)
    if isinstance(value, float):
        return f"{value:.6g}"
    if isinstance(value, Enum):
        return value.name
    if isinstance(value, _PLAIN):
        return shortened(repr(value), NAME)
    if isinstance(shape, tuple):
        return f"array({'×'.join(map(str, shape))})"
    if isinstance(value, tuple) and len(value) <= _FEW and all(isinstance(each, _PLAIN) for each in value):
        return f"({', '.join(map(_value, value))}{',' * (len(value) == 1)})"
    return f"{type(value).__name__}({len(value)})" if isinstance(value, Sized) else type(value).__name__
