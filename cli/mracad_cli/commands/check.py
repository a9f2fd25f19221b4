"""Check validity and continuity of a STEP file; exit code 1 when something asked for does not hold."""

from __future__ import annotations

import json

import click

from mracad_cli import options, render
from mracad_cli.files import read
from mracad_cli.progress import Progress


@click.command(help=__doc__)
@options.apply(
    options.reading,
    click.option("--max-gap", metavar="LENGTH", help="Largest gap along any seam of a NURBS face."),
    click.option(
        "--max-angle",
        metavar="DEG",
        type=click.FloatRange(min=0.0),
        help="Largest angle along seams that are meant to be smooth.",
    ),
    click.option(
        "--kink",
        metavar="DEG",
        type=click.FloatRange(min=0.0),
        default=1.0,
        show_default=True,
        help="A seam with a smaller angle is meant to be smooth.",
    ),
    click.option(
        "--fail-on",
        multiple=True,
        type=click.Choice(["invalid", "free-edges", "unsewn", "nothing"]),
        default=["invalid"],
        show_default=True,
        help="What else fails the check; repeatable.",
    ),
    options.printing,
)
def command(
    source: str,
    input_unit: str | None,
    max_gap: str | None,
    max_angle: float | None,
    kink: float,
    fail_on: tuple[str, ...],
    as_json: bool,
) -> int:
    from mracad.audit.continuity import key, seams, summary
    from mracad.occ.check import check
    from mracad.occ.view import view
    from mracad.options import length

    with Progress() as progress:
        progress("reading", 0, 1)
        document = read(source, input_unit)
        model = view(document)
        widest = None if max_gap is None else length(max_gap, model.diagonal, "max-gap")
        measures = seams(model)
        progress("checking", 0, 1)
        valid = check(document)
    meant = [m for m in measures if m.angle < kink]
    failures = []
    if "invalid" in fail_on and not valid.valid:
        failures += [str(failure) for failure in valid.failures] or ["not valid"]
    if "free-edges" in fail_on and valid.free_edges:
        failures.append(render.plural(valid.free_edges, "free edge"))
    totals = summary(measures, frozenset(key(m) for m in meant))
    if "unsewn" in fail_on and totals.unsewn:
        failures.append(f"{render.plural(totals.unsewn, 'seam')} not sewn")
    failures += [
        f"gap {render.mm(m.gap)} between #{m.faces[0] + 1} and #{m.faces[1] + 1}"
        for m in measures
        if widest is not None and m.gap > widest
    ]
    failures += [
        f"angle {render.degrees(m.angle)} between #{m.faces[0] + 1} and #{m.faces[1] + 1}"
        for m in meant
        if max_angle is not None and m.angle > max_angle
    ]
    if as_json:
        body = {
            "file": model.name,
            "passed": not failures,
            "failures": failures,
            "valid": render.validity(valid),
            "seams": {**render.plain(totals), "each": [render.seam(m) for m in measures]},
        }
        print(json.dumps(body, ensure_ascii=False))
        return 1 if failures else 0
    print(
        f"{model.name}: {render.plural(valid.solids, 'solid')}, {render.plural(valid.shells, 'shell')}, "
        f"{render.plural(valid.faces, 'face')}, {render.plural(valid.free_edges, 'free edge')}"
    )
    tolerance = max(valid.edge_tolerance, valid.vertex_tolerance)
    print(f"valid: {render.verdict(valid.valid)}; largest tolerance {render.mm(tolerance)}")
    print(render.seam_line(totals))
    for failure in failures:
        print(f"failed: {failure}")
    if not failures:
        print("passed")
    return 1 if failures else 0
