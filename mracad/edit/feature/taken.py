"""The share of the volume of copies that edges and holes that stay take away."""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping, Sequence
from dataclasses import replace

import numpy as np

from mracad.edit.feature.ideal import Copies, Way
from mracad.edit.feature.score import Copy
from mracad.edit.feature.seams import Wanted

Array = np.ndarray

POINTS, MOST, LEAST = 20_000, 1000, 300
"""Points at which copies beside edges are compared: in all, and in one copy at most and at least."""

BATCH = 60_000
"""Points compared at a time."""

GOLDEN = np.pi * (3 - np.sqrt(5))
"""Angle between points of a sunflower, which are spread evenly over a disc but lie on no lines along a rim."""

SLIGHT = 1e-3
"""Share of its height that a copy may lose without having its volume compared, and of its reach by which a point may
lie beside the ground."""

ALONG = np.linspace(0.0, 1.0, 101)


def clipped(
    copies: Copies,
    found: Sequence[Copy],
    wanted: Mapping[int, Wanted],
    done: Mapping[int, Array],
    still: Collection[int],
) -> list[Copy]:
    """The results for copies, with their volumes and the shares of these that are taken.

    Parameters
    ----------
    copies : Copies
    found : sequence of Copy
    wanted : mapping of int to Wanted
        By surface, the offsets of copies on it, and all others.
    done : mapping of int to ndarray (nu, nv, 3)
        The resulting offsets.
    still : collection of int
        Edges that stay.
    """
    cell = (2 * copies.feature.reach / (len(copies.feature.table) - 1)) ** 2
    volume = float(np.abs(copies.feature.table[..., 2]).sum()) * cell
    every = volume * copies.sizes**2 * np.abs(copies.heights)
    lost = np.array([copy.lost for copy in found]) > SLIGHT * copies.feature.height * np.abs(copies.heights)
    held = any((~each.free & each.offset.any(axis=2)).any() for each in wanted.values())
    some = np.flatnonzero(lost & held | _beside(copies, still))
    count = int(np.clip(POINTS // max(len(some), 1), LEAST, MOST))
    shares = np.zeros(len(found))
    for batch in np.array_split(some, math.ceil(len(some) * count / BATCH)) if len(some) else ():
        shares[batch] = _taken(copies, batch, count, wanted, done)
    return [
        replace(copy, volume=size, taken=share)
        for copy, size, share in zip(found, every.tolist(), shares.tolist(), strict=True)
    ]


def _beside(copies: Copies, still: Collection[int]) -> Array:
    """The copies within whose reach an edge of a face of the ground stays, ``(copies,)``."""
    from scipy.spatial import cKDTree

    lines = [
        np.asarray(patch.net.evaluate(trim.curve.evaluate(start + ALONG * (stop - start))[0]))
        for patch in copies.ground.patches.values()
        for face in patch.faces
        for trim in face.trims
        if trim.edge in still
        for start, stop in [trim.curve.knots.domain]
    ]
    if not lines:
        return np.zeros(len(copies.places), bool)
    step = max(float(np.linalg.norm(np.diff(line, axis=0), axis=1).max()) for line in lines)
    far = cKDTree(np.concatenate(lines)).query(copies.charts.origin)[0]
    return np.asarray(far <= copies.reach + step)


def _taken(copies: Copies, some: Array, count: int, wanted: Mapping[int, Wanted], done: Mapping[int, Array]) -> Array:
    """The shares of the volume of some copies that are not there, 0 to 1."""
    place, which = np.tile(np.arange(count), len(some)), np.repeat(some, count)
    reach = copies.reach[which]
    spread = np.stack([np.cos(GOLDEN * place), np.sin(GOLDEN * place)], axis=1)
    xy = (reach * np.sqrt((place + 0.5) / count))[:, None] * spread
    points = copies.charts.points(xy, which)
    way = Way(copies.turns[which], copies.sizes[which], copies.heights[which], copies.mirror)
    size = np.abs(copies.feature.lookup(way.back(xy))[:, 2])
    feet = copies.ground.feet(points)
    on = (copies.ground.faces(feet.surface, feet.uv) >= 0) & (feet.beside(points) <= reach * SLIGHT)
    kept = np.zeros(len(xy))
    for index in np.unique(feet.surface[on]).tolist():
        own, patch = np.flatnonzero(on & (feet.surface == index)), copies.ground.patches[index]
        ideal = copies.at(patch, feet.uv[own])
        each = wanted.get(index)
        if each is None:
            continue
        net = each.net.with_poles((done[index] - each.offset + each.alone) @ patch.turn.T)
        now = np.asarray(net.evaluate(feet.uv[own]))
        square = np.maximum((ideal**2).sum(axis=1), (1e-9 * copies.feature.height) ** 2)
        kept[own] = np.clip((now * ideal).sum(axis=1) / square, 0.0, 1.0)
    there, whole = ((x * size).reshape(len(some), count).sum(axis=1) for x in (kept, np.ones_like(kept)))
    return np.asarray(np.clip(1.0 - there / np.maximum(whole, 1e-300), 0.0, 1.0))
