"""Run a recipe on many models, each in a worker process with limits. A second run does only what changed.

IN are files, folders (all models below them) or patterns, here or at URLs (s3://, gs://); - reads a list from standard
input. If a file crashes its worker, hangs or needs too much memory, only that file fails. Exit code 1 if any file
failed; run again to continue.
"""

from __future__ import annotations

import os
import sys
import time
from collections import Counter
from collections.abc import Iterator, Sequence
from contextlib import closing, contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from mracad.errors import Code, MracadError, needing
from mracad.formats import FORMATS
from mracad.job.batch.settings import Limits, Settings
from mracad.spec.quantity import MEMORY, TIME
from mracad.store import location
from mracad_cli import options, running
from mracad_cli.command import Unguarded
from mracad_cli.outputs import check_depfile, check_meshes, check_page, check_reports, deliver, depfile_text
from mracad_cli.progress import Progress
from mracad_cli.say import json_text, say, warn
from mracad_cli.steps import needed, plan

if TYPE_CHECKING:
    from mracad.job.batch.find import Item
    from mracad.job.batch.run import Outcome, Workers
    from mracad.spec.recipe import Recipe
    from mracad_cli.render.batch import Pages


@dataclass(frozen=True)
class Place:
    """The output folder, and the workers."""

    folder: str
    format: str | None
    jobs: int | None
    cluster: str | None
    time_limit: float
    memory_limit: float | None


@dataclass(frozen=True)
class Reports:
    """What is printed, and what is written beside the outputs."""

    report: str | None
    report_html: str | None
    junit: str | None
    depfile: str | None
    dry_run: bool
    as_json: bool


_placing = options.gathered(
    "place",
    Place,
    options.option(
        "-O", "--folder", metavar="DIR", required=True, type=options.folder, help="Folder to write into, or its URL."
    ),
    options.option(
        "-j", "--jobs", type=click.IntRange(min=1), metavar="N", help="Number of workers.  [default: one per core]"
    ),
    options.option(
        "--cluster",
        metavar="ADDRESS",
        help="Work on a Dask cluster: tcp://HOST:8786, or local to start one here. Needs mracad[cluster].",
    ),
    options.option(
        "--time-limit",
        type=options.Quantity(TIME),
        default="10min",
        show_default=True,
        help="For each file: 90s, 2h.",
    ),
    options.option(
        "--memory-limit",
        type=options.Quantity(MEMORY),
        help="For each worker: 500MB, 2GB.  [default: its share of the machine]",
    ),
    options.option(
        "--format",
        type=click.Choice(list(FORMATS)),
        help="Format of the outputs, and their extension.  [default: that of each input]",
    ),
)
_settings = options.gathered(
    "settings",
    Settings,
    options.option(
        "--keep-going/--fail-fast", default=True, show_default=True, help="What to do after a file has failed."
    ),
    options.option(
        "--retry",
        type=click.IntRange(min=0),
        default=0,
        show_default=True,
        metavar="N",
        help="How often to try a file again after a crash or a limit.",
    ),
    options.section(options.Title.INPUT, options.input_unit, options.encoding),
    options.section(
        options.Title.OUTPUT, options.schema, options.verify, options.overwrite, options.if_changed, options.record
    ),
    options.meshes,
)
_printing = options.section(
    options.Title.RUNNING,
    options.option("--json", "as_json", is_flag=True, help="Print each result as a JSON line as soon as it is ready."),
    running.telling,
)
_reports = options.gathered(
    "reports",
    Reports,
    options.option("--report", metavar="F.json", type=options.data, help="Write the summary as JSON."),
    options.option(
        "--report-html",
        metavar="F.html",
        type=options.page,
        help="Write an index with pictures, and a page for each file into the folder F_files (HTML).",
    ),
    options.option("--junit", metavar="F.xml", type=options.junit, help="Write the summary as JUnit XML, for CI."),
    options.depfile,
    options.option("--dry-run", is_flag=True, help="List the steps and the files; do nothing."),
)


