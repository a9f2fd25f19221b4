"""Make a report of a model that opens in any browser, without a network: one HTML file.

It holds facts, a check layer by layer, pictures, the model to turn, spectra, and tables of faces and seams. With REF
the model is compared with that, too. A report is no check: the exit code tells only whether it was made.
"""

from __future__ import annotations

from dataclasses import replace

import click

from mracad_cli import options, running
from mracad_cli.command import Command
from mracad_cli.options import Reading
from mracad_cli.outputs import check_page, check_reports, deliver, load, read
from mracad_cli.progress import Progress
from mracad_cli.say import json_text


@click.command(cls=Command, help=__doc__, examples="mracad report new.step old.step -o new.html")
@options.apply(
    options.reading(),
    click.argument("reference", metavar="[REF]", required=False, type=options.model),
    options.option(
        "-o", "--output", metavar="F.html", required=True, type=options.page, help="Report to write (HTML)."
    ),
    options.section(options.Title.OUTPUT, options.overwrite),
    running.printing,
)
def command(reading: Reading, reference: str | None, output: str, overwrite: bool, as_json: bool) -> None:
    check_page(output)
    check_reports(output, overwrite=overwrite)
    from mracad.report.page import html
    from mracad_cli.render import report

    with Progress() as progress:
        progress("reading", 0, 1)
        text = load(reading.file)
        document = read(reading, text)
        other = read(replace(reading, file=reference)) if reference else None
        told = report.told(document, other, text.getvalue(), progress)
        progress("drawing", 0, 1)
        data = html(report.page(told))
    line = json_text(told.body | {"written": output}) if as_json else report.line(told, output, len(data))
    deliver({output: data}, [line])
