"""The index of the pages about many files."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from mracad.report.page import Verdict, rendered
from mracad.report.table import Column, Table

HEIGHT = 48
"""Of the pictures in rows, pixels."""

COLUMNS = (
    Column("Pictures", "pictures", link="link", height=HEIGHT),
    Column("File", "file", link="link"),
    Column("Status", "status", marked=True),
    Column("Exit code", "code"),
    Column("Valid", "valid"),
    Column("Faces edited", "edited"),
    Column("NURBS faces", "faces"),
    Column("Largest deviation, mm", "deviation"),
    Column("Time", "seconds", unit="s"),
    Column("Attempts", "attempts"),
    Column("Message", "message"),
)
"""What rows say."""


@dataclass(frozen=True)
class Index:
    """What is said of many files.

    Attributes
    ----------
    title : str
    asked : sequence of (str, str)
        What was asked, by name.
    lines : sequence of str
        What the command line said.
    verdicts : sequence of Verdict
    records : sequence of mapping
        A row each: values by the keys of ``COLUMNS``, and ``link``, the address of the page about the file.
    """

    title: str
    asked: Sequence[tuple[str, str]]
    lines: Sequence[str]
    verdicts: Sequence[Verdict]
    records: Sequence[Mapping[str, Any]]
    kind: str = "Batch report"

    @property
    def table(self) -> Table:
        return Table("files", "Files", COLUMNS, self.records)


def html(index: Index) -> bytes:
    """An index as one HTML file, which leads to the pages."""
    return rendered("index.html", index)
