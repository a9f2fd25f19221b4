"""Splines of other libraries as knots and control points, and back: what came in comes out."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np

from mracad.brief import line
from mracad.bspline.curve import Curve
from mracad.bspline.knots import Array, KnotVector
from mracad.bspline.surface import Net
from mracad.errors import UsageError

Spline = Any
"""A ``scipy.interpolate.BSpline`` or ``NdBSpline`` of two variables, a :class:`~mracad.bspline.curve.Curve` or a
:class:`~mracad.bspline.surface.Net`."""

Knots = tuple[KnotVector, ...]
"""Knots of a curve, or of a surface in u and v."""


@dataclass(frozen=True, eq=False)
class Form:
    """How control points become a spline of the type that came in.

    Attributes
    ----------
    knots : Knots
    weights : ndarray or None
        Of a rational spline; they stay.
    make : callable
        Gives the spline for knots, control points ``(nu, nv, k)`` or ``(n, k)``, and weights.
    turned : tuple of bool
        Directions that run backwards in the pyramid.
    """

    knots: Knots
    weights: Array | None
    make: Callable[[Knots, Array, Array | None], Spline]
    turned: tuple[bool, ...]

    __repr__ = line

    @property
    def domains(self) -> list[tuple[float, float]]:
        """First and last parameter of each direction."""
        return [knots.domain for knots in self.knots]

    def place(self, axis: int, at: Array, there: KnotVector) -> Array:
        """Parameters of the pyramid, whose knots are ``there``, as parameters of the spline."""
        own = self.knots[axis]
        if own == there and not self.turned[axis]:
            return at
        share = (at - there.domain[0]) / there.period
        return np.asarray(own.domain[0] + own.period * (1.0 - share if self.turned[axis] else share))

    def over(self, ladders: Sequence[Sequence[KnotVector]], rungs: Knots) -> Form:
        """The form over those of its knots that rungs of the pyramid's ladders leave."""
        knots = []
        for own, ladder, rung, turned in zip(self.knots, ladders, rungs, self.turned, strict=True):
            counts = np.zeros(len(own.breaks), dtype=int)
            counts[np.searchsorted(ladder[0].breaks, rung.breaks)] = rung.multiplicities
            knots.append(own.with_multiplicities(counts[::-1] if turned else counts))
        if self.weights is not None and tuple(knots) != self.knots:
            raise UsageError("a rational spline has weights on its finest knots only")
        return replace(self, knots=tuple(knots))

    def flipped(self, poles: Array) -> Array:
        """Control points of the pyramid in the order of the spline, or the other way."""
        return np.flip(poles, tuple(axis for axis, turned in enumerate(self.turned) if turned))

    def spline(self, poles: Array) -> Spline:
        """The spline with control points in the order of the pyramid."""
        return self.make(self.knots, np.ascontiguousarray(self.flipped(poles)), self.weights)


def lifted(spline: Spline) -> tuple[Form, Array]:
    """The form of a spline, and its control points ``(nu, nv, k)``, or ``(n, k)`` of a curve.

    Raises
    ------
    UsageError
        For anything else, more than two variables, complex control points, or degree 0.
    """
    if isinstance(spline, Curve):
        return Form((spline.knots,), spline.weights, _curve, (False,)), spline.poles
    if isinstance(spline, Net):
        return Form((spline.u, spline.v), spline.weights, _net, (False, False)), spline.poles
    from scipy.interpolate import BSpline, NdBSpline

    if isinstance(spline, BSpline):
        return _of_one(spline)
    if isinstance(spline, NdBSpline):
        return _of_many(spline)
    raise UsageError(f"{type(spline).__name__} is no spline: give a BSpline, NdBSpline, Curve or Net")


def _of_one(spline: Spline) -> tuple[Form, Array]:
    knots = _knots(spline.t, spline.k, spline.extrapolate == "periodic")
    n = len(spline.t) - spline.k - 1
    poles = _real(spline.c[:n])
    if knots.periodic and not np.array_equal(poles[knots.count :], poles[: n - knots.count]):
        knots = KnotVector(spline.t, spline.k)
    make = partial(_bspline, spline.c.shape[1:], spline.extrapolate, spline.axis)
    return Form((knots,), None, make, (False,)), poles[: knots.count].reshape(knots.count, -1)


def _of_many(spline: Spline) -> tuple[Form, Array]:
    degrees = [int(k) for k in spline.k]
    if len(degrees) > 2:
        raise UsageError(f"a spline of {len(degrees)} variables is no curve or surface")
    knots = tuple(KnotVector(t, k) for t, k in zip(spline.t, degrees, strict=True))
    shape = tuple(each.count for each in knots)
    poles = _real(spline.c)
    make = partial(_ndbspline, poles.shape[len(shape) :], spline.extrapolate)
    return Form(knots, None, make, (False,) * len(shape)), poles.reshape(*shape, -1)


def _knots(t: Array, degree: int, periodic: bool) -> KnotVector:
    """The knots; periodic if they repeat."""
    if periodic:
        try:
            return KnotVector(t, degree, periodic=True)
        except UsageError:
            pass
    return KnotVector(t, degree)


def _real(c: Array) -> Array:
    if not c.size:
        raise UsageError("the spline has no values")
    if np.iscomplexobj(c):
        raise UsageError("control points are complex: give the real and the imaginary part as two coordinates")
    return np.asarray(c, dtype=float)


def _curve(knots: Knots, poles: Array, weights: Array | None) -> Curve:
    return Curve(knots[0], poles, weights)


def _net(knots: Knots, poles: Array, weights: Array | None) -> Net:
    return Net(knots[0], knots[1], poles, weights)


def _bspline(
    rest: tuple[int, ...], extrapolate: Any, axis: int, knots: Knots, poles: Array, weights: Array | None
) -> Spline:
    from scipy.interpolate import BSpline

    (each,) = knots
    n = len(each.knots) - each.degree - 1
    c = poles[np.arange(n) % each.count].reshape(n, *rest)
    return BSpline(each.knots, np.moveaxis(c, 0, axis), each.degree, extrapolate, axis)


def _ndbspline(rest: tuple[int, ...], extrapolate: Any, knots: Knots, poles: Array, weights: Array | None) -> Spline:
    from scipy.interpolate import NdBSpline

    shape = tuple(each.count for each in knots)
    degrees = tuple(each.degree for each in knots)
    return NdBSpline(
        tuple(each.knots for each in knots), poles.reshape(*shape, *rest), degrees, extrapolate=extrapolate
    )
