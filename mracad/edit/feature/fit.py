"""Control points that hold a displacement, and the knots that they need.

The control points are those of the interpolant at the Greville points (of W δ in the polynomial space if the surface is
rational), so splines of the target's space are reproduced exactly.  Spans where the interpolant misses the ideal are
divided.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache

import numpy as np

from mracad.bspline.fit import SPARE, Knots, Sites, divided, evenly, missing, offsets_over, spans, through
from mracad.bspline.knots import KnotVector
from mracad.edit.feature.ideal import Copies
from mracad.edit.feature.patch import Patch
from mracad.errors import EditError
from mracad.model.region import grown
from mracad.wavelet.ladder import arc_lengths

Array = np.ndarray

MISSED = 3e-4
"""Share of its height by which a copy may miss the ideal before knots are inserted."""

SMOOTH = 3
"""Degree to which directions of a lower one are raised where copies need knots: they would crease facets, and jump in
curvature."""

FIRST = 4.0
"""Spans under a copy are at first no longer than its reach over this."""

UNEVEN = 1.4
"""Largest width of a span over its average."""

CHECKS, FEWEST, ALL = 300, 60, 30_000
"""Points in each direction at which a copy is compared with the ideal: at most, at least, and in all for all copies."""

APART, FINE = 3.0, 400_000
"""Where a copy has so many spans that more points are needed: so many spans between them, and points in all copies."""

NARROWEST = 1e-3
"""Least width of a knot span made for a copy, mm."""

MOST = 4_000_000
"""Largest number of control points of a net."""

_ACROSS = 160


def holding(copies: Copies, patch: Patch) -> tuple[Knots, Array]:
    """Knots of a patch that hold copies (its own, with too wide spans divided), and control points.

    Returns
    -------
    knots : pair of KnotVector
    poles : ndarray (nu, nv, 3)
        As from :func:`over_knots`.
    """
    poles = cache(lambda knots: over_knots(copies, patch, knots))
    widest = [float(arc_lengths(patch.net, axis).max()) for axis in (0, 1)]
    fine = [
        kv.degree > 1 and UNEVEN * x <= SPARE * _least(copies, kv) for x, kv in zip(widest, patch.knots, strict=True)
    ]
    u, v = (kv if enough else kv.elevated(SMOOTH) for enough, kv in zip(fine, patch.knots, strict=True))
    if all(fine):
        return (u, v), poles((u, v))
    least = [_least(copies, kv) for kv in (u, v)]
    first = _first(copies, patch, max(widest))

    def more(knots: Knots) -> Sequence[Array]:
        if knots[0].count * knots[1].count > MOST:
            raise EditError(
                f"the copies need {knots[0].count} × {knots[1].count} control points on #{patch.faces[0].index + 1}",
                "use larger or fewer copies",
            )
        delta = offsets_over(patch.net, knots, poles(knots))
        sites = between(copies, patch, knots)
        return missing(patch.net, delta, sites, lambda uv: copies.at(patch, uv), MISSED * copies.height, least)

    knots = divided((u.refined(first[0]), v.refined(first[1])), more)
    return knots, poles(knots)


def over_knots(copies: Copies, patch: Patch, knots: Knots) -> Array:
    """Control points over some knots that interpolate the ideal displacement, in the part's frame."""
    points, normals = patch.lattice(*(kv.greville() for kv in knots))
    values, count = copies.ideal(patch, points.reshape(-1, 3), normals.reshape(-1, 3))
    poles = through(patch.net.over(*knots), values.reshape(points.shape))
    near = grown(count.reshape(points.shape[:2]) > 0, knots)
    return np.where(near[..., None], poles, 0.0)


def _least(copies: Copies, kv: KnotVector) -> float:
    """Width of the spans that hold the smallest copy at this degree, mm."""
    return copies.feature.spacing * float(copies.sizes.min()) * (1.0 if kv.degree > 2 else 0.5)


def _first(copies: Copies, patch: Patch, longest: float) -> tuple[Array, Array]:
    """Knots that make spans under copies no longer than a share of their reach."""
    if 2 * longest <= float(copies.reach[copies.on(patch)].min()) / FIRST:
        return np.empty(0), np.empty(0)
    at = [np.unique(np.r_[k.breaks, np.linspace(*k.domain, _ACROSS)]) for k in patch.knots]
    points = np.asarray(patch.net.grid(at[0], at[1]))
    room = _room(copies, patch, points)
    u, v = (
        _needed(kv, x, points.swapaxes(0, axis), room.swapaxes(0, axis))
        for axis, (kv, x) in enumerate(zip(patch.knots, at, strict=True))
    )
    return u, v


def _room(copies: Copies, patch: Patch, points: Array) -> Array:
    """The least reach of the copies over points ``(m, n)``; infinite if there is none."""
    from scipy.spatial import cKDTree

    room = np.full(points.shape[0] * points.shape[1], np.inf)
    tree = cKDTree(points.reshape(-1, 3))
    for i in np.flatnonzero(copies.on(patch)):
        hit = tree.query_ball_point(copies.charts.origin[i], copies.reach[i])
        hit.append(tree.query(copies.charts.origin[i])[1])
        room[hit] = np.minimum(room[hit], copies.reach[i])
    return room.reshape(points.shape[:2])


def _needed(kv: KnotVector, at: Array, points: Array, room: Array) -> Array:
    """Knots to insert along the first axis so that spans are no longer than a share of the ``room`` there."""
    length = np.linalg.norm(np.diff(points, axis=0), axis=-1)
    cell = np.searchsorted(kv.breaks, (at[1:] + at[:-1]) / 2) - 1
    lengths, rooms = np.zeros((kv.spans, length.shape[1])), np.full((kv.spans, length.shape[1]), np.inf)
    np.add.at(lengths, cell, length)
    np.minimum.at(rooms, cell, np.minimum(room[1:], room[:-1]))
    pieces = (lengths / (rooms / FIRST)).max(axis=1)
    return evenly(kv, np.maximum(np.ceil(pieces - 1e-6), 1).astype(int))


def between(copies: Copies, patch: Patch, knots: Knots) -> Sites:
    """Places under copies, halfway between Greville points in one direction and on them in the other."""
    from scipy.spatial import cKDTree

    at = [k.greville() for k in knots]
    tree = cKDTree(np.asarray(patch.net.grid(at[0], at[1])).reshape(-1, 3))
    rng = np.random.default_rng(0)
    which = np.flatnonzero(copies.on(patch))
    hits = tree.query_ball_point(copies.charts.origin[which], copies.reach[which])
    each = max(len(which), 1)
    fine = (2 * copies.feature.reach / copies.feature.spacing / APART) ** 2
    most = int(max(np.clip(ALL // each, FEWEST, CHECKS), min(fine, FINE / each)))
    chosen = [np.asarray(h, int) if len(h) <= most else rng.choice(h, most, replace=False) for h in hits]
    place = np.divmod(np.unique(np.concatenate(chosen)), len(at[1]))
    found = []
    for axis, kv in enumerate(knots):
        order = np.argsort(at[axis], kind="stable")
        own = np.argsort(order)[place[axis]]
        keep = own + 1 < len(order)
        uv = np.stack([at[0][place[0]], at[1][place[1]]], axis=1)[keep]
        uv[:, axis] = (at[axis][order[own[keep]]] + at[axis][order[own[keep] + 1]]) / 2
        found.append((uv, spans(kv, uv[:, axis])))
    return found
