"""Put the details that mracad level saved back on the coarse model, or on one that was edited since."""

from __future__ import annotations

from typing import Any

import click

from mracad.spec.steps import Compose
from mracad_cli import options, running
from mracad_cli.command import Command
from mracad_cli.steps import run_edit


@click.command("compose", cls=Command, help=__doc__, examples=Compose.example)
@options.apply(
    options.reading("COARSE"),
    options.of(Compose, "chosen", arguments={"details": "DETAILS"}),
    options.writing,
    options.editing,
    running.printing,
)
def command(chosen: Compose, **how: Any) -> int:
    return run_edit("compose", chosen, **how)
