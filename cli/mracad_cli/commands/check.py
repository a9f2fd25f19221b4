"""Check a STEP file layer by layer; exit code 1 when something asked for does not hold.

The file as parsed, the shapes that the kernel loads from it, its own check of them, closed shells, seams, faces that
cross, tolerances, walls, the mesh. Valid is yes, no or unknown, never a guess.
"""

from __future__ import annotations

import click

from mracad_cli import options
from mracad_cli.progress import Progress

RULES = ("invalid", "unknown", "free-edges", "unsewn", "file", "self-intersection", "mesh", "nothing")


@click.command(help=__doc__)
@options.apply(
    options.reading,
    click.option("--max-gap", metavar="LENGTH", help="Largest gap along any seam."),
    click.option(
        "--max-angle",
        metavar="DEG",
        type=click.FloatRange(min=0.0),
        help="Largest angle along seams that are meant to be smooth.",
    ),
    click.option(
        "--kink",
        metavar="DEG",
        type=click.FloatRange(min=0.0),
        default=1.0,
        show_default=True,
        help="A seam with a smaller angle is meant to be smooth.",
    ),
    click.option("--max-tolerance", metavar="LENGTH", help="Largest tolerance of edges and vertices."),
    click.option("--min-wall", metavar="LENGTH", help="Least thickness of the walls of solids."),
    click.option(
        "--layer-limit",
        metavar="SECONDS",
        type=click.FloatRange(min=0.0, min_open=True),
        help="Time for each layer; one that takes longer says nothing.",
    ),
    click.option(
        "--fail-on",
        multiple=True,
        type=click.Choice(RULES),
        default=["invalid"],
        show_default=True,
        help="What fails the check beside the limits; repeatable.",
    ),
    options.reports,
    options.printing,
)
def command(
    source: str,
    input_unit: str | None,
    max_gap: str | None,
    max_angle: float | None,
    kink: float,
    max_tolerance: str | None,
    min_wall: str | None,
    layer_limit: float | None,
    fail_on: tuple[str, ...],
    junit: str | None,
    sarif: str | None,
    overwrite: bool,
    as_json: bool,
) -> int:
    from mracad_cli.files import check_reports, load, read

    check_reports(junit, sarif, overwrite=overwrite)
    from mracad import review
    from mracad.options import length
    from mracad_cli.verdicts import emit

    with Progress() as progress:
        progress("reading", 0, 1)
        text = load(source)
        document = read(text, input_unit)
        size = review.diagonal(document)
        gap, tolerance, wall = (
            None if given is None else length(given, size, name)
            for given, name in ((max_gap, "max-gap"), (max_tolerance, "max-tolerance"), (min_wall, "min-wall"))
        )
        progress("checking", 0, 1)
        limits = review.CheckLimits(gap, max_angle, kink, tolerance, wall, layer_limit)
        verdict = review.check(text.getvalue(), document.name, document, limits)
    failed = review.failing(verdict, fail_on)
    return emit(verdict, failed, command="check", as_json=as_json, junit=junit, sarif=sarif)
