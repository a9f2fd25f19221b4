"""Charts: geodesic normal coordinates around places, and the frames carried along.

Around a place the coarse surface is the graph of a polynomial c(a, b) over its tangent plane, whatever its faces, knots
and parameters.  Geodesics of that graph (the exponential map) give coordinates (x, y) in millimetres; log
and exp are polynomials fitted to a fan of them.  In normal coordinates the differential of the log map is, in the
frame carried along geodesics by parallel transport, a symmetric matrix (Gauss' lemma), so that its polar
decomposition gives that frame.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise

import numpy as np

from mracad.memo import kept

Array = np.ndarray

DEGREE = 6
"""Degree of the graph; the maps have one more."""

RAYS, STEPS = 16, 8
"""The fan of geodesics."""

AWAY = 1.5
"""No geodesic of unit length goes farther than 1, nor faster, unless a step crossed a place that is too steep."""

RIDGE = 1e-9
"""Keeps fits with few points from oscillating."""


@kept(16)
def _powers(degree: int) -> tuple[Array, Array]:
    """Exponents of a and b, by total degree."""
    pairs = [(total - k, k) for total in range(degree + 1) for k in range(total + 1)]
    i, j = np.array(pairs).T
    return i, j


def monomials(a: Array, b: Array, degree: int) -> Array:
    """Monomials ``(…, terms)`` at points, by total degree."""
    tables = []
    for x, power in zip((a, b), _powers(degree), strict=True):
        table = np.ones((degree + 1, *np.shape(x)))
        for k in range(1, degree + 1):
            table[k] = table[k - 1] * x
        tables.append(np.moveaxis(table[power], 0, -1))
    return np.asarray(tables[0] * tables[1])


def fitted(a: Array, b: Array, values: Array, degree: int, mask: Array | None = None) -> Array:
    """Coefficients ``(m, terms, k)`` of polynomials fitted to ``values (m, q, k)`` at points ``(m, q)``."""
    rows = monomials(a, b, degree)
    if mask is not None:
        rows, values = rows * mask[..., None], values * mask[..., None]
    terms = rows.shape[-1]
    ridge = np.broadcast_to(RIDGE * np.eye(terms), (len(rows), terms, terms))
    q, r = np.linalg.qr(np.concatenate([rows, ridge], axis=1))
    return np.linalg.solve(r, np.swapaxes(q[:, : rows.shape[1]], 1, 2) @ values)


@dataclass(frozen=True, eq=False)
class Charts:
    """Normal coordinates around some places; lengths within the polynomials are fractions of the reach.

    Attributes
    ----------
    origin : ndarray (m, 3)
    axes : ndarray (m, 3, 3)
        Rows: the directions of a and b, and the normal of the plane they span.
    reach : ndarray (m,)
        Geodesic radius within which the chart holds, mm.
    graph : ndarray (m, terms)
    log, exp : ndarray (m, terms, 2)
    """

    origin: Array
    axes: Array
    reach: Array
    graph: Array
    log: Array
    exp: Array

    @classmethod
    def joined(cls, parts: Sequence[Charts]) -> Charts:
        """Charts of several lists in one."""
        return cls(*(np.concatenate([getattr(c, name) for c in parts]) for name in cls.__dataclass_fields__))

    def local(self, points: Array, which: Array) -> Array:
        """a, b and height (mm) of points ``(q, 3)``, each in one of the charts."""
        return np.asarray(np.einsum("qij,qj->qi", self.axes[which], points - self.origin[which]))

    def coordinates(self, local: Array, which: Array) -> Array:
        """Normal coordinates x, y (mm) of points given by a and b."""
        reach = self.reach[which]
        return np.asarray(reach[:, None] * self._sums(local[:, :2].T / reach, which, self.log))

    def places(self, xy: Array, which: Array) -> Array:
        """a and b (mm) of normal coordinates."""
        reach = self.reach[which]
        return np.asarray(reach[:, None] * self._sums(xy.T / reach, which, self.exp))

    def points(self, xy: Array, which: Array) -> Array:
        """Points ``(q, 3)`` of the graphs at normal coordinates."""
        ab = self.places(xy, which)
        height = self.reach[which, None] * self._sums(ab.T / self.reach[which], which, self._graphs)
        local = np.concatenate([ab, height], axis=1)
        return np.asarray(self.origin[which] + np.einsum("qi,qij->qj", local, self.axes[which]))

    @staticmethod
    def _sums(at: Array, which: Array, coefficients: Array) -> Array:
        """Polynomials ``(m, terms, k)`` of degree :data:`DEGREE` + 1 at points ``(2, q)``, each in its own chart."""
        rows = _products(at)
        found = np.empty((at.shape[1], coefficients.shape[2]))
        begin = np.append(np.flatnonzero(np.diff(which, prepend=-1)), len(which))
        for low, high in pairwise(begin.tolist()):
            found[low:high] = (coefficients[which[low]].T @ rows[:, low:high]).T
        return found

    @cached_property
    def _graphs(self) -> Array:
        """Coefficients ``(m, terms, 1)`` of the graphs, with those of the degree of the maps, which are 0."""
        return np.asarray(np.pad(self.graph, ((0, 0), (0, self.log.shape[1] - self.graph.shape[1])))[..., None])

    @cached_property
    def _jets(self) -> Array:
        """Coefficients ``(m, terms, 8)`` of x, y, their derivatives by a and by b, and the slopes of the graph."""
        graph = self._graphs
        by_a, by_b = _derivations()
        parts = [self.log, by_a @ self.log, by_b @ self.log, by_a @ graph, by_b @ graph]
        return np.concatenate(parts, axis=2)

    def jets(self, local: Array, which: Array) -> tuple[Array, Array]:
        """Normal coordinates ``(q, 2)`` of points and the frames ``(q, 3, 3)`` carried there: e_x, e_y, normal."""
        reach = self.reach[which]
        x, y, xa, ya, xb, yb, ca, cb = self._sums(local[:, :2].T / reach, which, self._jets).T
        f1, f2, n = _tangents(ca, cb)
        # the differential of (x, y) on the orthonormal tangents f1 and f2
        one = xa * f1[:, 0] + xb * f1[:, 1], ya * f1[:, 0] + yb * f1[:, 1]
        two = xa * f2[:, 0] + xb * f2[:, 1], ya * f2[:, 0] + yb * f2[:, 1]
        turn = np.arctan2(one[1] - two[0], one[0] + two[1])
        cos, sin = np.cos(turn)[:, None], np.sin(turn)[:, None]
        frame = np.stack([cos * f1 - sin * f2, sin * f1 + cos * f2, n], axis=1)
        return np.stack([reach * x, reach * y], axis=1), np.matmul(frame, self.axes[which])


def _products(at: Array) -> Array:
    """Monomials ``(terms, q)`` of degree :data:`DEGREE` + 1."""
    powers = np.ones((2, DEGREE + 2, at.shape[1]))
    for k in range(1, DEGREE + 2):
        np.multiply(powers[:, k - 1], at, out=powers[:, k])
    i, j = _powers(DEGREE + 1)
    return np.asarray(powers[0, i] * powers[1, j])


@kept(16)
def _derivations() -> tuple[Array, Array]:
    """Matrices that take the coefficients of a polynomial to those of its derivatives by a and by b."""
    i, j = _powers(DEGREE + 1)
    place = {pair: k for k, pair in enumerate(zip(i.tolist(), j.tolist(), strict=True))}
    by = np.zeros((2, len(i), len(i)))
    for (p, q), k in place.items():
        if p:
            by[0, place[p - 1, q], k] = p
        if q:
            by[1, place[p, q - 1], k] = q
    return by[0], by[1]


def _tangents(ca: Array, cb: Array) -> tuple[Array, Array, Array]:
    """Orthonormal tangents of the graph, the first over a, and the normal; in the chart's axes."""
    one = np.ones_like(ca)
    n = np.stack([-ca, -cb, one], axis=-1)
    n /= np.linalg.norm(n, axis=-1, keepdims=True)
    f1 = np.stack([one, 0 * one, ca], axis=-1)
    f1 /= np.linalg.norm(f1, axis=-1, keepdims=True)
    return f1, np.cross(n, f1), n


