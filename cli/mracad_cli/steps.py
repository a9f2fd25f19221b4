"""Commands that take a model through steps: read once, do the steps, write once, report."""

from __future__ import annotations

import time
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import click
from msgspec import structs

from mracad.spec.steps import STEPS, Selection
from mracad_cli import options
from mracad_cli.files import Outputs, depfile_text, load, read
from mracad_cli.progress import Progress

if TYPE_CHECKING:
    from mracad.job.document import Report
    from mracad.job.judge import Judged
    from mracad.spec.recipe import Recipe, Step


def edits() -> list[str]:
    """The edits among the steps: each is a command, too."""
    return [use for use, struct in STEPS.items() if issubclass(struct, Selection)]


def edit_command(use: str) -> click.Command:
    """The command of an edit, from its declaration."""
    struct = STEPS[use]

    @click.command(use, help=struct.__doc__)
    @options.apply(options.reading, options.of(struct), options.writing, options.editing, options.printing)
    def command(source: str, **given: Any) -> int:
        from mracad.spec.recipe import Step
        from mracad.spec.text import options as options_of

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
    encoding: str | None,
    outputs: tuple[str, ...],
    report: str | None,
    depfile: str | None,
    record: bool = False,
    dry_run: bool,
    as_json: bool,
    **formats: Any,
) -> int:
    """Take one file through steps; without a recipe they are the one edit of a command."""
    from mracad.spec.recipe import record_of, title
    from mracad_cli import render

    start = time.perf_counter()
    places = [f"{path}.toml" for path in outputs if record and path != "-"]
    targets = Outputs(outputs, needed=not dry_run, beside=(report, depfile, *places), **formats)
    records = {place: record_of(steps, place) for place in places}
    with Progress() as progress:
        progress("reading", 0, 1)
        text = load(source)
        document = read(text, input_unit, encoding)
        from mracad.job.produce import produce
        from mracad.occ.files import read as read_again

        done = produce(
            document,
            lambda: read_again(text, input_unit, encoding),
            steps,
            () if dry_run else targets.targets(),
            title=title(steps),
            verify=targets.verify,
            progress=progress,
        )
    targets.take(done.made)
    body = _body(document.name, steps, done.results, recipe)
    body |= {"warnings": document.warnings, **targets.body()}
    files: dict[str, str | None] = {report: render.json_text(body, 1) + "\n"} if report else {}
    if done.made:
        files |= records
        needs = [source] * (source != "-") + needed(steps, recipe)
        files |= {depfile: depfile_text(targets.files(), needs)} if depfile else {}
    end = f"wrote {targets.sizes()}" if done.made else f"{'dry run, ' if dry_run else ''}nothing written"
    end += "" if dry_run else f", {time.perf_counter() - start:.1f} s"
    found = render.found(done.made)
    if as_json:
        lines = [render.json_text(body)]
    elif recipe:
        told = [
            line for step, result in zip(steps, done.results, strict=False) for line in render.step_lines(step, result)
        ]
        lines = [*(plan(steps) if dry_run else []), *told, f"valid: {found.words}; {end}" if found else end]
    else:
        lines = render.edit_lines(done.results[0], steps[0].options, end, found)  # type: ignore[arg-type]  # it is an edit
    targets.deliver(files, lines)
    return 0 if done.passed else 1


def _body(
    name: str, steps: Sequence[Step], results: Sequence[Report | Judged], recipe: Recipe | None
) -> dict[str, Any]:
    """The full report: that of an edit, or with a recipe that of each step."""
    from mracad_cli import render

    parts = [
        {**render.result(result), "options": structs.asdict(step.options)}
        for step, result in zip(steps, results, strict=False)
    ]
    if not recipe:
        return parts[0]
    named = [{"step": s.id, "use": s.use, **part} for s, part in zip(steps, parts, strict=False)]
    return {"file": name, "steps": named}


def plan(steps: Sequence[Step]) -> list[str]:
    """What would be done, a line for each step."""
    return [f"{i}. {step.id}: {step.text()}" for i, step in enumerate(steps, 1)]


def needed(steps: Sequence[Step], recipe: Recipe | None) -> list[str]:
    """The files beside the model that the result depends on."""
    own = [str(recipe.file)] if recipe and recipe.file else []
    return [*own, *(file for step in steps for file in step.options.files())]
