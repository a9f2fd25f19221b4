"""What every editing command does around its edit: read, run, write, report."""

from __future__ import annotations

import json
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import msgspec

from mracad.options import Selection
from mracad_cli import render
from mracad_cli.files import Outputs, read, write_text
from mracad_cli.progress import Progress


def run_edit(
    edit: Callable[..., Any],
    words: Selection,
    source: str,
    *,
    done: str,
    quiet: str,
    input_unit: str | None,
    outputs: tuple[str, ...],
    overwrite: bool,
    report: str | None,
    dry_run: bool,
    as_json: bool,
    **formats: Any,
) -> int:
    """Run one edit on one file; see :mod:`mracad_cli.options` for the parameters."""
    start = time.perf_counter()
    targets = Outputs(outputs, overwrite=overwrite, **formats)
    if report:
        targets.check_report(report)
    with Progress() as progress:
        progress("reading", 0, 1)
        document = read(source, input_unit)
        from mracad import job

        result = job.run(document, edit, words, progress=progress, apply=not dry_run)
        if not dry_run:
            progress("writing", 0, 1)
            targets.write(document, title(words))
    body = {
        **render.report(result),
        "options": msgspec.to_builtins(words),
        "written": [] if dry_run else targets.names(),
    }
    if report:
        write_text(Path(report), json.dumps(body, indent=1, ensure_ascii=False) + "\n")
    if as_json:
        targets.say(json.dumps(body, ensure_ascii=False))
        return 0
    written = "dry run, nothing written" if dry_run else f"wrote {targets.sizes()}, {time.perf_counter() - start:.1f} s"
    for line in render.edit_lines(result, done, quiet, written):
        targets.say(line)
    return 0


def title(words: Selection) -> str:
    """The options that were given, for the header of the file: no paths, no machine."""
    given = [
        f"{name.replace('_', '-')}={','.join(value) if isinstance(value, tuple) else value}"
        for name, value in msgspec.to_builtins(words).items()
        if value not in (None, (), [], False)
    ]
    return f"{type(words).__name__.lower()} {' '.join(given)}"
