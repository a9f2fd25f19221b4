"""Results for the defects of seams that an edit was asked to mend."""

from __future__ import annotations

import math
from collections.abc import Collection, Sequence
from dataclasses import dataclass, replace
from typing import Literal

from mracad.inspect.seams import SeamMeasure
from mracad.spec.quantity import length
from mracad.spec.steps import Fitting

LEFT = 0.1
"""Share of a defect that may remain if it counts as mended."""

MOSTLY = 0.3
"""If its mean falls to this share, a defect counts as mended except at the ends of the seam, beside points that
stay."""

TANGENT = 0.01
"""Largest angle that counts as none, degrees."""


@dataclass(frozen=True)
class Mending:
    """The result for gaps or angles that were to be mended.

    Attributes
    ----------
    what : {"close-gaps", "fit-g1"}
        The option.
    least, most : float
        Bounds between which a gap or angle is a defect: mm or degrees.
    defects, left, mostly : int
        Numbers of defects, of those not mended, and of the latter those that are mended except at the ends of seams.
    edge : int or None
        The edge with the largest remaining defect.
    after : float
        Size of that defect, mm or degrees.
    next : float or None
        If there was no defect: the widest gap, or the least angle above ``most``.
    """

    what: Literal["close-gaps", "fit-g1"]
    least: float
    most: float
    defects: int = 0
    left: int = 0
    mostly: int = 0
    edge: int | None = None
    after: float = 0.0
    next: float | None = None


def unmended(
    options: Fitting,
    diagonal: float,
    movable: Collection[int],
    before: Sequence[SeamMeasure],
    after: Sequence[SeamMeasure],
) -> tuple[Mending, ...]:
    """Gaps and angles that were to be mended and were not, or did not exist; empty if all were.

    Parameters
    ----------
    options : Fitting
    diagonal : float
        Diagonal of the model, mm.
    movable : collection of int
        Faces that the edit could move: only seams between two of them count.
    before, after : sequence of SeamMeasure
        Seams in the same order.
    """
    pairs = [pair for pair in zip(before, after, strict=True) if set(pair[0].faces) <= set(movable)]
    found: list[Mending | None] = []
    if options.close_gaps:
        none = Mending("close-gaps", length(options.gap_tolerance, diagonal, "gap-tolerance"), math.inf)
        gaps = [_Defect(m.edge, m.gap, n.gap, m.mean_gap, n.mean_gap) for m, n in pairs if m.gap > none.least]
        found.append(_result(none, gaps, max((m.gap for m, _ in pairs), default=0.0)))
    if options.fit_g1 is not None:
        none = Mending("fit-g1", TANGENT, options.fit_g1)
        bent = [
            _Defect(m.edge, m.angle, n.angle, m.mean_angle, n.mean_angle)
            for m, n in pairs
            if none.least < m.angle <= none.most
        ]
        found.append(_result(none, bent, min((m.angle for m, _ in pairs if m.angle > none.most), default=None)))
    return tuple(filter(None, found))


@dataclass(frozen=True)
class _Defect:
    """The largest gap or angle of a seam before and after, and the mean."""

    edge: int
    before: float
    after: float
    mean_before: float
    mean_after: float


def _result(none: Mending, defects: Sequence[_Defect], other: float | None) -> Mending | None:
    """The result for defects; None if all are mended; with ``next`` set to ``other`` if there were none."""
    if not defects:
        return replace(none, next=other)
    left = [defect for defect in defects if defect.after > LEFT * defect.before + none.least]
    if not left:
        return None
    mostly = sum(defect.mean_after <= MOSTLY * defect.mean_before for defect in left)
    worst = max(left, key=lambda defect: defect.after)
    return replace(none, defects=len(defects), left=len(left), mostly=mostly, edge=worst.edge, after=worst.after)
