"""Reports as text and as JSON-ready dictionaries."""

from __future__ import annotations

import json
import math
import re
import sys
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, TextIO

import msgspec

from mracad.spec.steps import Selection

if TYPE_CHECKING:
    from mracad.constraint.seam import Treatment
    from mracad.edit.result import FaceOutcome
    from mracad.inspect.faults import Fault, ReadBack
    from mracad.inspect.seams import SeamMeasure, SeamSummary
    from mracad.job.document import Report
    from mracad.job.judge import Judged
    from mracad.job.produce import Made
    from mracad.model.facts import Validity
    from mracad.spec.recipe import Step

SHOWN = 6
"""Most faces named in one line."""

REASONS = 3
"""Most reasons named in one line."""


def mm(value: float) -> str:
    """A length for people: three significant digits, millimetres."""
    return f"{value:.3g} mm"


def degrees(value: float) -> str:
    """An angle for people: two significant digits, or 0 below what measuring can tell."""
    return f"{value:.2g}°" if value > 1e-5 else "0°"


def plural(count: int, noun: str) -> str:
    """``1 face``, ``2 faces``."""
    return f"{count} {noun}" if count == 1 else f"{count} {noun}s"


def numbers(faces: list[int]) -> str:
    """``#3 #7 …`` from face indices."""
    return " ".join(f"#{i + 1}" for i in faces[:SHOWN]) + (" …" if len(faces) > SHOWN else "")


def verdict(valid: bool) -> str:
    return "yes" if valid else "no"


def step_lines(step: Step, result: Report | Judged) -> list[str]:
    """What a step of a recipe did; its first line begins with the step's name."""
    from mracad.job.document import Report

    if isinstance(result, Report):
        assert isinstance(step.options, Selection)
        first, *rest = edit_lines(result, step.options, f"{result.seconds:.1f} s")
        return [f"{step.id}: {first}", *(f"  {line}" for line in rest)]
    if result.passed:
        return [f"{step.id}: passed"]
    return [f"{step.id}: failed: {failure}" for failure in result.failures]


@dataclass(frozen=True)
class Found:
    """What is said of files that were read back."""

    valid: bool
    how: str = "as read back"

    @property
    def words(self) -> str:
        return f"{verdict(self.valid)}, {self.how}"


def found(made: Sequence[Made]) -> Found | None:
    """What is said of outputs; None where they were not read back."""
    known = [each.read_back for each in made if each.read_back]
    if not known:
        return None
    exact = any(each.counts for each in known)
    return Found(all(each.valid for each in known), "as read back" if exact else "as meshed")


def edit_lines(report: Report, options: Selection, end: str, found: Found | None = None) -> list[str]:
    """The four lines after an edit; ``end`` is that of the last one, ``found`` what its files are as read back."""
    from mracad.inspect.seams import key, summary

    edit, model = report.edit, report.model
    nurbs = [o for o in edit.outcomes if o.status != "analytic"]
    parts = [f"{len(edit.faces('edited'))} {options.done}"]
    if edit.faces("unchanged"):
        parts.append(f"{len(edit.faces('unchanged'))} {options.quiet}")
    parts += left_words(edit.faces("left"))
    if edit.faces("held"):
        parts.append(f"{len(edit.faces('held'))} held by --hold")
    if edit.faces("unselected"):
        parts.append(f"{len(edit.faces('unselected'))} not selected")
    lines = [f"{model.name}: {plural(len(nurbs), 'NURBS face')}: {', '.join(parts)}"]
    if not edit.faces("edited"):
        lines[0] += "; nothing changed"
    lines += [f"note: {note}" for note in edit.notes]
    if report.deviations:
        worst = max(report.deviations, key=lambda d: d.largest)
        mean = sum(d.mean for d in report.deviations) / len(report.deviations)
        lines.append(f"deviation: max {mm(worst.largest)} on #{worst.face + 1}, mean {mm(mean)}")
        lines[-1] += roughness_words(edit.faces("edited"))
        before, after = control_points(report)
        lines[-1] += f"; control points: {after} (were {before})" if after != before and not edit.copies else ""
    else:
        lines.append("deviation: none")
    if edit.copies:
        lines.append(copies_line(report))
    smooth = report.smooth_seams()
    old, new = summary(report.before, smooth), summary(report.after, smooth)
    lines.append(seam_line(new, old))
    worse = [
        a for b, a in zip(report.before, report.after, strict=True) if key(b) in smooth and a.angle > b.angle + 1e-4
    ]
    if worse:
        lines[-1] += f"; {len(worse)} less smooth"
    if edit.edges:
        lines[-1] += f"; {edge_words(edit.edges)}"
    now = found or Found(report.valid_after.valid, "in memory")
    lines.append(f"valid: {now.words} (was {verdict(report.valid_before.valid)}); {end}")
    return lines


