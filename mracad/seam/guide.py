"""Edges that slide: creases between a face that moves and a neighbour that keeps its surface.

Along the curve of the edge in the parameter plane of the face that moves, a displacement δ satisfies

    n_B · δ = 0,      n_B the normal of the neighbour at the foot of the edge,

which keeps the edge on a plane exactly and on a curved neighbour to first order.  The remaining error there is

    d(f + δ) − d(f),      d the signed distance from the neighbour,

removed by Newton steps n_B · c = −(d(f + δ) − d(f)) with the normals at the new feet.  On a natural boundary of the
face the conditions hold at the Greville points of the splines along it: on a plane that is n_B · δ_i = 0 for every
control point.  Elsewhere they hold as closely as the control points allow, at Gauss points of every piece between knot
lines.  At its ends an edge meets others: where none of them stays it follows its faces; where one stays, a line or a
circle between two faces that stay, its end moves along that one, which gets longer or shorter; otherwise it stays.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from mracad.bspline.closest import feet
from mracad.bspline.functions import functions
from mracad.bspline.knots import KnotVector
from mracad.bspline.surface import Net
from mracad.bspline.vectors import unit
from mracad.model.brep import Face, Model
from mracad.model.rails import Elementary, Path
from mracad.seam.cause import Cause
from mracad.seam.conditions import laid_out
from mracad.seam.guided import Guides
from mracad.seam.trace import LOOKS, Trace, pieces

Array = np.ndarray

POINTS = 3
"""Conditions in each piece of an edge between knot lines, off natural boundaries."""


@dataclass(frozen=True, eq=False)
class Freeform:
    """A NURBS face that stays, along which edges slide.

    Attributes
    ----------
    net : Net
        Its surface, in the frame of the face.
    face : Face
    seeds : ndarray (k, 2)
        Parameters of the edge on it.
    """

    net: Net
    face: Face
    seeds: Array

    def at(self, points: Array) -> tuple[Array, Array]:
        """Parameters of the nearest points ``(q, 2)``, and distances from them, mm."""
        local = self.face.local(points)
        near = np.linalg.norm(self.net.evaluate(self.seeds)[None] - local[:, None], axis=2).argmin(axis=1)
        return feet(self.net, local, self.seeds[near])

    def far(self, points: Array) -> Array:
        """Distances of points ``(q, 3)``, mm."""
        return self.at(points)[1]

    def off(self, points: Array) -> tuple[Array, Array]:
        """Signed distances of points ``(q, 3)`` and unit normals at their feet."""
        uv, _ = self.at(points)
        normals = self.face.turned(self.net.normals(uv))
        away = points - self.face.placed(np.asarray(self.net.evaluate(uv)))
        return (away * normals).sum(axis=1), normals


@dataclass(frozen=True, eq=False)
class Pin:
    """An end of an edge that slides.

    Attributes
    ----------
    uv : ndarray (2,)
        Parameters on the face that moves.
    path : Path or None
        The edge along which it moves; None if it stays.
    """

    uv: Array
    path: Path | None

    @property
    def count(self) -> int:
        """The number of its conditions."""
        return 3 if self.path is None else 2

    def off(self, points: Array, old: Array) -> tuple[Array, Array]:
        """By how much a point ``(1, 3)`` is farther away than the old one, mm, and the directions in which that
        counts."""
        if self.path is None:
            return (points - old)[0], np.eye(3)
        (foot, way), (before, _) = self.path.feet(points), self.path.feet(old)
        one = unit(np.cross(way, np.eye(3)[np.abs(way[0]).argmin()]))
        ways = np.concatenate([one, np.cross(way, one)])
        return ways @ (points - foot - old + before)[0], ways


@dataclass(frozen=True, eq=False)
class Slide:
    """An edge that slides.

    Attributes
    ----------
    edge, beside : int
        The edge, and the face along which it slides.
    trace : Trace
        The edge on the face that moves.
    border : (int, int) or None
        On a natural boundary, the axis across it and the end of the net (0, −1) on which it lies.
    ground : Elementary or Freeform
        The surface of the neighbour.
    pins : tuple of Pin
        Ends that do not just follow the faces.
    cause : Cause
        Why it stays if it cannot slide.
    """

    edge: int
    beside: int
    trace: Trace
    border: tuple[int, int] | None
    ground: Elementary | Freeform
    pins: tuple[Pin, ...]
    cause: Cause

    @property
    def curved(self) -> bool:
        """Whether Newton steps are needed besides the condition on displacements."""
        bent = any(pin.path is not None and pin.path.radius for pin in self.pins)
        return bent or not (isinstance(self.ground, Elementary) and self.ground.kind == "plane")

    def off(self, model: Model, net: Net, share: Array = LOOKS) -> Array:
        """Distances (mm) of the edge, on a displaced surface, from the neighbour at fractions of the edge."""
        face = model.faces[self.trace.face]
        points = np.asarray(net.evaluate(self.trace.places(share), 0, self.trace.limits))
        return self.ground.far(face.placed(points))


@dataclass(frozen=True, eq=False)
class Led:
    """Places of the conditions of edges that slide.

    Attributes
    ----------
    spots : sequence of (Slide, Pin or None, ndarray (q, 2))
        An edge or one of its ends, and parameters on the face that moves.
    slack : ndarray (conditions,)
        See :class:`mracad.seam.guided.Guides`.
    """

    spots: Sequence[tuple[Slide, Pin | None, Array]]
    slack: Array

    def guides(self, model: Model, nets: Mapping[int, Net]) -> Guides:
        """The conditions on displacements of surfaces, whose control points are laid out one after another.

        Parameters
        ----------
        model : Model
        nets : mapping of int to Net
            The surfaces undisplaced, in the spaces of their displacements.
        """
        ways, _ = self.aims(model, nets, nets)
        return Guides(self._matrix(nets), ways, self.slack, np.zeros(len(ways)))

    def aims(self, model: Model, nets: Mapping[int, Net], before: Mapping[int, Net]) -> tuple[Array, Array]:
        """The directions of the conditions ``(conditions, 3)``, and by how much surfaces are farther away in them than
        ``before``, ``(conditions,)``, mm."""
        ways, off = [np.empty((0, 3))], [np.empty(0)]
        for slide, pin, uv in self.spots:
            face, surface = model.faces[slide.trace.face], slide.trace.surface
            points, old = (
                face.placed(np.asarray(each[surface].evaluate(uv, 0, slide.trace.limits))) for each in (nets, before)
            )
            if pin is None:
                distance, normal = slide.ground.off(points)
                distance = distance - slide.ground.off(old)[0]
            else:
                distance, normal = pin.off(points, old)
            ways.append(normal @ face.frame[:3, :3])
            off.append(distance)
        return np.concatenate(ways), np.concatenate(off)

    def _matrix(self, nets: Mapping[int, Net]) -> Any:
        from scipy.sparse import csr_array

        first, total = laid_out(nets)
        rows, columns, values, count = [np.empty(0, int)], [np.empty(0, int)], [np.empty(0)], 0
        for slide, pin, uv in self.spots:
            index, (table,) = functions(nets[slide.trace.surface], uv, 0, slide.trace.limits)
            for _ in range(1 if pin is None else pin.count):
                rows.append(np.repeat(count + np.arange(len(uv)), index.shape[1]))
                columns.append(first[slide.trace.surface] + index.ravel())
                values.append(table.ravel())
                count += len(uv)
        entries = np.concatenate(values), (np.concatenate(rows), np.concatenate(columns))
        return csr_array(entries, shape=(count, total))


def led(nets: Mapping[int, Net], slides: Sequence[Slide], limit: float, weight: float) -> Led | None:
    """The places of the conditions of edges that slide; None without edges.

    Parameters
    ----------
    nets : mapping of int to Net
        The surfaces undisplaced, in the spaces of their displacements.
    slides : sequence of Slide
    limit : float
        Allowed error off natural boundaries, mm.
    weight : float
        Weight of a condition with its whole allowed error, mm³.
    """
    spots: list[tuple[Slide, Pin | None, Array]] = []
    slack = []
    for slide in slides:
        net = nets[slide.trace.surface]
        if slide.border is not None:
            uv = _along(net, slide)
            slack.append(np.zeros(len(uv)))
        else:
            share, part = pieces([slide.trace], nets, POINTS)
            uv = slide.trace.places(share)
            slack.append(limit**2 / (weight * slide.trace.length(net) * part))
        spots.append((slide, None, uv))
        for pin in slide.pins:
            spots.append((slide, pin, pin.uv[None]))
            slack.append(np.zeros(pin.count))
    return Led(spots, np.concatenate(slack)) if spots else None


def _along(net: Net, slide: Slide) -> Array:
    """Greville points ``(q, 2)`` of the splines along an edge on a natural boundary."""
    assert slide.border is not None
    axis, place = slide.border
    knots = (net.u, net.v)[1 - axis]
    ends = slide.trace.places(np.array([0.0, 1.0]))[:, 1 - axis]
    low, high = sorted(float(x) for x in ends)
    breaks, counts = knots.repeated()
    near = 1e-9 * (high - low)
    inner = (breaks > low + near) & (breaks < high - near)
    most = knots.degree + 1
    times = [most, *counts[inner].tolist(), most]
    along = KnotVector.from_multiplicities([low, *breaks[inner].tolist(), high], times, knots.degree).greville()
    at = (net.u, net.v)[axis].domain[place]
    return np.stack([np.full_like(along, at), along][:: 1 - 2 * axis], axis=1)
