"""Show what is in a model: units, products, faces, scales, seams, validity."""

from __future__ import annotations

from typing import Any

import click

from mracad.spec.quantity import LENGTH, length
from mracad_cli import options
from mracad_cli.command import Command
from mracad_cli.options import Reading
from mracad_cli.progress import Progress
from mracad_cli.say import json_text, say


@click.command(cls=Command, help=__doc__)
@options.apply(
    options.reading(),
    click.option(
        "--scale",
        type=options.Quantity(LENGTH),
        default="2%",
        show_default=True,
        help="Scale at which to look for detail.",
    ),
    click.option(
        "--keep",
        type=click.Choice(["g0", "g1", "g2"]),
        default="g1",
        show_default=True,
        help="Continuity that edges keep; it determines which control points are free.",
    ),
    click.option(
        "--all",
        "everything",
        is_flag=True,
        help="Also list instances, faces that are not NURBS and every seam.",
    ),
    options.printing,
)
def command(reading: Reading, scale: str, keep: Any, everything: bool, as_json: bool) -> None:
    from mracad.inspect.scales import scales
    from mracad.inspect.seams import seams
    from mracad.occ.check import check
    from mracad.occ.view import view
    from mracad_cli.outputs import read
    from mracad_cli.render import info

    with Progress() as progress:
        progress("reading", 0, 1)
        document = read(reading)
        progress("looking at faces", 0, 1)
        model = view(document)
        width = length(scale, model.diagonal, "scale")
        found = scales(model, width, keep, lambda done, total: progress("looking at scales", done, total))
        progress("measuring seams", 0, 1)
        measures = seams(model)
        progress("checking", 0, 1)
        valid = check(document)
    seen = info.Seen(document, model, width, keep, found, measures, valid)
    say(*([json_text(info.body(seen))] if as_json else info.lines(seen, everything)))
