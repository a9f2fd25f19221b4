"""Knot ladders that surfaces share along their seams.

A level of joined patches is a level of the surface that they form, so a coarse knot on one side of a seam must also be
a knot on the other side, whatever the knots, degrees and orientations.  The directions of surfaces along a seam are
therefore mapped affinely onto one common parameter, seam by seam across all patches.  The ladder is built on the union
of their knots, and each surface takes the knots within its own domain, as simple knots of the highest of their degrees.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from mracad.bspline.knots import KnotVector
from mracad.bspline.surface import Net
from mracad.seam.natural import Seam
from mracad.wavelet.ladder import arc_lengths, ladder_for_scale, rungs_by_level

Array = np.ndarray
Direction = tuple[int, int]
"""A surface and one of its directions: 0 for u, 1 for v."""
Map = tuple[float, float]
"""(slope, shift): common parameter = slope · own parameter + shift."""
Creases = tuple[frozenset[float], frozenset[float]]
"""Crease lines of a surface in u and v."""

SAME = 1e-9
"""Fraction of the common domain within which knots count as equal."""


@dataclass(frozen=True, eq=False)
class Ladder:
    """The levels of directions that seams link.

    Attributes
    ----------
    members : mapping of Direction to Map
        Maps of directions onto the common parameter.
    levels : sequence of KnotVector
        Knots over the common parameter, from all knots to the coarsest.
    degrees : (int, int)
        Degrees of the coarse splines on the first level and on the others.
    creases : mapping of Direction to mapping of float to int
        Knots that a surface keeps on every level, and by how much their multiplicity exceeds the degree.
    simple : bool
        Whether all other knots of coarse levels are simple.
    """

    members: Mapping[Direction, Map]
    levels: Sequence[KnotVector]
    degrees: tuple[int, int]
    creases: Mapping[Direction, Mapping[float, int]]
    simple: bool = True

    def coarse(self, direction: Direction, level: int, fine: KnotVector) -> KnotVector:
        """The knots of one direction on a level; beyond the last level, those of the last.

        Parameters
        ----------
        direction : Direction
        level : int
            0 for all knots.
        fine : KnotVector
            Knots of the direction, with those of its neighbours; there may be more, and of a higher degree.
        """
        rung = self.levels[min(level, len(self.levels) - 1)]
        whole = rung is self.levels[0]
        degree = self.degrees[not whole]
        slope, shift = self.members[direction]
        at = (rung.breaks - shift) / slope
        near = np.abs(at[:, None] - fine.breaks).argmin(axis=1)
        own = np.abs(fine.breaks[near] - at) <= SAME * rung.period / abs(slope)
        near, copies = near[own], 1 if self.simple else rung.multiplicities[own]
        most = np.maximum(fine.multiplicities - (fine.degree - degree), 0)
        counts = np.zeros(len(fine.breaks), dtype=int)
        counts[near] = most[near] if whole else copies
        for knot, excess in self.creases[direction].items():
            counts[fine.breaks == knot] = degree + excess
        counts = np.minimum(counts, most)
        if degree == fine.degree:
            return fine.with_multiplicities(counts)
        if not fine.periodic:
            counts[[0, -1]] = degree + 1
        kept = counts > 0
        return KnotVector.from_multiplicities(fine.breaks[kept], counts[kept], degree, fine.periodic)


def ladders(
    nets: Mapping[int, Net], creases: Mapping[int, Creases], seams: Sequence[Seam], scale: float | None = None
) -> dict[Direction, Ladder]:
    """The ladder of every direction of some surfaces.

    Parameters
    ----------
    nets : mapping of int to Net
        The surfaces, by index.
    creases : mapping of int to Creases
    seams : sequence of Seam
        Seams between these surfaces.
    scale : float, optional
        If given, the ladders have only one level besides all knots: that of a scale, mm.
    """
    knots = {(i, axis): each for i, net in nets.items() for axis, each in enumerate((net.u, net.v))}
    found: dict[Direction, Ladder] = {}
    for members in _linked(knots, seams):
        found |= dict.fromkeys(members, _ladder(nets, creases, members, scale))
    return found


def _linked(knots: Mapping[Direction, KnotVector], seams: Sequence[Seam]) -> list[dict[Direction, Map]]:
    """Groups of directions that seams link, directly or through others; a seam that contradicts others is ignored."""
    of: dict[Direction, dict[Direction, Map]] = {m: {m: (1.0, 0.0)} for m in knots}
    for seam in seams:
        one, two = (seam.a.surface, 1 - seam.a.axis), (seam.b.surface, 1 - seam.b.axis)
        slope = (seam.a.stop - seam.a.start) / (seam.b.stop - seam.b.start)
        shift = seam.a.start - slope * seam.b.start
        if of[one] is of[two] or not _alike(knots[one], knots[two], slope, shift):
            continue
        # own parameter -> parameter of two -> parameter of one -> common parameter
        a, b = of[one][one]
        c, d = of[two][two]
        ratio = a * slope / c
        move = a * shift + b - ratio * d
        of[one] |= {member: (ratio * p, ratio * q + move) for member, (p, q) in of[two].items()}
        of |= dict.fromkeys(of[two], of[one])
    return list({id(members): members for members in of.values()}.values())


def _alike(one: KnotVector, two: KnotVector, slope: float, shift: float) -> bool:
    """Whether two vectors can share knots: both periodic, beginning at the same place, or neither."""
    if not (one.periodic and two.periodic):
        return one.periodic == two.periodic
    ends = sorted(slope * x + shift for x in two.domain)
    return bool(np.allclose(ends, one.domain, rtol=0.0, atol=SAME * one.period))


@dataclass(frozen=True, eq=False)
class _Placed:
    """A direction on the common, ascending parameter: its knots, those that it keeps, and the lengths of its spans."""

    knots: KnotVector
    kept: Array
    lengths: Array
    sharp: Mapping[float, int] = field(default_factory=dict)

    def rungs(self) -> list[KnotVector]:
        return rungs_by_level(self.knots, keep=self.kept, lengths=self.lengths)

    def density(self, rung: KnotVector) -> float:
        """Logarithm of the number of spans per length; a knot of multiplicity r counts as r knots."""
        return float(np.log((rung.multiplicities[1:-1].sum() + 1) / self.lengths.sum()))


def _ladder(
    nets: Mapping[int, Net], creases: Mapping[int, Creases], members: Mapping[Direction, Map], scale: float | None
) -> Ladder:
    """The ladder on the union of the members' own knots, of the lowest degree whose splines they all contain."""
    degrees = [(nets[i].u, nets[i].v)[axis].degree for i, axis in members]
    placed = [_placed(nets[m[0]], creases[m[0]][m[1]], m[1], way, min(degrees)) for m, way in members.items()]
    union, copies = _union(placed, [max(degrees) - degree for degree in degrees])
    if scale is None:
        levels = _levels(union, placed)
    else:
        levels = [union.knots, ladder_for_scale(union.knots, union.lengths, scale, union.kept)]
    sharp = {m: one.sharp for m, one in zip(members, placed, strict=True)}
    both = max(degrees), max(min(degrees), max(degrees) + 1 - copies)
    return Ladder(members, levels, both, sharp, scale is None)


