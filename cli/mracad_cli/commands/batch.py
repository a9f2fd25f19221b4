"""Take many models through a recipe, each in a worker process within limits; done again, only what changed.

IN are files, folders (all models below them) or patterns; - reads a list from standard input. A file that crashes
its worker, hangs or takes too much memory fails alone. Exit code 1 when any file failed; run again to go on.
"""

from __future__ import annotations

from typing import Any

import click

from mracad.formats import FORMATS
from mracad_cli import options


@click.command(help=__doc__)
@click.argument("recipe", metavar="RECIPE", type=click.Path())
@click.argument("sources", metavar="IN...", nargs=-1, required=True)
@options.apply(
    click.option("-O", "--folder", metavar="DIR", required=True, type=click.Path(), help="Folder to write into."),
    options.assignments,
    click.option("-j", "--jobs", type=click.IntRange(min=1), metavar="N", help="Workers.  [default: one a core]"),
    click.option(
        "--cluster",
        metavar="ADDRESS",
        help="Work on a Dask cluster: tcp://HOST:8786, or local to start one here. Needs mracad[cluster].",
    ),
    click.option("--time-limit", metavar="TIME", default="10min", show_default=True, help="For each file: 90s, 2h."),
    click.option(
        "--memory-limit", metavar="SIZE", help="For each worker: 500MB, 2GB.  [default: its share of the machine]"
    ),
    click.option(
        "--keep-going/--fail-fast", default=True, show_default=True, help="What to do after a file has failed."
    ),
    click.option(
        "--retry",
        type=click.IntRange(min=0),
        default=0,
        show_default=True,
        metavar="N",
        help="Try a file again after a crash or a limit.",
    ),
    options.input_unit,
    options.encoding,
    click.option(
        "--format",
        type=click.Choice(list(FORMATS)),
        help="Format of the outputs, and their ending.  [default: that of each input]",
    ),
    options.schema,
    options.verify,
    options.overwrite,
    options.if_changed,
    options.record,
    click.option("--report", metavar="F.json", type=click.Path(), help="Write the summary as JSON."),
    click.option("--junit", metavar="F.xml", type=click.Path(), help="Write the summary as JUnit XML, for CI."),
    click.option("--depfile", metavar="F.d", type=click.Path(), help="Write what the outputs depend on, for make."),
    click.option("--dry-run", is_flag=True, help="List the steps and the files; do nothing."),
    click.option("--json", "as_json", is_flag=True, help="Print each result as a JSON line when it is there."),
    options.debug,
)
def command(recipe: str, sources: tuple[str, ...], assignments: tuple[str, ...], **given: Any) -> int:
    from mracad.spec.recipe import load
    from mracad_cli.batches import run_batch

    return run_batch(load(recipe).with_values(assignments), sources, **given)
