"""What is known of a document and of a file, read back; what may be worse in the file, and its figures."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum

import numpy as np

from mracad.model.facts import Counts

Array = np.ndarray


class FaultKind(StrEnum):
    """What is worse in a file."""

    UNREAD = "not read back"
    INVALID = "invalid"
    SOLIDS = "solids"
    SHELLS = "shells"
    FACES = "faces"
    FREE_EDGES = "free edges"
    LOST = "face lost"
    AREA = "area"
    VOLUME = "volume"
    BOX = "box"
    TOLERANCE = "tolerance"
    SEAM = "seam"
    GAP = "gap"
    ANGLE = "angle"
    OPEN = "open mesh"  # of a closed body


@dataclass(frozen=True)
class Fault:
    """One thing that is worse in the file.

    Attributes
    ----------
    reason : FaultKind
    faces : tuple of int
        Indices in the document of the faces that it concerns; empty where it cannot be told.
    value, was : float
        The figure in the file and in the document: a count, mm, mm², mm³ or degrees.
    status : str
        What the kernel calls it, for ``INVALID``; what the reader says, for ``UNREAD``.
    """

    reason: FaultKind
    faces: tuple[int, ...] = ()
    value: float = 0.0
    was: float = 0.0
    status: str = ""

    @property
    def key(self) -> tuple[FaultKind, tuple[int, ...], str]:
        """What identifies it in another file."""
        return self.reason, self.faces, self.status


@dataclass(frozen=True)
class ReadBack:
    """What a file is, as read back.

    Attributes
    ----------
    valid : bool
        Whether it passes the kernel's check, and nothing is worse.
    counts : Counts or None
        None for a mesh.
    box : ((float, float, float), (float, float, float)) or None
        Lowest and highest corner of the boxes of its faces, mm; never too small.
    volume : (float, float) or None
        In the document and in the file, mm³; None where no face is another one, so that it was not measured.
    tolerance : float
        The largest, mm.
    seams : int
        Seams that a reader lays otherwise than in the document, so that they were measured.
    gap, angle : float
        The largest of these, mm, and of the smooth ones among them, degrees.
    faults : tuple of Fault
        What is worse than in the document and than in the kernel's own copy of the input.
    forgiven : tuple of Fault
        What is worse than in the document, as it is in the kernel's own copy.
    """

    valid: bool
    faults: tuple[Fault, ...] = ()
    forgiven: tuple[Fault, ...] = ()
    counts: Counts | None = None
    box: tuple[tuple[float, ...], tuple[float, ...]] | None = None
    volume: tuple[float, float] | None = None
    tolerance: float = 0.0
    seams: int = 0
    gap: float = 0.0
    angle: float = 0.0
