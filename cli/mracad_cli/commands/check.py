"""Check a model layer by layer; exit code 1 when something asked for does not hold.

The file as parsed, the shapes that the kernel loads from it, its own check of them, closed shells, seams, faces that
cross, tolerances, walls, the mesh. Valid is yes, no or unknown, never a guess.
"""

from __future__ import annotations

from typing import Any

import click

from mracad.spec.steps import Check
from mracad_cli import options
from mracad_cli.progress import Progress


@click.command(help=__doc__)
@options.apply(options.reading, options.of(Check), options.reports, options.printing)
def command(
    source: str,
    input_unit: str | None,
    encoding: str | None,
    junit: str | None,
    sarif: str | None,
    overwrite: bool,
    as_json: bool,
    **given: Any,
) -> int:
    from mracad.spec.text import options as options_of
    from mracad_cli.files import check_reports, load, read

    check_reports(junit, sarif, overwrite=overwrite)
    limits = options_of(Check, given)
    from mracad.job import check
    from mracad_cli.verdicts import emit

    with Progress() as progress:
        progress("reading", 0, 1)
        text = load(source)
        document = read(text, input_unit, encoding)
        progress("checking", 0, 1)
        judged = check.check(document, limits, text=text.getvalue())
    return emit(judged.verdict, judged.failed, command="check", as_json=as_json, junit=junit, sarif=sarif)
