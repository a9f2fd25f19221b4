"""What an edit did to faces and edges, for pictures, in the words of its report."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable

from mracad.edit.result import FaceOutcome
from mracad.job.document import Report
from mracad.spec.steps import Selection
from mracad.view.rings import Ring
from mracad.view.treatment import Told

REASONS = 3
"""Largest number of reasons named."""

_WHOLE = 0.995  # share of the wanted change from which it counts as all of it
_EDGES = {
    "coupled": "moved with both faces",
    "mended": "closed or made tangent",
    "to tolerance": "moved, to tolerance",
    "slid": "slid along a face that stays",
    "frozen": "stayed",
}


def told(report: Report, options: Selection) -> Told:
    """What became of each face and edge."""
    outcomes, edges = report.edit.outcomes, report.edit.edges
    faces = {each.face: _kind(each) for each in outcomes}
    counts = Counter(faces.values()) + Counter(edge.how for edge in edges)
    words = {
        "edited": options.done,
        "in part": f"{options.done}, in part",
        "unchanged": options.quiet,
        "left": "left" + _reasons(each.reason.value for each in outcomes if each.status == "left" and each.reason),
        "held": "held by --hold",
        "unselected": "not selected",
        "analytic": "not NURBS",
    }
    nouns = {kind: f"{'face' if counts[kind] == 1 else 'faces'} {said}" for kind, said in words.items()}
    still = _reasons(str(edge.reason) for edge in edges if edge.reason)
    nouns |= {
        how: f"{'edge' if counts[how] == 1 else 'edges'} {said}{still if how == 'frozen' else ''}"
        for how, said in _EDGES.items()
    }
    said = {kind: f"{counts[kind]} {said}" for kind, said in nouns.items() if counts[kind]}
    return Told(faces, {each.edge: each.how for each in edges}, said)


def rings(report: Report) -> list[Ring] | None:
    """The copies of a feature that an edit made, on the faces that they touch; None if it made none."""
    return [Ring(copy.faces[0], copy.at, copy.radius, copy.faces) for copy in report.edit.copies if copy.faces] or None


def _kind(outcome: FaceOutcome) -> str:
    partly = outcome.status == "edited" and 0.0 < outcome.amount < _WHOLE
    return "in part" if partly else outcome.status


def _reasons(found: Iterable[str]) -> str:
    """The commonest reasons, each with its count."""
    why = Counter(found)
    named = ", ".join(f"{count} × {reason}" for reason, count in why.most_common(REASONS))
    return f": {named}{', …' if len(why) > REASONS else ''}" if named else ""
