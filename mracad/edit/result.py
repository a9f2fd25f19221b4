"""What an edit did: the displacement, and what became of each face and why."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Literal

from mracad.constraint.seam import Treatment
from mracad.feature.copies import Copy
from mracad.model import Displacement

Status = Literal["edited", "unchanged", "stuck", "held", "unselected", "analytic"]
"""``edited``; ``unchanged``: nothing to do there; ``stuck``: something to do but no free control point;
``held``: by ``--hold``; ``unselected``; ``analytic``: not a NURBS face."""


@dataclass(frozen=True)
class FaceOutcome:
    """What an edit did to one face.

    Attributes
    ----------
    face : int
        Index in ``Model.faces``.
    status : Status
    reason : str
        Why, in a few words; ``""`` for an edited face.
    detail : float
        Largest change that the edit would make to a control point of the face were nothing frozen, mm.
    moved : float
        Largest change made, mm.
    free, points : int
        Free and all visible control points of the face.
    spans : tuple of float
        Least and largest knot span, mm; zero for a face that is not NURBS.
    scale : float
        Least wavelength whose removal the knots allow (two neighbouring spans), mm; 0 where there is none.
    creases : int
        Crease lines inside the face, which every edit keeps.
    fairing : float
        Length ℓ of the fairing solve, mm; 0 where the mask was used.
    inserted : int
        Knots inserted.
    """

    face: int
    status: Status
    reason: str = ""
    detail: float = 0.0
    moved: float = 0.0
    free: int = 0
    points: int = 0
    spans: tuple[float, float] = (0.0, 0.0)
    scale: float = 0.0
    creases: int = 0
    fairing: float = 0.0
    inserted: int = 0


@dataclass(frozen=True, eq=False)
class Edit:
    """A displacement, the outcome for each face of the model in face order, what was done about each edge, and what
    became of each copy of a feature."""

    displacement: Displacement
    outcomes: tuple[FaceOutcome, ...]
    notes: tuple[str, ...] = field(default=())
    edges: tuple[Treatment, ...] = field(default=())
    copies: tuple[Copy, ...] = field(default=())

    def faces(self, *status: Status) -> list[FaceOutcome]:
        """Outcomes with one of the given statuses."""
        return [outcome for outcome in self.outcomes if outcome.status in status]
