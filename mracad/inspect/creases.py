"""Angles of the normal across knot lines of a surface where its derivatives may jump."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from mracad.bspline.curve import homogeneous
from mracad.bspline.knots import KnotVector, Side
from mracad.bspline.rows import Rows
from mracad.bspline.surface import Net, collocation, surface_quotient
from mracad.model.brep import Face
from mracad.model.cells import inside_grid
from mracad.wavelet.ladder import arc_lengths

Array = np.ndarray
Tangents = tuple[Array, Array]
"""S_u and S_v on the left and right of knot lines, ``(2, n, 3)`` each."""

CLUSTER = 1e-4, 1e-6
"""Knots closer than this, mm, or than this fraction of the surface, count as one."""

BESIDE = 1e-5
"""Distance from a knot line at which faces are searched for, as a fraction of the span there."""

LIMITS: tuple[Side, Side] = "left", "right"


def lines(net: Net, axis: int) -> Array:
    """Knot lines at which tangents may jump.

    Returns
    -------
    ndarray (k, 2)
        Parameters at which a knot, or a cluster of knots, of multiplicity ``degree`` or more begins and ends.
    """
    kv = (net.u, net.v)[axis]
    spans = np.diff(kv.breaks)
    if kv.multiplicities[1:-1].max(initial=kv.multiplicities[0] * kv.periodic) < kv.degree and _even(spans):
        return np.empty((0, 2))
    lengths = arc_lengths(net, axis)
    near = lengths < max(CLUSTER[0], CLUSTER[1] * float(lengths.sum()))
    first = np.flatnonzero(np.append(True, ~near))
    last = np.append(first[1:] - 1, kv.spans)
    total = np.add.reduceat(kv.multiplicities, first)
    inner = (first > 0) & (last < kv.spans)
    if kv.periodic:
        inner[0] = first[0] == last[0] == 0
    found = inner & (total >= kv.degree)
    return np.stack([kv.breaks[first[found]], kv.breaks[last[found]]], axis=1)


def _even(spans: Array) -> bool:
    """Whether no two knots are close enough to count as one."""
    return bool(spans.min() > 1e-2 * spans.mean())


@dataclass(frozen=True, eq=False)
class Crossing:
    """Places on knot lines of one direction where faces lie on both sides.

    Attributes
    ----------
    knots : (KnotVector, KnotVector)
    axis : {0, 1}
        0 for lines u = const.
    at : ndarray (k, 2)
        The knot lines, as from :func:`lines`.
    places : ndarray (q,)
        Parameters along the lines.
    seen : ndarray of bool (k, q)
    """

    knots: tuple[KnotVector, KnotVector]
    axis: int
    at: Array
    places: Array
    seen: Array

    def tangents(self, net: Net) -> Tangents:
        """Those of a surface over these knots."""
        poles, found = np.swapaxes(homogeneous(net.poles, net.weights), 0, self.axis), []
        along, *across = self._rows
        for value, slope in across:
            here, beside = value.apply(poles, 0), slope.apply(poles, 0)
            stack: tuple[Array, ...] = (along[0].apply(here, 1), along[0].apply(beside, 1), along[1].apply(here, 1))
            if net.weights is not None:
                stack = surface_quotient(stack)
            first, second = (part[self.seen] for part in stack[1:])
            found.append((first, second) if self.axis == 0 else (second, first))
        su, sv = zip(*found, strict=True)
        return np.stack(su), np.stack(sv)

    def angles(self, net: Net, tangents: Tangents) -> Array:
        """Angles between the normals on either side of these knot lines of a surface with the given tangents; radians,
        NaN where it is degenerate."""
        one, other = net.normals_beside(*tangents, self._sides)
        return np.asarray(2 * np.arcsin(np.minimum(np.linalg.norm(other - one, axis=1) / 2, 1.0)))

    @cached_property
    def _rows(self) -> list[list[Rows]]:
        """Functions and their first derivatives: along the lines, and across them on their left and right."""
        kv, other = self.knots[:: 1 - 2 * self.axis]
        sides = (collocation(kv, self.at[:, k], 1, limit) for k, limit in enumerate(LIMITS))
        return [collocation(other, self.places, 1, LIMITS[1]), *sides]

    @cached_property
    def _sides(self) -> list[tuple[Array, tuple[Side, Side]]]:
        """Parameters of the points, ``(n, 2)``, and the limits to take there, left and right of the lines."""
        line, place = np.nonzero(self.seen)
        found: list[tuple[Array, tuple[Side, Side]]] = []
        for k, limit in enumerate(LIMITS):
            at = [self.at[line, k], self.places[place]][:: 1 - 2 * self.axis]
            found.append((np.stack(at, axis=1), (LIMITS[1], limit) if self.axis else (limit, LIMITS[1])))
        return found


def crossings(net: Net, faces: Sequence[Face], axis: int, places: Array) -> Crossing | None:
    """Places on knot lines u = const (axis 0) or v = const where tangents of faces may jump; None without any."""
    at = lines(net, axis)
    if not len(at):
        return None
    kv = (net.u, net.v)[axis]
    seen = np.zeros((len(at), len(places)), dtype=bool)
    for face in faces:
        seen |= np.logical_and(*(_present(face, net, axis, _aside(kv, at, side), places) for side in (0, 1)))
    return Crossing((net.u, net.v), axis, at, places, seen) if seen.any() else None


def _aside(kv: KnotVector, at: Array, side: int) -> Array:
    """Parameters just beside the lines, on the left (0) or on the right (1)."""
    limit = at[:, side]
    span, _ = kv.locate(limit, LIMITS[side])
    return np.asarray(limit + (2 * side - 1) * BESIDE * (kv.knots[span + 1] - kv.knots[span]))


def _present(face: Face, net: Net, axis: int, at: Array, places: Array) -> Array:
    return inside_grid(face, net, at, places) if axis == 0 else inside_grid(face, net, places, at).T
