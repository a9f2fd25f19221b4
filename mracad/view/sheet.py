"""Panels on a sheet: where they go, their captions, colour bar and scale, and the PNG."""

from __future__ import annotations

import io
from collections.abc import Sequence
from functools import cache
from importlib.util import find_spec
from itertools import pairwise
from pathlib import Path

import numpy as np
from PIL import Image, ImageDraw, ImageFont

from mracad.view.colours import INK
from mracad.view.fields import Map, Scale, rounded
from mracad.view.labels import of_faces, placed
from mracad.view.panel import Panel

Array = np.ndarray
Box = tuple[int, int, int, int]
"""Left, top, width and height, pixels."""

_SMALL, _LARGE = 9, 20  # heights of letters, pixels
_TONE = tuple(round(255 * float(each)) for each in INK)
_BAR = 8.5  # width of the strip for the colour bar, heights of letters
_LONGEST = 0.2  # of a panel: the scale
_HALO = 2  # pixels around numbers of faces


def letters(size: tuple[int, int]) -> int:
    """Height of the letters of a sheet, pixels."""
    return int(np.clip(round(min(size) / 52), _SMALL, _LARGE))


def boxes(size: tuple[int, int], rows: int, columns: int, bar: bool) -> list[Box]:
    """The places of panels, row by row; beside them is room for a colour bar."""
    wide = size[0] - (round(_BAR * letters(size)) if bar else 0)
    across = np.linspace(0, wide, columns + 1).round().astype(int)
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


def png(
    size: tuple[int, int],
    places: Sequence[Box],
    panels: Sequence[Panel],
    captions: Sequence[str],
    legend: tuple[Map, Scale] | None,
    numbered: bool,
) -> bytes:
    """The sheet as a PNG file."""
    sheet = Image.new("RGB", size, "white")
    draw = ImageDraw.Draw(sheet)
    font = _font(letters(size))
    for (left, top, _, _), panel, caption in zip(places, panels, captions, strict=True):
        picture = panel.image(legend[1] if legend else None)
        sheet.paste(Image.fromarray(picture), (left, top))
        if numbered:
            _numbers(draw, font, panel, (left, top))
        if caption:
            draw.text((left + font.size, top + font.size), caption, _TONE, font, "la")
    if places:
        _ruler(draw, font, places[0], panels[0].stage.camera.pixel)
    if legend:
        _bar(sheet, draw, font, *legend)
    packed = io.BytesIO()
    sheet.save(packed, "PNG")
    return packed.getvalue()


@cache
def _font(height: int) -> ImageFont.FreeTypeFont:
    """A typeface with the signs of the field, which comes with matplotlib."""
    home = find_spec("matplotlib")
    assert home is not None and home.origin is not None
    return ImageFont.truetype(str(Path(home.origin).parent / "mpl-data" / "fonts" / "ttf" / "DejaVuSans.ttf"), height)


def _numbers(draw: ImageDraw.ImageDraw, font: ImageFont.FreeTypeFont, panel: Panel, corner: tuple[int, int]) -> None:
    """The numbers of faces that have room for them; the others are counted in the lower right corner."""
    labels, small = of_faces(panel)

    def size(text: str) -> tuple[int, int]:
        left, top, right, bottom = draw.textbbox((0, 0), text, font, "mm", stroke_width=_HALO)
        return round(right - left), round(bottom - top)

    texts, crowded = placed(labels, size, panel.stage.camera.size)
    for text, x, y in texts:
        _haloed(draw, (corner[0] + x, corner[1] + y), text, font, "mm")
    if left_out := small + crowded:
        width, height = panel.stage.camera.size
        said = f"{left_out} small face{'s' * (left_out > 1)} without number"
        _haloed(draw, (corner[0] + width - font.size, corner[1] + height - font.size), said, font, "rs")


def _haloed(
    draw: ImageDraw.ImageDraw, at: tuple[float, float], text: str, font: ImageFont.FreeTypeFont, anchor: str
) -> None:
    draw.text(at, text, _TONE, font, anchor, stroke_width=_HALO, stroke_fill="white")


def _ruler(draw: ImageDraw.ImageDraw, font: ImageFont.FreeTypeFont, box: Box, pixel: float) -> None:
    """A round length in the lower left corner."""
    left, top, width, height = box
    length = rounded(_LONGEST * width * pixel * 0.5)
    x, y = left + font.size, top + height - font.size
    end = x + round(length / pixel)
    draw.line([(x, y), (end, y)], _TONE, 1)
    for tick in (x, end):
        draw.line([(tick, y - 3), (tick, y + 3)], _TONE, 1)
    draw.text((x, y - 5), f"{length:g} mm", _TONE, font, "ls")


def _bar(
    sheet: Image.Image, draw: ImageDraw.ImageDraw, font: ImageFont.FreeTypeFont, legend: Map, scale: Scale
) -> None:
    """The colours of a map with their numbers, at the right."""
    width, height = sheet.size
    unit = int(font.size)
    left, top, bottom = width - round(_BAR * unit) + unit, 4 * unit, height - 2 * unit
    values = np.linspace(scale.high, scale.low, bottom - top)[:, None]
    colours = scale.colours(values.repeat(unit, axis=1).ravel()).reshape(bottom - top, unit, 3)
    sheet.paste(Image.fromarray((colours * 255.0 + 0.5).astype(np.uint8)), (left, top))
    draw.rectangle([left - 1, top - 1, left + unit, bottom], None, _TONE, 1)
    first, _, rest = legend.title.partition(" ")
    for line, text in enumerate([first, f"{rest} {legend.unit}".strip()] if rest else [first, legend.unit]):
        draw.text((width - unit // 2, unit // 2 + round(1.35 * line * unit)), text, _TONE, font, "ra")
    marks = 5 if bottom - top > 10 * unit else 3
    for k, value in enumerate(np.linspace(scale.high, scale.low, marks).tolist()):
        y = top + round(k * (bottom - top - 1) / (marks - 1))
        beyond = "≥ " if k == 0 and scale.above else "≤ " if k == marks - 1 and scale.below else ""
        draw.line([(left + unit, y), (left + unit + 3, y)], _TONE, 1)
        draw.text((left + unit + 6, y), beyond + f"{value:.3g}".replace("-", "−"), _TONE, font, "lm")
