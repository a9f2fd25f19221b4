"""Carry the detail of a face, or a feature, of one STEP file onto another; units may differ."""

from __future__ import annotations

from typing import Any

import click

from mracad.spec.steps import Transfer
from mracad_cli import options
from mracad_cli.steps import run_steps


@click.command("transfer", help=__doc__)
@click.argument("source", metavar="SRC", type=click.Path())
@click.argument("target", metavar="DST", type=click.Path(allow_dash=True))
@options.apply(
    options.input_unit,
    options.encoding,
    options.of(Transfer, "source"),
    options.writing,
    options.editing,
    options.printing,
)
def command(source: str, target: str, **given: Any) -> int:
    from mracad.spec.recipe import Step
    from mracad.spec.text import options as options_of

    values = {name: given.pop(name) for name in Transfer.__struct_fields__ if name != "source"}
    step = Step("transfer", "transfer", options_of(Transfer, {**values, "source": source}))
    return run_steps([step], target, **given)
