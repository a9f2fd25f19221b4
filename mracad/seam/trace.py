"""Traces: curves in the parameter planes of faces along which they meet, and directions across them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from mracad.bspline.basis import gauss_pieces
from mracad.bspline.curve import Curve
from mracad.bspline.knots import KnotVector
from mracad.bspline.knots import Side as Limit
from mracad.bspline.surface import Net
from mracad.bspline.vectors import components, cross, unit
from mracad.memo import kept
from mracad.model.brep import Face, Model, Trim
from mracad.model.region import meeting
from mracad.model.sampling import length, shares
from mracad.seam.border import Border
from mracad.seam.hold import local_span
from mracad.seam.sides import from_inside

Array = np.ndarray

SAMPLES = 1025
"""Number of points of a trace, between which it counts as straight when searching for crossings."""

NEAR = 1e-9
"""Crossings closer than this fraction of the edge count as one."""

EVENLY = np.linspace(0.0, 1.0, SAMPLES)
"""Fractions of a trace at these points."""

LOOKS = shares(75)
"""Fractions of a trace at which it is measured, as in the report."""


@dataclass(frozen=True, eq=False)
class Trace:
    """One side of a trimmed seam.

    Attributes
    ----------
    face, surface : int
    curve : Curve
        Curve in the parameter plane, over the edge's range.
    law : (ndarray, ndarray), optional
        Fractions of the seam and the corresponding fractions of the curve, if different.
    line : (int, float), optional
        The axis and the knot line on which it lies.
    limits : (str, str)
        The sides of knot lines in u and v on which the face lies.
    """

    face: int
    surface: int
    curve: Curve
    law: tuple[Array, Array] | None = None
    line: tuple[int, float] | None = None
    limits: tuple[Limit, Limit] = ("right", "right")

    def places(self, share: Array) -> Array:
        """Parameters ``(q, 2)`` at fractions of the seam."""
        uv = self.curve.evaluate(self._at(share))[0]
        if self.line is not None:
            uv[:, self.line[0]] = self.line[1]
        return np.asarray(uv)

    @cached_property
    def evenly(self) -> Array:
        """Parameters at the fractions ``EVENLY``."""
        return self.places(EVENLY)

    def on(self, net: Net, share: Array, derivatives: int) -> tuple[Array, ...]:
        """A surface and its derivatives at fractions of the seam, seen from inside the face."""
        return tuple(np.asarray(x) for x in net.evaluate(self.places(share), derivatives, self.limits))

    def inside(self, net: Net, share: Array) -> Array:
        """Parameters ``(q, 2)`` in the knot cells in which the face meets the seam at fractions of it."""
        uv = self.places(share)
        if self.line is not None:
            axis, at = self.line
            step = 0.5 * local_span((net.u, net.v)[axis], at)
            uv[:, axis] += step if self.limits[axis] == "right" else -step
        return uv

    def cells(self, net: Net, share: Array) -> Array:
        """Knot cells of a surface on which the face meets the seam at fractions of it, a mask."""
        uv = self.inside(net, share)
        return meeting(net.u, net.v, np.stack([uv, uv], axis=1))

    def part(self, low: float, high: float) -> Trace:
        """The part between two fractions of the seam, rescaled to 0 … 1."""
        share = np.linspace(low, high, 2 if self.law is None else SAMPLES)
        whole = share if self.law is None else np.interp(share, *self.law)
        return replace(self, law=(np.linspace(0.0, 1.0, len(share)), whole))

    def length(self, net: Net) -> float:
        """Length of the trace on a surface, mm."""
        return length(net.evaluate(self.evenly[::8]))

    def way(self, share: Array) -> Array:
        """Derivative of the curve by its own fraction, in the sense of the seam, ``(q, 2)``."""
        start, stop = self.curve.knots.domain
        back = self.law is not None and self.law[1][-1] < self.law[1][0]
        return np.asarray(self.curve.evaluate(self._at(share), 1)[1] * (start - stop if back else stop - start))

    def _at(self, share: Array) -> Array:
        start, stop = self.curve.knots.domain
        return start + (share if self.law is None else np.interp(share, *self.law)) * (stop - start)


def along(border: Border) -> Trace:
    """The trace of a border."""
    ends = Curve(KnotVector.clamped([0.0, 1.0], 1), border.places(np.array([0.0, 1.0])))
    return Trace(border.face, border.surface, ends, line=(border.axis, border.at), limits=border.limits("right"))


@kept(1024)
def trace_of(model: Model, face: Face, trim: Trim) -> Trace:
    """The trace by which a face meets one of its edges."""
    assert face.surface is not None
    net = model.surfaces[face.surface].net
    trace = Trace(face.index, face.surface, trim.curve)
    uv, limits = from_inside(face, net, trim.edge, trace.places(LOOKS))
    lines = [axis for axis in (0, 1) if np.ptp(uv[:, axis]) == 0.0]
    return replace(trace, line=(lines[0], float(uv[0, lines[0]])) if lines else None, limits=limits)


def crossings(trace: Trace, spaces: tuple[KnotVector, KnotVector]) -> Array:
    """Fractions of the edge, 0 and 1 among them, at which a trace crosses the knot lines of a space."""
    share = EVENLY
    found = [share[[0, -1]]]
    for knots, x in zip(spaces, trace.evenly.T, strict=True):
        lines = knots.breaks
        if knots.periodic:
            lines = np.unique(lines[None] + knots.period * np.arange(-2, 3)[:, None])
        low, high = np.minimum(x[:-1], x[1:]), np.maximum(x[:-1], x[1:])
        first, last = np.searchsorted(lines, low), np.searchsorted(lines, high)
        step = np.repeat(np.arange(len(low)), np.maximum(last - first, 0))
        line = lines[first[step] + np.arange(len(step)) - np.searchsorted(step, step)]
        inside = (line - x[step]) / (x[step + 1] - x[step])
        found.append(share[step] + inside * (share[1] - share[0]))
    every = np.sort(np.concatenate(found))
    return np.asarray(every[np.append(True, np.diff(every) > NEAR)])


def pieces(traces: Sequence[Trace], nets: Mapping[int, Net], points: int) -> tuple[Array, Array]:
    """Gauss points of the pieces of a seam between knot lines of its traces: fractions, and their shares of it."""
    found = [crossings(trace, (nets[trace.surface].u, nets[trace.surface].v)) for trace in traces]
    breaks = np.sort(np.concatenate(found))
    breaks = breaks[np.append(True, np.diff(breaks) > NEAR)]
    place, weight = gauss_pieces(breaks, points)
    return (breaks[:-1, None] + place).ravel(), weight.ravel()


def derived(table: Sequence[Array], way: Array, bend: Array, order: int) -> Array:
    """D_c of some order of basis functions, plus D_z for order 2.

    Parameters
    ----------
    table : sequence of ndarray (q, k)
        Derivatives, as from :func:`mracad.bspline.functions.functions`.
    way, bend : ndarray (q, 2)
        c and z.
    order : {0, 1, 2}

    Returns
    -------
    ndarray (q, k)
    """
    if order == 0:
        return table[0]
    x, y = way[:, :1], way[:, 1:]
    if order == 1:
        return np.asarray(x * table[1] + y * table[2])
    twice = x * x * table[3] + 2 * x * y * table[4] + y * y * table[5]
    return np.asarray(twice + bend[:, :1] * table[1] + bend[:, 1:] * table[2])


def directions(jets: Sequence[Sequence[Array] | Array], way: Array) -> list[tuple[Array, Array, Array]]:
    """For one or two sides of a seam the directions c, z and t ``(q, 2)`` in the parameter planes, t the unit tangent.

    Parameters
    ----------
    jets : sequence of sequence of ndarray (q, 3)
        The surface of each side and its derivatives at places of the seam, up to the first for z = 0, or the second.
    way : ndarray (q, 2)
        Direction of the seam in the parameter plane of the first.
    """
    _, su, sv, *second = jets[0]
    tangent = unit(su * way[:, :1] + sv * way[:, 1:])
    conormal = unit(cross(cross(su, sv), tangent))
    still = np.zeros_like(way)
    found = [(components(su, sv, conormal), still, components(su, sv, tangent))]
    for _, tu, tv, *other in jets[1:]:
        over = components(tu, tv, conormal)
        bend = components(tu, tv, _twice(found[0][0], second) - _twice(over, other)) if other else still
        found.append((over, bend, components(tu, tv, tangent)))
    return found


def _twice(way: Array, second: Sequence[Array]) -> Array:
    """Second derivative in a direction, from those along u and v."""
    x, y = way[:, :1], way[:, 1:]
    return np.asarray(x * x * second[0] + 2 * x * y * second[1] + y * y * second[2])
