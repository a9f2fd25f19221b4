"""Take a model through steps given in one argument: 'smooth --scale 5mm ! check'."""

from __future__ import annotations

from typing import Any

import click

from mracad_cli import options
from mracad_cli.command import Command
from mracad_cli.steps import run_recipe


@click.command(cls=Command, help=__doc__)
@click.argument("steps", metavar="STEPS")
@options.apply(options.reading(), options.writing, options.record, options.editing, options.printing)
def command(steps: str, **how: Any) -> int:
    from mracad.spec.recipe import pipeline

    return run_recipe(pipeline(steps), **how)
