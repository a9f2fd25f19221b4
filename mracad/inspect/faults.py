"""What is known of a document and of a file, read back; what may be worse in the file, and its figures."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum

import numpy as np

from mracad.model.facts import Counts

Array = np.ndarray


class Reason(StrEnum):
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
    reason : Reason
    faces : tuple of int
        Indices in the document of the faces that it concerns; empty where it cannot be told.
    value, was : float
        The figure in the file and in the document: a count, mm, mm², mm³ or degrees.
    status : str
        What the kernel calls it, for ``INVALID``; what the reader says, for ``UNREAD``.
    """

    reason: Reason
    faces: tuple[int, ...] = ()
    value: float = 0.0
    was: float = 0.0
    status: str = ""

    @property
    def key(self) -> tuple[Reason, tuple[int, ...], str]:
        """What identifies it in another file."""
        return self.reason, self.faces, self.status

    def __str__(self) -> str:
        where = " and ".join(f"#{face + 1}" for face in self.faces[:2]) + (" …" if len(self.faces) > 2 else "")
        return _WORDS[self.reason].format(
            f=self, where=where or _SOMEWHERE.get(self.reason, "somewhere"), share=_share(self.value, self.was)
        )


_WORDS = {
    Reason.UNREAD: "{where} cannot be read back: {f.status}",
    Reason.INVALID: "{f.status} in {where}",
    Reason.SOLIDS: "{f.value:.0f} solids (were {f.was:.0f})",
    Reason.SHELLS: "{f.value:.0f} shells (were {f.was:.0f})",
    Reason.FACES: "{f.value:.0f} faces (were {f.was:.0f})",
    Reason.FREE_EDGES: "{f.value:.0f} free edges (were {f.was:.0f})",
    Reason.LOST: "{where} is lost",
    Reason.AREA: "the area of {where} changes by {share}",
    Reason.VOLUME: "the volume changes by {share}",
    Reason.BOX: "the box changes by {f.value:.3g} mm",
    Reason.TOLERANCE: "a tolerance of {f.value:.3g} mm at {where} (largest {f.was:.3g} mm)",
    Reason.SEAM: "no seam between {where}",
    Reason.GAP: "a gap of {f.value:.3g} mm between {where} (was {f.was:.3g} mm)",
    Reason.ANGLE: "an angle of {f.value:.2g}° between {where} (was {f.was:.2g}°)",
    Reason.OPEN: "the mesh is open at {where}",
}
_SOMEWHERE = {Reason.UNREAD: "it"}


def _share(value: float, was: float) -> str:
    return f"{100 * abs(value - was) / abs(was):.3g} %" if was else f"{value:.3g}"


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
