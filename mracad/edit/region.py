"""Points of edges, and of regions around points, that sweeps move as a whole."""

from __future__ import annotations

import math

import numpy as np

from mracad.edit.feature.chart import DEGREE, monomials
from mracad.edit.feature.ground import SIDEWAYS, Feet, Ground
from mracad.edit.feature.locate import edge_of
from mracad.edit.feature.pattern import rotation
from mracad.seam.trace import EVENLY
from mracad.spec import motions
from mracad.spec.steps.shape import Sweep

Array = np.ndarray

APART = 0.1
"""Largest distance between neighbouring points, in scales: the surface between them follows to a hundredth."""


def of_edge(ground: Ground, number: int, scale: float) -> Feet:
    """Points along an edge, evenly, both ends among them."""
    face, trace = edge_of(ground, number, "at", "give an edge as edge#4")
    assert face.surface is not None
    points = ground.patches[face.surface].evaluate(trace.evenly)[0]
    length = np.append(0.0, np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1)))
    count = 2 * math.ceil(length[-1] / (2 * APART * scale)) + 1
    uv = trace.places(np.interp(np.linspace(0.0, length[-1], count), length, EVENLY))
    return ground.standing(np.full(count, face.surface), uv, np.zeros(count))


def around(ground: Ground, foot: Feet, radius: float, scale: float) -> Feet:
    """Points on rings around the foot of one point, that point first; without those beyond the ends of the ground."""
    rings = math.ceil(radius / (APART * scale))
    turns = [2 * np.pi * np.arange(6 * k) / (6 * k) for k in range(1, rings + 1)]
    far = np.repeat(radius * np.arange(1, rings + 1) / rings, [len(turn) for turn in turns])
    xy = far[:, None] * np.stack([np.cos(np.concatenate(turns)), np.sin(np.concatenate(turns))], axis=1)
    chart, _ = ground.charts(foot, foot.along, np.array([radius]))
    ab = chart.places(xy, np.zeros(len(xy), int))
    height = radius * monomials(ab[:, 0] / radius, ab[:, 1] / radius, DEGREE) @ chart.graph[0]
    points = chart.origin[0] + np.column_stack([ab, height]) @ chart.axes[0]
    feet = ground.feet(points)
    on = np.flatnonzero((feet.beside(points) <= SIDEWAYS * radius) & (ground.faces(feet.surface, feet.uv) >= 0))
    surface, uv = np.append(foot.surface, feet.surface[on]), np.concatenate([foot.uv, feet.uv[on]])
    return ground.standing(surface, uv, np.zeros(len(uv)))


def turned(points: Array, middle: Array, normal: Array, options: Sweep) -> Array:
    """Where rotation and stretch take points ``(q, 3)`` around a middle with an outward normal."""
    if options.stretch:
        axis, factor = motions.stretch(options.stretch, "stretch")
        through, way = _line(axis, middle, normal)
        off = points - through
        along = off if axis is None else (off @ way)[:, None] * way
        points = points + (factor - 1.0) * along
    if options.rotate:
        axis, angle = motions.turn(options.rotate, "rotate")
        through, way = _line(axis, middle, normal)
        points = through + (points - through) @ rotation(way, math.radians(angle)).T
    return points


def _line(axis: motions.Axis | None, middle: Array, normal: Array) -> tuple[Array, Array]:
    """A point of an axis and its unit direction."""
    through = middle if axis is None or axis.through is None else np.array(axis.through)
    way = normal if axis is None or axis.direction is None else np.array(axis.direction)
    return through, way / np.linalg.norm(way)
