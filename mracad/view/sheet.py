"""Panels on a sheet: where they go, their captions and numbers, and what explains them."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from PIL import Image

from mracad.view.labels import Label, placed
from mracad.view.legend import HALO, TONE, Box, Legend, Pen
from mracad.view.panel import Panel

Numbers = Callable[[Panel], tuple[list[Label], int]]
"""The numbers on a panel, and how many have no room from the start."""


def boxes(size: tuple[int, int], rows: int, columns: int, strip: int) -> list[Box]:
    """The places of panels, row by row, beside a strip of some width."""
    across = np.linspace(0, size[0] - strip, columns + 1).round().astype(int)
    down = np.linspace(0, size[1], rows + 1).round().astype(int)
    return [
        (int(x), int(y), int(right - x), int(bottom - y))
        for y, bottom in pairwise(down)
        for x, right in pairwise(across)
    ]


def grid(count: int, size: tuple[int, int]) -> tuple[int, int]:
    """Rows and columns that give a number of panels the most square shape."""

    def room(columns: int) -> float:
        return min(size[0] / columns, size[1] / -(-count // columns))

    columns = max(range(1, count + 1), key=lambda n: (room(n), -n))
    return -(-count // columns), columns


@dataclass(frozen=True, eq=False)
class Pane:
    """A place on a sheet with a panel, or with parts of two side by side, and captions of these."""

    box: Box
    panels: Sequence[Panel]
    captions: Sequence[str]

    @property
    def parts(self) -> list[tuple[int, int]]:
        """The columns of pixels of each panel."""
        ends = np.linspace(0, self.box[2], len(self.panels) + 1).round().astype(int).tolist()
        return list(pairwise(ends))


def drawn(
    size: tuple[int, int], panes: Sequence[Pane], legend: Legend, numbers: Numbers | None, noun: str
) -> Image.Image:
    """The sheet; ``noun`` is what has ``numbers``."""
    pen = Pen.on(Image.new("RGB", size, "white"))
    for pane in panes:
        left, top, _, height = pane.box
        for panel, caption, (first, last) in zip(pane.panels, pane.captions, pane.parts, strict=True):
            picture = panel.image(legend.scale)[:, first:last]
            pen.sheet.paste(Image.fromarray(np.ascontiguousarray(picture)), (left + first, top))
            if first:
                pen.draw.line([(left + first, top), (left + first, top + height)], TONE, 2)
            if numbers:
                _number(pen, numbers(panel), (left, top), (first, last, height), noun)
            if caption:
                pen.caption((left + first, top), last - first, caption)
    if panes:
        pen.rulers(panes[0].box, panes[0].panels[0].stage.camera.pixel, legend.comb)
    pen.beside(legend)
    return pen.sheet


def _number(
    pen: Pen, numbers: tuple[list[Label], int], corner: tuple[int, int], window: tuple[int, int, int], noun: str
) -> None:
    """Numbers that have room; the others are counted in the lower right corner."""
    (left, top), (first, last, height) = corner, window
    texts, crowded = placed(numbers[0], pen.size, np.array([[first, 0], [last, height]]))
    for text, x, y in texts:
        pen.write((left + x, top + y), text, "mm", HALO)
    if left_out := numbers[1] + crowded:
        said = f"{left_out} {noun}{'s' * (left_out > 1)} without number"
        pen.write((left + last - pen.font.size, top + height - pen.font.size), said, "rs", HALO)
