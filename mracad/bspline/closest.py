"""Nearest points on NURBS surfaces.

Newton's method on half the squared distance, all points at once, from the nearest of a grid of points; where the
Hessian is not positive definite, the Gauss–Newton matrix replaces it.  Parameters stay within the domain (components
that push against its ends are fixed), and a step that does not come nearer is halved.
"""

from __future__ import annotations

import numpy as np

from mracad.bspline.surface import Net

Array = np.ndarray
_STEPS = 30
_SEEDS = 3  # with one, a point near a thin edge may end on the wrong side of it
_SETTLED = 1e-14, 1e-8  # shares of the surface's extent and of the distance; shorter steps do not change the distance
_PLACES = 100  # least number of places in each direction


def distances(net: Net, points: Array) -> Array:
    """Distance of each point ``(q, 3)`` from a surface, its natural borders included."""
    from scipy.spatial import cKDTree

    us, vs = _places(net, 0), _places(net, 1)
    grid = net.grid(us, vs).reshape(-1, 3)
    _, seeds = cKDTree(grid).query(points, k=_SEEDS)
    places = np.stack(np.divmod(seeds, len(vs)), axis=-1)
    starts = np.stack([us[places[..., 0]], vs[places[..., 1]]], axis=-1)
    uv, best = _descend(net, points, starts[:, 0])
    # seeds side by side lead to the same foot, unless that is beyond them
    first = places[:, 0].T
    around = [
        (at[np.maximum(k - 1, 0)], at[np.minimum(k + 1, len(at) - 1)]) for at, k in zip((us, vs), first, strict=True)
    ]
    beyond = np.any([(x < low) | (x > high) for x, (low, high) in zip(uv.T, around, strict=True)], axis=0)
    more = beyond[:, None] | (np.abs(places[:, 1:] - places[:, :1]) > 1).any(axis=-1)
    point, seed = np.nonzero(more)
    if len(point):
        np.minimum.at(best, point, _descend(net, points[point], starts[point, seed + 1])[1])
    return best


def _places(net: Net, axis: int) -> Array:
    """About a hundred parameters of one direction, half of them spread over the spans and half over the length."""
    knots, other = (net.u, net.v)[:: 1 - 2 * axis]
    spans = len(knots.breaks) - 1
    fine = np.interp(np.linspace(0, spans, 4 * spans + _PLACES), np.arange(spans + 1), knots.breaks)
    across = np.linspace(*other.domain, 9)
    lines = net.grid(fine, across) if axis == 0 else net.grid(across, fine)
    steps = np.linalg.norm(np.diff(lines, axis=axis), axis=2).max(axis=1 - axis)
    length = np.concatenate([[0.0], np.cumsum(steps)])
    even = np.interp(np.linspace(0, length[-1], _PLACES), length, fine) if length[-1] > 0 else fine[:1]
    return np.unique(np.concatenate([knots.breaks, even]))


def feet(net: Net, points: Array, uv: Array) -> tuple[Array, Array]:
    """The points of a surface nearest to points, as far as Newton's method reaches from given parameters.

    Parameters
    ----------
    net : Net
    points : ndarray (q, 3)
    uv : ndarray (q, 2)
        Initial parameters.

    Returns
    -------
    uv : ndarray (q, 2)
    distances : ndarray (q,)
    """
    uv, best = _descend(net, points, uv)
    # near their minimum, distances hardly depend on parameters
    low, high = _limits(net)
    tried = np.clip(uv + _newton(np.stack(net.evaluate(uv, 2)), points, uv, low, high)[0], low, high)
    rounding = 4 * np.finfo(float).eps * float(np.abs(net.poles).max())
    good = np.linalg.norm(net.evaluate(tried) - points, axis=1) <= best + rounding
    return np.where(good[:, None], tried, uv), best


def _limits(net: Net) -> tuple[Array, Array]:
    """Smallest and largest parameters; infinite where there are no limits."""
    low, high = np.array([net.u.domain, net.v.domain]).T
    periodic = np.array([net.u.periodic, net.v.periodic])
    return np.where(periodic, -np.inf, low), np.where(periodic, np.inf, high)


def _descend(net: Net, points: Array, uv: Array) -> tuple[Array, Array]:
    """Parameters that Newton's method reaches from given ones, and distances there."""
    low, high = _limits(net)
    uv = np.clip(uv, low, high)
    jets = np.stack(net.evaluate(uv, 2))
    best = np.linalg.norm(jets[0] - points, axis=1)
    active, extent = np.arange(len(points)), float(np.linalg.norm(np.ptp(net.poles, axis=(0, 1))))
    for _ in range(_STEPS):
        step, length = _newton(jets[:, active], points[active], uv[active], low, high)
        far = length > np.maximum(_SETTLED[0] * extent, _SETTLED[1] * best[active])
        active, step = active[far], step[far]
        moved = np.zeros(len(active), bool)
        share = 1.0
        while share > 1e-3 and not moved.all():
            rest = ~moved
            tried = np.clip(uv[active[rest]] + share * step[rest], low, high)
            found = np.stack(net.evaluate(tried, 2))
            there = np.linalg.norm(found[0] - points[active[rest]], axis=1)
            nearer = there < best[active[rest]] * (1 - 1e-15)
            which = active[rest][nearer]
            uv[which], best[which], jets[:, which] = tried[nearer], there[nearer], found[:, nearer]
            moved[np.flatnonzero(rest)[nearer]] = True
            share /= 4
        active = active[moved]
        if not len(active):
            break
    return uv, best


def _newton(jets: Array, points: Array, uv: Array, low: Array, high: Array) -> tuple[Array, Array]:
    """One step each, and how far it goes on the surface, given its points and derivatives there."""
    s, su, sv, suu, suv, svv = jets
    r = s - points
    gradient = np.stack([(r * su).sum(1), (r * sv).sum(1)], axis=1)
    a, b, c = (su * su).sum(1), (su * sv).sum(1), (sv * sv).sum(1)
    p, q, t = a + (r * suu).sum(1), b + (r * suv).sum(1), c + (r * svv).sum(1)
    bent = (p > 0) & (t > 0) & (p * t - q * q > 1e-6 * a * c)
    a, b, c = np.where(bent, p, a), np.where(bent, q, b), np.where(bent, t, c)
    held = ((uv <= low) & (gradient > 0)) | ((uv >= high) & (gradient < 0))
    gradient[held] = 0.0
    b = np.where(held.any(axis=1), 0.0, b)
    tiny = np.finfo(float).tiny
    determinant = np.maximum(a * c - b * b, 1e-14 * a * c + tiny)
    step = np.stack([b * gradient[:, 1] - c * gradient[:, 0], b * gradient[:, 0] - a * gradient[:, 1]], axis=1)
    step /= determinant[:, None]
    return step, np.linalg.norm(step[:, :1] * su + step[:, 1:] * sv, axis=1)
