"""Take a model through the steps of a recipe (TOML): one read, one write."""

from __future__ import annotations

from typing import Any

import click

from mracad_cli import options, running
from mracad_cli.command import Command
from mracad_cli.steps import run_recipe


@click.command(cls=Command, help=__doc__, examples="mracad run fair.toml part.step --set smooth.scale=3mm -o fair.step")
@click.argument("recipe", metavar="RECIPE", type=options.recipe)
@options.apply(
    options.reading(),
    options.assignments,
    options.writing,
    options.section(options.Title.OUTPUT, options.record),
    options.editing,
    running.printing,
)
def command(recipe: str, **how: Any) -> int:
    from mracad.spec.recipe import load

    return run_recipe(load(recipe), **how)
