"""Reports as lines of text."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from mracad.job.words import notes, numbers, placed
from mracad.spec.steps import Fitting, Selection
from mracad_cli.say import size

if TYPE_CHECKING:
    from mracad.edit.result import FaceOutcome
    from mracad.inspect.seams import SeamSummary
    from mracad.inspect.verdict import Layer, Verdict
    from mracad.job.batch.run import Outcome
    from mracad.job.document import Report
    from mracad.job.judge import Judged
    from mracad.job.output import Made
    from mracad.seam.natural import Treatment
    from mracad.spec.recipe import Step

FINDINGS = 8
"""Largest number of findings shown for one layer."""

GROWN = 3
"""Largest number of faces named of those that got more control points."""

REASONS = 3
"""Largest number of reasons named in one line."""


def mm(value: float) -> str:
    """A length in millimetres with three significant digits."""
    return f"{value:.3g} mm"


def degrees(value: float) -> str:
    """An angle in degrees with two significant digits, or 0 below the accuracy of measurement."""
    return f"{value:.2g}°" if value > 1e-5 else "0°"


def plural(count: int, noun: str) -> str:
    """``1 face``, ``2 faces``."""
    return f"{count} {noun}" if count == 1 else f"{count} {noun}s"


def verdict(valid: bool | None) -> str:
    return {True: "yes", False: "no", None: "unknown"}[valid]


def step_lines(step: Step, result: Report | Judged) -> list[str]:
    """The result of a step of a recipe; the first line begins with the step's name."""
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
    """The verdict on files that were read back."""

    valid: bool
    how: str = "as read back"

    @property
    def words(self) -> str:
        return f"{verdict(self.valid)}, {self.how}"


def found(made: Sequence[Made]) -> Found | None:
    """The verdict on outputs; None where they were not read back."""
    known = [each.read_back for each in made if each.read_back]
    if not known:
        return None
    exact = any(each.counts for each in known)
    return Found(all(each.valid for each in known), "as read back" if exact else "as meshed")


def edit_lines(report: Report, options: Selection, end: str, found: Found | None = None) -> list[str]:
    """The four lines after an edit; the last one ends in ``end``, ``found`` is the verdict on files as read back."""
    from mracad.inspect.seams import key, summary

    edit, model = report.edit, report.model
    nurbs = [o for o in edit.outcomes if o.status != "analytic"]
    parts = [f"{len(edit.faces('edited'))} {options.done}"]
    if edit.scale is not None:
        parts[0] += f", {mm(edit.scale)}"
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
    lines += [f"note: {note}" for note in notes(report)]
    lines += noise_lines(edit.outcomes)
    lines.append(deviation_line(report, options))
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


def deviation_line(report: Report, options: Selection) -> str:
    """How far an edit moved faces, and their roughness before and after."""
    if not report.deviations:
        return "deviation: none"
    worst = max(report.deviations, key=lambda d: d.largest)
    mean = sum(d.mean for d in report.deviations) / len(report.deviations)
    line = f"deviation: max {mm(worst.largest)} on #{worst.face + 1}, mean {mm(mean)}"
    if isinstance(options, Fitting) and options.max_deviation is not None:
        line += f", along the normal {mm(max(d.normal for d in report.deviations))}"
    line += roughness_words(report.edit.faces("edited"))
    return line if report.edit.copies else line + growth_words(report)


