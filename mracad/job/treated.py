"""What an edit did to faces and edges, for pictures, in the words of its report."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable

from mracad.edit.result import FaceOutcome
from mracad.job.document import Report
from mracad.seam.cause import Still
from mracad.seam.natural import Treatment
from mracad.spec.steps import Selection
from mracad.view.rings import Ring
from mracad.view.treatment import Told

REASONS = 3
"""Largest number of reasons named; edges have as many colours for them."""

_WHOLE = 0.995  # share of the wanted change from which it counts as all of it
_EDGES = {
    "coupled": "moved with both faces",
    "mended": "closed or made tangent",
    "to tolerance": "moved, to tolerance",
    "slid": "slid along a face that stays",
    "idle": "with no change on either side",
}


def told(report: Report, options: Selection) -> Told:
    """What became of each face and edge."""
    outcomes, edges = report.edit.outcomes, report.edit.edges
    faces = {each.face: _kind(each) for each in outcomes}
    treated, said_of_edges = _edges(edges)
    counts = Counter(faces.values()) + Counter(treated.values())
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
    nouns |= {how: f"{'edge' if counts[how] == 1 else 'edges'} {said}" for how, said in said_of_edges.items()}
    said = {kind: f"{counts[kind]} {said}" for kind, said in nouns.items() if counts[kind]}
    return Told(faces, treated, said)


def _edges(edges: Iterable[Treatment]) -> tuple[dict[int, str], dict[str, str]]:
    """How edges were treated, by index, and the words for it; those that stayed by the commonest reasons."""
    why = {each.edge: str(each.reason) for each in edges if each.how == "frozen" and not _idle(each)}
    common = [reason for reason, _ in Counter(why.values()).most_common(REASONS)]
    stayed = {reason: f"stayed {number}" for number, reason in enumerate(common, 1)}
    treated = {
        each.edge: "idle" if _idle(each) else stayed.get(why[each.edge], "stayed") if each.edge in why else each.how
        for each in edges
    }
    words = {how: f"stayed: {reason}" for reason, how in stayed.items()}
    return treated, {**_EDGES, **words, "stayed": "stayed for other reasons"}


def _idle(edge: Treatment) -> bool:
    """Whether an edge stayed because nothing moved beside it."""
    return edge.reason is not None and edge.reason.still is Still.IDLE


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
