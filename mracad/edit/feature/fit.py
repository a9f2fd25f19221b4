"""Control points that hold copies of a feature, and the knots that they need.

Control points are those of the interpolant at the Greville points (W δ in the polynomial space where the surface is
rational): a spline of the target's space is reproduced exactly.  Spans that are too wide are divided where the
interpolant misses the ideal.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from mracad.bspline.fit import interpolated
from mracad.bspline.knots import KnotVector
from mracad.bspline.surface import Net
from mracad.edit.feature.ideal import Copies
from mracad.edit.feature.patch import Patch
from mracad.errors import EditError
from mracad.wavelet.ladder import arc_lengths

Array = np.ndarray
Knots = tuple[KnotVector, KnotVector]

MISSED = 3e-4
"""Share of its height by which a copy may miss the ideal before knots are inserted."""

SMOOTH = 3
"""Degree to which degree 1 is raised under copies."""

FIRST = 4.0
"""Spans under a copy are at first no longer than its reach over this."""

SPARE = 1.5
"""Spans are not divided that are at most so many times as wide as those that held the feature."""

UNEVEN = 1.4
"""By how much a span may be wider somewhere than on average."""

ROUNDS, PIECES = 5, 6
"""Times that spans are divided, and into how many pieces at most each time."""

CHECKS, FEWEST, ALL = 300, 60, 30_000
"""Points in each direction at which a copy is compared with the ideal: at most, at least, and for all copies."""

NARROWEST = 1e-3
"""Least width of a knot span that is made for a copy, mm."""

MOST = 4_000_000
"""Control points that a net may grow to."""

_ACROSS = 160


class Fit:
    """Control points that hold copies on patches; the last ones of each patch are remembered.

    Parameters
    ----------
    copies : Copies
    some : ndarray of bool (copies,)
        Those that are to be held.
    """

    def __init__(self, copies: Copies, some: Array) -> None:
        self.copies, self.some = copies, some
        self._known: dict[int, tuple[Knots, Array]] = {}

    def on(self, patch: Patch) -> Array:
        """Which copies are to be held by a patch."""
        return self.copies.on(patch) & self.some

    def poles(self, patch: Patch, knots: Knots) -> Array:
        """Control points over some knots whose surface takes the ideal displacement, in the part's frame."""
        known = self._known.get(patch.index)
        if known is None or known[0] != knots:
            known = self._known[patch.index] = knots, self._made(patch, knots)
        return known[1]

    def _made(self, patch: Patch, knots: Knots) -> Array:
        us, vs = (kv.greville() for kv in knots)
        points, normals = patch.lattice(us, vs)
        values, count = self.copies.ideal(patch, points.reshape(-1, 3), normals.reshape(-1, 3), self.some)
        poles = through(patch, knots, values.reshape(points.shape))
        near = grown(count.reshape(points.shape[:2]) > 0, knots)
        return np.where(near[..., None], poles, 0.0)

    def knots(self, patch: Patch) -> Knots:
        """Knots of the patch's surface that hold the copies: its own, and such as divide spans too wide for them."""
        some = self.on(patch)
        if not some.any():
            return patch.knots
        u, v = (kv.elevated(SMOOTH) if kv.degree == 1 else kv for kv in patch.knots)
        widest = [float(arc_lengths(patch.net, axis).max()) for axis in (0, 1)]
        if all(UNEVEN * x <= SPARE * self._least(kv) for x, kv in zip(widest, (u, v), strict=True)):
            return u, v
        first = _first(self.copies, patch, some, max(widest))
        knots = u.refined(first[0]), v.refined(first[1])
        return divided(knots, lambda knots: self._more(patch, knots, some))

    def _more(self, patch: Patch, knots: Knots, some: Array) -> list[Array]:
        """Knots that divide the spans in which the interpolant misses the ideal."""
        if knots[0].count * knots[1].count > MOST:
            raise EditError(
                f"the copies need {knots[0].count} × {knots[1].count} control points on #{patch.faces[0].index + 1}",
                "use larger or fewer copies",
            )
        delta = Net(*knots, self.poles(patch, knots), weights_over(patch, knots))
        more = []
        for axis, (uv, span) in enumerate(between(self.copies, patch, knots, some)):
            kv = knots[axis]
            points, *tangents, normals = patch.evaluate(uv)
            wanted, _ = self.copies.ideal(patch, points, normals, self.some)
            missed = np.linalg.norm(np.asarray(delta.evaluate(uv)) - wanted, axis=1)
            limit = MISSED * self.copies.height
            more.append(split(kv, span, missed / limit, np.linalg.norm(tangents[axis], axis=1), self._least(kv)))
        return more

    def _least(self, kv: KnotVector) -> float:
        """Width of the spans that hold the smallest copy at this degree, mm."""
        return self.copies.feature.spacing * float(self.copies.sizes.min()) * (1.0 if kv.degree > 2 else 0.5)


def divided(knots: Knots, more: Callable[[Knots], Sequence[Array]]) -> Knots:
    """Knots with those that ``more`` asks for, a few times over."""
    for _ in range(ROUNDS):
        extra = more(knots)
        if not any(map(len, extra)):
            break
        knots = knots[0].refined(extra[0]), knots[1].refined(extra[1])
    return knots


def split(kv: KnotVector, span: Array, missed: Array, speed: Array, least: float) -> Array:
    """Knots that divide spans until they miss nothing, none narrower than need be.

    Parameters
    ----------
    kv : KnotVector
    span : ndarray (q,) of int
        Of points in them.
    missed : ndarray (q,)
        By how much the points are off, as a multiple of what they may be.
    speed : ndarray (q,)
        Length by parameter there.
    least : float
        Width that is narrow enough, mm.
    """
    worst, fastest = np.zeros(kv.spans), np.zeros(kv.spans)
    np.maximum.at(worst, span, missed)
    np.maximum.at(fastest, span, speed)
    width = fastest * np.diff(kv.breaks)
    most = np.where(width > SPARE * least, np.ceil(width / least), 1.0)
    pieces = np.clip(np.ceil(worst ** (1 / (kv.degree + 1))), 1, PIECES)
    return evenly(kv, np.minimum(pieces, most).astype(int))


