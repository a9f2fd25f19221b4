"""NURBS curves as plain arrays: evaluation, exact knot insertion and degree elevation, Bézier pieces."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from math import comb

import numpy as np

from mracad.brief import line
from mracad.bspline.basis import jet
from mracad.bspline.knots import Array, KnotVector, Side
from mracad.bspline.refine import refinement
from mracad.errors import UsageError


@dataclass(frozen=True, eq=False)
class Curve:
    """A NURBS curve; two curves are equal if all their numbers are.

    Attributes
    ----------
    knots : KnotVector
    poles : ndarray (n, k)
        Euclidean control points.
    weights : ndarray (n,) or None
        None for a polynomial curve.
    """

    knots: KnotVector
    poles: Array
    weights: Array | None = None

    __repr__ = line

    def __post_init__(self) -> None:
        if self.poles.ndim != 2 or len(self.poles) != self.knots.count:
            raise UsageError(
                f"control points of shape {self.poles.shape}, but the knot vector needs {self.knots.count}"
            )
        check_weights(self.weights, self.poles.shape[:1])

    def evaluate(self, t: Array, derivatives: int = 0, side: Side = "right") -> Array:
        """Points and derivatives.

        Parameters
        ----------
        t : array_like (q,)
            Parameters; wrapped if periodic, otherwise the end polynomials continue beyond the domain.
        derivatives : int
            Highest derivative wanted.
        side : {"right", "left"}
            Which limit is taken at a knot.

        Returns
        -------
        ndarray (derivatives + 1, q, k)
            ``[r]`` is the r-th derivative with respect to the parameter.
        """
        poles = homogeneous(self.poles, self.weights)
        first, values = jet(self.knots, t, range(derivatives + 1), side)
        index = (first[:, None] + np.arange(self.knots.degree + 1)) % self.knots.count
        stack = np.ascontiguousarray(np.matmul(values, poles[index]).swapaxes(0, 1))
        return stack if self.weights is None else _curve_quotient(stack)

    def refined(self, extra_knots: Array | Sequence[float]) -> Curve:
        """The same curve with more knots, exactly; itself if there are none to insert."""
        fine = self.knots.refined(extra_knots)
        return self if fine == self.knots else self.over(fine)

    def over(self, fine: KnotVector) -> Curve:
        """The same curve over a finer knot vector, or one of higher degree."""
        poles = refinement(self.knots, fine).apply(homogeneous(self.poles, self.weights))
        return Curve(fine, *euclidean(poles, self.weights is not None))

    @cached_property
    def _key(self) -> tuple[KnotVector, bytes, bytes]:
        return self.knots, self.poles.tobytes(), b"" if self.weights is None else self.weights.tobytes()

    def __hash__(self) -> int:
        return hash(self._key)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Curve) and self._key == other._key

    def bezier(self) -> Array:
        """Homogeneous Bézier points of the polynomial (or rational) pieces, ``(s, d + 1, k + 1)``, read-only."""
        return self._bezier

    @cached_property
    def _bezier(self) -> Array:
        points, d = homogeneous(self.poles, self.weights), self.knots.degree
        if self.knots.spans > 1 or self.knots.multiplicities[0] <= d:
            knots, fine = self.knots.unrolled(), KnotVector(np.repeat(self.knots.breaks, d + 1), d)
            points = refinement(knots, fine).apply(points[np.arange(knots.count) % self.knots.count])
        if self.weights is None:
            points = np.concatenate([points, np.ones((len(points), 1))], axis=1)
        points = points.reshape(self.knots.spans, d + 1, -1)
        points.setflags(write=False)
        return points


def bezier_pieces(curves: Sequence[Curve]) -> Iterator[tuple[Array, Array]]:
    """Homogeneous Bézier points ``(q, d + 1, k + 1)`` of curves, and the index of each one's curve ``(q,)``, by
    degree."""
    by_degree: dict[int, list[tuple[Array, Array]]] = defaultdict(list)
    for i, curve in enumerate(curves):
        points = curve.bezier()
        by_degree[curve.knots.degree].append((points, np.full(len(points), i)))
    for parts in by_degree.values():
        points, owners = (np.concatenate(column) for column in zip(*parts, strict=True))
        yield points, owners


def check_weights(weights: Array | None, shape: tuple[int, ...]) -> None:
    if weights is None:
        return
    if weights.shape != shape:
        raise UsageError(f"weights of shape {weights.shape} for control points of shape {shape}")
    if not (weights > 0).all():
        raise UsageError("a weight is not positive")


def homogeneous(poles: Array, weights: Array | None) -> Array:
    """``(w P, w)``, or the control points themselves without weights."""
    if weights is None:
        return poles
    return np.concatenate([poles * weights[..., None], weights[..., None]], axis=-1)


def euclidean(poles: Array, rational: bool) -> tuple[Array, Array | None]:
    if not rational:
        return poles, None
    weights = poles[..., -1]
    return poles[..., :-1] / weights[..., None], np.ascontiguousarray(weights)


def _curve_quotient(stack: Array) -> Array:
    """Derivatives of ``A / w`` from those of ``(A, w)``, by Leibniz' rule."""
    top, w = stack[..., :-1].copy(), stack[..., -1:]
    for r in range(len(stack)):
        for i in range(1, r + 1):
            top[r] -= comb(r, i) * w[i] * top[r - i]
        top[r] /= w[0]
    return top
