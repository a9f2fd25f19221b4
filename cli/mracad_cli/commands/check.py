"""Check validity and continuity of a STEP file; exit code 1 when something asked for does not hold."""

from __future__ import annotations

from typing import Any

import click

from mracad.options import Check
from mracad_cli import options, render
from mracad_cli.progress import Progress


@click.command(help=__doc__)
@options.apply(options.reading, options.of(Check), options.printing)
def command(source: str, input_unit: str | None, as_json: bool, **given: Any) -> int:
    import json

    from mracad import job
    from mracad.audit.continuity import key, summary
    from mracad.recipe import options as options_of
    from mracad_cli.files import read

    limits = options_of("check", given)
    assert isinstance(limits, Check)
    with Progress() as progress:
        progress("reading", 0, 1)
        document = read(source, input_unit)
        verdict = job.check(document, limits, progress=progress)
    found, failures = verdict.facts, verdict.failures
    model, valid = found.model, found.valid
    totals = summary(found.seams, frozenset(key(m) for m in found.meant))
    if as_json:
        body = {
            "file": model.name,
            "passed": not failures,
            "failures": failures,
            "valid": render.validity(valid),
            "seams": {**render.plain(totals), "each": [render.seam(m) for m in found.seams]},
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
