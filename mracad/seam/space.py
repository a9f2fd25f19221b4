"""More control points for an edit, beside rims that are held."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from mracad.bspline.curve import Curve
from mracad.bspline.knots import KnotVector
from mracad.bspline.surface import Net
from mracad.memo import kept
from mracad.model.brep import Trim
from mracad.model.region import Course, spanned
from mracad.seam.hold import ISO, local_span
from mracad.wavelet.ladder import arc_lengths, piece_lengths

Array = np.ndarray

MOST_POINTS = 10_000
"""Largest number of control points to which a surface is refined."""

HALVINGS = 12

END = 1e-9
"""Fraction of the domain within which a parameter line is its end."""


@kept(64)
def refined(net: Net, held: tuple[Curve, ...], longest: tuple[float, float]) -> Net:
    """A surface with its knot spans halved beside held boundary curves until they are at most ``longest`` (mm) there,
    along u and v.

    Across a curve that is a parameter line, spans get shorter towards it step by step; along it they stay.
    """
    knots, course = [net.u, net.v], Course(held)
    lengths = [arc_lengths(net, axis) for axis in (0, 1)]
    for _ in range(HALVINGS if held else 0):
        boxes, owners = course.boxes(knots[0], knots[1])
        lines = np.array([_line(knots, curve) for curve in held])[owners]
        beside = (spanned(k, boxes[(lines < 0) | (lines == axis), :, axis]) for axis, k in enumerate(knots))
        long = [b & (n > most * (1 + 1e-9)) for b, n, most in zip(beside, lengths, longest, strict=True)]
        middles = (((k.breaks[:-1] + k.breaks[1:]) / 2)[which] for k, which in zip(knots, long, strict=True))
        finer = [k.refined(middle) for k, middle in zip(knots, middles, strict=True)]
        if finer == knots or finer[0].count * finer[1].count > MOST_POINTS:
            break
        knots = finer
        lengths = [_halved(net, axis, k, lengths[axis], long[axis]) for axis, k in enumerate(knots)]
    return net.over(knots[0], knots[1])


def _halved(net: Net, axis: int, knots: KnotVector, lengths: Array, which: Array) -> Array:
    """Arc lengths of the spans of ``knots``, from those before some of them were halved."""
    if not which.any():
        return lengths
    halves, found = np.repeat(which, 1 + which), np.repeat(lengths, 1 + which)
    found[halves] = piece_lengths(net, axis, np.stack([knots.breaks[:-1], knots.breaks[1:]], axis=1)[halves])
    return found


def _line(knots: Sequence[KnotVector], curve: Curve) -> int:
    """The axis across a boundary curve that is a parameter line; −1 if it is none."""
    for axis, (each, at) in enumerate(zip(knots, curve.poles.T, strict=True)):
        if at.max() - at.min() <= 2 * ISO * local_span(each, float(at.mean())):
            return axis
    return -1


def end(net: Net, trim: Trim) -> tuple[int, int] | None:
    """The axis across a boundary curve and the end (0, −1) of a clamped net on which it lies; None if on neither."""
    axis = _line((net.u, net.v), trim.curve)
    if axis < 0:
        return None
    knots = (net.u, net.v)[axis]
    if knots.periodic:
        return None
    at, (low, high) = float(trim.curve.poles[:, axis].mean()), knots.domain
    for place, limit, multiplicity in ((0, low, knots.multiplicities[0]), (-1, high, knots.multiplicities[-1])):
        if abs(at - limit) <= END * (high - low) and multiplicity == knots.degree + 1:
            return axis, place
    return None
