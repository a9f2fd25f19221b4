"""Tables made of the records of reports: every cell knows the value that it shows."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

MOST = 2000
"""Largest number of rows."""

FLOOR = 1e-9
"""Millimetres or degrees that count as 0 where they are shown."""

NOTHING = "–"
"""What stands for a value that there is not."""


@dataclass(frozen=True)
class Column:
    """A column.

    Attributes
    ----------
    title : str
    key : str
        Where its values are in the records; keys and positions in what these hold follow after dots.
    sign : str
        What stands before numbers: ``"#"`` of faces.
    link : str
        Where the addresses are that its cells lead to.
    height : int
        Of its values where they are lists of pictures, pixels; 0 for text.
    unit : {"", "s"}
        What its numbers are.
    marked : bool
        Whether its cells take the colours of what they say.
    """

    title: str
    key: str
    sign: str = ""
    link: str = ""
    height: int = 0
    unit: str = ""
    marked: bool = False

    @property
    def floor(self) -> float:
        """Numbers below are shown as 0: of lengths and angles they are rounding errors."""
        return FLOOR if self.title.endswith((", mm", ", °")) else 0.0


@dataclass(frozen=True)
class Cell:
    """What stands in a cell, the exact value where it is a number, where it leads to, its pictures, and the class of
    its style."""

    text: str
    value: int | float | None = None
    link: str = ""
    pictures: Sequence[str] = ()
    height: int = 0
    mark: str = ""

    @property
    def exact(self) -> str:
        """The value as JSON has it."""
        return repr(self.value)


@dataclass(frozen=True)
class Table:
    """Records as rows.

    Attributes
    ----------
    name : str
        Identifies it in the page.
    title : str
    columns : sequence of Column
    records : sequence of mapping
        As in the report that is JSON.
    """

    name: str
    title: str
    columns: Sequence[Column]
    records: Sequence[Mapping[str, Any]]

    @cached_property
    def shown(self) -> list[Column]:
        """The columns that hold anything."""
        return [
            each for each in self.columns if any(_at(record, each.key) not in (None, "", []) for record in self.records)
        ]

    @cached_property
    def rows(self) -> list[list[Cell]]:
        """The cells of the first rows."""
        return [[_cell(record, each) for each in self.shown] for record in self.records[:MOST]]

    @cached_property
    def heads(self) -> list[tuple[Column, bool]]:
        """The columns that hold anything, and whether that is numbers."""
        columns = zip(*self.rows, strict=True)
        return [
            (head, any(c.value is not None for c in cells)) for head, cells in zip(self.shown, columns, strict=True)
        ]

    @property
    def left_out(self) -> int:
        """The number of records that have no row."""
        return max(len(self.records) - MOST, 0)


def _cell(record: Mapping[str, Any], column: Column) -> Cell:
    value, link = _at(record, column.key), (_at(record, column.link) or "") if column.link else ""
    if column.height:
        return Cell("", None, link, value or (), column.height)
    shown = cell(value, column.sign)
    if shown.value is not None and abs(shown.value) < column.floor:
        shown = replace(shown, text=f"{column.sign}0")
    if shown.value is not None and column.unit == "s":
        shown = replace(shown, text=f"{shown.value:.{0 if shown.value >= 9.95 else 1}f} s")
    return replace(shown, link=link, mark=shown.text.replace(" ", "-") if column.marked else "")


def cell(value: Any, sign: str = "") -> Cell:
    """A value as it is shown: numbers with five significant digits, lists of them with their signs."""
    if value is None or (isinstance(value, float) and not math.isfinite(value)):
        return Cell(NOTHING)
    if isinstance(value, bool):
        return Cell("yes" if value else "no")
    if isinstance(value, int | float):
        return Cell(sign + _number(value), value)
    if isinstance(value, list | tuple):
        return Cell((" " if sign else " × ").join(cell(each, sign).text for each in value))
    return Cell(str(value))


def _number(value: int | float) -> str:
    text = str(value) if isinstance(value, int) else f"{value:.5g}"
    return text.replace("-", "−")


def _at(record: Any, key: str) -> Any:
    for part in key.split("."):
        if isinstance(record, list | tuple):
            record = record[int(part)]
        else:
            record = record.get(part) if isinstance(record, Mapping) else None
    return record
