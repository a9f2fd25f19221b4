"""Compare a STEP file with a reference; exit code 1, with the reasons, when something differs beyond its limit.

Faces are matched whatever their numbers. A face's deviation is measured both ways by exact projection; where it only
became longer or shorter, its outline has moved. Lengths are compared in millimetres whatever the files' units.
"""

from __future__ import annotations

import click

from mracad_cli import options
from mracad_cli.progress import Progress

LAYERS = (
    "faces", "deviation", "seams", "topology", "validity", "size", "assembly", "names", "colours", "layers",
    "materials", "annotations",
)  # fmt: skip


@click.command(help=__doc__)
@options.apply(
    click.argument("reference", metavar="REF", type=click.Path(allow_dash=True)),
    click.argument("source", metavar="NEW", type=click.Path(allow_dash=True)),
    click.option(
        "--max-deviation",
        metavar="LENGTH",
        default="1e-6mm",
        show_default=True,
        help="How far any face or outline may lie from its partner.",
    ),
    click.option("--max-gap-growth", metavar="LENGTH", help="How much wider the gap of any seam may become."),
    click.option(
        "--max-angle-growth",
        metavar="DEG",
        type=click.FloatRange(min=0.0),
        help="How much larger the angle of any seam may become.",
    ),
    click.option(
        "--max-volume-change",
        metavar="PERCENT",
        type=click.FloatRange(min=0.0),
        help="How much of the volume may be gained or lost.",
    ),
    click.option("--ignore", multiple=True, type=click.Choice(LAYERS), help="What may differ in any way; repeatable."),
    options.reports,
    options.printing,
)
def command(
    reference: str,
    source: str,
    max_deviation: str,
    max_gap_growth: str | None,
    max_angle_growth: float | None,
    max_volume_change: float | None,
    ignore: tuple[str, ...],
    junit: str | None,
    sarif: str | None,
    overwrite: bool,
    as_json: bool,
) -> int:
    from mracad_cli.files import check_reports, read

    check_reports(junit, sarif, overwrite=overwrite)
    from mracad.audit.compare import Limits
    from mracad.options import length
    from mracad.review import compare, diagonal
    from mracad_cli.verdicts import emit

    with Progress() as progress:
        progress("reading", 0, 1)
        old, new = read(reference, None), read(source, None)
        size = diagonal(old)
        limits = Limits(
            deviation=length(max_deviation, size, "max-deviation"),
            gap_growth=None if max_gap_growth is None else length(max_gap_growth, size, "max-gap-growth"),
            angle_growth=max_angle_growth,
            volume_change=None if max_volume_change is None else max_volume_change / 100,
        )
        progress("comparing", 0, 1)
        verdict = compare(old, new, limits, ignore)
    return emit(verdict, verdict.failed(), command="compare", as_json=as_json, junit=junit, sarif=sarif)
