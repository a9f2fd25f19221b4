"""Draw a model: shaded, or with zebra stripes, isophotes, maps of numbers, features or numbered faces.

Every pixel is evaluated on the surface itself. No display is needed.
"""

from __future__ import annotations

from dataclasses import replace

import click

from mracad.errors import UsageError
from mracad.formats import FORMATS, by_extension
from mracad.spec.pictures import Picture, show_of, unedited
from mracad_cli import options, running
from mracad_cli.command import Unedited
from mracad_cli.options import Reading
from mracad_cli.outputs import check_reports, deliver, read
from mracad_cli.progress import Progress
from mracad_cli.say import json_text, warn

DRAWN = [extension for format in FORMATS.values() if format.kind == "picture" for extension in format.extensions]
"""Extensions of pictures."""


@click.command(cls=Unedited, help=__doc__, examples=Picture.example)
@options.apply(
    options.reading(),
    options.option(
        "-o",
        "--output",
        metavar="OUT.png",
        required=True,
        type=options.File(DRAWN, dash=True),
        help="Picture to write: .png, or .gif or .mp4, in which the model turns; - for PNG on standard output.",
    ),
    options.of(Picture, "picture"),
    options.section(options.Title.OUTPUT, options.overwrite),
    running.printing,
)
def command(reading: Reading, output: str, picture: Picture, overwrite: bool, as_json: bool) -> None:
    import time

    from mracad_cli.render import picture as words

    start = time.perf_counter()
    show = show_of(picture.show)
    unedited(show)
    if picture.wipe and not picture.before:
        raise UsageError("wipe: there is no other model", "add --before REF.step")
    format = FORMATS["png"] if output == "-" else by_extension(output, "picture")
    if format.kind != "picture":
        raise UsageError(f"cannot draw {output}: pictures are .png, .gif or .mp4", "name a file that ends in .png")
    picture.check(format.name)
    check_reports(None if output == "-" else output, overwrite=overwrite)
    with Progress() as progress:
        progress("reading", 0, 1)
        document = read(reading)
        before = read(replace(reading, file=picture.before)) if picture.before else None
        reference = read(replace(reading, file=show.of)) if show.kind == "deviation" else None
        progress("drawing", 0, 1)
        from mracad.view.picture import render

        drawn = render(document, picture, before=before, reference=reference, format=format.name)
    if drawn.note:
        warn(drawn.note)
    if as_json:
        line = json_text(words.body(document.name, document.warnings, picture, drawn, output))
    else:
        line = words.line(document.name, picture, drawn, output, time.perf_counter() - start)
    files = {} if output == "-" else {output: drawn.data}
    deliver(files, [line], stream=drawn.data if output == "-" else None)
