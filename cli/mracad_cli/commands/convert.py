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

    from mracad_cli import render
    from mracad_cli.files import Outputs, load, read

    start = time.perf_counter()
    targets = Outputs(outputs, **formats)
    with Progress() as progress:
        progress("reading", 0, 1)
        text = load(source)
        document = read(text, input_unit, encoding)
        from mracad.job.produce import produce
        from mracad.occ.files import read as read_again

        done = produce(
            document,
            lambda: read_again(text, input_unit, encoding),
            targets=targets.targets(),
            title="convert",
            verify=targets.verify,
            progress=progress,
        )
    targets.take(done.made)
    found = render.found(done.made)
    valid = f"valid: {found.words}; " if found else ""
    line = f"{document.name}: {valid}wrote {targets.sizes()}, {time.perf_counter() - start:.1f} s"
    if as_json:
        line = render.json_text({"file": document.name, "warnings": document.warnings, **targets.body()})
    targets.deliver({}, [line])
    return 0
