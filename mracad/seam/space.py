"""More control points for an edit, beside rims that are held."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from mracad.bspline.surface import Net
from mracad.model.brep import Face, Trim
from mracad.model.region import face_region
from mracad.seam.hold import ISO, local_span
from mracad.wavelet.ladder import arc_lengths

Array = np.ndarray

MOST_POINTS = 10_000
"""Largest number of control points to which a surface is refined."""

HALVINGS = 12

END = 1e-9
"""Fraction of the domain within which a parameter line is its end."""


def refined(net: Net, held: Sequence[tuple[Face, Trim]], longest: tuple[float, float]) -> Net:
    """A surface with its knot spans halved beside held boundary curves until they are at most ``longest`` (mm) there,
    along u and v.

    Across a curve that is a parameter line, spans get shorter towards it step by step; along it they stay.
    """
    for _ in range(HALVINGS):
        halves = _halves(net, held, longest)
        if not any(map(len, halves)):
            break
        finer = net.refined(*halves)
        if finer.u.count * finer.v.count > MOST_POINTS:
            break
        net = finer
    return net


def _halves(net: Net, held: Sequence[tuple[Face, Trim]], longest: tuple[float, float]) -> tuple[Array, Array]:
    """Middles of the spans that are too long."""
    wanted = np.zeros(net.u.spans, bool), np.zeros(net.v.spans, bool)
    for face, trim in held:
        crossed = face_region(net, face).crossed[next(i for i, each in enumerate(face.trims) if each is trim)]
        across = line(net, trim)
        for axis in (0, 1):
            if across in (None, axis):
                wanted[axis][:] |= crossed.any(axis=1 - axis)
    found = []
    for axis, (knots, mask) in enumerate(zip((net.u, net.v), wanted, strict=True)):
        long = mask & (arc_lengths(net, axis) > longest[axis] * (1 + 1e-9))
        found.append(((knots.breaks[:-1] + knots.breaks[1:]) / 2)[long])
    return found[0], found[1]


def line(net: Net, trim: Trim) -> int | None:
    """The axis across a boundary curve that is a parameter line."""
    for axis, knots in enumerate((net.u, net.v)):
        at = trim.curve.poles[:, axis]
        if np.ptp(at) <= 2 * ISO * local_span(knots, float(at.mean())):
            return axis
    return None


def end(net: Net, trim: Trim) -> tuple[int, int] | None:
    """The axis across a boundary curve and the end (0, −1) of a clamped net on which it lies; None if on neither."""
    axis = line(net, trim)
    if axis is None:
        return None
    knots = (net.u, net.v)[axis]
    if knots.periodic:
        return None
    at, (low, high) = float(trim.curve.poles[:, axis].mean()), knots.domain
    for place, limit, multiplicity in ((0, low, knots.multiplicities[0]), (-1, high, knots.multiplicities[-1])):
        if abs(at - limit) <= END * (high - low) and multiplicity == knots.degree + 1:
            return axis, place
    return None
