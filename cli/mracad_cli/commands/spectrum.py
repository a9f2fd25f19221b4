"""Show how high the waves on NURBS faces are, by wavelength and direction, and where the shape begins."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

import click

from mracad.errors import EditError, UsageError
from mracad.spec.steps import Selection
from mracad_cli import options, running
from mracad_cli.command import Command
from mracad_cli.options import Reading
from mracad_cli.outputs import check_reports, deliver, read
from mracad_cli.progress import Progress
from mracad_cli.say import json_text

if TYPE_CHECKING:
    from mracad.inspect.spectrum import Spectrum
    from mracad.model.brep import Model

OTHERS = "instance hold keep edges"
"""Options of edits that do not apply here."""

PICTURES = ".png", ".svg"
ENDINGS = ".csv", ".json", *PICTURES


@click.command("spectrum", cls=Command, help=__doc__, examples="mracad spectrum part.step --faces '#3' -o spectrum.png")
@options.apply(
    options.reading(),
    options.of(Selection, "chosen", OTHERS),
    options.option(
        "-o",
        "--output",
        "outputs",
        metavar="F",
        type=options.File(ENDINGS),
        multiple=True,
        help="Write all bands of all faces to a .csv or .json file, or draw them: .png or .svg, with a scalogram of a "
        "single face; repeatable.",
    ),
    options.section(options.Title.OUTPUT, options.overwrite),
    running.printing,
)
def command(reading: Reading, chosen: Selection, outputs: tuple[str, ...], overwrite: bool, as_json: bool) -> None:
    for output in outputs:
        if Path(output).suffix not in ENDINGS:
            raise UsageError(
                f"cannot write {output}: unknown extension {Path(output).suffix!r}", f"use {', '.join(ENDINGS)}"
            )
    check_reports(*outputs, overwrite=overwrite)
    from mracad.inspect.spectrum import spectra
    from mracad.job.look import looked_at
    from mracad.spec.select import NURBS
    from mracad_cli.render import spectrum

    with Progress() as progress:
        progress("reading", 0, 1)
        model, scope = looked_at(read(reading), chosen)
        every = [i for i in sorted(scope.chosen) if model.faces[i].kind in NURBS]
        found = []
        for done, face in enumerate(every):
            progress("measuring waves", done, len(every))
            found += spectra(model, [face])
    body = json_text(spectrum.body(model.name, found))
    if not found and any(output.endswith(PICTURES) for output in outputs):
        raise EditError(f"{model.name}: there is no NURBS face to draw", "choose others with --faces")
    forms: dict[str, Callable[[], str | bytes]] = {
        ".csv": lambda: spectrum.csv(found),
        ".json": lambda: body + "\n",
    } | {form: partial(_drawn, model, found, form[1:]) for form in PICTURES}
    files: dict[str, str | bytes | None] = {output: forms[Path(output).suffix]() for output in outputs}
    written = [f"wrote {', '.join(Path(output).name for output in outputs)}"] if outputs else []
    deliver(files, [body] if as_json else [*spectrum.lines(model.name, found), *written])


def _drawn(model: Model, found: Sequence[Spectrum], form: str) -> bytes:
    """A picture of spectra; of a single face with its scalograms."""
    from mracad.inspect.scalogram import scalogram
    from mracad_cli.render import plot

    face = model.faces[found[0].faces[0]]
    alone = len(found) == 1 and face.surface is not None
    net = model.surfaces[face.surface or 0].net
    shown = {way: scalogram(net, face, axis) for axis, way in enumerate("uv")} if alone else {}
    return plot.picture(model.name, found, shown, form)
