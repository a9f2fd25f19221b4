"""Commands that take a model through steps: read once, do the steps, write once, report."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

import click

from mracad.spec.steps import STEPS, Options
from mracad_cli import options, running
from mracad_cli.command import Command
from mracad_cli.options import Editing, Reading, Writing
from mracad_cli.outputs import (
    check_depfile,
    check_outputs,
    check_page,
    deliver_models,
    depfile_text,
    load,
    read,
    read_silently,
)
from mracad_cli.progress import Progress
from mracad_cli.say import json_text

if TYPE_CHECKING:
    from mracad.job.document import Report
    from mracad.job.output import Target
    from mracad.job.produce import Production
    from mracad.occ.document import Document
    from mracad.occ.load import Text
    from mracad.spec.recipe import Recipe, Step


def edit_command(use: str) -> click.Command:
    """The command of an edit, from its declaration."""
    struct = STEPS[use]

    @click.command(use, cls=Command, help=struct.__doc__, examples=struct.example)
    @options.apply(options.reading(), options.of(struct, "chosen"), options.writing, options.editing, running.printing)
    def command(chosen: Options, **how: Any) -> int:
        return run_edit(use, chosen, **how)

    return command


def run_edit(
    use: str,
    chosen: Options,
    reading: Reading,
    writing: Writing,
    editing: Editing,
    beside: Mapping[str, Callable[[Report], bytes]] = MappingProxyType({}),
) -> int:
    """Do one edit on one file; files ``beside`` the models are made of its report."""
    from mracad.spec.recipe import Step

    return run_steps([Step(use, use, chosen)], reading, writing, editing, beside=beside)


def run_recipe(
    recipe: Recipe, reading: Reading, writing: Writing, editing: Editing, assignments: Sequence[str] = ()
) -> int:
    """Take one file through a recipe."""
    return run_steps(recipe.with_values(assignments).steps(reading.file), reading, writing, editing, recipe)


def run_steps(
    steps: Sequence[Step],
    reading: Reading,
    writing: Writing,
    editing: Editing,
    recipe: Recipe | None = None,
    beside: Mapping[str, Callable[[Report], bytes]] = MappingProxyType({}),
) -> int:
    """Take one file through steps; without a recipe they are the one edit of a command."""
    from mracad.spec.recipe import record_of
    from mracad_cli.render import json

    start = time.perf_counter()
    places = [f"{path}.toml" for path in writing.outputs if editing.record and path != "-"]
    check_page(editing.report_html)
    check_depfile(editing.depfile, reading.file, *writing.outputs)
    others = (editing.report, editing.report_html, editing.depfile, *places, *beside)
    targets = check_outputs(writing, others, dry=editing.dry_run)
    records = {place: record_of(steps, place) for place in places}
    text = load(reading.file)
    document, done = produced(reading, text, writing, [] if editing.dry_run else targets, steps)
    body = json.steps(document.name, steps, done, single=recipe is None)
    body |= {"warnings": document.warnings, **json.written(done.made)}
    files: dict[str, str | bytes | None] = {editing.report: json_text(body, 1) + "\n"} if editing.report else {}
    if done.made:
        files |= records
        files |= {path: make(done.results[0]) for path, make in beside.items()}  # type: ignore[arg-type]  # it is an edit
        needs = [reading.file, *needed(steps, recipe), *writing.picture.files(), *writing.scalars.files()]
        files |= {editing.depfile: depfile_text(writing.outputs, needs)} if editing.depfile else {}
    if editing.report_html:
        from mracad_cli.render import pages

        before = read_silently(reading, text)
        files[editing.report_html] = pages.edited(before, None if editing.dry_run else done.document, steps, done, body)
    seconds = None if editing.dry_run else time.perf_counter() - start
    lines = [json_text(body)] if editing.as_json else _lines(steps, done, recipe, seconds, editing.report_html)
    deliver_models(writing, done.made, files, lines)
    return 0 if done.passed else 1


def produced(
    reading: Reading, text: Text, writing: Writing, targets: Sequence[Target], steps: Sequence[Step]
) -> tuple[Document, Production]:
    """Read a document and take it through steps; returns the document and what was produced from it."""
    with Progress() as progress:
        progress("reading", 0, 1)
        document = read(reading, text)
        from mracad.job.produce import produce

        return document, produce(
            document,
            lambda: read_silently(reading, text),
            steps,
            targets,
            verify=writing.verify,
            progress=progress,
        )


def _lines(
    steps: Sequence[Step], done: Production, recipe: Recipe | None, seconds: float | None, page: str | None
) -> list[str]:
    """The lines to print after steps; ``seconds`` is None for a dry run."""
    from mracad_cli.render import text

    end = f"wrote {text.sizes(done.made)}" if done.made else f"{'no model' if page else 'nothing'} written"
    end += f", report {page}" if page else ""
    end = f"dry run, {end}" if seconds is None else f"{end}, {seconds:.1f} s"
    found = text.found(done.made)
    if not recipe:
        return text.edit_lines(done.results[0], steps[0].options, end, found)  # type: ignore[arg-type]  # it is an edit
    told = [line for step, result in zip(steps, done.results, strict=False) for line in text.step_lines(step, result)]
    return [*(plan(steps) if seconds is None else []), *told, f"valid: {found.words}; {end}" if found else end]


def plan(steps: Sequence[Step]) -> list[str]:
    """What would be done, one line per step."""
    return [f"{i}. {step.id}: {step.text()}" for i, step in enumerate(steps, 1)]


def needed(steps: Sequence[Step], recipe: Recipe | None) -> list[str]:
    """The files beside the model that the result depends on."""
    own = [str(recipe.file)] if recipe and recipe.file else []
    return [*own, *(file for step in steps for file in step.options.files())]
