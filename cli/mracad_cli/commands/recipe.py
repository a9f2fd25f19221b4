"""Check a recipe without running it, or print the JSON schema of recipes."""

from __future__ import annotations

import click

from mracad_cli import options, running
from mracad_cli.command import Group
from mracad_cli.say import json_text, printing, say
from mracad_cli.steps import plan


@click.group(cls=Group, help=__doc__)
def command() -> None:
    pass


@command.command(examples="mracad recipe check fair.toml --set smooth.scale=3mm")
@click.argument("file", metavar="RECIPE", type=options.recipe)
@options.apply(options.assignments, running.printing)
def check(file: str, assignments: tuple[str, ...], as_json: bool) -> None:
    """Show what a recipe would do; exit code 2 when something in it is wrong."""
    from mracad.spec.recipe import load

    found = load(file).with_values(assignments)
    steps = found.steps("model.step")
    listed = [{"id": step.id, "use": step.use, "text": step.text()} for step in steps]
    say(*([json_text({"recipe": found.name, "steps": listed})] if as_json else plan(steps)))


@command.command(examples="mracad recipe schema > recipe.schema.json")
def schema() -> None:
    """Print the JSON schema of recipes, for editors and validators."""
    from mracad.spec import schema

    with printing():
        print(json_text(schema.schema(), 1))
