"""Show what is in a model: units, products, faces, scales, seams, validity."""

from __future__ import annotations

from typing import Any

import click

from mracad.spec.quantity import LENGTH
from mracad_cli import options, running
from mracad_cli.command import Command
from mracad_cli.options import Reading
from mracad_cli.progress import Progress
from mracad_cli.say import json_text, say


@click.command(cls=Command, help=__doc__, examples="mracad info part.step --at 10,20,5")
@options.apply(
    options.reading(),
    options.option(
        "--scale",
        type=options.Quantity(LENGTH),
        default="2%",
        show_default=True,
        help="Scale at which to look for detail.",
    ),
    options.option(
        "--keep",
        type=click.Choice(["g0", "g1", "g2"]),
        default="g1",
        show_default=True,
        help="Continuity that edges keep; it determines which control points are free.",
    ),
    options.option(
        "--all",
        "everything",
        is_flag=True,
        help="Also list instances, faces that are not NURBS, the area, centre and box of faces, and every seam.",
    ),
    options.option(
        "--at",
        "places",
        metavar="PLACE",
        multiple=True,
        help="Also tell the face nearest to X,Y,Z (mm), or #3@u,v, with its parameters, frame and curvature there; "
        "repeatable.",
    ),
    running.printing,
)
def command(reading: Reading, scale: str, keep: Any, everything: bool, places: tuple[str, ...], as_json: bool) -> None:
    from mracad.job.info import info as look
    from mracad.spec.places import spot
    from mracad_cli.outputs import read
    from mracad_cli.render import info

    points = [spot(text, "at") for text in places]
    with Progress() as progress:
        progress("reading", 0, 1)
        document = read(reading)
        sized = everything or as_json
        seen = look(document, scale, keep, sized=sized, places=points, progress=progress)
    say(*([json_text(info.body(seen))] if as_json else info.lines(seen, everything)))
