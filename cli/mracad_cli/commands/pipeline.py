"""Take a model through steps given in one argument: 'smooth --scale 5mm ! check'."""

from __future__ import annotations

from typing import Any

import click

from mracad_cli import options, running
from mracad_cli.command import Command
from mracad_cli.steps import run_recipe


@click.command(
    cls=Command, help=__doc__, examples="mracad pipeline 'smooth --scale 5mm ! check' part.step -o fair.step"
)
@click.argument("steps", metavar="STEPS")
@options.apply(
    options.reading(),
    options.writing,
    options.section(options.Title.OUTPUT, options.record),
    options.editing,
    running.printing,
)
def command(steps: str, **how: Any) -> int:
    from mracad.spec.recipe import pipeline

    return run_recipe(pipeline(steps), **how)
