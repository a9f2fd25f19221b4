"""A file as read back: its figures, and how it is worse than the document."""

from __future__ import annotations

from collections.abc import Collection, Iterable
from dataclasses import dataclass
from enum import StrEnum

import numpy as np

from mracad.model.facts import Counts, Facts

Array = np.ndarray


class FaultKind(StrEnum):
    """How a file is worse."""

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
        Indices in the document of the faces that it concerns; empty if unknown.
    value, was : float
        The figure in the file and in the document: a count, mm, mm², mm³ or degrees.
    status : str
        The kernel's name of the failure for ``INVALID``; the reader's message for ``UNREAD``.
    """

    reason: FaultKind
    faces: tuple[int, ...] = ()
    value: float = 0.0
    was: float = 0.0
    status: str = ""

    @property
    def key(self) -> tuple[FaultKind, tuple[int, ...], str]:
        """The key that identifies the same fault in another file."""
        return self.reason, self.faces, self.status


@dataclass(frozen=True)
class ReadBack:
    """A file as read back.

    Attributes
    ----------
    valid : bool
        Whether it passes the kernel's check, and nothing is worse.
    counts : Counts or None
        Numbers of solids, shells, faces and free edges; None for a mesh.
    box : ((float, float, float), (float, float, float)) or None
        Lowest and highest corner of the boxes of its faces, mm; never too small.
    volume : (float, float) or None
        Volume in the document and in the file, mm³; None where it was not measured because no face was replaced.
    tolerance : float
        Largest tolerance, mm.
    seams : int
        Number of seams that lie elsewhere in the file than in the document, which were measured.
    gap, angle : float
        Largest gap of these, mm, and largest angle of the smooth ones among them, degrees.
    faults : tuple of Fault
        Faults that neither the document nor the kernel's own copy of the input has.
    forgiven : tuple of Fault
        Faults that the kernel's own copy has too.
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


def blamed(faults: Iterable[Fault], edited: Collection[int], memory: Facts) -> set[int]:
    """The edited faces blamed for faults: those that they name, else their neighbours, else all."""
    named = {face for fault in faults for face in fault.faces}
    own = named & set(edited)
    if own:
        return own
    beside = {face for edge in memory.edges if named.intersection(edge.faces) for face in edge.faces}
    return beside & set(edited) or set(edited)