def noise_lines(outcomes: Sequence[FaceOutcome]) -> list[str]:
    """The noise that an edit found, and the share of the faces' bending energy that it removed, if it looks for
    noise."""
    known = [each for each in outcomes if each.noise is not None]
    noisy = sorted((each for each in known if each.noise), key=lambda each: each.noise or 0.0)
    if not noisy:
        return ["noise: none found"] if known else []
    least, middle, most = (noisy[k] for k in (0, len(noisy) // 2, -1))
    text = f"noise: {mm(middle.noise or 0.0)} on {plural(len(noisy), 'face')}"
    if mm(least.noise or 0.0) != mm(most.noise or 0.0):
        text += f" ({mm(least.noise or 0.0)} on #{least.face + 1} to {mm(most.noise or 0.0)} on #{most.face + 1})"
    clean = len(known) - len(noisy)
    text += f", none on {clean}" if clean else ""
    both = [each.roughness for each in noisy if each.roughness]
    before, after = (sum(pair[k].bending for pair in both) for k in (0, 1))
    return [f"{text}; {100 * (1 - after / before):.2g} % of their bending energy removed" if before else text]


def left_words(left: Sequence[FaceOutcome]) -> list[str]:
    """The faces that had to stay unchanged, by reason."""
    groups: dict[str, list[int]] = {}
    for each in left:
        groups.setdefault(each.words, []).append(each.face)
    most = sorted(groups.items(), key=lambda group: -len(group[1]))
    return [f"{len(faces)} left ({numbers(faces)}: {why})" for why, faces in most]


def roughness_words(edited: Sequence[FaceOutcome]) -> str:
    """The roughness of edited faces before and after."""
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
    """The quality of the copies of a feature."""
    from mracad.edit.feature.score import share

    copies = report.edit.copies
    worst = max(copies, key=lambda c: c.deviation)
    exact = sum(c.exact for c in copies)
    text = f"copies: {len(copies)}" + (f", {exact} exact" if exact else "")
    text += f", deviation from the ideal ≤ {mm(worst.deviation)} ({worst.place})"
    lost = max(copies, key=lambda c: c.lost)
    if lost.lost > 1e-9:
        text += f"; lost to constraints ≤ {mm(lost.lost)} ({lost.place})"
    if taken := share(copies):
        text += f"; edges and holes take {100 * taken:.2g} % of their volume"
    base = max(c.base for c in copies)
    if base > worst.deviation:
        text += f"; the surface under the feature is known to {mm(base)}"
    return text + growth_words(report)


def growth_words(report: Report) -> str:
    """The control points after an edit, where knots were added, and how many of them move."""
    before, after = report.control_points
    faces = {report.model.faces[o.face].surface: o for o in reversed(report.edit.faces("edited")) if o.added}
    most = sorted(faces.values(), key=lambda outcome: -outcome.added)
    if not most:
        return f"; control points: {after}" if report.edit.copies else ""
    parts = [f"{each.added} more on #{each.face + 1}" for each in most[:GROWN]]
    if rest := most[GROWN:]:
        parts.append(f"{sum(each.added for each in rest)} on {plural(len(rest), 'other face')}")
    moving = sum(each.moving for each in most)
    words = f"; control points: {after} (were {before}: {', '.join(parts)}"
    return words + (f", by whole knot lines; {moving} of these faces' move)" if report.edit.copies else ")")


def edge_words(edges: tuple[Treatment, ...]) -> str:
    """How the edges of the edited faces were treated."""
    slid = sum(e.how == "slid" for e in edges)
    moved = sum(e.how != "frozen" for e in edges) - slid
    loose = sum(e.how == "to tolerance" for e in edges)
    why = Counter(str(e.reason) for e in edges if e.reason)
    reasons = ", ".join(f"{count} × {reason}" for reason, count in why.most_common(REASONS))
    reasons += ", …" if len(why) > REASONS else ""
    words = f"{moved} of {plural(len(edges), 'edge')} moved with both faces"
    words += (f", {loose} to tolerance" if loose else "") + (f", {slid} slid along a face that stays" if slid else "")
    return words + (f" (stayed: {reasons})" if why else "")


def seam_line(new: SeamSummary, old: SeamSummary | None = None) -> str:
    """The seams of NURBS faces in one line."""
    angle, bend, gap = degrees(new.angle), f"{new.bend:.2g} 1/mm", mm(new.gap)
    if old:
        angle, bend = f"{angle} (was {degrees(old.angle)})", f"{bend} (was {old.bend:.2g})"
        gap = f"{gap} (was {mm(old.gap)})"
    line = f"seams of NURBS faces: {new.smooth} smooth of {new.seams}, angle ≤ {angle}, curvature jump ≤ {bend}"
    return f"{line}; gap ≤ {gap}" + (f"; {new.unsewn} not sewn" if new.unsewn else "")


def verdict_lines(found: Verdict, failed: Sequence[Layer]) -> list[str]:
    """A verdict, layer by layer."""
    end = "failed: " + ", ".join(layer.name for layer in failed) if failed else "passed"
    return [f"{found.subject}: valid: {verdict(found.valid)}", *layer_lines(found), end]


def layer_lines(found: Verdict) -> list[str]:
    """The layers of a verdict, each with its findings."""
    width = max(len(layer.name) for layer in found.layers)
    lines = []
    for layer in found.layers:
        lines.append(f"{layer.name.ljust(width)}  {layer.status.ljust(7)}  {layer.text}".rstrip())
        lines += [f"  {placed(finding)}" for finding in layer.findings[:FINDINGS]]
        if len(layer.findings) > FINDINGS:
            lines.append(f"  and {len(layer.findings) - FINDINGS} more")
        lines += [f"  note: {placed(note)}" for note in layer.notes[:FINDINGS]]
        if len(layer.notes) > FINDINGS:
            lines.append(f"  and {len(layer.notes) - FINDINGS} more notes")
    return lines


def batch_lines(outcomes: Sequence[Outcome], seconds: float) -> list[str]:
    """One line for the batch, and one for each file that failed."""
    counts = Counter(outcome.status for outcome in outcomes)
    parts = [f"{counts[status]} {status}" for status in ("done", "unchanged", "failed", "not tried") if counts[status]]
    lines = [f"{len(outcomes)} file{'s' * (len(outcomes) != 1)}: {', '.join(parts)}; {seconds:.1f} s"]
    failed = [outcome for outcome in outcomes if outcome.status == "failed"]
    return lines + [f"failed: {o.file}: {o.message}" + (f"; {o.hint}" if o.hint else "") for o in failed]


def sizes(made: Sequence[Made]) -> str:
    """The outputs: names, sizes, the faces that are in parts, and numbers at points."""
    each = (", ".join([m.target.name, size(len(m.data)), *map(str, m.written.cut)]) for m in made)
    return ", ".join([*each, *dict.fromkeys(str(legend) for m in made for legend in m.written.legends)])
