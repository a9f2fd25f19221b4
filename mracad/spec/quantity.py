"""Quantities as text: one table of units and one parser for lengths, times, memory sizes, angles and percentages."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Annotated

from msgspec import Meta

from mracad.errors import UsageError

MILLIMETRES = {"um": 1e-3, "mm": 1.0, "cm": 10.0, "m": 1000.0, "in": 25.4, "ft": 304.8, "yd": 914.4, "mi": 1609344.0}
"""Length units by name, in millimetres."""

NUMBER = r"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?"
"""Regular expression of a number."""

MOST_GAIN = 1000.0
"""Largest gain of a band."""

_QUANTITY = re.compile(rf"\s*({NUMBER})\s*([a-zA-Z]*|%|°)\s*")


@dataclass(frozen=True, eq=False)
class Kind:
    """A kind of quantity.

    Attributes
    ----------
    noun : str
        What messages call it, such as ``"a length"``.
    example : str
        Examples of how to write it.
    units : mapping
        Value of each unit; ``""`` stands for a number without unit.
    positive : bool
        Whether the value must be greater than zero.
    most : float
        The largest value.
    folded : bool
        Whether units ignore case.
    """

    noun: str
    example: str
    units: Mapping[str, float]
    positive: bool = True
    most: float = 1e12
    folded: bool = False

    def read(self, text: str, name: str, percent: float | None = None) -> float:
        """The value of a text, in the unit whose value is 1.

        Parameters
        ----------
        text : str
        name : str
            Name of the option, for messages.
        percent : float, optional
            Value of one per cent; if given, ``%`` is also a unit.

        Raises
        ------
        UsageError
            For a malformed text, or a value out of bounds.
        """
        units = self.units if percent is None else {**self.units, "%": percent}
        match = _QUANTITY.fullmatch(text)
        unit = "" if match is None else match[2].lower() if self.folded else match[2]
        hint = f"write {name} as {self.example}"
        value = float(match[1]) * units[unit] if match and unit in units else math.nan
        if not math.isfinite(value):
            raise UsageError(f"{name}: {text!r} is not {self.noun}", hint)
        if abs(value) > self.most:
            raise UsageError(f"{name}: {text!r} is too large for {self.noun}", hint)
        if self.positive and not value > 0:
            raise UsageError(f"{name}: {text!r} is not greater than zero", hint)
        return value


LENGTH = Kind("a length", "5mm, 0.2in or 2% (of the model's diagonal)", {"": 1.0, **MILLIMETRES})
TIME = Kind("a time", "90s, 10min or 2h", {"": 1.0, "s": 1.0, "min": 60.0, "h": 3600.0}, most=1e8)
"""In seconds, up to three years."""
_BYTES = {"": 1.0, "k": 1e3, "m": 1e6, "g": 1e9, "ki": 2.0**10, "mi": 2.0**20, "gi": 2.0**30}
MEMORY = Kind(
    "an amount of memory",
    "500MB or 2GB",
    {**_BYTES, **{f"{unit}b": factor for unit, factor in _BYTES.items()}},
    most=2.0**60,
    folded=True,
)
"""In bytes."""
ANGLE = Kind("an angle", "0.5 or 0.5deg", {"": 1.0, "deg": 1.0, "°": 1.0, "rad": math.degrees(1.0)}, positive=False)
"""In degrees."""
PLACE = Kind("a position", "120mm or -2in", {"": 1.0, **MILLIMETRES}, positive=False)
"""In millimetres."""
SHARE = Kind("a percentage", "1%", {"": 1.0, "%": 1.0}, positive=False)
"""In hundredths."""

Length = Annotated[
    str,
    LENGTH,
    Meta(extra_json_schema={"pattern": rf"^\s*\+?(\d+\.?\d*|\.\d+)([eE][-+]?\d+)?\s*({'|'.join(MILLIMETRES)}|%)?\s*$"}),
]
"""The type of a field that :func:`length` reads; it stays text, because it may be a share of the model."""

Angle = Annotated[float, ANGLE]
"""The type of a field that is an angle, degrees."""

Time = Annotated[float, TIME]
"""The type of a field that is a time, seconds."""

Share = Annotated[float, SHARE]
"""The type of a field that is a percentage."""


def worded(text: str) -> str:
    """A length as it is told: a plain number is in millimetres."""
    return f"{text.strip()} mm" if re.fullmatch(NUMBER, text.strip()) else text


def length(text: str, diagonal: float, name: str) -> float:
    """A positive length in millimetres from ``"5"``, ``"5mm"``, ``"0.2in"`` or ``"2%"`` of ``diagonal``.

    Raises
    ------
    UsageError
        When it is not a positive finite length.
    """
    return LENGTH.read(text, name, diagonal / 100)


def band_of(text: str, diagonal: float | None) -> tuple[float, float]:
    """The smallest and the largest wavelength of a band, mm, on a model of a diagonal (1 mm if not known yet); raises
    UsageError."""
    low, colon, high = text.partition(":")
    hint = "write a band as 0.5mm:20mm or :20mm"
    if not colon:
        raise UsageError(f"band: {text!r} is not a band", hint)
    if not high.strip():
        message = f"band: {text!r} has no end: the longest waves are the shape itself"
        raise UsageError(message, f"give its longest wavelength: {text.strip()}500mm")
    zero = re.fullmatch(r"\s*0*\.?0*\s*[a-z]*\s*", low) is not None
    whole = 1.0 if diagonal is None else diagonal
    band = 0.0 if zero else length(low, whole, "band"), length(high, whole, "band")
    if band[0] >= band[1] and (diagonal is not None or "%" not in text):
        raise UsageError(f"band: {text!r} is empty", hint)
    return band


def gain_of(text: str, diagonal: float | None) -> tuple[float, float, float]:
    """The least and the largest wavelength of a band, mm, and its gain, from ``"2mm:10mm=0"``; raises UsageError."""
    band, equals, gain = text.partition("=")
    hint = "write a band and its gain as 2mm:10mm=0, or :10mm=1.5"
    if not equals or not re.fullmatch(rf"\s*{NUMBER}\s*", gain):
        raise UsageError(f"band: {text!r} is not a band with a gain", hint)
    if not 0.0 <= float(gain) <= MOST_GAIN:
        raise UsageError(f"band: a gain of {gain.strip()} is not between 0 and {MOST_GAIN:g}", hint)
    return (*band_of(band, diagonal), float(gain))


def blend_of(text: str, diagonal: float | None) -> tuple[tuple[float, float] | None, float]:
    """A band, if there is one, and the share of the other detail there, from ``"0.3"`` or ``"2mm:10mm=0.3"``; raises
    UsageError."""
    band, equals, share = text.rpartition("=")
    hint = "write a share as 0.3, or with a band as 2mm:10mm=0.3"
    if not re.fullmatch(rf"\s*{NUMBER}\s*", share) or not 0.0 <= float(share) <= 1.0:
        raise UsageError(f"blend: {share.strip() or text!r} is not a share between 0 and 1", hint)
    return band_of(band, diagonal) if equals else None, float(share)