def left_words(left: Sequence[FaceOutcome]) -> list[str]:
    """The faces that had to be left, by reason."""
    groups: dict[str, list[int]] = {}
    for each in left:
        groups.setdefault(each.words, []).append(each.face)
    most = sorted(groups.items(), key=lambda group: -len(group[1]))
    return [f"{len(faces)} left ({numbers(faces)}: {why})" for why, faces in most]


def roughness_words(edited: Sequence[FaceOutcome]) -> str:
    """How rough edited faces were and are."""
    both = [each.roughness for each in edited if each.roughness]
    if not both:
        return ""
    bending, variation = (
        [sum(getattr(pair[k], name) for pair in both) for k in (0, 1)] for name in ("bending", "variation")
    )
    curvature = [max(pair[k].curvature for pair in both) for k in (0, 1)]
    return (
        f"; bending {bending[0]:.3g} → {bending[1]:.3g}, curvature variation {variation[0]:.3g} → {variation[1]:.3g}"
        f" 1/mm², curvature ≤ {curvature[1]:.3g} (was {curvature[0]:.3g}) 1/mm"
    )


def copies_line(report: Report) -> str:
    """What became of the copies of a feature."""
    copies, (before, after) = report.edit.copies, control_points(report)
    worst = max(copies, key=lambda c: c.deviation)
    exact = sum(c.exact for c in copies)
    text = f"copies: {len(copies)}" + (f", {exact} exact" if exact else "")
    text += f", off the ideal by ≤ {mm(worst.deviation)} ({worst.place})"
    lost = max(copies, key=lambda c: c.lost)
    if lost.lost > 1e-9:
        text += f"; constraints took ≤ {mm(lost.lost)} ({lost.place})"
    return f"{text}; control points: {after}" + (f" (were {before})" if after != before else "")


def control_points(report: Report) -> tuple[int, int]:
    """Control points of all NURBS faces before and after."""
    before = after = 0
    for surface in report.model.surfaces:
        net, offset = surface.net, report.edit.displacement.offsets.get(surface.index)
        before += net.u.count * net.v.count
        after += net.u.count * net.v.count if offset is None else offset.poles.shape[0] * offset.poles.shape[1]
    return before, after


def edge_words(edges: tuple[Treatment, ...]) -> str:
    """What was done about the edges of the edited faces."""
    moved = sum(e.how != "frozen" for e in edges)
    loose = sum(e.how == "to tolerance" for e in edges)
    why = Counter(str(e.reason) for e in edges if e.reason)
    reasons = ", ".join(f"{count} {reason}" for reason, count in why.most_common(REASONS))
    reasons += ", …" if len(why) > REASONS else ""
    words = f"{moved} of {plural(len(edges), 'edge')} moved with both faces"
    return words + (f", {loose} to tolerance" if loose else "") + (f" (not: {reasons})" if why else "")


def seam_line(new: SeamSummary, old: SeamSummary | None = None) -> str:
    """The seams in one line."""
    angle, bend, gap = degrees(new.angle), f"{new.bend:.2g} 1/mm", mm(new.gap)
    if old:
        angle, bend = f"{angle} (was {degrees(old.angle)})", f"{bend} (was {old.bend:.2g})"
        gap = f"{gap} (was {mm(old.gap)})"
    line = f"seams: {new.smooth} smooth of {new.seams}, angle ≤ {angle}, curvature jump ≤ {bend}; gap ≤ {gap}"
    return line + (f"; {new.unsewn} not sewn" if new.unsewn else "")


