"""What became of the defects of seams that an edit was asked to mend."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass

from mracad.inspect.seams import SeamMeasure
from mracad.spec.quantity import length
from mracad.spec.steps import Fitting

LEFT = 0.1
"""A defect is mended where no more than this share of it is left, beside what counts for none."""

MOSTLY = 0.3
"""Where its mean falls to this share, it is mended but for the ends of the seam, beside points that stay."""

TANGENT = 0.01
"""Angle, degrees, that counts for none."""


def unmended(
    options: Fitting,
    diagonal: float,
    movable: Collection[int],
    before: Sequence[SeamMeasure],
    after: Sequence[SeamMeasure],
    reasons: Mapping[int, str],
) -> tuple[str, ...]:
    """What to say of gaps and angles that were to be mended and were not, or were not there; nothing where all were.

    Parameters
    ----------
    options : Fitting
    diagonal : float
        Of the model, mm.
    movable : collection of int
        Faces that the edit could move: only seams between two of them count.
    before, after : sequence of SeamMeasure
        In the same order.
    reasons : mapping
        Why edges did not move.
    """
    pairs = [pair for pair in zip(before, after, strict=True) if set(pair[0].faces) <= set(movable)]
    notes = []
    if options.close_gaps:
        none = length(options.gap_tolerance, diagonal, "gap-tolerance")
        gaps = [_Defect(m.edge, m.gap, n.gap, m.mean_gap, n.mean_gap) for m, n in pairs if m.gap > none]
        widest = max((m.gap for m, _ in pairs), default=0.0)
        missing = f"close-gaps: no gap between edited faces is wider than {none:g} mm (the widest: {widest:.2g} mm)"
        notes.append(_told("close-gaps: closed", "gap", "open by {:.3g} mm", gaps, none, reasons) if gaps else missing)
    if options.fit_g1 is not None:
        bent = [
            _Defect(m.edge, m.angle, n.angle, m.mean_angle, n.mean_angle)
            for m, n in pairs
            if TANGENT < m.angle <= options.fit_g1
        ]
        above = min((m.angle for m, _ in pairs if m.angle > options.fit_g1), default=None)
        missing = f"fit-g1: no seam between edited faces has an angle of {TANGENT}° to {options.fit_g1:g}°"
        missing += "" if above is None else f" (the least above: {above:.3g}°)"
        notes.append(
            _told("fit-g1: made tangent", "seam", "bent by {:.3g}°", bent, TANGENT, reasons) if bent else missing
        )
    return tuple(filter(None, notes))


@dataclass(frozen=True)
class _Defect:
    """The largest gap or angle of a seam before and after, and the mean."""

    edge: int
    before: float
    after: float
    mean_before: float
    mean_after: float


def _told(done: str, noun: str, how: str, defects: Sequence[_Defect], none: float, reasons: Mapping[int, str]) -> str:
    """A line about defects; empty where all are mended."""
    left = [defect for defect in defects if defect.after > LEFT * defect.before + none]
    if not left:
        return ""
    mostly = sum(defect.mean_after <= MOSTLY * defect.mean_before for defect in left)
    worst = max(left, key=lambda defect: defect.after)
    text = f"{done} {len(defects) - len(left)} of {len(defects)} {noun}{'s' * (len(defects) > 1)}"
    text += f", {mostly} more but for their ends" if mostly else ""
    why = f" ({reasons[worst.edge]})" if worst.edge in reasons else ""
    return f"{text}; edge#{worst.edge + 1} stays {how.format(worst.after)}{why}"
