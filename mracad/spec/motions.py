"""How sweeps move points and regions, as texts, read; what they mean on a model says :mod:`mracad.edit.led`."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

from mracad.errors import UsageError
from mracad.spec.files import Naming
from mracad.spec.places import AXES, Listed, OnFace, Point, numbers, place, whole
from mracad.spec.quantity import ANGLE

STEP = "write DX,DY,DZ in millimetres: 0,0,-2.5; or one number, along the outward normal"
TURN = "write it as AXIS,ANGLE: z,15 or normal,15; or DX,DY,DZ,ANGLE or X,Y,Z,DX,DY,DZ,ANGLE"
STRETCH = "write a factor, 1.1, or AXIS,FACTOR: x,1.1"
MOST_STRETCH = 100.0
"""Largest factor of a stretch, and its inverse the smallest."""


@dataclass(frozen=True)
class Rim:
    """An edge, by its number."""

    number: int


@dataclass(frozen=True)
class Axis:
    """An axis: its direction (the outward normal if None), through a point (mm; the middle of the region if None)."""

    direction: tuple[float, ...] | None
    through: tuple[float, ...] | None = None


def start(text: str, name: str) -> Point | OnFace | Listed | Rim:
    """A place, ``@FILE`` or ``edge#4``; raises UsageError."""
    number = whole(text.removeprefix("edge#")) if text.startswith("edge#") else None
    return place(text, name) if number is None else Rim(number)


def step(text: str, name: str) -> tuple[float, ...]:
    """``DX,DY,DZ``, or one number: a distance along normals; raises UsageError."""
    found = numbers(text, (1, 3))
    if found is None:
        raise UsageError(f"{name}: {text!r} is neither three numbers nor one", STEP)
    return found


def turn(text: str, name: str) -> tuple[Axis, float]:
    """An axis and an angle (degrees) from ``AXIS,ANGLE``; raises UsageError."""
    axis, _, angle = text.rpartition(",")
    return _axis(axis, text, name, TURN), ANGLE.read(angle, name)


def stretch(text: str, name: str) -> tuple[Axis | None, float]:
    """An axis (None for all directions) and a factor from ``FACTOR`` or ``AXIS,FACTOR``; raises UsageError."""
    axis, comma, last = text.rpartition(",")
    factor = numbers(last, (1,))
    if factor is None or not 1 / MOST_STRETCH <= factor[0] <= MOST_STRETCH:
        raise UsageError(
            f"{name}: {last.strip()!r} is no factor between {1 / MOST_STRETCH:g} and {MOST_STRETCH:g}", STRETCH
        )
    return (_axis(axis, text, name, STRETCH) if comma else None), factor[0]


def _axis(axis: str, text: str, name: str, hint: str) -> Axis:
    word = axis.strip().lower()
    if word == "normal":
        return Axis(None)
    found = AXES[word][3:] if word in AXES else numbers(axis, (3, 6))
    if found is None or not any(found[-3:]):
        raise UsageError(f"{name}: {text!r} has no axis", hint)
    return Axis(found[-3:], found[:3] if len(found) == 6 else None)


Start = Annotated[str, Naming(prefix="@"), start]
"""The type of a field that is a place or an edge, or names a file of places."""

Step = Annotated[str, step]
"""The type of a field that is a move."""

Turn = Annotated[str, turn]
"""The type of a field that is a rotation."""

Stretch = Annotated[str, stretch]
"""The type of a field that is a stretch."""
