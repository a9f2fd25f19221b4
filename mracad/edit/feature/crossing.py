"""Seams under copies of a feature: the parts of them that copies move, and the knots that both sides need there."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from mracad.bspline.surface import Net
from mracad.constraint.border import Border
from mracad.constraint.seam import Seam
from mracad.constraint.trace import Trace, along, crossings
from mracad.constraint.trimmed import TrimmedSeam
from mracad.edit.feature.fit import grown
from mracad.edit.feature.ideal import Copies
from mracad.seam.conditions import SAME, doubled, matched

Array = np.ndarray
Stretch = tuple[float, float]

MOVED = 1e-7
"""A seam moves where a copy displaces it by more than this share of its height."""

_EVENLY = np.linspace(0, 1, 401)


@dataclass(frozen=True, eq=False)
class Crossing:
    """A seam that copies lie over.

    Attributes
    ----------
    seam : Seam or TrimmedSeam
    stretches : sequence of (float, float)
        Fractions between which control points that move reach it: the rest of it stays.
    """

    seam: Seam | TrimmedSeam
    stretches: Sequence[Stretch]

    @property
    def edges(self) -> set[int]:
        return {self.seam.edge, self.seam.twin}

    @property
    def surfaces(self) -> set[int]:
        return {self.seam.a.surface, self.seam.b.surface}

    def sides(self) -> Iterator[Trace]:
        """Both sides of the seam."""
        yield from map(trace, (self.seam.a, self.seam.b))

    def rests(self) -> Iterator[Stretch]:
        """What is not in a stretch."""
        ends = [0.0, *(x for stretch in self.stretches for x in stretch), 1.0]
        yield from ((low, high) for low, high in zip(ends[::2], ends[1::2], strict=True) if low < high)


def trace(side: Border | Trace) -> Trace:
    """One side of a seam of either kind."""
    return along(side) if isinstance(side, Border) else side


def reached(copies: Copies, seam: Seam | TrimmedSeam, removed: Mapping[int, Array]) -> bool:
    """Whether copies, or what is removed (offsets by surface over its own net), displace a seam."""
    for side in (seam.a, seam.b):
        patch, uv = copies.ground.patches[side.surface], side.places(_EVENLY)
        points, _, _, normals = patch.evaluate(uv)
        moved = [copies.ideal(patch, points, normals)[0]]
        if side.surface in removed:
            moved.append(np.asarray(Net(*patch.knots, removed[side.surface], patch.net.weights).evaluate(uv)))
        if max(np.linalg.norm(each, axis=1).max() for each in moved) > MOVED * copies.height:
            return True
    return False


def crossing(seam: Seam | TrimmedSeam, nets: Mapping[int, Net], moved: Mapping[int, Array]) -> Crossing:
    """The parts of a seam that copies move.

    Parameters
    ----------
    seam : Seam or TrimmedSeam
    nets : mapping of int to Net
        By surface.
    moved : mapping of int to ndarray of bool (nu, nv)
        Control points of those that move.
    """
    found: list[Stretch] = []
    for side in map(trace, (seam.a, seam.b)):
        net = nets[side.surface]
        knots = net.u, net.v
        # over finer knots, other functions may reach as far as those that overlap these
        near = grown(moved[side.surface], knots, max(kv.degree for kv in knots))
        breaks = crossings(side, knots)
        shares = Net(*knots, near[..., None].astype(float)).evaluate(side.inside(net, (breaks[1:] + breaks[:-1]) / 2))
        hit = np.flatnonzero(np.asarray(shares)[:, 0] > 0)
        found += [(float(breaks[k]), float(breaks[k + 1])) for k in hit]
    return Crossing(seam, tuple(_merged(found)))


def _merged(stretches: Sequence[Stretch]) -> Iterator[Stretch]:
    """Stretches in order, those that meet as one."""
    low = high = -1.0
    for start, stop in sorted(stretches):
        if start > high + SAME:
            if high > low:
                yield low, high
            low = start
        high = max(high, stop)
    if high > low:
        yield low, high


def refined(nets: Mapping[int, Net], crossings: Sequence[Crossing], halvings: Mapping[int, int]) -> dict[int, Net]:
    """The nets with the knots that seams need under copies.

    Parameters
    ----------
    nets : mapping of int to Net
    crossings : sequence of Crossing
    halvings : mapping of int to int
        For trimmed seams, by edge, how often the spans under them are to be halved.
    """
    result = dict(nets)
    for each in crossings:
        for _ in range(halvings.get(each.seam.edge, 0)):
            result |= {side.surface: _halved(result[side.surface], side, each.stretches) for side in each.sides()}
    parts = exact_parts(crossings)
    result = doubled(matched(result, parts), parts)
    return matched(result, parts)


def exact_parts(crossings: Sequence[Crossing]) -> list[Seam]:
    """Those parts of seams that move exactly, as seams."""
    return [each.seam.part(*s) for each in crossings if isinstance(each.seam, Seam) for s in each.stretches]


def _halved(net: Net, side: Trace, stretches: Sequence[Stretch]) -> Net:
    """A net with the spans halved through which stretches of a trace run."""
    cells = met(net, side, stretches)
    halves = [
        ((kv.breaks[:-1] + kv.breaks[1:]) / 2)[cells.any(axis=1 - axis)] for axis, kv in enumerate((net.u, net.v))
    ]
    return net.refined(*halves)


def met(net: Net, side: Trace, stretches: Sequence[Stretch]) -> Array:
    """Knot cells of a net through which stretches of a trace run, a mask."""
    shares = [np.empty(0)]
    for low, high in stretches:
        breaks = low + (high - low) * crossings(side.part(low, high), (net.u, net.v))
        shares.append((breaks[1:] + breaks[:-1]) / 2)
    return side.cells(net, np.concatenate(shares))
