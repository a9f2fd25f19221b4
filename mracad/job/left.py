"""What an edit may not touch any more, because something came out worse."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass, field
from enum import Enum

from mracad.edit.result import Edit
from mracad.errors import EditError
from mracad.inspect.seams import SeamMeasure
from mracad.job.words import numbers

ROUNDS = 8
"""How often an edit is done again, each time without the faces that came out worse; then all are left that seams join
to those, and if that does not help it is refused."""


class Spoilt(Enum):
    """Why an edit may not touch a face, of which something would come out worse."""

    SEAMS = "its seams would not hold"
    INVALID = "its result would not be valid"
    FILE = "the file would be worse there"


@dataclass
class Left:
    """The faces that an edit may not touch, and why, and the edges that must not slide; they become more with every
    round.

    Attributes
    ----------
    name : str
        Of the model.
    """

    name: str
    faces: dict[int, Spoilt]
    firm: set[int] = field(default_factory=set)
    rounds: int = 0

    def leave(self, faces: set[int], reason: Spoilt, seams: Sequence[SeamMeasure], edit: Edit) -> None:
        """Leave some more, for a reason; after enough rounds all edited ones that seams join to any of them."""
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
        """Let edges not slide; whether there are any."""
        self.firm |= set(edges)
        return bool(edges)

    def explained(self, error: EditError) -> EditError:
        """An error of an edit, which cannot know of the faces that were left."""
        if not self.faces:
            return error
        face, reason = next(iter(self.faces.items()))
        return EditError(
            f"{self.name}: #{face + 1} cannot be edited: {reason.value}", "choose other faces or another place"
        )


def _joined(faces: set[int], seams: Sequence[SeamMeasure], edited: set[int]) -> set[int]:
    """Faces, and the edited ones that seams join to them, directly or through each other."""
    found, fresh = set(faces), set(faces)
    while fresh:
        fresh = {face for seam in seams if fresh.intersection(seam.faces) for face in seam.faces} & edited - found
        found |= fresh
    return found
