"""Pages about the files of a batch, and their index."""

from __future__ import annotations

import os
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any
from urllib.parse import quote

from mracad.errors import FileError
from mracad.store import Location, location

if TYPE_CHECKING:
    from mracad.job.batch.run import Outcome
    from mracad.job.produce import Production
    from mracad.occ.document import Document
    from mracad.spec.recipe import Step

FIRST = "failed", "not tried", "done", "unchanged"
"""The order of rows."""


@dataclass(frozen=True)
class Pages:
    """Pages in a folder beside their index, with the names of the outputs; workers draw them.

    Attributes
    ----------
    folder : Path or Url
    """

    folder: Location

    @classmethod
    def beside(cls, index: str) -> Pages:
        """Pages for an index, in a folder that is made if needed; raises FileError."""
        path = location(index)
        folder = path.with_name(f"{path.stem}_files")
        try:
            folder.mkdir(exist_ok=True)
        except OSError as error:
            hint = "choose another name for the report"
            raise FileError(f"cannot make a folder {folder} for the pages: {error.strerror}", hint) from error
        return cls(folder)

    def place(self, output: str) -> Location:
        """The page about an output."""
        return self.folder / f"{output}.html"

    def made(self, output: str, key: str) -> bool:
        """Whether there is a page of the work with this key."""
        from mracad.report.page import row_of

        return row_of(self.place(output)).get("key") == key

    def draw(self, before: Document, steps: Sequence[Step], done: Production, key: str) -> bytes:
        """The page about a file that was taken through steps."""
        from mracad_cli.render import json, pages

        body = json.steps(before.name, steps, done, single=False)
        return pages.edited(before, done.document, steps, done, body, key)


def index(
    recipe: str, asked: Sequence[str], outcomes: Sequence[Outcome], lines: Sequence[str], beside: Location
) -> bytes:
    """The index of the pages about the files of a batch.

    Parameters
    ----------
    recipe : str
    asked : sequence of str
        The steps.
    outcomes : sequence of Outcome
    lines : sequence of str
        What the command line says.
    beside : Path or Url
        The folder of the index.
    """
    from mracad.report.index import Index, html
    from mracad.report.page import Verdict
    from mracad.spec.recipe import versions

    counts: Counter[str] = Counter(outcome.status for outcome in outcomes)
    told = ", ".join(f"{counts[status]} {status}" for status in FIRST if counts[status])
    ordered = sorted(outcomes, key=lambda outcome: FIRST.index(outcome.status))
    return html(
        Index(
            title=recipe,
            asked=[("Recipe", recipe), *(("Step", step) for step in asked), *versions().items()],
            lines=lines,
            verdicts=[Verdict("files", told, not (counts["failed"] or counts["not tried"]))],
            records=[_record(outcome, beside) for outcome in ordered],
        )
    )


def _record(outcome: Outcome, beside: Location) -> dict[str, Any]:
    """A row: what became of a file, and what its page says of it."""
    from mracad.report.page import row_of

    done = outcome.status in ("done", "unchanged")
    said = [outcome.message, outcome.hint, *(f"warning: {each}" for each in outcome.warnings)]
    return {
        **(row_of(location(outcome.page)) if outcome.page else {}),
        "link": address(outcome.page, beside) if outcome.page else "",
        "file": outcome.file,
        "status": outcome.status,
        "code": outcome.code if done or outcome.status == "failed" else None,
        "seconds": outcome.seconds or None,
        "attempts": outcome.attempts if outcome.attempts > 1 else None,
        "message": "; ".join(filter(None, said)),
    }


def address(page: str, beside: Location) -> str:
    """The address of a page, seen from a folder above it."""
    return quote(os.fsencode(Path(os.path.relpath(page, str(beside))).as_posix()))
