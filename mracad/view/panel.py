"""One view of one model: its pixels."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from mracad.model.facets import Placed
from mracad.view.colours import PAPER, opacity
from mracad.view.fields import Scale
from mracad.view.lines import REACH, Dots, Lines, Stroke, edges
from mracad.view.looks import Look
from mracad.view.seen import FINE, Seen, Stage, layers, seen

Array = np.ndarray

AT_ONCE = 1 << 17
"""Number of pixels that are worked on together."""


@dataclass(frozen=True, eq=False)
class Panel:
    """A view before its colours are known.

    Attributes
    ----------
    stage : Stage
    pixel : ndarray of int (q,)
        Pixels in which something is seen, several times where it is several things.
    weight : ndarray (q,)
        Their shares of the pixel.
    shown : ndarray (q, 3) or (q,)
        Colours, or numbers of a map.
    entry : ndarray of int (q,)
    inks : list of (Stroke, ndarray (height, width))
        How much lines cover, the lowest first.
    """

    stage: Stage
    pixel: Array
    weight: Array
    shown: Array
    entry: Array
    inks: list[tuple[Stroke, Array]]

    def image(self, scale: Scale | None) -> Array:
        """The picture, ``(height, width, 3)`` bytes."""
        width, height = self.stage.camera.size
        colours = scale.colours(self.shown) if scale else self.shown
        paper = np.maximum(1.0 - np.bincount(self.pixel, self.weight, width * height), 0.0)
        lined = [np.flatnonzero(ink) for _, ink in self.inks]
        picture = np.empty((height, width, 3), np.uint8)
        for k in range(3):
            light = np.bincount(self.pixel, self.weight * colours[:, k], width * height) + PAPER[k] * paper
            for (stroke, ink), at in zip(self.inks, lined, strict=True):
                light[at] += stroke.opacity * ink.ravel()[at] * (stroke.colour[k] - light[at])
            picture[..., k] = (255.0 * light + 0.5).reshape(height, width)
        return picture


def panel(stage: Stage, look: Look, lines: Sequence[Lines] = ()) -> Panel:
    """Look at a model, and at lines on it."""
    width, height = stage.camera.size
    dots = [*edges(stage, look.strokes), *(each.dots(stage.camera) for each in lines)]
    tall = max(1, AT_ONCE // width)
    found = [_rows(stage, look, dots, (y, min(y + tall, height))) for y in range(0, height, tall)]
    parts = [part for each, _ in found for part in each]
    inks = [(each.stroke, np.concatenate([ink[k] for _, ink in found])) for k, each in enumerate(dots)]
    pixel, weight, shown, entry = (np.concatenate([part[k] for part in parts]) for k in range(4))
    return Panel(stage, pixel, weight, shown, entry, inks)


Part = tuple[Array, Array, Array, Array]


def _rows(stage: Stage, look: Look, dots: Sequence[Dots], rows: tuple[int, int]) -> tuple[list[Part], list[Array]]:
    """What is seen in some rows, and their lines."""
    around = max(rows[0] - REACH, 0), min(rows[1] + REACH, stage.camera.size[1])
    own = slice((rows[0] - around[0]) * FINE, (rows[1] - around[0]) * FINE)
    solid, deep, glass, near = layers(stage, around, lambda place, k: look.coloured and _opacity(place, k) < 1.0)
    inks = [each.drawn(rows, near, around, stage.camera.pixel) for each in dots]
    behind = seen(stage, solid[own], deep[own], rows, look.order)
    parts = [(behind, np.ones(len(behind.pixel)))]
    if (glass[own] >= 0).any():
        before = seen(stage, glass[own], near[own], rows, look.order)
        alpha = np.array([_opacity(place, k) for place, k, _ in stage.entries])[before.entry]
        parts = list(_blended(behind, before, alpha, stage.camera.size))
    return [
        (each.pixel.astype(np.int32), (each.weight * share).astype(np.float32),
         look.at(stage, each).astype(np.float32), each.entry.astype(np.int32))
        for each, share in parts
    ], inks  # fmt: skip


def _opacity(place: Placed, position: int) -> float:
    return opacity(place.colours[position])


def _blended(behind: Seen, before: Seen, alpha: Array, size: tuple[int, int]) -> Iterator[tuple[Seen, Array]]:
    """What is behind glass, and the glass, with their shares."""
    covered = np.bincount(before.pixel, before.weight * alpha, size[0] * size[1])
    yield behind, np.maximum(1.0 - covered[behind.pixel], 0.0)
    yield before, alpha
