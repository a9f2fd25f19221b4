"""What explains pictures: bars of colours with numbers, keys of colours with words, rulers."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from importlib.util import find_spec
from pathlib import Path

import numpy as np
from PIL import Image, ImageDraw, ImageFont

from mracad.view.colours import INK
from mracad.view.fields import Map, Scale, rounded
from mracad.view.section import Comb

Box = tuple[int, int, int, int]
"""Left, top, width and height, pixels."""

TONE = tuple(round(255 * float(each)) for each in INK)
HALO = 2
"""Pixels around numbers."""

_SMALL, _LARGE = 9, 20  # heights of letters, pixels
_BAR, _KEY = 8.5, 19.0  # widths of strips for a bar and for a key, heights of letters
_LONGEST = 0.2  # of a panel: the ruler


@dataclass(frozen=True)
class Entry:
    """A colour and its meaning; of lines, or of faces."""

    colour: tuple[float, ...]
    text: str
    line: bool = False


@dataclass(frozen=True)
class Legend:
    """What explains a picture: a map and its range, or a key; and the scale of combs."""

    map: Map | None = None
    scale: Scale | None = None
    key: Sequence[Entry] = ()
    comb: Comb | None = None


def letters(size: tuple[int, int]) -> int:
    """Height of the letters of a sheet, pixels."""
    return int(np.clip(round(min(size) / 52), _SMALL, _LARGE))


def strip(legend: Legend, size: tuple[int, int]) -> int:
    """Width of what stands beside panels, pixels: at most half of the sheet."""
    wide = round((_BAR if legend.map else _KEY if legend.key else 0.0) * letters(size))
    return min(wide, size[0] // 2)


@dataclass(frozen=True, eq=False)
class Pen:
    """What draws on a sheet."""

    sheet: Image.Image
    draw: ImageDraw.ImageDraw
    font: ImageFont.FreeTypeFont

    @classmethod
    def on(cls, sheet: Image.Image) -> Pen:
        return cls(sheet, ImageDraw.Draw(sheet), _font(letters(sheet.size)))

    def size(self, text: str) -> tuple[int, int]:
        """Width and height of a text with its halo, pixels."""
        left, top, right, bottom = self.draw.textbbox((0, 0), text, self.font, "mm", stroke_width=HALO)
        return round(right - left), round(bottom - top)

    def write(self, at: tuple[float, float], text: str, anchor: str, halo: int = 0) -> None:
        """A text on what is there."""
        self.draw.text(at, text, TONE, self.font, anchor, stroke_width=halo, stroke_fill="white")

    def caption(self, corner: tuple[int, int], wide: int, text: str) -> None:
        """A text in the upper left corner of a part of a sheet, in as many lines as its width asks for."""
        unit = int(self.font.size)
        for row, line in enumerate(self._wrapped(text, wide - 2 * unit)):
            shown = line
            while len(shown) > 1 and self.font.getlength(shown) > wide - 2 * unit:
                shown = shown.rstrip("…")[:-1] + "…"
            self.write((corner[0] + unit, corner[1] + unit + round(1.3 * row * unit)), shown, "la", HALO)

    def beside(self, legend: Legend) -> None:
        """What stands at the right."""
        if legend.map and legend.scale:
            self._bar(legend.map, legend.scale, self.sheet.width - strip(legend, self.sheet.size))
        elif legend.key:
            self._key(legend.key, self.sheet.width - strip(legend, self.sheet.size))

    def rulers(self, box: Box, pixel: float, comb: Comb | None) -> None:
        """A round length in the lower left corner, and above it a round curvature as the tooth of a comb."""
        length = rounded(_LONGEST * box[2] * pixel * 0.5)
        self._ruler(box, 0, length / pixel, f"{length:g} mm")
        if comb:
            cut = f", cut at {comb.most:.3g}" if np.isfinite(comb.most) else ""
            said = f"{comb.unit:.3g} 1/mm{cut}" if comb.unit else "nothing bends"
            self._ruler(box, 1, comb.unit * comb.length / pixel, f"comb: {said}")

    def _ruler(self, box: Box, row: int, length: float, text: str) -> None:
        unit = int(self.font.size)
        x, y = box[0] + unit, box[1] + box[3] - unit - round(2.2 * row * unit)
        end = x + round(length)
        self.draw.line([(x, y), (end, y)], TONE, 1)
        for tick in (x, end):
            self.draw.line([(tick, y - 3), (tick, y + 3)], TONE, 1)
        self.write((x, y - 5), text, "ls")

    def _bar(self, legend: Map, scale: Scale, left: int) -> None:
        """The colours of a map with their numbers."""
        width, height = self.sheet.size
        unit = int(self.font.size)
        left, top, bottom = left + unit, 4 * unit, max(height - 2 * unit, 4 * unit + 2)
        values = np.linspace(scale.high, scale.low, bottom - top)[:, None]
        colours = scale.colours(values.repeat(unit, axis=1).ravel()).reshape(bottom - top, unit, 3)
        self.sheet.paste(Image.fromarray((colours * 255.0 + 0.5).astype(np.uint8)), (left, top))
        self.draw.rectangle([left - 1, top - 1, left + unit, bottom], None, TONE, 1)
        first, _, rest = legend.title.partition(" ")
        for line, text in enumerate([first, f"{rest} {legend.unit}".strip()] if rest else [first, legend.unit]):
            self.write((width - unit // 2, unit // 2 + round(1.35 * line * unit)), text, "ra")
        marks = 5 if bottom - top > 10 * unit else 3
        for k, value in enumerate(np.linspace(scale.high, scale.low, marks).tolist()):
            y = top + round(k * (bottom - top - 1) / (marks - 1))
            beyond = "≥ " if k == 0 and scale.above else "≤ " if k == marks - 1 and scale.below else ""
            self.draw.line([(left + unit, y), (left + unit + 3, y)], TONE, 1)
            self.write((left + unit + 6, y), beyond + f"{value:.3g}".replace("-", "−"), "lm")

    def _key(self, key: Sequence[Entry], left: int) -> None:
        """Colours with their words."""
        unit = int(self.font.size)
        left, top, width = left + unit, unit, self.sheet.width - left - round(4.5 * unit)
        for entry in key:
            colour = tuple(round(255 * each) for each in entry.colour)
            if entry.line:
                self.draw.line([(left, top + unit // 2), (left + 2 * unit, top + unit // 2)], colour, 3)
            else:
                self.draw.rectangle([left, top, left + 2 * unit, top + unit], colour, TONE, 1)
            for line in self._wrapped(entry.text, width):
                self.write((left + round(2.6 * unit), top + unit // 2), line, "lm")
                top += round(1.3 * unit)
            top += round(0.6 * unit)

    def _wrapped(self, text: str, width: int) -> list[str]:
        lines = [""]
        for word in text.split():
            longer = f"{lines[-1]} {word}".strip()
            if lines[-1] and self.font.getlength(longer) > width:
                lines.append(word)
            else:
                lines[-1] = longer
        return lines


@cache
def _font(height: int) -> ImageFont.FreeTypeFont:
    """A typeface with the signs of the field, which comes with matplotlib."""
    home = find_spec("matplotlib")
    assert home is not None and home.origin is not None
    return ImageFont.truetype(str(Path(home.origin).parent / "mpl-data" / "fonts" / "ttf" / "DejaVuSans.ttf"), height)
