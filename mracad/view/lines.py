"""Lines with soft borders: edges of faces, and curves on a model; faces hide what lies behind them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from types import MappingProxyType

import numpy as np

from mracad.view.camera import Camera
from mracad.view.colours import INK
from mracad.view.runs import runs
from mracad.view.seen import FINE, Stage

Array = np.ndarray

REACH = 2
"""Rows of pixels around some rows whose depths and lines count there."""

_STEP = 0.25  # pixels between the dots of which lines are made
_BEHIND = 1.5  # pixels: dots that are no deeper than this behind the faces beside them are seen


@dataclass(frozen=True)
class Stroke:
    """How lines are drawn.

    Attributes
    ----------
    colour : tuple of float
        Red, green and blue, 0 to 1.
    half : float
        Half the width, pixels, at most 1.5.
    opacity : float
    hidden : float
        Share of it where faces hide the line.
    """

    colour: tuple[float, ...] = tuple(INK.tolist())
    half: float = 0.6
    opacity: float = 0.85
    hidden: float = 0.0


EDGE = Stroke()
"""How edges are drawn."""


@dataclass(frozen=True, eq=False)
class Dots:
    """Dots along lines.

    Attributes
    ----------
    stroke : Stroke
    at : ndarray (n, 2)
        Pixels from the left and from the top, sorted from the top down.
    depth : ndarray (n,)
    """

    stroke: Stroke
    at: Array
    depth: Array

    @classmethod
    def of(cls, stroke: Stroke, a: Array, b: Array, *, size: tuple[int, int]) -> Dots:
        """The dots of segments between points ``(n, 3)``, in pixels and depth, in a picture."""
        a, b = _clipped(a, b, size)
        count = np.ceil(np.linalg.norm((b - a)[:, :2], axis=1) / _STEP).astype(int) + 1
        which, step = runs(np.arange(len(a)), np.zeros(len(a), int), count)
        share = (step / np.maximum(count[which] - 1, 1))[:, None]
        dots = a[which] + share * (b - a)[which]
        dots = dots[np.argsort(dots[:, 1], kind="stable")]
        return cls(stroke, dots[:, :2], dots[:, 2])

    def drawn(self, rows: tuple[int, int], depth: Array, around: tuple[int, int], pixel: float) -> Array:
        """How much of each pixel of some rows lines cover, ``(rows, width)``.

        Parameters
        ----------
        rows : (int, int)
        depth : ndarray
            Depths of the samples of the rows ``around`` them.
        around : (int, int)
        pixel : float
            Size of a pixel, mm.
        """
        tall, wide = rows[1] - rows[0], depth.shape[1] // FINE
        part = slice(*np.searchsorted(self.at[:, 1], [rows[0] - REACH, rows[1] + REACH]).tolist())
        at, deep = self.at[part], self.depth[part]
        shown = _deepest(depth, np.floor(FINE * (at - [0.0, around[0]])).astype(int)) >= deep - _BEHIND * pixel
        full = np.where(shown, 1.0, self.stroke.hidden)
        at, full = at[full > 0.0], full[full > 0.0]
        x, y = np.floor(at).astype(int).T
        ink = np.zeros(tall * wide)
        reach = range(-int(self.stroke.half + 0.5), int(self.stroke.half + 0.5) + 1)
        for dy in reach:
            for dx in reach:
                column, row = x + dx, y + dy - rows[0]
                cover = self.stroke.half + 0.5 - np.hypot(column + 0.5 - at[:, 0], y + dy + 0.5 - at[:, 1])
                kept = (cover > 0.0) & (column >= 0) & (column < wide) & (row >= 0) & (row < tall)
                np.maximum.at(ink, (row * wide + column)[kept], (full * np.minimum(cover, 1.0))[kept])
        return ink.reshape(tall, wide)


@dataclass(frozen=True, eq=False)
class Lines:
    """Segments between points of the document.

    Attributes
    ----------
    stroke : Stroke
    starts, ends : ndarray (n, 3)
        Millimetres.
    """

    stroke: Stroke
    starts: Array = field(repr=False)
    ends: Array = field(repr=False)

    def dots(self, camera: Camera) -> Dots:
        """Their dots, seen by a camera."""
        return Dots.of(self.stroke, camera.project(self.starts), camera.project(self.ends), size=camera.size)


def edges(stage: Stage, strokes: Mapping[int, Stroke] = MappingProxyType({})) -> list[Dots]:
    """The dots of every edge of every instance, once; some edges by index have strokes of their own, which lie over
    the others."""
    found: dict[Stroke, list[tuple[Array, Array]]] = {EDGE: []}
    known = set()
    for (place, _, facets), first in zip(stage.entries, stage.first, strict=False):
        for edge, along in facets.rims.items():
            if (id(place), edge) not in known:
                known.add((id(place), edge))
                found.setdefault(strokes.get(edge, EDGE), []).append((along[:-1] + first, along[1:] + first))
    points = stage.points * [1.0 / FINE, 1.0 / FINE, 1.0]
    return [
        Dots.of(stroke, *(points[np.concatenate(ends)] for ends in zip(*pairs, strict=True)), size=stage.camera.size)
        for stroke, pairs in found.items()
        if pairs
    ]


def _deepest(depth: Array, at: Array) -> Array:
    """The largest depth in the samples around places (x, y)."""
    (x, y), (tall, wide) = at.T, depth.shape
    found = np.full(len(at), -np.inf)
    for dy in (-1, 0, 1):
        for dx in (-1, 0, 1):
            there = depth[np.clip(y + dy, 0, tall - 1), np.clip(x + dx, 0, wide - 1)]
            found = np.maximum(found, there)
    return found


def _clipped(a: Array, b: Array, size: tuple[int, int]) -> tuple[Array, Array]:
    """The parts of segments within a picture and a little around it."""
    first, last = np.zeros(len(a)), np.ones(len(a))
    way = b - a
    for axis in (0, 1):
        moves = way[:, axis] != 0.0
        pace = np.where(moves, way[:, axis], 1.0)
        ends = np.stack([(-REACH - a[:, axis]) / pace, (size[axis] + REACH - a[:, axis]) / pace])
        inside = (a[:, axis] >= -REACH) & (a[:, axis] <= size[axis] + REACH)
        first = np.maximum(first, np.where(moves, ends.min(axis=0), np.where(inside, 0.0, 2.0)))
        last = np.minimum(last, np.where(moves, ends.max(axis=0), 1.0))
    kept = last >= first
    a, way, first, last = a[kept], way[kept], first[kept, None], last[kept, None]
    return a + first * way, a + last * way
