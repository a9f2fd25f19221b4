"""Remove detail finer than a scale from the NURBS faces of a STEP file."""

from __future__ import annotations

from typing import Any

import click

from mracad.options import Smooth
from mracad_cli import options


@click.command(help=__doc__)
@options.apply(options.reading, options.of(Smooth), options.writing, options.editing, options.printing)
def command(source: str, **given: Any) -> int:
    from mracad.edit.smooth import smooth
    from mracad_cli.edit import run_edit

    words = Smooth(**{name: given.pop(name) for name in Smooth.__struct_fields__})
    scale = words.scale if words.scale is not None else f"level {words.level:g}"
    return run_edit(smooth, words, source, done=f"smoothed at {scale}", quiet="already smooth there", **given)
