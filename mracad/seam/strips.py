"""Control points of joined surfaces: those in joints, and strips along joints."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np

from mracad.bspline.surface import Net

Array = np.ndarray

WIDTH = 7.0
"""Width of strips, in lengths within which the effect of joints fades."""

MASS = 0.37
"""Length within which it fades by masses alone, in chords of the control net times degrees."""


@dataclass(frozen=True, eq=False)
class Layout:
    """Control points of surfaces, laid out one after another.

    Attributes
    ----------
    ends : ndarray (surfaces + 1,) of int
        Position at which each surface begins.
    places : ndarray (points, 3)
    reach : ndarray (surfaces,)
        Width of strips on each, mm.
    """

    ends: Array
    places: Array
    reach: Array

    @classmethod
    def of(cls, nets: Sequence[Net], stiffness: float) -> Layout:
        """That of nets; strips are as wide as the effect of a joint reaches, by the form of a stiffness (mm⁴)."""
        reach = []
        for net in nets:
            chord = max(float(np.linalg.norm(np.diff(net.poles, axis=k), axis=2).mean()) for k in (0, 1))
            reach.append(WIDTH * max(stiffness**0.25, MASS * max(net.u.degree, net.v.degree) * chord))
        ends = np.cumsum([0, *(net.u.count * net.v.count for net in nets)])
        return cls(ends, np.concatenate([net.poles.reshape(-1, 3) for net in nets]), np.array(reach))

    @property
    def owner(self) -> Array:
        """Number of the surface of each point, ``(points,)``."""
        return np.repeat(np.arange(len(self.reach)), np.diff(self.ends))


@dataclass(frozen=True, eq=False)
class Division:
    """The parts in which surfaces are solved.

    Attributes
    ----------
    layout : Layout
    joined : mapping of (int, int) to ndarray of int
        See :func:`joints`.
    strips : sequence of ndarray of int
        See :func:`strips`.
    """

    layout: Layout
    joined: Mapping[tuple[int, int], Array]
    strips: Sequence[Array]


def joints(layout: Layout, rows: Any, soft: Any, free: Array) -> dict[tuple[int, int], Array]:
    """The free points of two surfaces (or of one) that conditions or contacts join, by the pair of surfaces."""
    owner, rows = layout.owner, rows.tocsr()
    row = np.repeat(np.arange(rows.shape[0]), np.diff(rows.indptr))
    low, high = np.full(rows.shape[0], len(layout.reach)), np.zeros(rows.shape[0], int)
    np.minimum.at(low, row, owner[rows.indices])
    np.maximum.at(high, row, owner[rows.indices])
    pairs, points = [(low * len(layout.reach) + high)[row]], [rows.indices]
    if soft is not None:
        both = soft.tocoo()
        a, b = owner[both.row], owner[both.col]
        apart = a != b
        pairs.append((np.minimum(a, b) * len(layout.reach) + np.maximum(a, b))[apart])
        points.append(both.row[apart])
    pair, point = np.concatenate(pairs), np.concatenate(points)
    pair, point = pair[free[point]], point[free[point]]
    order = np.argsort(pair, kind="stable")
    keys, first = np.unique(pair[order], return_index=True)
    each = np.split(point[order], first[1:])
    return {divmod(key, len(layout.reach)): np.unique(own) for key, own in zip(keys.tolist(), each, strict=False)}


def strips(
    layout: Layout,
    joined: Mapping[tuple[int, int], Array],
    free: Array,
    most: float = np.inf,
    those: Collection[tuple[int, int]] | None = None,
) -> list[Array] | None:
    """The free points near the points of each joint, or of some joints, on its surfaces and on their joined neighbours.

    None if there are more than ``most`` in all.
    """
    boxes = [_box(layout.places[begin:end]) for begin, end in pairwise(layout.ends.tolist())]
    size = np.array([np.linalg.norm(high - low) for low, high in boxes])
    about = np.add.reduceat(free, layout.ends[:-1], dtype=int) * np.minimum(layout.reach / (size + 1e-300), 1.0)
    if sum(about[i] for pair in joined for i in set(pair)) > most:  # without those of other surfaces
        return None
    from scipy.spatial import cKDTree

    beside: dict[int, set[int]] = {}
    for a, b in joined:
        beside.setdefault(a, {a}).add(b)
        beside.setdefault(b, {b}).add(a)
    found: list[Array] = []
    total = 0
    for a, b in joined if those is None else those:
        points = joined[a, b]
        near, (low, high) = [], _box(layout.places[points])
        for surface in sorted(beside[a] | beside[b]):
            own = slice(layout.ends[surface], layout.ends[surface + 1])
            reach, places = layout.reach[surface], layout.places[own]
            if (boxes[surface][0] > high + reach).any() or (boxes[surface][1] < low - reach).any():
                continue
            close = np.flatnonzero(free[own] & ((places >= low - reach) & (places <= high + reach)).all(axis=1))
            near.append((own.start + close, np.full(len(close), reach)))
        point, reach = (np.concatenate(each) for each in zip(*near, strict=True))
        away = cKDTree(layout.places[points]).query(layout.places[point])[0]
        found.append(_along(layout.places, point[away <= reach]))
        total += len(found[-1])
        if total > most:
            return None
    return found


def about(layout: Layout, those: Array, reach: Array) -> Array:
    """Which points lie within the reach of their surface (mm) from some points, ``(points,)``."""
    from scipy.spatial import cKDTree

    found = np.zeros(len(layout.places), bool)
    if not len(those):
        return found
    tree, (low, high) = cKDTree(layout.places[those]), _box(layout.places[those])
    for (begin, end), far in zip(pairwise(layout.ends.tolist()), reach.tolist(), strict=True):
        places = layout.places[begin:end]
        close = ((places >= low - far) & (places <= high + far)).all(axis=1)
        if close.any():
            away = tree.query(places[close], distance_upper_bound=far)[0]
            found[begin + np.flatnonzero(close)[np.isfinite(away)]] = True
    return found


def _box(places: Array) -> tuple[Array, Array]:
    """The least and the largest coordinates of points."""
    return places.min(axis=0), places.max(axis=0)


def _along(places: Array, points: Array) -> Array:
    """Points sorted along the direction in which they extend most, which keeps the band of a strip narrow."""
    off = places[points] - places[points].mean(axis=0)
    return points[np.argsort(off @ np.linalg.eigh(off.T @ off)[1][:, -1], kind="stable")]


def coloured(strips: Sequence[Array], conditions: Sequence[Array], size: int) -> list[list[int]]:
    """Strips in sets that share neither points nor conditions."""
    from scipy.sparse import csr_array

    if not strips:
        return []
    every = [np.concatenate([points, size + own]) for points, own in zip(strips, conditions, strict=True)]
    ends = np.cumsum([0, *map(len, every)])
    of = csr_array((np.ones(ends[-1]), np.concatenate(every), ends))
    shared = (of @ of.T).tocsr()
    colour = np.full(len(strips), -1)
    for i in range(len(strips)):
        taken = set(colour[shared.indices[shared.indptr[i] : shared.indptr[i + 1]]].tolist())
        colour[i] = next(c for c in range(len(strips) + 1) if c not in taken)
    return [np.flatnonzero(colour == c).tolist() for c in range(colour.max(initial=-1) + 1)]
