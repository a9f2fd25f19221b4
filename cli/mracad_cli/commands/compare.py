"""Compare a model with a reference; exit code 1, with the reasons, when something differs beyond its limit.

Faces are matched whatever their numbers. A face's deviation is measured both ways by exact projection; where it only
became longer or shorter, its outline has moved. Lengths are compared in millimetres whatever the files' units.
"""

from __future__ import annotations

from typing import Any

import click

from mracad.spec.steps import Compare
from mracad_cli import options
from mracad_cli.progress import Progress


@click.command(help=__doc__)
@options.apply(
    click.argument("reference", metavar="REF", type=click.Path(allow_dash=True)),
    click.argument("source", metavar="NEW", type=click.Path(allow_dash=True)),
    options.input_unit,
    options.encoding,
    options.of(Compare, without="reference"),
    options.reports,
    options.printing,
)
def command(
    reference: str,
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
    from mracad_cli.files import check_reports, read

    check_reports(junit, sarif, overwrite=overwrite)
    limits = options_of(Compare, given)
    from mracad.job import compare
    from mracad_cli.verdicts import emit

    with Progress() as progress:
        progress("reading", 0, 1)
        old = read(reference, limits.reference_unit, encoding)
        new = read(source, input_unit, encoding)
        progress("comparing", 0, 1)
        judged = compare.compare(new, limits, lambda: old)
    return emit(judged.verdict, judged.failed, command="compare", as_json=as_json, junit=junit, sarif=sarif)
