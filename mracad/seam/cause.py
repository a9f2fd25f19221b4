"""Why edges stay in place although faces beside them move."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum


class Still(Enum):
    """Why an edge does not move with both of its faces, in words for users; ``{}`` is the kind of the neighbour."""

    HELD = "held by --hold"
    FROZEN = "frozen by --edges"
    IDLE = "no change on either side"
    FREE = "free edge"
    POLE = "pole"
    SHARP = "sharp edge"
    CROWDED = "shared by more than two faces"
    ELSEWHERE = "touches another instance, which moves on its own"
    PART = "coincides with part of another edge"
    PLACED = "its faces have different placements"
    ITSELF = "a face meets itself there"
    ANALYTIC = "{} neighbour"
    NEIGHBOUR = "neighbour does not move"
    TRIMMED = "trimmed"
    UNEVEN = "parameters differ along the seam"
    DEGENERATE = "degenerate along the seam"
    FLAT = "curvature undefined along the seam"
    APART = "its faces are edited separately"
    STAYS = "one of its faces stays"
    UNSLID = "could not slide along its {} neighbour"
    BARE = "no copy on the other side"
    OPEN = "trimmed: cannot be kept within the tolerance"
    BROKEN = "would open or lose its smoothness"


@dataclass(frozen=True)
class Cause:
    """Why an edge stays.

    Attributes
    ----------
    still : Still
    kind : str
        Kind of the neighbour, for ``ANALYTIC`` and ``UNSLID``.
    """

    still: Still
    kind: str = ""

    def __str__(self) -> str:
        return self.still.value.format(self.kind)
