"""Copy the detail of faces, or a feature, from one file to another; units may differ."""

from __future__ import annotations

from typing import Any

import click

from mracad.spec.steps import Transfer
from mracad_cli import options, running
from mracad_cli.command import Command
from mracad_cli.steps import run_edit


@click.command("transfer", cls=Command, help=__doc__, examples=Transfer.example)
@options.apply(
    options.of(Transfer, "chosen", arguments={"source": "SRC"}),
    options.reading("DST"),
    options.writing,
    options.editing,
    running.printing,
)
def command(chosen: Transfer, **how: Any) -> int:
    return run_edit("transfer", chosen, **how)