@click.command(cls=Unguarded, help=__doc__, examples="mracad batch fair.toml models -O out -j 4 --junit batch.xml")
@click.argument("recipe", metavar="RECIPE", type=options.recipe)
@click.argument("sources", metavar="IN...", nargs=-1, required=True, type=options.model)
@options.apply(_placing, options.assignments, _settings, options.section(options.Title.REPORTS, _reports), _printing)
def command(
    recipe: str, sources: Sequence[str], assignments: Sequence[str], place: Place, settings: Settings, reports: Reports
) -> int:
    from mracad.job.batch.find import find
    from mracad.spec.recipe import load

    steps = load(recipe).with_values(assignments)
    steps.steps("model.step")  # errors in it are reported before anything is read
    check_page(reports.report_html)
    if place.cluster:
        with needing("cluster", "no cluster"):
            import distributed  # noqa: F401
    check_reports(reports.report, reports.report_html, reports.junit, reports.depfile, overwrite=True)
    words = [word for given in sources for word in (_listed() if given == "-" else [given])]
    check_depfile(reports.depfile, place.folder, *words)
    folder = location(place.folder)
    items = find(words, folder, place.format or "")
    check_meshes([FORMATS[item.format] for item in items], settings.scalars)
    if not reports.dry_run:
        return _run(steps, items, place, settings, reports)
    listed = {item.source: str(folder / item.output) for item in items}
    planned = plan(steps.steps(items[0].source))
    lines = [*planned, *(f"{source} -> {output}" for source, output in listed.items())]
    deliver({}, [json_text({"plan": planned, "files": listed})] if reports.as_json else lines)
    return 0


def _listed() -> list[str]:
    """The lines of standard input."""
    return [os.fsdecode(line) for line in sys.stdin.buffer.read().splitlines() if line]


def _run(recipe: Recipe, items: Sequence[Item], place: Place, settings: Settings, reports: Reports) -> int:
    """Do a batch, and print the outcome of each file and a summary."""
    from mracad_cli.render import batch, json, junit, text

    start = time.perf_counter()
    pages = batch.Pages.beside(reports.report_html) if reports.report_html else None
    outcomes = _outcomes(recipe, items, place, (settings, pages), reports.as_json)
    seconds = time.perf_counter() - start
    order = {item.output: number for number, item in enumerate(items)}
    outcomes.sort(key=lambda outcome: order[outcome.output])
    counts: Counter[str] = Counter(outcome.status for outcome in outcomes)
    body: dict[str, Any] = {"recipe": recipe.name, "files": len(items), **counts, "seconds": seconds}
    files: dict[str, str | bytes | None] = {}
    if reports.report:
        files[reports.report] = json_text({**body, "each": json.plain(outcomes)}, 1) + "\n"
    if reports.junit:
        files[reports.junit] = junit.batch(recipe.name, outcomes, seconds)
    if reports.depfile:
        files[reports.depfile] = _depfile(recipe, items, Path(place.folder))
    told = text.batch_lines(outcomes, seconds)
    if reports.report_html:
        planned = plan(recipe.steps(items[0].source))
        files[reports.report_html] = batch.index(
            recipe.name, planned, outcomes, told, location(reports.report_html).parent
        )
        told.append(f"wrote {reports.report_html}")
    deliver(files, [json_text({"summary": body})] if reports.as_json else told)
    return 1 if counts["failed"] else 0


def _outcomes(
    recipe: Recipe, items: Sequence[Item], place: Place, how: tuple[Settings, Pages | None], as_json: bool
) -> list[Outcome]:
    """The outcomes of the files, in the order in which they were done."""
    from mracad.job.batch.manifest import Manifest
    from mracad.job.batch.run import run
    from mracad_cli.render.json import plain

    outcomes: list[Outcome] = []
    failed = 0
    with (
        Manifest(location(place.folder)) as manifest,
        _workers(place, len(items)) as executor,
        closing(run(recipe, items, manifest, executor, *how)) as results,
        Progress(rate=True) as progress,
    ):
        try:
            progress(recipe.name, 0, len(items))
            for outcome in results:
                outcomes.append(outcome)
                for warning in outcome.warnings:
                    warn(f"{outcome.file}: {warning}")
                if as_json and outcome.status != "not tried":
                    say(json_text(plain(outcome)))
                failed += outcome.status == "failed"
                progress(f"{recipe.name}, {failed} failed" if failed else recipe.name, len(outcomes), len(items))
        except KeyboardInterrupt:
            said = f"interrupted after {len(outcomes)} of {len(items)} files"
            raise MracadError(said, "run it again to continue", Code.INTERRUPTED) from None
    return outcomes


@contextmanager
def _workers(place: Place, files: int) -> Iterator[Workers]:
    """The executor of a batch."""
    from mracad.job.batch.cluster import Cluster
    from mracad.job.batch.pool import Pool
    from mracad.job.batch.work import warm

    workers = min(place.jobs or os.cpu_count() or 1, files)
    limits = Limits(place.time_limit, int(place.memory_limit or 0))
    with Cluster(place.cluster, limits, workers) if place.cluster else Pool(workers, limits, warm) as executor:
        yield executor


def _depfile(recipe: Recipe, items: Sequence[Item], folder: Path) -> str:
    """One make rule per output."""
    return "".join(
        depfile_text([str(folder / item.output)], [item.source, *needed(recipe.steps(item.source), recipe)])
        for item in items
    )
