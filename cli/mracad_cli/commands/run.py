"""Take a model through the steps of a recipe (TOML): one read, one write."""

from __future__ import annotations

from typing import Any

import click

from mracad_cli import options
from mracad_cli.command import Command
from mracad_cli.steps import run_recipe


@click.command(cls=Command, help=__doc__)
@click.argument("recipe", metavar="RECIPE", type=options.path)
@options.apply(
    options.reading(), options.assignments, options.writing, options.record, options.editing, options.printing
)
def command(recipe: str, **how: Any) -> int:
    from mracad.spec.recipe import load

    return run_recipe(load(recipe), **how)
