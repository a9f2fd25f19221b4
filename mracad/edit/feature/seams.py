"""Seams under copies of a feature: the stretches that move, and the admissible displacement nearest to the copies.

Only control points beside the stretches of seams that copies lie over take part, in windows of the nets; all others
have exactly the displacement of the copies.  Both sides of a stretch get the knots that its conditions need there.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from mracad.bspline.knots import KnotVector
from mracad.bspline.surface import Net
from mracad.edit.pose import WITHIN, worth
from mracad.edit.tolerances import Tolerances
from mracad.model.brep import Face
from mracad.model.cells import quadrature
from mracad.model.region import grown, supported
from mracad.seam.border import Border
from mracad.seam.conditions import SAME, doubled, matched
from mracad.seam.conditions import rows as seam_rows
from mracad.seam.contact import Contact
from mracad.seam.contact import rows as contact_rows
from mracad.seam.energy import masses
from mracad.seam.natural import Seam
from mracad.seam.solve import Problem, Soft, Space
from mracad.seam.trace import Trace, along, crossings
from mracad.seam.trimmed import TrimmedSeam
from mracad.seam.wishes import BENT

Array = np.ndarray
Stretch = tuple[float, float]


@dataclass(frozen=True)
class Size:
    """What copies are like.

    Attributes
    ----------
    error, reach : float
        Allowed error of the least copy, and the largest reach, mm.
    curvature : float
        Largest curvature of the flattest copy, 1/mm.
    """

    error: float
    reach: float
    curvature: float

    @property
    def allowed(self) -> tuple[float, float, float]:
        """By how much the gap (mm), the angle and the jump of curvature (1/mm) of a seam may grow."""
        gap, angle, bend = Tolerances().contact(self.reach)
        return gap, angle, max(bend, BENT * self.curvature)


@dataclass(frozen=True, eq=False)
class Crossing:
    """A seam under copies.

    Attributes
    ----------
    seam : Seam or TrimmedSeam
    stretches : sequence of (float, float)
        Pairs of fractions of its length between which control points that move reach it; the rest of it stays.
    halvings : int
        Number of times that the spans under them are halved.
    excess : float
        Opening over the allowed one, when last measured.
    """

    seam: Seam | TrimmedSeam
    stretches: Sequence[Stretch]
    halvings: int = 0
    excess: float = np.inf

    @property
    def bent(self) -> bool:
        """Whether it only keeps the curvature of a seam whose other conditions are exact."""
        return isinstance(self.seam, TrimmedSeam) and self.seam.since == 2

    @property
    def edges(self) -> set[int]:
        return {self.seam.edge, self.seam.twin}

    @property
    def surfaces(self) -> set[int]:
        return {self.seam.a.surface, self.seam.b.surface}

    def rests(self) -> Iterator[Stretch]:
        """The parts outside all stretches."""
        ends = [0.0, *(x for stretch in self.stretches for x in stretch), 1.0]
        yield from ((low, high) for low, high in zip(ends[::2], ends[1::2], strict=True) if low < high)


@dataclass(frozen=True, eq=False)
class Wanted:
    """The wanted offsets of copies on a surface.

    Attributes
    ----------
    net : Net
        The surface undisplaced, in the space of its displacement.
    offset, alone : ndarray (nu, nv, 3)
        Wanted offsets of its control points, mm: in all, and of the copies alone.
    free : ndarray of bool (nu, nv)
        Control points that may move.
    face : Face
        One of the faces on it.
    """

    net: Net
    offset: Array
    alone: Array
    free: Array
    face: Face


@dataclass(frozen=True, eq=False)
class _Window:
    """A part of a net: its rows and columns of control points, and a mask of those that take part."""

    part: tuple[slice, slice]
    net: Net
    local: Array


def trace(side: Border | Trace) -> Trace:
    """One side of a seam of either kind."""
    return along(side) if isinstance(side, Border) else side


def crossing(seam: Seam | TrimmedSeam, nets: Mapping[int, Net], moved: Mapping[int, Array]) -> Crossing:
    """The parts of a seam that copies move.

    Parameters
    ----------
    seam : Seam or TrimmedSeam
    nets : mapping of int to Net
        By surface.
    moved : mapping of int to ndarray of bool (nu, nv)
        Control points that move, by surface.
    """
    found: list[Stretch] = []
    for side in map(trace, (seam.a, seam.b)):
        net = nets[side.surface]
        knots = net.u, net.v
        # over finer knots, further functions may overlap these
        near = grown(moved[side.surface], knots, max(kv.degree for kv in knots))
        breaks = crossings(side, knots)
        shares = Net(*knots, near[..., None].astype(float)).evaluate(side.inside(net, (breaks[1:] + breaks[:-1]) / 2))
        hit = np.flatnonzero(np.asarray(shares)[:, 0] > 0)
        found += [(float(breaks[k]), float(breaks[k + 1])) for k in hit]
    return Crossing(seam, tuple(_merged(found)))


def _merged(stretches: Sequence[Stretch]) -> Iterator[Stretch]:
    """Stretches in order, adjoining ones merged."""
    low = high = -1.0
    for start, stop in sorted(stretches):
        if start > high + SAME:
            if high > low:
                yield low, high
            low = start
        high = max(high, stop)
    if high > low:
        yield low, high


def refined(nets: Mapping[int, Net], found: Sequence[Crossing]) -> dict[int, Net]:
    """The nets with the knots that seams need under copies."""
    result = dict(nets)
    for step in range(max((each.halvings for each in found), default=0)):
        again = [each for each in found if each.halvings > step]
        for i in {i for each in again for i in each.surfaces}:
            net = result[i]
            cells = np.logical_or.reduce([_met(net, side, stretches) for side, stretches in _on(i, again)])
            middles = ((kv.breaks[:-1] + kv.breaks[1:]) / 2 for kv in (net.u, net.v))
            result[i] = net.refined(*(x[cells.any(axis=1 - axis)] for axis, x in enumerate(middles)))
    parts = _exact_parts(found)
    return matched(doubled(matched(result, parts), parts), parts)


def _on(surface: int, found: Iterable[Crossing]) -> Iterator[tuple[Trace, Sequence[Stretch]]]:
    """The sides of seams that lie on a surface, and their stretches."""
    sides = ((trace(side), each.stretches) for each in found for side in (each.seam.a, each.seam.b))
    yield from ((side, stretches) for side, stretches in sides if side.surface == surface)


def _exact_parts(found: Sequence[Crossing]) -> list[Seam]:
    """The parts of seams that move exactly, as seams."""
    return [each.seam.part(*s) for each in found if isinstance(each.seam, Seam) for s in each.stretches]


def _met(net: Net, side: Trace, stretches: Sequence[Stretch]) -> Array:
    """Knot cells of a net through which stretches of a trace run, a mask."""
    shares = [np.empty(0)]
    for low, high in stretches:
        breaks = low + (high - low) * crossings(side.part(low, high), (net.u, net.v))
        shares.append((breaks[1:] + breaks[:-1]) / 2)
    return side.cells(net, np.concatenate(shares))


def held(wanted: Mapping[int, Wanted], found: Sequence[Crossing], size: Size) -> dict[int, Array]:
    """The offsets nearest to those wanted that keep seams under copies.

    Parameters
    ----------
    wanted : mapping of int to Wanted
        By surface; those of both sides of a seam have the same knots where copies move it.
    found : sequence of Crossing
    size : Size

    Returns
    -------
    dict of int to ndarray (nu, nv, 3)
    """
    result = {i: np.where(each.free[..., None], each.offset, 0.0) for i, each in wanted.items()}
    windows = {}
    for i in sorted({i for each in found for i in each.surfaces}):
        near, barred = _near(wanted[i].net, i, found)
        result[i] = np.where(barred[..., None], 0.0, result[i])
        windows[i] = _window(wanted[i].net, near, near & ~barred & wanted[i].free)
    if windows:
        laid = np.concatenate([result[i][window.part].reshape(-1, 3) for i, window in windows.items()])
        problem = _problem({i: wanted[i].face for i in windows}, laid, windows, found, size)
        change = problem.split(problem.nearest(np.zeros_like(problem.f)))
        for i, window in windows.items():
            result[i][window.part] += change[i]
    return result


def _problem(
    faces: Mapping[int, Face],
    laid: Array,
    windows: Mapping[int, _Window],
    found: Sequence[Crossing],
    size: Size,
) -> Problem:
    """The least changes of offsets ``(points, 3)`` that satisfy the seams."""
    nets = {i: window.net for i, window in windows.items()}
    spaces = {}
    for i, window in windows.items():
        # copies continue beyond trim curves, so control points that barely reach into a face stay near them
        points = quadrature(window.net, [replace(faces[i], trims=())])
        reached = Net(window.net.u, window.net.v, window.local[..., None].astype(float))
        near = np.asarray(reached.grid(points.u.ravel(), points.v.ravel()))[..., 0] > 0
        form = masses(window.net, replace(points, mask=points.mask & near))
        spaces[i] = Space(window.net, form, window.local, np.ones_like(window.local))
    rows, _ = seam_rows(nets, _exact_parts(found), everywhere=True)
    contacts = [
        Contact(each.seam.a.part(*stretch), each.seam.b.part(*stretch), each.seam.order, since=each.seam.since)
        for each in found
        if isinstance(each.seam, TrimmedSeam)
        for stretch in each.stretches
    ]
    if not contacts:
        return Problem(spaces, rows, -(rows @ laid))
    soft = contact_rows(nets, contacts)
    weight, limits = worth(size.error, size.reach), WITHIN * np.array(size.allowed)[soft.order]
    pull = weight * soft.pull(-(soft.matrix @ laid), limits)
    return Problem(spaces, rows, -(rows @ laid), Soft(weight * soft.form(limits), pull))


def _near(net: Net, surface: int, found: Sequence[Crossing]) -> tuple[Array, Array]:
    """Control points beside stretches of seams, and those on which the rest of these seams depends."""
    near, barred = (np.zeros(net.poles.shape[:2], bool) for _ in range(2))
    for each in found:
        for side in map(trace, (each.seam.a, each.seam.b)):
            if side.surface == surface:
                near |= supported(net, _met(net, side, each.stretches))
                barred |= supported(net, _met(net, side, tuple(each.rests())))
    return near, barred


def _window(net: Net, near: Array, local: Array) -> _Window:
    """The part of a net that contains the whole support of control points."""
    (rows, u), (columns, v) = (
        _cut(kv, np.flatnonzero(near.any(axis=1 - axis))) for axis, kv in enumerate((net.u, net.v))
    )
    part = rows, columns
    return _Window(part, Net(u, v, net.poles[part], None if net.weights is None else net.weights[part]), local[part])


def _cut(kv: KnotVector, functions: Array) -> tuple[slice, KnotVector]:
    """The functions that overlap given ones, and their knots; all in a periodic direction."""
    if kv.periodic:
        return slice(None), kv
    low = max(int(functions.min()) - kv.degree, 0)
    high = min(int(functions.max()) + kv.degree + 1, kv.count)
    return slice(low, high), KnotVector(kv.knots[low : high + kv.degree + 1], kv.degree)
