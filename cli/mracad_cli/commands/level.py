"""Reduce the NURBS faces of a model to a level: the coarse shape that they form together, without its details."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import click

from mracad.errors import UsageError
from mracad.spec.steps import Level
from mracad_cli import options, running
from mracad_cli.command import Command
from mracad_cli.steps import run_edit

if TYPE_CHECKING:
    from mracad.job.document import Report


@click.command("level", cls=Command, help=__doc__, examples=Level.example)
@options.apply(
    options.reading(),
    options.of(Level, "chosen"),
    options.option(
        "--details",
        metavar="F.mra",
        type=options.File((".mra",)),
        help="Save the details to a file, for mracad compose.",
    ),
    options.writing,
    options.editing,
    running.printing,
)
def command(chosen: Level, details: str | None, **how: Any) -> int:
    if details and not details.endswith(".mra"):
        raise UsageError(f"cannot write {details}: unknown extension", "use .mra for details")

    def taken(report: Report) -> bytes:
        from mracad.edit.details import Details
        from mracad.edit.mra import save

        return save(Details.of(report.model, report.edit.displacement, chosen.done))

    return run_edit("level", chosen, **how, beside={details: taken} if details else {})
