"""The steps that judge: a check of a document, a comparison with another."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from mracad import review
from mracad.errors import FileError, UsageError
from mracad.inspect.check import SeamLimits
from mracad.inspect.compare import Limits
from mracad.inspect.verdict import Layer, Verdict
from mracad.inspect.words import words
from mracad.options import Check, Compare, length

if TYPE_CHECKING:
    from mracad.occ.document import Document

Original = Callable[[], "Document"]
"""Reads a document again as it was."""


@dataclass(frozen=True)
class Judged:
    """What a check or comparison found, and the layers for which it fails."""

    verdict: Verdict
    failed: tuple[Layer, ...]

    @property
    def passed(self) -> bool:
        return not self.failed

    @property
    def failures(self) -> list[str]:
        """What does not hold, one line each; empty when it is passed."""
        return [text for layer in self.failed for text in ([words(f) for f in layer.findings] or [layer.text])]


def check(document: Document, options: Check, original: Original | None = None, *, text: bytes | None = None) -> Judged:
    """Check a document.

    Parameters
    ----------
    document : Document
    options : Check
    original : callable, optional
        Not needed.
    text : bytes, optional
        The file that the document was read from: then every layer is looked at.  Without it there is no file to be
        judged, and of the layers that take long only those that ``options.fail_on`` names are.
    """
    expected, freeform = expectation(options.expect) if options.expect else (None, False)

    def limits(size: float) -> review.CheckLimits:
        gap, tolerance, wall = (
            None if given is None else length(given, size, name)
            for given, name in (
                (options.max_gap, "max-gap"),
                (options.max_tolerance, "max-tolerance"),
                (options.min_wall, "min-wall"),
            )
        )
        along = SeamLimits(options.kink, gap, options.max_angle, expected, freeform)
        return review.CheckLimits(along, tolerance, wall, options.layer_limit)

    slow = review.SLOW if text is not None else review.SLOW.intersection(options.fail_on)
    verdict = review.check(text, document, limits, slow)
    return Judged(verdict, tuple(review.failing(verdict, options.fail_on)))


def expectation(text: str) -> tuple[int, bool]:
    """How many seams are to be smooth, and whether only those of NURBS faces count.

    Parameters
    ----------
    text : str
        The number, or the file of a report: of a check, which counts all seams, or of an edit, which counts those of
        NURBS faces.

    Raises
    ------
    FileError
        When there is no such report, or it says nothing of seams.
    """
    if text.isdecimal():
        return int(text), False
    hint = "name a JSON report that mracad check or an edit wrote, or give the number of smooth seams"
    try:
        found = _smooth(json.loads(Path(text).read_bytes()))
    except (OSError, ValueError) as error:
        raise FileError(f"cannot read the report '{text}': {error}", hint) from error
    if found is None:
        raise FileError(f"the report '{text}' says nothing of seams", hint)
    return found


def _smooth(report: object) -> tuple[int, bool] | None:
    """What :func:`expectation` finds in a report; in that of several steps, what the last one says."""
    match report:
        case {"layers": [*layers]}:
            counts = [x["figures"]["smooth"] for x in layers if x["name"] == "seams"]
            return (counts[0], False) if counts else None
        case {"seams": {"each": [*each]}}:
            return sum(seam.get("after", seam)["smooth"] for seam in each), True
        case {"steps": [*steps]}:
            return next(filter(None, map(_smooth, reversed(steps))), None)
    return None


def compare(document: Document, options: Compare, original: Original | None = None) -> Judged:
    """Compare a document with the reference that ``options`` names, or else with the original.

    Raises
    ------
    UsageError
        When there is neither.
    """
    from mracad.occ.files import read

    if options.reference:
        reference = read(options.reference, options.reference_unit)
    elif original:
        reference = original()
    else:
        raise UsageError("compare has nothing to compare with", "name a reference")

    def limits(size: float) -> Limits:
        growth, volume = options.max_gap_growth, options.max_volume_change
        return Limits(
            deviation=length(options.max_deviation, size, "max-deviation"),
            gap_growth=None if growth is None else length(growth, size, "max-gap-growth"),
            angle_growth=options.max_angle_growth,
            volume_change=None if volume is None else volume / 100,
        )

    verdict = review.compare(reference, document, limits, options.ignore)
    return Judged(verdict, verdict.failed())
