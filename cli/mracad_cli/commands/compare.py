"""Compare a model with a reference; exit code 1, with the reasons, when something differs beyond its limit.

Faces are matched by shape, not by number. A face's deviation is measured both ways by exact projection; a face that
only became longer or shorter counts as a moved outline. Lengths are compared in millimetres whatever the files' units.
"""

from __future__ import annotations

from dataclasses import replace

import click

from mracad.spec.steps import Compare
from mracad_cli import options, running
from mracad_cli.command import Command
from mracad_cli.options import Reading, Reports
from mracad_cli.outputs import check_page, check_reports, deliver_verdict, read
from mracad_cli.progress import Progress


@click.command(cls=Command, help=__doc__, examples=Compare.example)
@click.argument("reference", metavar="REF", type=options.model)
@options.apply(
    options.reading("NEW"), options.of(Compare, "limits", without="reference"), options.reports, running.judging
)
def command(reference: str, reading: Reading, limits: Compare, reports: Reports) -> int:
    check_page(reports.report_html)
    check_reports(reports.junit, reports.sarif, reports.report_html, overwrite=reports.overwrite)
    from mracad.job import compare

    with Progress() as progress:
        progress("reading", 0, 1)
        old = read(replace(reading, file=reference, input_unit=limits.reference_unit))
        new = read(reading)
        progress("comparing", 0, 1)
        judged = compare.compare(new, limits, lambda: old)
    return deliver_verdict(judged, "compare", reports, new, old)
