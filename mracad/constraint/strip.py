"""Strips: the directions of surfaces that run side by side along seams, and the knot ladder that they share.

All directions of a strip are mapped affinely onto one line.  The ladder is walked on the union of their knots there,
so that a coarse knot of one is one of all, whatever the orientation; each direction takes the part of it within its own
domain.  Where degrees differ, a curve of the lowest degree d_min with a knot of multiplicity r is one of degree d with
multiplicity r + d − d_min; where a joint's ratio varies along a seam, T_n = a S_n + b S_t has one degree more than S_n
or one derivative less.  So the control points that such a seam looks at are given more copies of the coarse knots
(``lifted``), or the seam would lock; the rest of the surface does without.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass, field

import numpy as np

from mracad.bspline.knots import KnotVector
from mracad.constraint.seam import Seam

Array = np.ndarray
Direction = tuple[int, int]
"""A surface and one of its directions: 0 for u, 1 for v."""

SAME = 1e-9
"""Knots of two directions closer than this fraction of the strip are one knot."""


@dataclass(eq=False)
class Strip:
    """Directions on one line.

    Attributes
    ----------
    members : dict
        For each direction (slope, shift): line = slope · parameter + shift.
    copies : int
        Additional copies of each coarse knot, for joints of varying ratio.
    """

    members: dict[Direction, tuple[float, float]] = field(default_factory=dict)
    copies: int = 0


def strips(seams: Iterable[Seam], knots: Callable[[Direction], KnotVector]) -> tuple[list[Strip], dict[int, str]]:
    """Directions linked by seams, and the edges whose seam contradicts the others of its strip, with the reason."""
    of: dict[Direction, Strip] = {}
    refused: dict[int, str] = {}
    for seam in seams:
        one, two = (seam.a.surface, 1 - seam.a.axis), (seam.b.surface, 1 - seam.b.axis)
        slope = (seam.a.stop - seam.a.start) / (seam.b.stop - seam.b.start)
        shift = seam.a.start - slope * seam.b.start
        first, second = knots(one), knots(two)
        if first.periodic != second.periodic:
            refused[seam.edge] = "periodic on one side only"
            continue
        p = of.setdefault(one, Strip({one: (1.0, 0.0)}))
        q = of.setdefault(two, Strip({two: (1.0, 0.0)}))
        # parameter of two -> parameter of one -> line of p
        wanted = (p.members[one][0] * slope, p.members[one][0] * shift + p.members[one][1])
        low, high = second.domain
        size = abs(wanted[0]) * (high - low)
        if p is q:
            apart = [abs((wanted[0] - q.members[two][0]) * x + wanted[1] - q.members[two][1]) for x in (low, high)]
            if max(apart) > SAME * size:
                refused[seam.edge] = "its strip of faces closes on itself at another place"
                continue
        elif first.periodic and not _same_ends(first, second, slope, shift):
            refused[seam.edge] = "periodic faces that begin at different places"
            continue
        else:
            ratio = wanted[0] / q.members[two][0]
            move = wanted[1] - ratio * q.members[two][1]
            for member, (a, b) in q.members.items():
                p.members[member] = (ratio * a, ratio * b + move)
                of[member] = p
            p.copies = max(p.copies, q.copies)
        if seam.joint.varying and not _roomy(seam, first.degree, second.degree):
            p.copies = 1
    return list({id(s): s for s in of.values()}.values()), refused


def _same_ends(first: KnotVector, second: KnotVector, slope: float, shift: float) -> bool:
    ends = sorted(slope * x + shift for x in second.domain)
    return bool(np.allclose(ends, first.domain, rtol=0, atol=SAME * first.period))


def _roomy(seam: Seam, one: int, two: int) -> bool:
    """Whether the degree of T along the seam holds a S_n for every S_n already."""
    return len(seam.joint.along) == 0 and two - one >= len(seam.joint.across) - 1


@dataclass(frozen=True, eq=False)
class Line:
    """The union of a strip's knots.

    Attributes
    ----------
    knots : KnotVector
        On the line, in the strip's lowest degree.
    own : dict of Direction to ndarray
        For each direction and each break of the line: the parameter there, NaN beyond its domain.
    """

    knots: KnotVector
    own: dict[Direction, Array]
    kept: frozenset[float]
    lengths: Array


def line(
    strip: Strip,
    knots: Callable[[Direction], KnotVector],
    lengths: Callable[[Direction], Array],
    creases: Callable[[Direction], frozenset[float]],
) -> Line:
    """Put the knots of a strip on its line.

    ``lengths`` are the arc lengths of each direction's spans (mm), ``creases`` its knots that every level keeps.
    """
    spots = {m: slope * knots(m).breaks + shift for m, (slope, shift) in strip.members.items()}
    low, high = min(x.min() for x in spots.values()), max(x.max() for x in spots.values())
    every = np.sort(np.concatenate(list(spots.values())))
    breaks = every[np.append(True, np.diff(every) > SAME * (high - low))]
    degree = min(knots(m).degree for m in strip.members)
    mults, kept = np.ones(len(breaks), dtype=int), np.zeros(len(breaks), dtype=bool)
    own, total, share = {}, np.zeros(len(breaks) - 1), np.zeros(len(breaks) - 1)
    periodic = knots(next(iter(strip.members))).periodic
    for m, (slope, shift) in strip.members.items():
        kv, spot = knots(m), spots[m]
        at = np.abs(spot[:, None] - breaks).argmin(axis=1)
        reduced = np.clip(kv.multiplicities - (kv.degree - degree), 1, degree)
        inner = slice(None) if periodic else slice(1, -1)
        np.maximum.at(mults, at[inner], reduced[inner])
        kept[at[np.isin(kv.breaks, list(creases(m)))]] = True
        kept[at[[0, -1]]] = True
        parameter = (breaks - shift) / slope
        parameter[(breaks < spot.min() - SAME * (high - low)) | (breaks > spot.max() + SAME * (high - low))] = np.nan
        parameter[at] = kv.breaks
        own[m] = parameter
        order = np.argsort(spot)
        walked = np.append(0.0, np.cumsum(lengths(m) if slope > 0 else lengths(m)[::-1]))
        along = np.interp(breaks, spot[order], walked)
        inside = ~np.isnan(parameter[:-1]) & ~np.isnan(parameter[1:])
        total[inside] += np.diff(along)[inside]
        share[inside] += 1
    if not periodic:
        mults[[0, -1]] = degree + 1
    vector = KnotVector.from_multiplicities(breaks, mults, degree, periodic)
    return Line(vector, own, frozenset(breaks[kept].tolist()), total / np.maximum(share, 1))


@dataclass(frozen=True, eq=False)
class Coarse:
    """The coarse knots of one direction.

    Attributes
    ----------
    base : KnotVector
        Of the whole surface.
    lifted : KnotVector
        Of the control points that a seam along this direction looks at: ``base`` or a refinement of it.
    inserted : ndarray
        Knots that the surface must be given before it holds them all.
    """

    base: KnotVector
    lifted: KnotVector
    inserted: Array


def members(
    strip: Strip,
    line: Line,
    coarse: KnotVector,
    knots: Callable[[Direction], KnotVector],
    creases: Callable[[Direction], frozenset[float]],
) -> dict[Direction, Coarse]:
    """The coarse knots of every direction of a strip, from those of its line."""
    result = {}
    place = np.searchsorted(line.knots.breaks, coarse.breaks)
    for m in strip.members:
        kv = knots(m)
        lift = kv.degree - line.knots.degree
        more = lift + (strip.copies if len(strip.members) > 1 else 0)
        start, stop = kv.domain
        base: dict[float, int] = {}
        lifted: dict[float, int] = {}
        have = dict(zip(kv.breaks.tolist(), kv.multiplicities.tolist(), strict=True))
        for at, count in zip(line.own[m][place].tolist(), coarse.multiplicities.tolist(), strict=True):
            if kv.periodic or start < at < stop:
                base[at] = count if count == 1 else min(count + lift, kv.degree)
                lifted[at] = min(count + more, kv.degree)
        for at in creases(m):
            base[at] = lifted[at] = have[at]
        extra = [np.full(max(count - have.get(at, 0), 0), at) for at, count in lifted.items() if at != stop]
        inserted = np.sort(np.concatenate(extra)) if extra else np.empty(0)
        fine = kv.refined(inserted)
        spaces = [fine.with_multiplicities(np.array([w.get(float(x), 0) for x in fine.breaks])) for w in (base, lifted)]
        result[m] = Coarse(spaces[0], spaces[1], inserted)
    return result