_CONTROL = re.compile("[\x00-\x1f\x7f-\x9f\u2028\u2029]")


def printable(line: str) -> str:
    """A line for a terminal: control characters, which names may hold, are spelled as in JSON (``\\u001b``)."""
    return _CONTROL.sub(lambda match: f"\\u{ord(match[0]):04x}", line)


def say(*lines: str, file: TextIO | None = None) -> None:
    """Print lines, on standard output unless ``file`` is given."""
    for line in lines:
        print(printable(line), file=file)


def json_text(value: Any, indent: int | None = None) -> str:
    """JSON that any reader takes: what is not finite is null, signs that cannot be written as they are, escaped."""
    body = _finite(value)
    text = json.dumps(body, indent=indent, ensure_ascii=False)
    try:
        for encoding in {"utf-8", sys.stdout.encoding or "utf-8"}:
            text.encode(encoding)
    except UnicodeEncodeError:
        return json.dumps(body, indent=indent)
    return text


def _finite(value: Any) -> Any:
    if isinstance(value, dict):
        return {key: _finite(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [_finite(item) for item in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value


def plain(value: Any) -> Any:
    """Dataclasses and structs as JSON-ready values; face and edge indices count from 1 as on the command line."""
    return msgspec.to_builtins(value)


def outcome(value: FaceOutcome) -> dict[str, Any]:
    """One face's outcome; lengths in millimetres."""
    return {**plain(value), "face": value.face + 1}


def treatment(value: Treatment) -> dict[str, Any]:
    """What was done about an edge; the edge and its faces by number."""
    faces, reason = [i + 1 for i in value.faces], "" if value.reason is None else str(value.reason)
    return {**plain(value), "edge": value.edge + 1, "faces": faces, "reason": reason}


def seam(value: SeamMeasure) -> dict[str, Any]:
    """One seam; its faces by number."""
    return {
        **plain(value),
        "edge": value.edge + 1,
        "faces": [i + 1 for i in value.faces],
        "smooth": value.smooth,
    }


def result(value: Report | Judged) -> dict[str, Any]:
    """What a step did, in full."""
    from mracad.job.document import Report

    if isinstance(value, Report):
        return report(value)
    from mracad_cli.verdicts import as_data

    return as_data(value.verdict, value.failed)


def report(value: Report) -> dict[str, Any]:
    """The full report of an edit."""
    from mracad.inspect.seams import key, summary

    smooth = value.smooth_seams()
    after = {key(m): m for m in value.after}
    return {
        "file": value.model.name,
        "diagonal": value.model.diagonal,
        "counts": dict(Counter(o.status for o in value.edit.outcomes)),
        "faces": [outcome(o) for o in value.edit.outcomes],
        "edges": [treatment(e) for e in value.edit.edges],
        "copies": [{**plain(c), "faces": [i + 1 for i in c.faces]} for c in value.edit.copies],
        "control_points": dict(zip(("before", "after"), control_points(value), strict=True)),
        "notes": list(value.edit.notes),
        "deviation": [{**plain(d), "face": d.face + 1} for d in value.deviations],
        "seams": {
            "before": plain(summary(value.before, smooth)),
            "after": plain(summary(value.after, smooth)),
            "each": [
                {
                    **seam(m),
                    "after": {k: v for k, v in seam(after[key(m)]).items() if k not in ("edge", "faces", "sewn")},
                }
                for m in value.before
            ],
        },
        "valid": {"before": validity(value.valid_before), "after": validity(value.valid_after)},
    }


def read_back(value: ReadBack | None) -> dict[str, Any] | None:
    """What an output is as read back; None where it was not."""
    if value is None:
        return None
    return {**plain(value), "faults": _faults(value.faults), "forgiven": _faults(value.forgiven)}


def _faults(faults: Sequence[Fault]) -> list[dict[str, Any]]:
    return [{**plain(fault), "faces": [face + 1 for face in fault.faces]} for fault in faults]


def validity(value: Validity) -> dict[str, Any]:
    """The kernel's verdict."""
    return dict(plain(value))
