"""The result of an edit: the displacement, and the outcome for each face."""

from __future__ import annotations

import math
from collections.abc import Collection
from dataclasses import dataclass, field, replace
from enum import Enum
from typing import Literal

import numpy as np

from mracad.brief import line
from mracad.edit.feature.score import Copy
from mracad.inspect.roughness import Roughness
from mracad.model.brep import Face
from mracad.model.displacement import Displacement, Offset
from mracad.seam.natural import Treatment
from mracad.spec.select import Scope

Status = Literal["edited", "unchanged", "left", "held", "unselected", "analytic"]
"""``edited``; ``unchanged``: nothing to do there; ``left``: the edit would have made it worse;
``held``: by ``--hold``; ``unselected``; ``analytic``: not a NURBS face."""


class Reason(Enum):
    """Why a face did not change."""

    FAIR = "already fair"
    CLEAN = "no noise found"
    UNSURE = "noise that cannot be told from shape"
    AMOUNT = "amount 0"
    NO_COPY = "no copy on it"
    NO_DETAIL = "no details for it"
    NO_FREE = "no free control points"
    ASKEW = "parameter lines do not follow the direction"
    RIM = "cannot get fairer with its edges held"
    STUCK = "can hardly move with its edges held"
    ROUGHER = "would get rougher"
    FOLDED = "would fold"
    WORSE = "would come out worse"
    HELD = "held"
    UNSELECTED = "not selected"
    ANALYTIC = "not a NURBS face"


@dataclass(frozen=True)
class FaceOutcome:
    """What an edit did to one face.

    Attributes
    ----------
    face : int
        Index in ``Model.faces``.
    status : Status
    reason : Reason or None
        Why it did not change.
    said : str
        Details of the reason: which figures would get worse, or the kind of an analytic face.
    detail : float
        Largest change of a control point of the face that the edit would make if nothing were held, mm.
    moved : float
        Largest change made, mm.
    amount : float
        Share of the wanted change that was made.
    free, points : int
        Control points that are free, and all control points of the surface after the edit.
    inserted : int
        Knots inserted.
    added, moving : int
        Control points of the surface that the edit added, and those that it moves.
    creases : int
        Crease lines inside the surface, which every edit keeps.
    roughness : pair of Roughness, optional
        Roughness before and after, if the edit measures it.
    noise : float, optional
        Standard deviation of each coordinate of the control points, mm, if the edit measures it.
    taken : float, optional
        Share of the bending energy that went with it.
    """

    face: int
    status: Status
    reason: Reason | None = None
    said: str = ""
    detail: float = 0.0
    moved: float = 0.0
    amount: float = 0.0
    free: int = 0
    points: int = 0
    inserted: int = 0
    added: int = 0
    moving: int = 0
    creases: int = 0
    roughness: tuple[Roughness, Roughness] | None = None
    noise: float | None = None
    taken: float | None = None

    __repr__ = line

    @property
    def words(self) -> str:
        """The reason with its details."""
        told = "" if self.reason is None else self.reason.value
        return f"{told}: {self.said}" if told and self.said else told or self.said

    def grown(self, points: int, offset: Offset) -> FaceOutcome:
        """The outcome with the control points that a surface of so many has after an edit by an offset."""
        now, inserted = math.prod(offset.poles.shape[:2]), len(offset.u_knots) + len(offset.v_knots)
        moving = int(np.any(offset.poles, axis=2).sum())
        return replace(self, points=now, inserted=inserted, added=now - points, moving=moving)


@dataclass(frozen=True, eq=False)
class Edit:
    """A displacement, the outcome for each face in face order, the treatment of each edge, the result for each copy of
    a feature, the scale (mm) if the edit determined it, notes for the report, and whether the edit restores what was
    there before."""

    displacement: Displacement
    outcomes: tuple[FaceOutcome, ...]
    edges: tuple[Treatment, ...] = field(default=())
    copies: tuple[Copy, ...] = field(default=())
    scale: float | None = None
    notes: tuple[str, ...] = ()
    restored: bool = False

    __repr__ = line

    def faces(self, *status: Status) -> list[FaceOutcome]:
        """Outcomes with one of the given statuses."""
        return [outcome for outcome in self.outcomes if outcome.status in status]


def untouched(face: Face, scope: Scope, movable: Collection[int]) -> FaceOutcome | None:
    """The outcome for a face that the edit must not touch; None if it may."""
    if face.surface is None:
        return FaceOutcome(face.index, "analytic", Reason.ANALYTIC, face.kind)
    if face.index in scope.held:
        return FaceOutcome(face.index, "held", Reason.HELD)
    if face.index not in movable:
        return FaceOutcome(face.index, "unselected", Reason.UNSELECTED)
    return None
