"""The command ``batch``: what it says while files are done, and at the end."""

from __future__ import annotations

import os
import sys
import time
from collections import Counter
from collections.abc import Sequence
from contextlib import closing
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import msgspec

from mracad.errors import Code, MracadError
from mracad.job.batch.cluster import Cluster
from mracad.job.batch.find import Item, find
from mracad.job.batch.manifest import Manifest
from mracad.job.batch.pool import Limits, Pool
from mracad.job.batch.run import Outcome, Settings, run
from mracad.job.batch.work import warm
from mracad.job.guard import size
from mracad.spec.quantity import duration
from mracad.spec.recipe import Recipe
from mracad_cli.files import check_reports, deliver, depfile_text
from mracad_cli.progress import Progress
from mracad_cli.render import json_text, say
from mracad_cli.steps import needed, plan
from mracad_cli.verdicts import clean


def run_batch(
    recipe: Recipe,
    sources: Sequence[str],
    *,
    folder: str,
    jobs: int | None,
    cluster: str | None,
    time_limit: str,
    memory_limit: str | None,
    keep_going: bool,
    retry: int,
    input_unit: str | None,
    encoding: str | None,
    format: str | None,
    schema: str | None,
    verify: str,
    overwrite: bool,
    if_changed: bool,
    record: bool,
    report: str | None,
    junit: str | None,
    depfile: str | None,
    dry_run: bool,
    as_json: bool,
) -> int:
    """Take many files through a recipe; see :mod:`mracad_cli.commands.batch` for the parameters."""
    recipe.steps("model.step")  # what is wrong in it is said before anything is read
    settings = Settings(
        input_unit,
        encoding,
        (schema or "").upper(),
        verify == "on",
        overwrite,
        if_changed,
        record,
        retry,
        fail_fast=not keep_going,
    )
    limits = Limits(duration(time_limit, "time-limit"), size(memory_limit) if memory_limit else 0)
    check_reports(report, junit, depfile, overwrite=True)
    words = [word for given in sources for word in (_listed() if given == "-" else [given])]
    items = find(words, Path(folder), format or "")
    if dry_run:
        listed = {item.source: str(Path(folder, item.output)) for item in items}
        planned = plan(recipe.steps(items[0].source))
        lines = [*planned, *(f"{source} -> {output}" for source, output in listed.items())]
        deliver({}, [json_text({"plan": planned, "files": listed})] if as_json else lines)
        return 0
    workers = min(jobs or os.cpu_count() or 1, len(items))
    start = time.perf_counter()
    outcomes: list[Outcome] = []
    failed = 0
    with (
        Manifest(Path(folder)) as manifest,
        Cluster(cluster, limits, workers) if cluster else Pool(workers, limits, warm) as executor,
        closing(run(recipe, items, manifest, executor, settings)) as results,
        Progress(rate=True) as progress,
    ):
        try:
            progress(recipe.name, 0, len(items))
            for outcome in results:
                outcomes.append(outcome)
                for warning in outcome.warnings:
                    say(f"warning: {outcome.file}: {warning}", file=sys.stderr)
                if as_json and outcome.status != "not tried":
                    say(json_text(msgspec.to_builtins(outcome)))
                    sys.stdout.flush()
                failed += outcome.status == "failed"
                progress(f"{recipe.name}, {failed} failed" if failed else recipe.name, len(outcomes), len(items))
        except KeyboardInterrupt:
            text = f"interrupted after {len(outcomes)} of {len(items)} files"
            raise MracadError(text, "run it again to go on", Code.INTERRUPTED) from None
    place = {item.output: number for number, item in enumerate(items)}
    outcomes.sort(key=lambda outcome: place[outcome.output])
    seconds = time.perf_counter() - start
    counts = Counter(outcome.status for outcome in outcomes)
    body: dict[str, Any] = {
        "recipe": recipe.name,
        "files": len(items),
        **{str(k): n for k, n in counts.items()},
        "seconds": seconds,
    }
    files: dict[str, str] = {}
    if report:
        files[report] = json_text({**body, "each": msgspec.to_builtins(outcomes)}, 1) + "\n"
    if junit:
        files[junit] = junit_text(recipe.name, outcomes, seconds)
    if depfile:
        files[depfile] = _depfile(recipe, items, Path(folder))
    deliver(files, [json_text({"summary": body})] if as_json else summary(outcomes, seconds))
    return 1 if failed else 0


def _listed() -> list[str]:
    """The lines of standard input."""
    return [os.fsdecode(line) for line in sys.stdin.buffer.read().splitlines() if line]


def summary(outcomes: Sequence[Outcome], seconds: float) -> list[str]:
    """The batch in a line, and one for each file that failed."""
    counts = Counter(outcome.status for outcome in outcomes)
    parts = [f"{counts[status]} {status}" for status in ("done", "unchanged", "failed", "not tried") if counts[status]]
    lines = [f"{len(outcomes)} file{'s' * (len(outcomes) != 1)}: {', '.join(parts)}; {seconds:.1f} s"]
    failed = [outcome for outcome in outcomes if outcome.status == "failed"]
    return lines + [f"failed: {o.file}: {o.message}" + (f"; {o.hint}" if o.hint else "") for o in failed]


def junit_text(name: str, outcomes: Sequence[Outcome], seconds: float) -> str:
    """The batch as a JUnit report: a failure is a check that did not hold, an error anything else."""
    counts = Counter("failure" if o.code == 1 else "error" for o in outcomes if o.status == "failed")
    skipped = sum(o.status == "not tried" for o in outcomes)
    totals = {"tests": len(outcomes), "failures": counts["failure"], "errors": counts["error"], "skipped": skipped}
    shared: dict[str, str] = {key: str(value) for key, value in totals.items()} | {"time": f"{seconds:.3f}"}
    root = ElementTree.Element("testsuites", shared)
    suite = ElementTree.SubElement(root, "testsuite", {"name": name, **shared})
    for outcome in outcomes:
        case = ElementTree.SubElement(
            suite, "testcase", {"classname": name, "name": clean(outcome.file), "time": f"{outcome.seconds:.3f}"}
        )
        if outcome.status == "failed":
            tag = "failure" if outcome.code == 1 else "error"
            ElementTree.SubElement(
                case, tag, {"message": clean(outcome.message), "type": str(outcome.code)}
            ).text = clean(outcome.hint)
        elif outcome.status == "not tried":
            ElementTree.SubElement(case, "skipped", {"message": "the batch stopped before"})
        elif outcome.status == "unchanged":
            ElementTree.SubElement(case, "system-out").text = "unchanged"
    ElementTree.indent(root)
    return '<?xml version="1.0" encoding="utf-8"?>\n' + ElementTree.tostring(root, encoding="unicode") + "\n"


def _depfile(recipe: Recipe, items: Sequence[Item], folder: Path) -> str:
    """A rule for make for each output."""
    return "".join(
        depfile_text([str(folder / item.output)], [item.source, *needed(recipe.steps(item.source), recipe)])
        for item in items
    )