def _levels(union: _Placed, placed: Sequence[_Placed]) -> list[KnotVector]:
    """Levels of a union: the densest that are no denser than the average of its members'."""
    rungs, each = union.rungs(), [(one, one.rungs()) for one in placed]
    both, levels = [(rung, union.density(rung)) for rung in rungs], [rungs[0]]
    for level in range(1, max(len(those) for _, those in each)):
        wanted = np.mean([one.density(those[min(level, len(those) - 1)]) for one, those in each])
        levels.append(next((rung for rung, density in both if density <= wanted + SAME), rungs[-1]))
    return levels


def _placed(net: Net, creases: frozenset[float], axis: int, way: Map, degree: int) -> _Placed:
    """A direction on the common parameter, its knots of a lower degree but the same smoothness."""
    knots, lengths = (net.u, net.v)[axis], arc_lengths(net, axis)
    order = slice(None, None, 1 if way[0] > 0 else -1)
    counts = np.clip(knots.multiplicities + degree - knots.degree, 1, degree)
    if not knots.periodic:
        counts[[0, -1]] = degree + 1
    breaks = way[0] * knots.breaks + way[1]
    kept = np.isin(knots.breaks, list(creases))
    if knots.periodic:
        kept[[0, -1]] = kept[[0, -1]].any()  # one line
    vector = KnotVector.from_multiplicities(breaks[order], counts[order], degree, knots.periodic)
    excess = zip(knots.breaks[kept].tolist(), (knots.multiplicities[kept] - knots.degree).tolist(), strict=True)
    return _Placed(vector, kept[order], lengths[order], dict(excess))


def _union(placed: Sequence[_Placed], elevations: Sequence[int]) -> tuple[_Placed, int]:
    """The union of all knots, with ends among those that are kept and mean lengths, and the least multiplicity once
    elevated."""
    every = np.sort(np.concatenate([one.knots.breaks for one in placed]))
    breaks = every[np.append(True, np.diff(every) > SAME * (every[-1] - every[0]))]
    middle = (breaks[:-1] + breaks[1:]) / 2
    counts, kept = np.ones(len(breaks), dtype=int), np.zeros(len(breaks), dtype=bool)
    total, shares, copies = np.zeros(len(middle)), np.zeros(len(middle)), np.ones(len(breaks), dtype=int)
    for one, more in zip(placed, elevations, strict=True):
        at = np.abs(one.knots.breaks[:, None] - breaks).argmin(axis=1)
        inner = slice(None) if one.knots.periodic else slice(1, -1)
        np.maximum.at(counts, at[inner], one.knots.multiplicities[inner])
        np.maximum.at(copies, at[inner], one.knots.multiplicities[inner] + more)
        kept[at[one.kept]] = True
        kept[at[[0, -1]]] |= not one.knots.periodic
        total += np.diff(np.interp(breaks, one.knots.breaks, np.append(0.0, np.cumsum(one.lengths))))
        shares += (middle > one.knots.breaks[0]) & (middle < one.knots.breaks[-1])
    first = placed[0].knots
    if not first.periodic:
        counts[[0, -1]] = first.degree + 1
    vector = KnotVector.from_multiplicities(breaks, counts, first.degree, first.periodic)
    return _Placed(vector, kept, total / np.maximum(shares, 1)), int(copies[1:-1].min(initial=1 << 30))