def charts(origin: Array, axes: Array, reach: Array, points: Array, mask: Array, degree: int = DEGREE) -> Charts:
    """Charts around places, from points of the coarse surface around each of them.

    Parameters
    ----------
    origin, axes, reach
        As in :class:`Charts`; x runs along the first axis.
    points : ndarray (m, q, 3)
    mask : ndarray of bool (m, q)
        Points that count.
    degree : int
        Degree of the graph.
    """
    local = np.einsum("mij,mqj->mqi", axes, points - origin[:, None]) / reach[:, None, None]
    a, b, c = (local[..., k] for k in range(3))
    found = fitted(a, b, c[..., None], degree, mask)[..., 0]
    graph = np.pad(found, ((0, 0), (0, len(_powers(DEGREE)[0]) - found.shape[1])))
    x, y, fan_a, fan_b = _fan(graph)
    fan = np.stack([fan_a, fan_b], axis=-1).reshape(len(origin), -1, 2)
    ray = np.stack([x, y], axis=-1).reshape(1, -1, 2)
    log = fitted(fan[..., 0], fan[..., 1], np.broadcast_to(ray, fan.shape), DEGREE + 1)
    exp = np.linalg.pinv(monomials(ray[0, :, 0], ray[0, :, 1], DEGREE + 1)) @ fan
    return Charts(origin, axes, reach, graph, log, exp)


