"""Faces laid beside each other in a plane, so that a texture goes on from one to the next across their seams.

Each face is the rectangle of its arc lengths, turned by quarters and mirrored as its neighbours ask.  Along a seam, the
two sides are measured on different lines, so the rectangles are also stretched a little, to meet at the ends of seams.
"""

from __future__ import annotations

import itertools
from collections.abc import Mapping, Sequence

import numpy as np

from mracad.edit.character import Character
from mracad.edit.texture import Chart
from mracad.model.brep import Model

Array = np.ndarray

STRETCH = 1.5
"""Largest factor by which a face is stretched in one direction."""

TURNS = [
    np.array(rows)
    for a, b in itertools.product((1.0, -1.0), repeat=2)
    for rows in ([[a, 0.0], [0.0, b]], [[0.0, a], [b, 0.0]])
]
"""Turns by quarters, also mirrored."""

LEAST = 0.2
"""Extent of lengths along an axis, as a share of that of places there, below which they do not tell its stretch."""

Seams = Sequence[tuple[int, int, Array, Array]]
"""Seams between different surfaces: both, and the arc lengths of each along it."""

Met = Sequence[tuple[Array, Array, Array]]
"""Places in the plane along seams, the arc lengths of a surface there, and the middle of the surface beside it."""


def charts(model: Model, own: Mapping[int, Character]) -> dict[int, Chart]:
    """A chart for each of some surfaces; those that seams join lie beside each other."""
    seams = _seams(model, own)
    found: dict[int, Chart] = {}
    while len(found) < len(own):
        each = {i: _met(i, found, own, seams) for i in own if i not in found}
        index = max(each, key=lambda i: sum(len(places) for places, _, _ in each[i]))
        found[index] = _fitted(own[index], each[index]) if each[index] else _beside(found, own)
    return found


def _seams(model: Model, own: Mapping[int, Character]) -> Seams:
    """The seams between different surfaces of some."""
    found = []
    for edge in model.edges:
        on = [(model.faces[side.face].surface, side.uv) for side in edge.sides]
        if len(on) == 2 and on[0][0] != on[1][0]:
            (a, one), (b, two) = on
            if a in own and b in own and one is not None and two is not None:
                assert a is not None
                assert b is not None
                found.append((a, b, own[a].lengths(one), own[b].lengths(two)))
    return found


def _met(index: int, found: Mapping[int, Chart], own: Mapping[int, Character], seams: Seams) -> Met:
    """The seams of a surface with those that have a place."""
    both = [*seams, *((b, a, two, one) for a, b, one, two in seams)]
    return [(found[a](one), two, found[a](_middle(own[a]))[0]) for a, b, one, two in both if b == index and a in found]


def _fitted(own: Character, met: Met) -> Chart:
    """The chart of a surface that meets those beside it best, and does not lie over them."""
    places, lengths = (np.concatenate([each[k] for each in met]) for k in (0, 1))
    best, least = Chart(np.eye(2), np.zeros(2)), np.inf
    for turn in TURNS:
        turned = lengths @ turn.T
        stretch = [_stretch(turned[:, k], places[:, k]) for k in (0, 1)]
        matrix = np.diag(stretch) @ turn
        shift = (places - lengths @ matrix.T).mean(axis=0)
        chart = Chart(matrix, shift)
        middle = chart(_middle(own))[0]
        off = ((chart(lengths) - places) ** 2).sum()
        over = sum((middle - at.mean(axis=0)) @ (other - at.mean(axis=0)) > 0 for at, _, other in met)
        off += over * len(places) * max(own.sizes) ** 2
        if off < least:
            best, least = chart, off
    return best


def _stretch(lengths: Array, places: Array) -> float:
    """The factor that brings lengths along an axis to places; 1 where they do not tell."""
    off = lengths - lengths.mean()
    if np.ptp(lengths) < LEAST * max(np.ptp(places), 1e-300) or not off.any():
        return 1.0
    found = float(off @ places / (off @ off))
    return found if 1 / STRETCH <= found <= STRETCH else 1.0


def _beside(found: Mapping[int, Chart], own: Mapping[int, Character]) -> Chart:
    """A chart to the right of all others."""
    right = max((float(chart(_corners(own[i]))[:, 0].max()) for i, chart in found.items()), default=0.0)
    return Chart(np.eye(2), np.array([right, 0.0]))


def corners(own: Mapping[int, Character], laid: Mapping[int, Chart]) -> Array:
    """Places of the corners of surfaces, ``(q, 2)``."""
    return np.concatenate([laid[i](_corners(each)) for i, each in own.items()])


def _middle(own: Character) -> Array:
    return np.array([own.sizes]) / 2


def _corners(own: Character) -> Array:
    return np.array(list(itertools.product(*((0.0, size) for size in own.sizes))))