def evenly(kv: KnotVector, pieces: Array) -> Array:
    """Knots that divide each span into equal pieces."""
    found = [
        low + (high - low) * np.arange(1, k) / k
        for low, high, k in zip(kv.breaks[:-1], kv.breaks[1:], pieces, strict=True)
        if k > 1
    ]
    return np.concatenate(found) if found else np.empty(0)


def through(patch: Patch, knots: Knots, values: Array) -> Array:
    """Control points ``(nu, nv, 3)`` over knots of a patch that take values at the Greville points."""
    weights = weights_over(patch, knots)
    if weights is None:
        return interpolated(*knots, values)
    us, vs = (kv.greville() for kv in knots)
    values = values * np.asarray(Net(*knots, weights[..., None]).grid(us, vs))
    return np.asarray(interpolated(*knots, values) / weights[..., None])


def weights_over(patch: Patch, knots: Knots) -> Array | None:
    """The weights of a patch over finer knots."""
    return patch.net.weights if patch.net.weights is None else patch.net.over(*knots).weights


def grown(near: Array, knots: Knots, steps: int = 1) -> Array:
    """Control points ``(nu, nv)`` at most so many steps beside some."""
    for axis, kv in enumerate(knots):
        for _ in range(steps):
            before, after = np.roll(near, 1, axis), np.roll(near, -1, axis)
            if not kv.periodic:
                np.moveaxis(before, axis, 0)[0] = False
                np.moveaxis(after, axis, 0)[-1] = False
            near = near | before | after
    return near


def _first(copies: Copies, patch: Patch, some: Array, longest: float) -> tuple[Array, Array]:
    """Knots that make spans under copies no longer than a share of their reach."""
    if 2 * longest <= float(copies.reach[some].min()) / FIRST:
        return np.empty(0), np.empty(0)
    at = [np.unique(np.r_[k.breaks, np.linspace(*k.domain, _ACROSS)]) for k in patch.knots]
    points = np.asarray(patch.net.grid(at[0], at[1]))
    room = _room(copies, points, some)
    u, v = (
        _needed(kv, x, points.swapaxes(0, axis), room.swapaxes(0, axis))
        for axis, (kv, x) in enumerate(zip(patch.knots, at, strict=True))
    )
    return u, v


def _room(copies: Copies, points: Array, some: Array) -> Array:
    """The least reach of copies that points ``(m, n)`` lie under; infinite where there is none."""
    from scipy.spatial import cKDTree

    room = np.full(points.shape[0] * points.shape[1], np.inf)
    tree = cKDTree(points.reshape(-1, 3))
    for i in np.flatnonzero(some):
        hit = tree.query_ball_point(copies.charts.origin[i], copies.reach[i])
        near = tree.query(copies.charts.origin[i])[1]
        room[hit] = np.minimum(room[hit], copies.reach[i])
        room[near] = min(room[near], copies.reach[i])
    return room.reshape(points.shape[:2])


def _needed(kv: KnotVector, at: Array, points: Array, room: Array) -> Array:
    """Knots of one direction, along the first axis, that make spans no longer than a share of the room there."""
    length = np.linalg.norm(np.diff(points, axis=0), axis=-1)
    cell = np.searchsorted(kv.breaks, (at[1:] + at[:-1]) / 2) - 1
    lengths = np.zeros((kv.spans, length.shape[1]))
    rooms = np.full((kv.spans, length.shape[1]), np.inf)
    np.add.at(lengths, cell, length)
    np.minimum.at(rooms, cell, np.minimum(room[1:], room[:-1]))
    pieces = (lengths / (rooms / FIRST)).max(axis=1)
    return evenly(kv, np.maximum(np.ceil(pieces - 1e-6), 1).astype(int))


def between(copies: Copies, patch: Patch, knots: Knots, some: Array) -> list[tuple[Array, Array]]:
    """For each direction: places under copies half-way between Greville points in it, on them in the other, and the
    spans they are in."""
    from scipy.spatial import cKDTree

    at = [k.greville() for k in knots]
    tree = cKDTree(np.asarray(patch.net.grid(at[0], at[1])).reshape(-1, 3))
    rng = np.random.default_rng(0)
    which = np.flatnonzero(some)
    hits = tree.query_ball_point(copies.charts.origin[which], copies.reach[which])
    most = int(np.clip(ALL // max(len(which), 1), FEWEST, CHECKS))
    chosen = [np.asarray(h, int) if len(h) <= most else rng.choice(h, most, replace=False) for h in hits]
    index = np.unique(np.concatenate(chosen)) if chosen else np.empty(0, int)
    found = []
    for axis, kv in enumerate(knots):
        place = list(np.divmod(index, len(at[1])))
        order = np.argsort(at[axis], kind="stable")
        rank = np.empty(len(order), int)
        rank[order] = np.arange(len(order))
        own = rank[place[axis]]
        keep = own + 1 < len(order)
        uv = np.stack([at[0][place[0]], at[1][place[1]]], axis=1)[keep]
        uv[:, axis] = (at[axis][order[own[keep]]] + at[axis][order[own[keep] + 1]]) / 2
        span = np.clip(np.searchsorted(kv.breaks, uv[:, axis], side="right") - 1, 0, kv.spans - 1)
        found.append((uv, span))
    return found
