"""Pages of edits, checks and comparisons, made of the values that are also their reports as JSON."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

from mracad.report.figures import alone, both, reference_name, still, thumbnail
from mracad.report.mesh import mesh
from mracad.report.page import SVG, Figure, Page, Verdict, html
from mracad.report.table import Column, Table
from mracad.spec.quantity import length
from mracad.spec.recipe import versions
from mracad_cli.render import json, text
from mracad_cli.render.text import mm

if TYPE_CHECKING:
    from mracad.job.document import Report
    from mracad.job.judge import Judged
    from mracad.job.produce import Production
    from mracad.occ.document import Document
    from mracad.spec.recipe import Step

FACES = (
    Column("Face", "face", "#"),
    Column("Status", "status"),
    Column("Reason", "reason"),
    Column("Details", "said"),
    Column("Moved, mm", "moved"),
    Column("Amount", "amount"),
    Column("Bending before", "roughness.0.bending"),
    Column("Bending after", "roughness.1.bending"),
    Column("Variation before, 1/mm²", "roughness.0.variation"),
    Column("Variation after, 1/mm²", "roughness.1.variation"),
    Column("Noise, mm", "noise"),
    Column("Control points", "points"),
)
DEVIATION = (
    Column("Face", "face", "#"),
    Column("Largest, mm", "largest"),
    Column("Mean, mm", "mean"),
    Column("Along the normal, mm", "normal"),
    Column("Bound, mm", "bound"),
)
SEAMS = (
    Column("Edge", "edge", "#"),
    Column("Faces", "faces", "#"),
    Column("Gap before, mm", "gap"),
    Column("Gap after, mm", "after.gap"),
    Column("Angle before, °", "angle"),
    Column("Angle after, °", "after.angle"),
    Column("Curvature jump before, 1/mm", "bend"),
    Column("Curvature jump after, 1/mm", "after.bend"),
    Column("Smooth", "smooth"),
)
EDGES = (Column("Edge", "edge", "#"), Column("Faces", "faces", "#"), Column("How", "how"), Column("Reason", "reason"))
COPIES = (
    Column("Place", "place"),
    Column("Faces", "faces", "#"),
    Column("Exact", "exact"),
    Column("Deviation, mm", "deviation"),
    Column("rms, mm", "rms"),
    Column("Cut off, mm", "lost"),
    Column("Not held, mm", "short"),
    Column("Height, mm", "height"),
)


def edited(
    before: Document,
    after: Document | None,
    steps: Sequence[Step],
    done: Production,
    body: Mapping[str, Any],
    key: str = "",
) -> bytes:
    """The page of steps; without a document after them, on a dry run, its pictures are those before.

    With the ``key`` of what was done it can be found by an index.
    """
    from mracad.job.document import Report

    parts = body.get("steps", [body])
    pairs = list(zip(steps, done.results, strict=False))
    verdicts = [_written(done)] + [
        _judged(step.id, json.verdict(result.verdict, result.failed))
        for step, result in pairs
        if not isinstance(result, Report)
    ]
    edits = [(step, part) for (step, result), part in zip(pairs, parts, strict=True) if isinstance(result, Report)]
    tables = [
        table
        for number, (step, part) in enumerate(reversed(edits))
        for table in _tables(part, f"{number or ''}", f"{step.id}: " if len(edits) > 1 else "")
    ]
    found = text.found(done.made) if len(steps) == 1 else None
    said = [line for step, result in pairs for line in _lines(step, result, found)]
    shown = after or before
    figures = [*(both(after, before) if after else []), *alone(shown, "zebra" if after else "")]
    figures += _plots(before.name, pairs) if after else []
    asked = [(f"Step {k}" if len(steps) > 1 else "Step", step.text()) for k, step in enumerate(steps, 1)]
    if done.made:
        said.append(f"wrote {', '.join(made.target.name for made in done.made)}")
    else:
        said.append("nothing written" if after else "dry run, nothing written")
    page = _page("Edit report", (shown, before if after else None), asked, said, verdicts, figures, tables)
    return html(replace(page, row=_row(page, done, key)) if key else page)


def _plots(name: str, pairs: Sequence[tuple[Step, Report | Judged]]) -> list[Figure]:
    """Heights of waves on the faces that edits moved, before and after all of them."""
    from mracad.inspect.spectrum import spectra
    from mracad.job.document import Report
    from mracad_cli.render.plot import compared

    edits = [(step, result) for step, result in pairs if isinstance(result, Report)]
    moved = sorted({o.face for _, each in edits for o in each.edit.faces("edited")})
    if not moved:
        return []
    first, last = edits[0][1], edits[-1][1]
    before, after = spectra(first.model, moved), spectra(last.edit.displacement.applied(last.model), moved)
    common = {each.faces for each in before} & {each.faces for each in after}
    before, after = ([each for each in some if each.faces in common] for some in (before, after))
    if not common:
        return []
    scales = {f"{step.id} at {mm(scale)}": scale for step, each in edits for scale in _scales(step, each)}
    caption = f"Height of waves by wavelength before and after, {text.plural(len(common), 'face')} that moved"
    return [Figure(caption, compared(name, before, after, scales), SVG, wide=True)]


def _scales(step: Step, result: Report) -> list[float]:
    """The scale of an edit, mm, if it has one."""
    asked = getattr(step.options, "scale", None)
    own = length(asked, result.model.diagonal, "scale") if asked else result.edit.scale
    return [own] if own else []


def _row(page: Page, done: Production, key: str) -> dict[str, Any]:
    """What an index says of the page of steps."""
    from mracad.job.document import Report

    edits = [each for each in done.results if isinstance(each, Report)]
    return {
        "key": key,
        "valid": page.verdicts[0].answer.partition(",")[0],
        "edited": len({o.face for each in edits for o in each.edit.faces("edited")}),
        "faces": len({o.face for each in edits for o in each.edit.outcomes}),
        "deviation": max((d.largest for each in edits for d in each.deviations), default=0.0),
        "pictures": [thumbnail(page.still), thumbnail(page.figures[0])],
    }


def judged(document: Document, other: Document | None, found: Judged, command: str) -> bytes:
    """The page of a check or comparison."""
    body = json.verdict(found.verdict, found.failed)
    asked = [("Command", f"mracad {command}"), *([("Reference", other.name)] if other else [])]
    figures = [*(both(document, other) if other else []), *alone(document, "zebra" if other else "")]
    verdict = _judged(command, body)
    return html(
        _page(
            f"{command} report",
            (document, other),
            asked,
            text.verdict_lines(found.verdict, found.failed),
            [verdict],
            figures,
        )
    )


def _page(
    kind: str,
    compared: tuple[Document, Document | None],
    asked: Sequence[tuple[str, str]],
    said: Sequence[str],
    verdicts: Sequence[Verdict],
    figures: Sequence[Figure],
    tables: Sequence[Table] = (),
) -> Page:
    document, reference = compared
    return Page(
        title=document.name,
        kind=kind,
        asked=[("Model", document.name), *asked, *versions().items()],
        lines=[*said, *(f"warning: {each}" for each in document.warnings)],
        verdicts=verdicts,
        still=still(document),
        mesh=mesh(document, {}, reference),
        reference=reference_name(document, reference),
        figures=figures,
        tables=tables,
    )


def _judged(title: str, body: Mapping[str, Any]) -> Verdict:
    return Verdict(title, passed(body), body["passed"], body["layers"])


def passed(body: Mapping[str, Any]) -> str:
    """Whether a check passed, and if not, what did not."""
    return "passed" if body["passed"] else f"failed ({', '.join(body['failed'])})"


def _written(done: Production) -> Verdict:
    """Whether what was made is valid."""
    from mracad.job.document import Report

    found = text.found(done.made)
    if found:
        return Verdict("valid", found.words, found.valid)
    last = next((each for each in reversed(done.results) if isinstance(each, Report)), None)
    valid = last.valid_after.valid if last else None
    return Verdict("valid", f"{text.verdict(valid)}, in memory", valid)


def _lines(step: Step, result: Report | Judged, found: text.Found | None) -> list[str]:
    """What is said of a step, without the time that it took."""
    from mracad.job.document import Report

    if isinstance(result, Report):
        return [line.removesuffix("; ") for line in text.edit_lines(result, step.options, "", found)]  # type: ignore[arg-type]
    return text.step_lines(step, result)


def _tables(part: Mapping[str, Any], number: str, title: str) -> list[Table]:
    """The tables of an edit; numbered beyond the first."""
    return [
        Table(f"faces{number}", f"{title}Faces", FACES, part["faces"]),
        Table(f"deviation{number}", f"{title}Deviation", DEVIATION, part["deviation"]),
        Table(f"seams{number}", f"{title}Seams", SEAMS, part["seams"]["each"]),
        Table(f"edges{number}", f"{title}Edges", EDGES, part["edges"]),
        Table(f"copies{number}", f"{title}Copies", COPIES, part["copies"]),
    ]
