"""Lengths, times and bands of wavelengths as texts: their units, and what reads them."""

from __future__ import annotations

import math
import re
from typing import Annotated

from msgspec import Meta

from mracad.errors import UsageError

MILLIMETRES = {"um": 1e-3, "mm": 1.0, "cm": 10.0, "m": 1000.0, "in": 25.4, "ft": 304.8, "yd": 914.4, "mi": 1609344.0}
"""Length units by name, in millimetres."""

_QUANTITY = re.compile(r"\s*([-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?)\s*([a-zA-Z]*|%)\s*")


def length(text: str, diagonal: float, name: str) -> float:
    """A positive length in millimetres from ``"5"``, ``"5mm"``, ``"0.2in"`` or ``"2%"`` of ``diagonal``.

    Raises
    ------
    UsageError
        When it is not a positive finite length.
    """
    match = _QUANTITY.fullmatch(str(text))
    hint = f"write {name} as 5mm, 0.2in or 2% (of the model's diagonal)"
    if not match or (match[2] not in {"", "%"} and match[2] not in MILLIMETRES):
        raise UsageError(f"{name}: {text!r} is not a length", hint)
    value = float(match[1]) * (diagonal / 100 if match[2] == "%" else MILLIMETRES[match[2] or "mm"])
    if not (math.isfinite(value) and value > 0):
        raise UsageError(f"{name}: {text!r} is not greater than zero", hint)
    return value


SECONDS = {"s": 1.0, "min": 60.0, "h": 3600.0}
"""Units of time by name, in seconds."""


LONGEST = 1e8
"""The longest time that can be given, in seconds: three years."""


def duration(text: str, name: str) -> float:
    """Seconds from ``"90"``, ``"90s"``, ``"10min"`` or ``"2h"``; raises UsageError."""
    match = _QUANTITY.fullmatch(text)
    units = {"": 1.0, **SECONDS}
    found = float(match[1]) * units.get(match[2], 0.0) if match else 0.0
    if not 0 < found <= LONGEST:
        raise UsageError(f"{name}: {text!r} is not a time", "write it as 90s, 10min or 2h")
    return found


Length = Annotated[
    str,
    Meta(extra_json_schema={"pattern": rf"^\s*\+?(\d+\.?\d*|\.\d+)([eE][-+]?\d+)?\s*({'|'.join(MILLIMETRES)}|%)?\s*$"}),
]
"""The type of a field that :func:`length` reads."""


def band_of(text: str, diagonal: float) -> tuple[float, float]:
    """The least and the largest wavelength of a band, mm; raises UsageError."""
    low, colon, high = text.partition(":")
    hint = "write a band as 0.5mm:20mm or 0mm:20mm"
    if not colon:
        raise UsageError(f"band: {text!r} is not a band", hint)
    zero = re.fullmatch(r"\s*0*\.?0*\s*[a-z]*\s*", low) is not None
    band = 0.0 if zero else length(low, diagonal, "band"), length(high, diagonal, "band")
    if band[0] >= band[1]:
        raise UsageError(f"band: {text!r} is empty", hint)
    return band
