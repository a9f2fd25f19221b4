"""Conditions along seams, as rows on the control points of a problem.

Along a seam on knot lines of both surfaces, degrees and knots are made the same, exactly.  A displacement δ then
satisfies, at the Greville points of the splines along it,

    G0   δ_b = δ_a,   G1   ∂_n δ_b = a ∂_n δ_a + b ∂_t δ_a,   G2   ∂_nn δ_b = a² ∂_nn δ_a + r ∂_n δ_a + s ∂_t δ_a

(a, b, r, s of the input's joint: :class:`mracad.seam.joint.Joint`), or an equivalent with fewer control points in each
condition.  One condition per function of the space is exact where the joint's coefficients are constant, and leaves the
seam free to move where they vary.  With double knots along the seam (:func:`doubled`) it can be exact there too.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from itertools import pairwise
from typing import Any

import numpy as np

from mracad.bspline.basis import basis
from mracad.bspline.functions import functions
from mracad.bspline.knots import KnotVector
from mracad.bspline.surface import Net
from mracad.memo import kept
from mracad.seam.border import Border
from mracad.seam.joint import Joint
from mracad.seam.natural import Seam

Array = np.ndarray

ROUNDING = 1e-13
"""Share of the largest entry of the conditions of a seam below which entries are dropped."""

MOST_PLAIN = 1_000_000
"""Largest number of entries of a dense matrix in which conditions are simplified."""

SAME = 1e-9
"""Fraction of a seam within which knots of its two sides are the same."""


def laid_out(nets: Mapping[int, Net]) -> tuple[dict[int, int], int]:
    """Offset of the control points of each net when all are laid out one after another, and their total number."""
    ends = np.cumsum([0, *(net.u.count * net.v.count for net in nets.values())]).tolist()
    return dict(zip(nets, ends[:-1], strict=True)), ends[-1]


def matched(nets: Mapping[int, Net], seams: Sequence[Seam]) -> dict[int, Net]:
    """The nets with the degrees and the knots of their neighbours along seams, exactly.

    Both sides of every seam then have the same splines along it.
    """
    result, changed = _elevated(nets, seams), set(nets)
    for _ in nets:  # knots are passed on from seam to seam
        wanted: dict[int, tuple[list[float], list[float]]] = {}
        for seam in seams:
            if seam.a.surface not in changed and seam.b.surface not in changed:
                continue
            a, b = (_inner(_along(result[border.surface], border), border) for border in (seam.a, seam.b))
            if a == b:
                continue
            for border, own, other in ((seam.a, a, b), (seam.b, b, a)):
                share = np.array([*other], float)
                missing = np.maximum(np.array([*other.values()], int) - _counts(own, share), 0)
                more = _near(result, border, np.repeat(share, missing))
                wanted.setdefault(border.surface, ([], []))[1 - border.axis].extend(more)
        changed = {i for i, (u, v) in wanted.items() if u or v}
        if not changed:
            break
        for i in changed:
            both = zip(wanted[i], (result[i].u, result[i].v), strict=True)
            result[i] = result[i].refined(*(_most(each, SAME * knots.period) for each, knots in both))
    return result


def doubled(nets: Mapping[int, Net], seams: Sequence[Seam]) -> dict[int, Net]:
    """The nets with double knots along seams whose joint varies, so that their conditions can hold everywhere.

    Laws that are linear between knots get as many as they need.  Both sides still have the same splines along these
    seams, but other seams may have to be matched again.
    """
    result = dict(nets)
    for seam in seams:
        if _lost(seam.joint):
            for border in (seam.a, seam.b):
                net = result[border.surface]
                if _along(net, border).degree > 1:
                    more = np.array([*_double(_inner(_along(net, border), border), seam.joint.pieces)])
                    places = _near(result, border, more)
                    result[border.surface] = net.refined(*(places, [])[:: 1 if border.axis else -1])
    return result


def _double(inner: Mapping[float, int], pieces: int) -> Iterator[float]:
    """Fractions of further knots along a seam: all inner ones are double, and spans short enough for laws of so many
    pieces."""
    yield from (share for share, count in inner.items() if count == 1)
    ends = [0.0, *inner, 1.0]
    for low, high in pairwise(ends):
        count = math.ceil((pieces if low > 0 and high < 1 else 2 * pieces) * (high - low) - SAME)
        yield from (low + (high - low) * k / count for k in range(1, count) for _ in range(2))


def _lost(joint: Joint) -> int:
    """Number of continuous derivatives by which a condition along a seam falls short of the displacement."""
    return int(joint.varying or joint.shear != 0.0)


def _elevated(nets: Mapping[int, Net], seams: Sequence[Seam]) -> dict[int, Net]:
    """The nets, raised along seams to the highest degree of those that are joined there."""
    degrees = {(i, axis): knots.degree for i, net in nets.items() for axis, knots in enumerate((net.u, net.v))}
    sides = [[(border.surface, 1 - border.axis) for border in (seam.a, seam.b)] for seam in seams]
    unequal = True
    while unequal:
        unequal = False
        for one, other in sides:
            if degrees[one] != degrees[other]:
                degrees[one] = degrees[other] = max(degrees[one], degrees[other])
                unequal = True
    return {i: net.over(net.u.elevated(degrees[i, 0]), net.v.elevated(degrees[i, 1])) for i, net in nets.items()}


def _inner(knots: KnotVector, border: Border) -> Mapping[float, int]:
    """Fractions of the knots along a seam, and their multiplicities."""
    return _between(knots, border.start, border.stop)


@kept(1024)
def _between(knots: KnotVector, start: float, stop: float) -> Mapping[float, int]:
    """Fractions of the knots between two parameters, and their multiplicities; seams often share their knots."""
    breaks, counts = knots.repeated()
    counts = np.minimum(counts, knots.degree)  # an end of a surface may lie inside a seam
    share = (breaks - start) / (stop - start)
    order = np.argsort(share)
    return {float(x): int(n) for x, n in zip(share[order], counts[order], strict=True) if SAME < x < 1 - SAME}


def _counts(inner: Mapping[float, int], share: Array) -> Array:
    """Multiplicities of the knots of a side at fractions; 0 where it has none."""
    have, counts = (np.array([*each, 0.0]) for each in (inner.keys(), inner.values()))
    index = np.abs(have[:-1, None] - share).argmin(axis=0) if inner else np.full(len(share), -1)
    return np.where(np.abs(have[index] - share) <= SAME, counts[index], 0).astype(int)


def _near(nets: Mapping[int, Net], border: Border, share: Array) -> Array:
    """Parameters at fractions of a border: knots where they equal these to rounding."""
    knots = _along(nets[border.surface], border)
    at = knots.wrap(border.start + share * (border.stop - border.start))
    place = np.clip(np.searchsorted(knots.breaks, at), 1, knots.spans)
    low, high = knots.breaks[place - 1], knots.breaks[place]
    nearest = np.where(at - low <= high - at, low, high)
    return np.where(np.abs(nearest - at) <= SAME * abs(border.stop - border.start), nearest, at)


def _most(values: Iterable[float], apart: float) -> Array:
    """Sorted knots needed by several seams, without duplicates up to a distance."""
    result: list[float] = []
    for value in sorted(values):
        if not result or value - result[-1] > apart:
            result.append(value)
    return np.array(result)


def _along(net: Net, border: Border) -> KnotVector:
    return (net.u, net.v)[1 - border.axis]


def rows(
    nets: Mapping[int, Net],
    seams: Sequence[Seam],
    everywhere: bool = False,
    coarse: Mapping[int, tuple[KnotVector, KnotVector]] | None = None,
) -> tuple[Any, Array]:
    """The conditions of seams on displacements of surfaces.

    Parameters
    ----------
    nets : mapping of int to Net
        Spaces of the displacements by surface, with the same knots on both sides of every seam (:func:`matched`); their
        control points are laid out one after another.
    seams : sequence of Seam
    everywhere : bool
        Whether joints that vary are also exact, for which their knots must be double.
    coarse : mapping of int to pair of KnotVector, optional
        Coarse knots in u and v, by surface, if displacements lie in these splines: no more conditions than these need.

    Returns
    -------
    scipy.sparse.csr_array (conditions, points)
    ndarray of bool (conditions,)
        Conditions whose defect in the input is to be mended.
    """
    from scipy.sparse import csr_array

    first, total = laid_out(nets)
    implied: dict[int, list[int]] = {}
    for number, end in _implied(seams):
        implied.setdefault(number, []).append(end)
    spaces = coarse or {i: (net.u, net.v) for i, net in nets.items()}
    entries: list[tuple[Array, Array, Array]] = [(np.empty(0, int), np.empty(0, int), np.empty(0))]
    count, mended = 0, [np.empty(0, bool)]
    for number, seam in enumerate(seams):
        asked: KnotVector | None = None
        for order in range(seam.joint.order + 1):
            knots = _asked(spaces, seam, order if everywhere else 0)
            if knots != asked:
                asked, share = knots, knots.greville()
                sides = [(_sided(nets[b.surface], b, share), first[b.surface]) for b in (seam.b, seam.a)]
            column = np.concatenate([begin + index for (index, _), begin in sides], axis=1)
            value = np.concatenate(_terms(seam.joint, order, share, knots.breaks, sides), axis=1)
            row, column, value = _plain(knots, column, value)
            if order == 1:
                ends = [len(share) - 1 if end else 0 for end in implied.get(number, ())]
                more = ~np.isin(row, ends)
                row, column, value = row[more], column[more], value[more]
            entries.append((count + row, column, value))
            mended.append(np.full(len(share), (seam.joint.close, seam.joint.fit, False)[order]))
            count += len(share)
    row, column, value = (np.concatenate(part) for part in zip(*entries, strict=True))
    return csr_array((value, (row, column)), shape=(count, total)), np.concatenate(mended)


def _implied(seams: Sequence[Seam]) -> list[tuple[int, int]]:
    """Ends of seams (number, 0 or 1) at which the condition of first order follows from those of other seams.

    All round a corner, the tangents of n seams are combinations of two, so that n − 2 of the n conditions, one after
    another, imply the rest.  Laws that are only close contradict each other a little, and the corner could not tilt.
    """
    corners: dict[tuple[int, float, float], list[tuple[int, int]]] = {}
    for number, seam in enumerate(seams):
        if seam.joint.pieces:
            for border in (seam.a, seam.b):
                for end, (u, v) in enumerate(border.places(np.array([0.0, 1.0])).tolist()):
                    corners.setdefault((border.surface, u, v), []).append((number, end))
    beside: dict[tuple[int, int], list[tuple[int, int]]] = {}
    for one, other in (ends for ends in corners.values() if len(ends) == 2):
        beside.setdefault(one, []).append(other)
        beside.setdefault(other, []).append(one)
    found: list[tuple[int, int]] = []
    seen: set[tuple[int, int]] = set()
    for start in beside:
        around = [start]
        while start not in seen and (ahead := [each for each in beside[around[-1]] if each not in around]):
            around.append(ahead[0])
        if start not in seen and len(around) > 2 and start in beside[around[-1]]:
            found += around[:2]
        seen.update(around)
    return found


def _plain(knots: KnotVector, column: Array, value: Array) -> tuple[Array, Array, Array]:
    """Conditions at the Greville points, on the coefficients of the spline through them if that is sparser.

    If both sides have the same form across their seam, a condition then involves only a few control points.

    Parameters
    ----------
    knots : KnotVector
    column : ndarray (q, k) of int
    value : ndarray (q, k)

    Returns
    -------
    row, column, value : ndarray
        Entries that are not zero.
    """
    used, place = np.unique(column, return_inverse=True)
    asked: Array = np.zeros((len(column), len(used)))
    np.add.at(asked, (np.arange(len(column))[:, None], place.reshape(column.shape)), value)
    if asked.size <= MOST_PLAIN:
        table, inverse = _collocation(knots)
        plain: Array = inverse @ asked
        plain += inverse @ (asked - table @ plain)
        plain[np.abs(plain) <= ROUNDING * np.abs(plain).max(initial=0.0)] = 0.0
        same = np.abs(table @ plain - asked).max(initial=0.0) <= ROUNDING * np.abs(asked).max(initial=0.0)
        if same and np.count_nonzero(plain) < np.count_nonzero(asked):
            asked = plain
    row, place = np.nonzero(asked)
    return row, used[place], asked[row, place]


@kept(64)
def _collocation(knots: KnotVector) -> tuple[Array, Array]:
    """The functions at the Greville points, ``(n, n)``, and the inverse of this matrix."""
    first, local = basis(knots, knots.greville())
    table = np.zeros((knots.count, knots.count))
    table[np.arange(knots.count)[:, None], first[:, None] + np.arange(local.shape[1])] = local
    return table, np.linalg.inv(table)


def _terms(joint: Joint, order: int, share: Array, breaks: Array, sides: Sequence[Any]) -> tuple[Array, Array]:
    """The terms of a condition on side b and on side a, at fractions of a seam with knots at ``breaks``."""
    b, a = (table for (_, table), _ in sides)
    if order == 0:
        return b["s"], -a["s"]
    if order == 1:
        across, along = (law.at(share, breaks)[:, None] for law in (joint.across, joint.along))
        return b["n"], -(across * a["n"] + along * a["t"])
    return b["nn"], -(joint.across.values[0] ** 2 * a["nn"] + joint.bend * a["n"] + joint.shear * a["t"])


def _asked(spaces: Mapping[int, tuple[KnotVector, KnotVector]], seam: Seam, order: int) -> KnotVector:
    """The larger of the spaces of both sides along a seam, over its fractions; conditions hold at its Greville points.

    For an order above 0, the space in which the condition of that order lies.
    """
    more, lost = (order * max(seam.joint.across.degree, 0), _lost(seam.joint)) if order else (0, 0)
    both = (_fractions(spaces[b.surface][1 - b.axis], b.start, b.stop, more, lost) for b in (seam.a, seam.b))
    return max(both, key=lambda each: each.count)


@kept(1024)
def _fractions(knots: KnotVector, start: float, stop: float, more: int, lost: int) -> KnotVector:
    """The knots between two parameters as fractions, of a degree higher by ``more``, and with ``lost`` derivatives less
    than that leaves."""
    inner, degree = _between(knots, start, stop), knots.degree + more
    counts = [degree + 1, *(min(n + more + lost, degree) for n in inner.values()), degree + 1]
    return KnotVector.from_multiplicities([0.0, *inner, 1.0], counts, degree)


def _sided(net: Net, border: Border, share: Array) -> tuple[Array, dict[str, Array]]:
    """Control points ``(q, k)`` and the rational functions with derivatives n across, t along at fractions."""
    index, (s, u, v, uu, _, vv) = functions(net, border.places(share), 2, border.limits("right"))
    n, t, nn = (u, v, uu) if border.axis == 0 else (v, u, vv)
    return index, {"s": s, "n": n, "t": t * (border.stop - border.start), "nn": nn}
