"""Copies of a feature that obey the seams under them: the admissible displacement nearest to the ideal one.

Only control points beside the stretches of seams that copies lie over take part, in windows of the nets: all others
have the displacement that the copies are.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from mracad.bspline.knots import KnotVector
from mracad.bspline.surface import Net
from mracad.constraint.border import Border
from mracad.constraint.frozen import jet_support, meeting
from mracad.constraint.seam import Seam
from mracad.constraint.trimmed import TrimmedSeam
from mracad.edit.feature.crossing import Crossing, Stretch, exact_parts, met, trace
from mracad.edit.feature.fit import grown
from mracad.model.brep import Face
from mracad.model.cells import quadrature
from mracad.model.region import supported
from mracad.seam.conditions import rows as seam_rows
from mracad.seam.contact import Contact
from mracad.seam.contact import rows as contact_rows
from mracad.seam.energy import forms
from mracad.seam.solve import Problem, Space

Array = np.ndarray


@dataclass(frozen=True, eq=False)
class Wanted:
    """What copies are on a surface.

    Attributes
    ----------
    net : Net
        The surface undisplaced, in the space of its displacement.
    offset : ndarray (nu, nv, 3)
        Of its control points, mm.
    free : ndarray of bool (nu, nv)
        Control points that may move.
    face : Face
        One of those on it.
    """

    net: Net
    offset: Array
    free: Array
    face: Face


@dataclass(frozen=True)
class Softness:
    """How closely seams to a tolerance are kept.

    Attributes
    ----------
    tolerances : (float, float, float)
        Of gaps (mm), angles and curvatures (1/mm).
    weight : float
        Squared displacement (mm²) times length (mm) that a seam off by its tolerances is worth.
    """

    tolerances: tuple[float, float, float]
    weight: float


@dataclass(frozen=True, eq=False)
class _Window:
    """A part of a net: the control points of its rows and columns, and which of them take part."""

    rows: slice
    columns: slice
    net: Net
    local: Array

    def cut(self, points: Array) -> Array:
        """What belongs to it of values ``(nu, nv, …)``."""
        return points[self.rows, self.columns]


def held(wanted: Mapping[int, Wanted], crossings: Sequence[Crossing], softness: Softness) -> dict[int, Array]:
    """The offsets nearest to those wanted that keep seams under copies.

    Parameters
    ----------
    wanted : mapping of int to Wanted
        By surface; those of both sides of a seam have the same knots where copies move it.
    crossings : sequence of Crossing
    softness : Softness

    Returns
    -------
    dict of int to ndarray (nu, nv, 3)
    """
    result = {i: np.where(each.free[..., None], each.offset, 0.0) for i, each in wanted.items()}
    windows = {}
    for i in sorted({i for each in crossings for i in each.surfaces}):
        near, barred = _near(wanted[i].net, i, crossings)
        result[i] = np.where(barred[..., None], 0.0, result[i])
        windows[i] = _window(wanted[i].net, near, near & ~barred & wanted[i].free)
    if not windows:
        return result
    problem = _problem(wanted, {i: w.cut(result[i]) for i, w in windows.items()}, windows, crossings, softness)
    change = problem.split(problem.nearest(np.zeros_like(problem.f)))
    for i, window in windows.items():
        window.cut(result[i])[...] += change[i]
    return result


def _problem(
    wanted: Mapping[int, Wanted],
    offsets: Mapping[int, Array],
    windows: Mapping[int, _Window],
    crossings: Sequence[Crossing],
    softness: Softness,
) -> Problem:
    """The changes of offsets that make seams hold, nearest to none."""
    nets = {i: window.net for i, window in windows.items()}
    spaces = {}
    for i, window in windows.items():
        # copies go on beyond trim curves: what barely reaches into a face stays near them
        masses = forms(window.net, window.net, quadrature(window.net, [replace(wanted[i].face, trims=())]))
        spaces[i] = Space(window.net, masses, window.local, np.ones_like(window.local))
    laid = np.concatenate([each.reshape(-1, 3) for each in offsets.values()])
    rows, _ = seam_rows(nets, exact_parts(crossings), everywhere=True)
    contacts = _contacts(crossings)
    if not contacts:
        return Problem(spaces, rows, -(rows @ laid))
    soft = contact_rows(nets, contacts)
    weight, limits = softness.weight, np.asarray(softness.tolerances)[soft.order]
    pull = weight * soft.pull(-(soft.matrix @ laid), limits)
    return Problem(spaces, rows, -(rows @ laid), weight * soft.form(limits), pull)


def _contacts(crossings: Sequence[Crossing]) -> list[Contact]:
    """Those parts of seams that are kept to a tolerance."""
    return [
        Contact(each.seam.a.part(*stretch), each.seam.b.part(*stretch), each.seam.order, since=each.seam.since)
        for each in crossings
        if isinstance(each.seam, TrimmedSeam)
        for stretch in each.stretches
    ]


def _near(net: Net, surface: int, crossings: Sequence[Crossing]) -> tuple[Array, Array]:
    """Control points beside stretches of seams, and those on which the rest of these seams depends."""
    near, barred = (np.zeros(net.poles.shape[:2], bool) for _ in range(2))
    for each in crossings:
        for side in (each.seam.a, each.seam.b):
            if side.surface != surface:
                continue
            if isinstance(each.seam, Seam) and isinstance(side, Border):
                rows, band = _across(net, side, each.seam.joint.order)
                near |= _crossed(net, side, band, each.stretches)
                barred |= _crossed(net, side, rows, tuple(each.rests()))
            else:
                own = trace(side)
                near |= supported(net, met(net, own, each.stretches))
                barred |= supported(net, met(net, own, tuple(each.rests())))
    return near, barred


def _across(net: Net, border: Border, order: int) -> tuple[Array, Array]:
    """Functions across a border on which its derivatives up to an order depend, and those that overlap these."""
    knots = (net.u, net.v)[border.axis]
    rows = jet_support(knots, border.at, order)
    wide = grown(rows[:, None], (knots, knots), knots.degree)[:, 0]
    return rows, wide


def _crossed(net: Net, border: Border, rows: Array, stretches: Sequence[Stretch]) -> Array:
    """Control points in some rows whose functions along a border overlap stretches of it."""
    knots = (net.u, net.v)[1 - border.axis]
    columns = np.zeros(knots.count, bool)
    margin = 1e-9 * abs(border.stop - border.start)
    for stretch in stretches:
        part = border.part(*stretch)
        low, high = sorted((part.start, part.stop))
        columns |= meeting(knots, low + margin, high - margin)
    return rows[:, None] & columns if border.axis == 0 else columns[:, None] & rows


def _window(net: Net, near: Array, local: Array) -> _Window:
    """The part of a net that holds the whole support of control points."""
    (rows, u), (columns, v) = (
        _cut(kv, np.flatnonzero(near.any(axis=1 - axis))) for axis, kv in enumerate((net.u, net.v))
    )
    weights = None if net.weights is None else net.weights[rows, columns]
    return _Window(rows, columns, Net(u, v, net.poles[rows, columns], weights), local[rows, columns])


def _cut(kv: KnotVector, functions: Array) -> tuple[slice, KnotVector]:
    """The functions that overlap some, and their knots; all of them in a periodic direction."""
    if kv.periodic:
        return slice(None), kv
    low = max(int(functions.min()) - kv.degree, 0)
    high = min(int(functions.max()) + kv.degree + 1, kv.count)
    return slice(low, high), KnotVector(kv.knots[low : high + kv.degree + 1], kv.degree)
