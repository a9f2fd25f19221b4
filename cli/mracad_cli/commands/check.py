"""Check a model layer by layer; exit code 1 when a check that was asked for fails.

The layers: the file as parsed, the shapes that the kernel loads from it, the kernel's own check, closed shells, seams,
faces that cross, tolerances, walls, the mesh. The verdict is yes, no or unknown, never a guess.
"""

from __future__ import annotations

import click

from mracad.spec.steps import Check
from mracad_cli import options, running
from mracad_cli.command import Command
from mracad_cli.options import Reading, Reports
from mracad_cli.outputs import check_page, check_reports, deliver_verdict, load, read
from mracad_cli.progress import Progress


@click.command(cls=Command, help=__doc__, examples=Check.example)
@options.apply(options.reading(), options.of(Check, "limits"), options.reports, running.judging)
def command(reading: Reading, limits: Check, reports: Reports) -> int:
    check_page(reports.report_html)
    check_reports(reports.junit, reports.sarif, reports.report_html, overwrite=reports.overwrite)
    from mracad.job import check

    with Progress() as progress:
        progress("reading", 0, 1)
        text = load(reading.file)
        document = read(reading, text)
        progress("checking", 0, 1)
        judged = check.check(document, limits, text=text.getvalue())
    return deliver_verdict(judged, "check", reports, document, None)