def _fan(graph: Array) -> tuple[Array, Array, Array, Array]:
    """A fan of geodesics of unit length, by Runge–Kutta.

    Returns
    -------
    x, y : ndarray (rays, steps + 1)
        Normal coordinates.
    a, b : ndarray (m, rays, steps + 1)
        Places.
    """

    by_a, by_b = _derivations()
    padded = np.pad(graph, ((0, 0), (0, len(by_a) - graph.shape[1])))
    first = padded @ by_a.T, padded @ by_b.T
    wanted = np.stack([*first, first[0] @ by_a.T, first[0] @ by_b.T, first[1] @ by_b.T], axis=1)

    def rate(state: Array) -> Array:
        a, b, va, vb = np.clip(state, -AWAY, AWAY)
        rows = _products(np.stack([a.ravel(), b.ravel()])).reshape(-1, *a.shape)
        ca, cb, caa, cab, cbb = np.moveaxis(wanted @ np.moveaxis(rows, 0, 1), 1, 0)
        pull = -(caa * va**2 + 2 * cab * va * vb + cbb * vb**2) / (1 + ca**2 + cb**2)
        return np.stack([va, vb, ca * pull, cb * pull])

    angle = 2 * np.pi * np.arange(RAYS) / RAYS
    start = np.zeros((len(graph), RAYS))
    f1, f2, _ = _tangents(wanted[:, 0, :1], wanted[:, 1, :1])
    way = np.cos(angle)[:, None] * f1 + np.sin(angle)[:, None] * f2
    state = np.stack([start, start, way[..., 0], way[..., 1]])
    track = [state[:2]]
    h = 1.0 / STEPS
    for _ in range(STEPS):
        k1 = rate(state)
        k2 = rate(state + h / 2 * k1)
        k3 = rate(state + h / 2 * k2)
        k4 = rate(state + h * k3)
        state = state + h / 6 * (k1 + 2 * k2 + 2 * k3 + k4)
        track.append(state[:2])
    a, b = np.stack(track, axis=-1)
    radius = h * np.arange(STEPS + 1)
    x, y = np.cos(angle)[:, None] * radius, np.sin(angle)[:, None] * radius
    return x, y, a, b
