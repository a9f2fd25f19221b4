"""Write a model in another format: STEP, IGES, BREP, BinBREP, or as a mesh (STL, 3MF, OBJ, PLY, glTF, VTK)."""

from __future__ import annotations

import click

from mracad.spec.pictures import show_of, unedited
from mracad_cli import options, running
from mracad_cli.command import Unedited
from mracad_cli.options import Reading, Writing
from mracad_cli.outputs import check_outputs, deliver_models, load
from mracad_cli.say import json_text
from mracad_cli.steps import produced


@click.command(cls=Unedited, help=__doc__, examples="mracad convert part.igs -o part.step -o part.stl")
@options.apply(options.reading(), options.writing, running.printing)
def command(reading: Reading, writing: Writing, as_json: bool) -> int:
    import time

    from mracad_cli.render import json, text

    start = time.perf_counter()
    unedited(show_of(writing.picture.show))
    for scalar in writing.scalars.shows:
        unedited(scalar, "scalar")
    targets = check_outputs(writing)
    document, done = produced(reading, load(reading.file), writing, targets, ())
    found = text.found(done.made)
    valid = f"valid: {found.words}; " if found else ""
    line = f"{document.name}: {valid}wrote {text.sizes(done.made)}, {time.perf_counter() - start:.1f} s"
    if as_json:
        line = json_text({"file": document.name, "warnings": document.warnings, **json.written(done.made)})
    deliver_models(writing, done.made, {}, [line])
    return 0
