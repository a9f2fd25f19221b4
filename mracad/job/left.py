"""Faces that an edit may no longer change, because the result was worse there."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass, field
from enum import Enum

from mracad.edit.result import Edit
from mracad.errors import EditError
from mracad.inspect.seams import SeamMeasure
from mracad.job.words import numbers

ROUNDS = 8
"""How often an edit is repeated, each time without the faces that came out worse.  After that all faces that seams join
to them are left too, and if that does not help the edit is refused."""


class Excluded(Enum):
    """Why an edit may not change a face: what would be worse."""

    SEAMS = "its seams would not hold"
    INVALID = "its result would not be valid"
    FILE = "the file would be worse there"


@dataclass
class Left:
    """Faces that an edit may not change, and why, and edges that must not slide; each round adds some.

    Attributes
    ----------
    name : str
        Name of the model, for messages.
    """

    name: str
    faces: dict[int, Excluded]
    firm: set[int] = field(default_factory=set)
    rounds: int = 0

    def leave(self, faces: set[int], reason: Excluded, seams: Sequence[SeamMeasure], edit: Edit) -> None:
        """Leave more faces, for a reason; after enough rounds also all edited faces that seams join to any of them."""
        self.rounds += 1
        if self.rounds > ROUNDS + 1:
            names = numbers(sorted(faces))
            raise EditError(
                f"{self.name}: {names} would come out worse even with {len(self.faces)} other faces left as they are",
                "leave them out with --faces '!#N', or use --amount 0.5",
            )
        if self.rounds > ROUNDS:
            faces = _joined(faces | self.faces.keys(), seams, {outcome.face for outcome in edit.faces("edited")})
        self.faces |= dict.fromkeys(faces - self.faces.keys(), reason)

    def stopped(self, edges: Collection[int]) -> bool:
        """Forbid edges to slide; returns whether there are any new ones."""
        self.firm |= set(edges)
        return bool(edges)

    def explained(self, error: EditError) -> EditError:
        """An error of an edit, explained by the faces that were left, of which the edit does not know."""
        if not self.faces:
            return error
        face, reason = next(iter(self.faces.items()))
        return EditError(
            f"{self.name}: #{face + 1} cannot be edited: {reason.value}", "choose other faces or another place"
        )


def _joined(faces: set[int], seams: Sequence[SeamMeasure], edited: set[int]) -> set[int]:
    """Faces, and all edited faces that seams join to them, directly or through others."""
    found, fresh = set(faces), set(faces)
    while fresh:
        fresh = {face for seam in seams if fresh.intersection(seam.faces) for face in seam.faces} & edited - found
        found |= fresh
    return found
