"""NURBS surfaces as plain arrays: evaluation, normals, exact knot insertion and degree elevation."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Literal, overload

import numpy as np
from numpy.typing import ArrayLike

from mracad.brief import line
from mracad.bspline.basis import SHORT, jet
from mracad.bspline.curve import check_weights, euclidean, homogeneous
from mracad.bspline.gather import GATHER
from mracad.bspline.knots import Array, KnotVector, Side
from mracad.bspline.refine import refinement
from mracad.bspline.rows import Rows
from mracad.bspline.vectors import cross
from mracad.compiled import pointer
from mracad.errors import UsageError
from mracad.memo import kept

_BLOCK = 1 << 19


@dataclass(frozen=True, eq=False)
class Net:
    """A NURBS surface: the control net over two knot vectors.

    Attributes
    ----------
    u, v : KnotVector
    poles : ndarray (nu, nv, k)
        Euclidean control points.
    weights : ndarray (nu, nv) or None
        None for a polynomial surface.
    """

    u: KnotVector
    v: KnotVector
    poles: Array
    weights: Array | None = None

    __repr__ = line

    def __post_init__(self) -> None:
        if self.poles.ndim != 3 or self.poles.shape[:2] != (self.u.count, self.v.count):
            raise UsageError(
                f"control points of shape {self.poles.shape}, but the knots need {self.u.count} × {self.v.count}"
            )
        check_weights(self.weights, self.poles.shape[:2])
        for name in ("poles", "weights"):
            values = getattr(self, name)
            if values is not None and values.dtype != float:
                object.__setattr__(self, name, values.astype(float))

    def with_poles(self, poles: Array) -> Net:
        """The net with other control points over the same knots, with the same weights."""
        return Net(self.u, self.v, poles, self.weights)

    @overload
    def evaluate(self, uv: Array, derivatives: Literal[0] = 0, side: tuple[Side, Side] = ...) -> Array: ...  # type: ignore[overload-overlap]

    @overload
    def evaluate(self, uv: Array, derivatives: int, side: tuple[Side, Side] = ...) -> tuple[Array, ...]: ...

    def evaluate(
        self, uv: Array, derivatives: int = 0, side: tuple[Side, Side] = ("right", "right")
    ) -> Array | tuple[Array, ...]:
        """Points and derivatives at scattered parameters.

        Parameters
        ----------
        uv : array_like (q, 2)
            Parameters; wrapped if periodic, otherwise the end polynomials continue beyond the domain.
        derivatives : {0, 1, 2}
        side : pair of {"right", "left"}
            Which limit is taken at a knot of u and of v.

        Returns
        -------
        ndarray (q, k), or a tuple of such
            ``S``; ``(S, Su, Sv)``; or ``(S, Su, Sv, Suu, Suv, Svv)``.
        """
        uv = np.asarray(uv, dtype=float).reshape(-1, 2)
        size = (self.u.degree + 1) * (self.v.degree + 1) * (self.poles.shape[2] + (self.weights is not None))
        step = max(_BLOCK // size, 1)
        parts = [
            Collocation.of(self.u, self.v, uv[begin : begin + step], derivatives, side).evaluate(self)
            for begin in range(0, max(len(uv), 1), step)
        ]
        stack = parts[0] if len(parts) == 1 else tuple(np.concatenate(each) for each in zip(*parts, strict=True))
        return stack if derivatives else stack[0]

    @overload
    def grid(self, us: Array, vs: Array, derivatives: Literal[0] = 0, side: tuple[Side, Side] = ...) -> Array: ...  # type: ignore[overload-overlap]

    @overload
    def grid(self, us: Array, vs: Array, derivatives: int, side: tuple[Side, Side] = ...) -> tuple[Array, ...]: ...

    def grid(
        self, us: Array, vs: Array, derivatives: int = 0, side: tuple[Side, Side] = ("right", "right")
    ) -> Array | tuple[Array, ...]:
        """Points and first derivatives on the tensor product of two lists of parameters.

        Returns
        -------
        ndarray (qu, qv, k), or a tuple of such
            ``S``; or ``(S, Su, Sv)`` for ``derivatives=1``.
        """
        poles = homogeneous(self.poles, self.weights)
        in_u = collocation(self.u, us, derivatives, side[0])
        in_v = collocation(self.v, vs, derivatives, side[1])
        along_u = [rows.apply(poles, 0) for rows in in_u]
        stack = tuple(in_v[s].apply(along_u[r], 1) for total in range(derivatives + 1) for r, s in _pairs(total))
        if self.weights is not None:
            stack = surface_quotient(stack)
        return stack if derivatives else stack[0]

    def tangents(self, us: Array, vs: Array, axis: int) -> Array:
        """Only ``S_u`` (axis 0) or only ``S_v`` (axis 1) on the tensor product of two lists of parameters."""
        if self.weights is not None:
            return self.grid(us, vs, 1)[1 + axis]
        in_u = collocation(self.u, us, 1 - axis, "right")[-1]
        in_v = collocation(self.v, vs, axis, "right")[-1]
        return in_v.apply(in_u.apply(self.poles, 0), 1)

    def normals(
        self,
        uv: Array,
        side: tuple[Side, Side] = ("right", "right"),
        tangents: tuple[Array, Array] | None = None,
    ) -> Array:
        """Unit normals ``S_u × S_v / |…|``, ``(q, 3)``.

        Where the surface is degenerate (a collapsed side, a cusp) the limit from the middle of the domain is taken, by
        the second derivatives or, if those vanish too, from a point nearby; NaN where there is none.
        ``tangents`` are ``S_u`` and ``S_v``, if known.
        """
        uv = np.asarray(uv, dtype=float).reshape(-1, 2)
        su, sv = tangents or self.evaluate(uv, 1, side)[1:]
        return np.asarray(self.normals_beside(su[None], sv[None], [(uv, side)])[0])

    def normals_beside(self, su: Array, sv: Array, sides: Sequence[tuple[Array, tuple[Side, Side]]]) -> Array:
        """The same where several limits are taken at once, ``(sides, q, 3)``; from ``S_u`` and ``S_v``, and for each
        side the parameters and limits."""
        lengths = [np.linalg.norm(x, axis=2) for x in (su, sv)]
        floor = self.least_tangents
        normal = cross(su, sv)
        bad = ~(np.linalg.norm(normal, axis=2) > 1e-9 * lengths[0] * lengths[1])
        bad |= (lengths[0] < floor[0]) | (lengths[1] < floor[1])
        if bad.any():
            for own, degenerate, (uv, side) in zip(normal, bad, sides, strict=True):
                own[degenerate] = self._limits(uv[degenerate], side)
        return _unit(normal)

    @cached_property
    def least_tangents(self) -> tuple[float, float]:
        """Lengths of ``S_u`` and of ``S_v`` below which the surface is degenerate."""
        return 1e-7 * (self._extent / self.u.period), 1e-7 * (self._extent / self.v.period)

    @cached_property
    def _extent(self) -> float:
        high, low = self.poles.max(axis=0).max(axis=0), self.poles.min(axis=0).min(axis=0)
        return float(np.linalg.norm(high - low))

    def _limits(self, uv: Array, side: tuple[Side, Side]) -> Array:
        """Directions of the normal near ``uv``, towards the middle of the domain."""
        low, high = np.array([self.u.domain, self.v.domain]).T
        inward = (np.clip(uv, low, high) - 0.5 * (low + high)) * -1.0
        inward = np.where(inward == 0, high - low, inward)
        _, su, sv, suu, suv, svv = self.evaluate(uv, 2, side)
        e, f = inward[:, :1], inward[:, 1:]
        normal = e * (cross(suu, sv) + cross(su, suv)) + f * (cross(suv, sv) + cross(su, svv))
        size = self._extent**2 / ((high - low).prod())
        bad = ~(np.linalg.norm(normal, axis=1) > 1e-6 * size)
        if bad.any():
            _, su, sv = self.evaluate(uv[bad] + 1e-4 * inward[bad], 1)
            near = cross(su, sv)
            near[~(np.linalg.norm(near, axis=1) > 1e-13 * size)] = np.nan
            normal[bad] = near
        return np.asarray(normal)

    def refined(self, u_knots: Array | Sequence[float], v_knots: Array | Sequence[float]) -> Net:
        """The same surface with more knots, exactly; itself if there are none to insert."""
        return self.over(self.u.refined(u_knots), self.v.refined(v_knots))

    def over(self, u: KnotVector, v: KnotVector) -> Net:
        """The same surface over finer knot vectors, or ones of higher degree, exactly; itself over its own."""
        if (u, v) == (self.u, self.v):
            return self
        poles = homogeneous(self.poles, self.weights)
        if u != self.u:
            poles = refinement(self.u, u).apply(poles, 0)
        if v != self.v:
            poles = refinement(self.v, v).apply(poles, 1)
        return Net(u, v, *euclidean(poles, self.weights is not None))


@dataclass(frozen=True, eq=False)
class Collocation:
    """The functions of two knot vectors at scattered parameters, for surfaces over these knots.

    Attributes
    ----------
    rows, columns : ndarray of int (q, d + 1)
        Numbers whose sums are those of the control points, u-major.
    in_u, in_v : ndarray (q, derivatives + 1, d + 1)
        Values and derivatives of the functions of each.
    """

    rows: Array
    columns: Array
    in_u: Array
    in_v: Array

    @classmethod
    def of(cls, u: KnotVector, v: KnotVector, uv: Array, derivatives: int, side: tuple[Side, Side]) -> Collocation:
        """Arguments as for :meth:`Net.evaluate`."""
        first_u, in_u = jet(u, uv[:, 0], range(derivatives + 1), side[0])
        first_v, in_v = jet(v, uv[:, 1], range(derivatives + 1), side[1])
        row = (first_u[:, None] + np.arange(u.degree + 1)) % u.count
        column = (first_v[:, None] + np.arange(v.degree + 1)) % v.count
        return cls(row * v.count, column, in_u, in_v)

    def evaluate(self, net: Net) -> tuple[Array, ...]:
        """Points and derivatives, ``(q, k)`` each, in the order of :meth:`Net.evaluate`."""
        poles = homogeneous(net.poles, net.weights)
        places = self.rows, self.columns
        return evaluated(poles.reshape(-1, poles.shape[2]), places, (self.in_u, self.in_v), net.weights is not None)


def evaluated(
    poles: Array, places: tuple[Array, Array], functions: tuple[Array, Array], rational: bool
) -> tuple[Array, ...]:
    """Points and derivatives in the order of :meth:`Net.evaluate`, ``(q, k)`` each.

    Parameters
    ----------
    poles : ndarray (points, k)
        Control points, homogeneous if rational.
    places : pair of ndarray of int (q, du + 1) and (q, dv + 1)
        Numbers whose sums are those of the control points that matter.
    functions : pair of ndarray (q, derivatives + 1, d + 1)
        Values and derivatives of their functions.
    rational : bool
    """
    (rows, columns), (in_u, in_v), k = places, functions, poles.shape[1]
    (q, count, a), b = in_u.shape, in_v.shape[2]
    orders = [order for total in range(count) for order in _pairs(total)]
    found = np.zeros((len(orders), q, k))
    if GATHER.pays(q):
        held = [np.ascontiguousarray(each) for each in (poles, rows, columns, in_u, in_v)]
        at_poles, at_rows, at_columns, at_u, at_v = map(pointer, held)
        memory = np.empty(count * b * k)
        GATHER(at_poles, k, at_rows, at_columns, q, a, b, at_u, at_v, count, pointer(found), pointer(memory))
    else:
        local, partial = poles[rows[:, :, None] + columns[:, None]], np.zeros((q, count, b, k))
        for i in range(a):
            partial += in_u[:, :, i, None, None] * local[:, None, i]
        for one, (r, s) in zip(found, orders, strict=True):
            for j in range(b):
                one += in_v[:, s, j, None] * partial[:, r, j]
    return surface_quotient(tuple(found)) if rational else tuple(found)


def pairs(us: ArrayLike, vs: ArrayLike) -> Array:
    """All pairs of parameters ``(m n, 2)``, with v varying fastest."""
    return np.stack(np.meshgrid(us, vs, indexing="ij"), axis=-1).reshape(-1, 2)


def curvature(derivatives: tuple[Array, ...], direction: Array) -> Array:
    """Normal curvature of surfaces in given directions.

    κ = (L a² + 2 M a b + N b²) / |a S_u + b S_v|² with the unit normal S_u × S_v / |…|, the direction's part in the
    tangent plane being a S_u + b S_v.

    Parameters
    ----------
    derivatives : tuple of ndarray (q, 3)
        ``Su, Sv, Suu, Suv, Svv``.
    direction : ndarray (q, 3)

    Returns
    -------
    ndarray (q,)
        Curvatures, in one over the unit of length; NaN where the surface is degenerate.
    """
    su, sv, suu, suv, svv = derivatives
    e, f, g, p, q = ((x * y).sum(axis=1) for x, y in ((su, su), (su, sv), (sv, sv), (su, direction), (sv, direction)))
    normal = cross(su, sv)
    with np.errstate(invalid="ignore", divide="ignore"):
        determinant = e * g - f * f
        a, b = (p * g - q * f) / determinant, (q * e - p * f) / determinant
        bend = sum(w * (x * normal).sum(axis=1) for w, x in ((a * a, suu), (2 * a * b, suv), (b * b, svv)))
        return np.asarray(bend / np.sqrt(determinant) / (e * a * a + 2 * f * a * b + g * b * b))


def _pairs(total: int) -> list[tuple[int, int]]:
    """Derivative orders (in u, in v) of the given sum, u first."""
    return [(total - b, b) for b in range(total + 1)]


def collocation(kv: KnotVector, x: Array, derivatives: int, side: Side) -> list[Rows]:
    """Collocation matrices of the derivatives up to the given one."""
    x = np.asarray(x, dtype=float)
    if x.size <= SHORT:
        return _remembered(kv, x.tobytes(), derivatives, side)
    return _collocation(kv, x, derivatives, side)


@kept(1024)
def _remembered(kv: KnotVector, x: bytes, derivatives: int, side: Side) -> list[Rows]:
    """Cached matrices for few parameters: the same ones are often taken on many surfaces."""
    return _collocation(kv, np.frombuffer(x), derivatives, side)


def _collocation(kv: KnotVector, x: Array, derivatives: int, side: Side) -> list[Rows]:
    first, values = jet(kv, x, range(derivatives + 1), side)
    return [Rows(first, np.ascontiguousarray(part), kv.count, kv.periodic) for part in values.swapaxes(0, 1)]


def surface_quotient(stack: tuple[Array, ...]) -> tuple[Array, ...]:
    """Derivatives of ``A / w`` from those of ``(A, w)``, up to the second."""
    top, w = [x[..., :-1] for x in stack], [x[..., -1:] for x in stack]
    s = top[0] / w[0]
    if len(stack) == 1:
        return (s,)
    su, sv = (top[1] - w[1] * s) / w[0], (top[2] - w[2] * s) / w[0]
    if len(stack) == 3:
        return s, su, sv
    suu = (top[3] - 2 * w[1] * su - w[3] * s) / w[0]
    suv = (top[4] - w[1] * sv - w[2] * su - w[4] * s) / w[0]
    svv = (top[5] - 2 * w[2] * sv - w[5] * s) / w[0]
    return s, su, sv, suu, suv, svv


def _unit(vectors: Array) -> Array:
    with np.errstate(invalid="ignore", divide="ignore"):
        return np.asarray(vectors / np.linalg.norm(vectors, axis=-1, keepdims=True))
