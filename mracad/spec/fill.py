"""Ways to fill faces with places, as texts, read."""

from __future__ import annotations

import re
from dataclasses import dataclass

from mracad.errors import UsageError
from mracad.spec.quantity import length

FILL = "write it as poisson with a distance: poisson,spacing:4mm"

MOST_FILLED = 50_000
"""Places that fill the faces of one edit, at most."""


@dataclass(frozen=True)
class Fill:
    """Places all over the faces: how they are arranged, and their distance as text, a length."""

    kind: str
    spacing: str


def fill(text: str, name: str) -> Fill:
    """Places all over the faces from ``KIND,spacing:LENGTH``; raises UsageError."""
    match = re.fullmatch(r"\s*(poisson)\s*,\s*spacing\s*:\s*(.+)", text)
    if match is None:
        raise UsageError(f"{name}: {text!r} is not a way to fill faces", FILL)
    length(match[2], 1.0, f"{name}: spacing")
    return Fill(match[1], match[2])
