"""Seams that hold under a given displacement: the knots they need and the smallest change that makes them hold."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence

import numpy as np

from mracad.bspline.gram import gram
from mracad.bspline.knots import KnotVector
from mracad.bspline.net import Net
from mracad.constraint.couple import Conditions, Restoration
from mracad.constraint.seam import Border, Seam

Array = np.ndarray

SAME = 1e-9
"""Knots of two sides closer than this fraction of the seam are one knot."""

PASSES = 4


def held(
    nets: Mapping[int, Net], seams: Sequence[Seam], delta: Mapping[int, Array], free: Mapping[int, Array]
) -> dict[int, Array]:
    """The displacement nearest to a given one that keeps the joints along seams.

    Parameters
    ----------
    nets : mapping of int to Net
        By surface.
    seams : sequence of Seam
        Between these surfaces.
    delta : mapping of int to ndarray (nu, nv, 3)
        Offsets of the control points, mm; they are zero where ``free`` is false.
    free : mapping of int to ndarray of bool (nu, nv)
    """
    conditions = Conditions(nets, seams, {i: (net.u, net.v) for i, net in nets.items()})
    size = {i: float(np.ptp(net.poles.reshape(-1, 3), axis=0).max()) for i, net in nets.items()}
    diagonal = np.concatenate([size[i] ** 2 * np.outer(_mass(net.u), _mass(net.v)).ravel() for i, net in nets.items()])
    mask = np.concatenate([free[i].ravel() for i in nets])
    stacked = np.concatenate([delta[i].reshape(-1, 3) for i in nets])
    restoration = Restoration(conditions.matrix, diagonal, mask)
    for _ in range(PASSES):
        stacked = stacked - restoration.change(conditions.matrix @ stacked)
    return {i: stacked[conditions.first[i] :][: free[i].size].reshape(*free[i].shape, 3) for i in nets}


def _mass(knots: KnotVector) -> Array:
    """∫ N_i as a share of the domain."""
    return np.asarray(gram(knots).apply(np.ones(knots.count)) / knots.period)


def matching(
    knots: Mapping[tuple[int, int], KnotVector], seams: Sequence[Seam], spans: Collection[tuple[int, float, float]]
) -> dict[tuple[int, int], Array]:
    """Knots to insert so that both sides of seams hold the same curves, and the same tilts, within stretches of them.

    Parameters
    ----------
    knots : mapping
        Of each direction: a surface and 0 for u, 1 for v.
    seams : sequence of Seam
    spans : collection of (int, float, float)
        Stretches: the index of a seam, and the fractions where they begin and end.

    Returns
    -------
    dict of (int, int) to ndarray
        By direction, knots with repetition.
    """
    now = dict(knots)
    extra: dict[tuple[int, int], list[float]] = {}
    changed = True
    while changed:
        changed = False
        for number, low, high in spans:
            seam = seams[number]
            sides = [(b, now[b.surface, 1 - b.axis]) for b in (seam.a, seam.b)]
            share, smooth = _continuity(sides, 1 if seam.joint.varying else 0)
            chosen = (share > low) & (share < high)
            for border, kv in sides:
                wanted = np.clip(kv.degree - smooth[chosen], 0, kv.degree).astype(int)
                new = _missing(border, kv, share[chosen], wanted)
                if len(new):
                    key = border.surface, 1 - border.axis
                    extra.setdefault(key, []).extend(new)
                    now[key] = now[key].refined(new)
                    changed = True
    return {key: np.sort(found) for key, found in extra.items()}


def _continuity(sides: Sequence[tuple[Border, KnotVector]], lost: int) -> tuple[Array, Array]:
    """Fractions of a seam where either side has knots, and the continuity of the curves that both hold there."""
    every, smooth = [], []
    degree = min(kv.degree for _, kv in sides)
    for border, kv in sides:
        share = (kv.breaks - border.start) / (border.stop - border.start)
        inside = (share > SAME) & (share < 1 - SAME)
        every.append(share[inside])
        smooth.append(np.minimum(kv.degree - kv.multiplicities[inside], degree - 1))
    share, best = np.concatenate(every), np.concatenate(smooth)
    order = np.argsort(share, kind="stable")
    share, best = share[order], best[order]
    first = np.append(True, np.diff(share) > SAME)[: len(share)]
    group = np.cumsum(first) - 1
    least = np.full(int(first.sum()), degree)
    np.minimum.at(least, group, best)
    # where the ratio of the joint varies, tilts have one derivative less than the curves they come from
    return share[first], np.maximum(np.minimum(least, degree - 1 - lost), 0)


def _missing(border: Border, kv: KnotVector, share: Array, wanted: Array) -> list[float]:
    """Knots that one side lacks."""
    at = border.start + share * (border.stop - border.start)
    near = np.abs(kv.breaks[:, None] - at).argmin(axis=0) if len(at) else np.empty(0, int)
    have = np.abs(kv.breaks[near] - at) <= 2 * SAME * abs(border.stop - border.start)
    place = np.where(have, kv.breaks[near], at)
    count = wanted - np.where(have, kv.multiplicities[near], 0)
    return [float(x) for x, k in zip(place, count, strict=True) for _ in range(max(int(k), 0))]
