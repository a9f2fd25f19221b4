"""Commands that take a model through steps: read once, do the steps, write once, report."""

from __future__ import annotations

import json
import time
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click
from msgspec import structs

from mracad.options import STEPS, Selection
from mracad_cli import options
from mracad_cli.files import Outputs, depfile_text, load, read, write_text
from mracad_cli.progress import Progress

if TYPE_CHECKING:
    from mracad.occ import Document
    from mracad.recipe import Recipe, Step


def edits() -> list[str]:
    """The edits among the steps: each is a command, too."""
    return [use for use, struct in STEPS.items() if issubclass(struct, Selection)]


def edit_command(use: str) -> click.Command:
    """The command of an edit, from its declaration."""
    struct = STEPS[use]

    @click.command(use, help=struct.__doc__)
    @options.apply(options.reading, options.of(struct), options.writing, options.editing, options.printing)
    def command(source: str, **given: Any) -> int:
        from mracad.recipe import Step
        from mracad.recipe import options as options_of

        values = {name: given.pop(name) for name in struct.__struct_fields__}
        return run_steps([Step(use, use, options_of(struct, values))], source, **given)

    return command


def run_recipe(recipe: Recipe, source: str, *, assignments: tuple[str, ...] = (), **given: Any) -> int:
    """Take one file through a recipe; see :mod:`mracad_cli.options` for the parameters."""
    return run_steps(recipe.with_values(assignments).steps(source), source, recipe=recipe, **given)


def run_steps(
    steps: Sequence[Step],
    source: str,
    *,
    recipe: Recipe | None = None,
    input_unit: str | None,
    outputs: tuple[str, ...],
    report: str | None,
    depfile: str | None,
    record: bool = False,
    dry_run: bool,
    as_json: bool,
    **formats: Any,
) -> int:
    """Take one file through steps; without a recipe they are the one edit of a command."""
    from mracad.recipe import record_of, title
    from mracad_cli import render

    start = time.perf_counter()
    targets = Outputs(outputs, needed=not dry_run, **formats)
    for path in (report, depfile, *(targets.records() if record else ())):
        if path:
            targets.check_report(path)
    if recipe and dry_run and not as_json:
        for line in plan(steps):
            targets.say(line)
    with Progress() as progress:
        progress("reading", 0, 1)
        text = load(source)
        document = read(text, input_unit)
        from mracad import job

        def original() -> Document:
            return read(text, input_unit)

        results = job.play(document, steps, original=original, progress=progress, apply=not dry_run)
        failed = isinstance(results[-1], job.Judged) and not results[-1].passed
        written = not (dry_run or failed)
        if written:
            progress("writing", 0, 1)
            targets.write(document, title(steps))
    if written and record:
        for path in targets.records():
            write_text(Path(path), record_of(steps))
    if written and depfile:
        needs = [source] * (source != "-") + needed(steps, recipe)
        write_text(Path(depfile), depfile_text(targets.files(), needs))
    parts = [render.result(result) for result in results]
    for part, step in zip(parts, steps, strict=False):
        part["options"] = structs.asdict(step.options)
    ends = {"written": targets.names() if written else [], "lost": render.plain(targets.lost)}
    if recipe:
        named = [{"step": s.id, "use": s.use, **part} for s, part in zip(steps, parts, strict=False)]
        body: dict[str, Any] = {"file": document.name, "steps": named, **ends}
    else:
        body = {**parts[0], **ends}
    if report:
        write_text(Path(report), json.dumps(body, indent=1, ensure_ascii=False) + "\n")
    end = f"wrote {targets.sizes()}" if written else f"{'dry run, ' if dry_run else ''}nothing written"
    end += "" if dry_run else f", {time.perf_counter() - start:.1f} s"
    if as_json:
        targets.say(json.dumps(body, ensure_ascii=False))
    elif recipe:
        for step, result in zip(steps, results, strict=False):
            for line in render.step_lines(step, result):
                targets.say(line)
        targets.say(end)
    else:
        for line in render.edit_lines(results[0], steps[0].options, end):  # type: ignore[arg-type]  # it is an edit
            targets.say(line)
    return 1 if failed else 0


def plan(steps: Sequence[Step]) -> list[str]:
    """What would be done, a line for each step."""
    return [f"{i}. {step.id}: {step.text()}" for i, step in enumerate(steps, 1)]


def needed(steps: Sequence[Step], recipe: Recipe | None) -> list[str]:
    """The files beside the model that the result depends on."""
    own = [str(recipe.file)] if recipe and recipe.file else []
    return [*own, *(file for step in steps for file in step.options.files())]
