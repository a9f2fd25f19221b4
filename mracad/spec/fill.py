"""Ways to fill faces with places, as texts, read."""

from __future__ import annotations

import math
import re
from dataclasses import dataclass

from mracad.errors import UsageError
from mracad.spec.places import AXES, numbers, whole
from mracad.spec.quantity import NUMBER, length

FILLS = "hexagons", "grid", "poisson"
"""Ways to arrange places all over faces."""

FILL = "write it as hexagons, grid or poisson with a distance: hexagons,spacing:4mm"
ALIGN = "write it as X, Y, Z, three numbers such as 1,1,0, or edge#4"
FADE = "write two distances and the factors there: distance-to:edge#4,from:2mm=0.4,to:30mm=1"

MOST_FILLED = 50_000
"""Places that fill the faces of one edit, at most."""

LEAST, MOST = 0.01, 100.0
"""Factors by which copies may fade."""


@dataclass(frozen=True)
class Fill:
    """Places all over the faces: how they are arranged, and their distance as text, a length."""

    kind: str
    spacing: str


@dataclass(frozen=True)
class Align:
    """A direction in space, or that of an edge (its number)."""

    way: tuple[float, ...] | None
    edge: int = 0


@dataclass(frozen=True)
class Fade:
    """Factors by the distance from an edge (its number): two distances as texts, lengths, and the factors there."""

    edge: int
    distances: tuple[str, str]
    factors: tuple[float, float]


def fill(text: str, name: str) -> Fill:
    """Places all over the faces from ``KIND,spacing:LENGTH``; raises UsageError."""
    match = re.fullmatch(rf"\s*({'|'.join(FILLS)})\s*,\s*spacing\s*:\s*(.+)", text)
    if match is None:
        kind = text.partition(",")[0].strip()
        what = "has no spacing" if kind in FILLS and "spacing" not in text else "is not a way to fill faces"
        raise UsageError(f"{name}: {text!r} {what}", FILL)
    length(match[2], 1.0, f"{name}: spacing")
    return Fill(match[1], match[2])


def align(text: str, name: str) -> Align:
    """A direction from ``X``, ``1,1,0`` or ``edge#4``; raises UsageError."""
    word = text.strip().lower()
    if word in AXES:
        return Align(AXES[word][3:])
    if word.startswith("edge#") and (edge := whole(word.removeprefix("edge#"))):
        return Align(None, edge)
    way = numbers(text, (3,))
    if way is None or not math.hypot(*way) > 0:
        raise UsageError(f"{name}: {text!r} is not a direction", ALIGN)
    return Align(way)


def fade(text: str, name: str) -> Fade:
    """Factors from ``distance-to:edge#4,from:2mm=0.4,to:30mm=1``; raises UsageError."""
    end = rf"\s*([^,=]+)=\s*({NUMBER})\s*"
    match = re.fullmatch(rf"\s*distance-to\s*:\s*edge#([0-9]{{1,9}})\s*,\s*from\s*:{end},\s*to\s*:{end}", text)
    if match is None or int(match[1]) == 0:
        raise UsageError(f"{name}: {text!r} does not tell how copies fade", FADE)
    factors = float(match[3]), float(match[5])
    if not all(LEAST <= factor <= MOST for factor in factors):
        raise UsageError(f"{name}: a factor is not between {LEAST:g} and {MOST:g}", FADE)
    distances = match[2].strip(), match[4].strip()
    low, high = ends(distances, 1.0, name)
    if "%" not in text and not low < high:
        raise UsageError(f"{name}: it ends at {high:g} mm, which is not farther than {low:g} mm", FADE)
    return Fade(int(match[1]), distances, factors)


def ends(distances: tuple[str, str], diagonal: float, name: str) -> tuple[float, float]:
    """The two distances in mm, of which the first may be zero, on a model of a diagonal; raises UsageError."""
    zero = re.fullmatch(r"0*\.?0*\s*[a-z]*", distances[0]) is not None
    return 0.0 if zero else length(distances[0], diagonal, name), length(distances[1], diagonal, name)
