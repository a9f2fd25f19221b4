"""Write a model in another format: STEP, IGES, BREP, BinBREP, or as a mesh (STL, 3MF, OBJ, PLY, glTF)."""

from __future__ import annotations

from typing import Any

import click

from mracad_cli import options
from mracad_cli.progress import Progress


@click.command(help=__doc__)
@options.apply(options.reading, options.writing, options.printing)
def command(
    source: str, input_unit: str | None, encoding: str | None, as_json: bool, outputs: tuple[str, ...], **formats: Any
) -> int:
    import time

    from mracad_cli.files import Outputs, read
    from mracad_cli.render import json_text

    start = time.perf_counter()
    targets = Outputs(outputs, **formats)
    with Progress() as progress:
        progress("reading", 0, 1)
        document = read(source, input_unit, encoding)
        progress("writing", 0, 1)
        targets.make(document, "convert")
    line = f"{document.name}: wrote {targets.sizes()}, {time.perf_counter() - start:.1f} s"
    if as_json:
        line = json_text({"file": document.name, "warnings": document.warnings, **targets.body()})
    targets.deliver({}, [line])
    return 0
