"""Why edges stay where faces beside them move."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum


class Still(Enum):
    """Why an edge does not move with both of its faces, and what is said of it; of ``{}`` with its kind."""

    HELD = "held by --hold"
    FROZEN = "no edge moves"
    IDLE = "nothing to smooth on either side"
    FREE = "free edge"
    POLE = "pole"
    SHARP = "sharp edge"
    CROWDED = "more than two faces"
    ELSEWHERE = "touches another instance, which moves by itself"
    PART = "coincides with a part of another edge"
    PLACED = "faces are placed differently"
    ITSELF = "a face that meets itself"
    ANALYTIC = "{} neighbour"
    NEIGHBOUR = "neighbour does not move"
    TRIMMED = "trimmed"
    UNEVEN = "parameters differ along the seam"
    DEGENERATE = "degenerate along the seam"
    FLAT = "no curvature along the seam"
    APART = "its faces get fairer each by itself"
    STAYS = "a face there stays"
    BARE = "no copy beyond it"
    UNSEWN = "trimmed and not sewn"
    OPEN = "trimmed: not within the tolerance"
    BROKEN = "would not hold"


@dataclass(frozen=True)
class Cause:
    """Why an edge stays.

    Attributes
    ----------
    still : Still
    kind : str
        Of the neighbour, for ``ANALYTIC``.
    """

    still: Still
    kind: str = ""

    def __str__(self) -> str:
        return self.still.value.format(self.kind)
