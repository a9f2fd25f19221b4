"""Places all over the ground, by distances along it and over smooth seams.

No copy comes nearer to a border than the margin.  The feature's own place, if it has one, is among the places.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from mracad.edit.feature.clear import along, borders, parts
from mracad.edit.feature.detail import Feature
from mracad.edit.feature.field import Cloud, Field, framed
from mracad.edit.feature.ground import Ground
from mracad.edit.feature.locate import Place, edge_of
from mracad.edit.feature.rows import Rows
from mracad.edit.feature.spread import Area, Spots, apart, nearest, thrown
from mracad.errors import Code, EditError, MracadError, UsageError
from mracad.seam.interface import Joints, joints
from mracad.seam.wishes import Wishes
from mracad.spec import fill as spec
from mracad.spec.quantity import length
from mracad.spec.steps import Repeat

Array = np.ndarray

DENSITY, WAVES = 8.0, 10
"""Points at random for each square of the distance between places, at a time, and how many times: what is still free
after them is smaller than a place."""

FINE = 8.0
"""Points on borders within the distance that is kept."""

SHARE, CLOUD = 0.35, 14_000
"""Distance of points at which directions are known, in that of places, and their number, at most, about."""

COUNTS = {"hexagons": 6, "grid": 4}
"""Directions that are alike."""

TIED, EDGED, FIRM = 30.0, 1.5, 1e4
"""How directions hold to one in space, to that of an edge within how many steps, and how much."""


@dataclass(frozen=True, eq=False)
class Room:
    """The ground and what of it may be filled.

    Attributes
    ----------
    ground : Ground
    joined : Joints
    seed : int
    """

    ground: Ground
    joined: Joints
    seed: int

    @classmethod
    def of(cls, ground: Ground, wishes: Wishes, coupled: bool, seed: int) -> Room:
        """The room on a ground whose seams are joined unless they are frozen (not ``coupled``)."""
        return cls(ground, joints(ground.model, ground.chosen, wishes) if coupled else Joints(zones=wishes.zones), seed)

    @cached_property
    def parts(self) -> Array:
        """By face."""
        return parts(self.ground, self.joined)

    @cached_property
    def areas(self) -> list[Area]:
        return [Area(patch, self.seed) for patch in self.ground.patches.values()]

    def thrown(self, density: float) -> Spots:
        """Points at random, ``density`` per mm²."""
        return thrown(self.ground, self.parts, self.areas, density)

    def cloud(self, spacing: float) -> Cloud:
        """Points spread evenly, for places that are ``spacing`` apart."""
        step = max(spacing * SHARE, float(np.sqrt(sum(area.total for area in self.areas) / CLOUD)))
        spots = self.thrown(DENSITY / step**2)
        return Cloud(self.ground, spots.only(apart(spots, step)), step)

    def clear(self, spots: Spots, far: Array) -> Array:
        """Which of the points are at least ``far (m,)`` (mm) from borders."""
        most = float(far.max(initial=0.0))
        if most == 0:
            return np.ones(len(spots), bool)
        rims = borders(self.ground, self.joined, self.parts, most / FINE)
        return np.asarray(nearest(spots, rims, most)[0] >= far)


@dataclass(frozen=True, eq=False)
class Sizes:
    """Factors of copies by their distance from an edge.

    Attributes
    ----------
    cloud : Cloud
    far : ndarray (m,)
        Distances from the edge at its points, mm.
    ends, factors : (float, float)
    """

    cloud: Cloud
    far: Array
    ends: tuple[float, float]
    factors: tuple[float, float]

    @classmethod
    def of(cls, room: Room, cloud: Cloud, text: str, name: str) -> Sizes:
        """From a text; raises UsageError and EditError."""
        given, diagonal = spec.fade(text, name), room.ground.model.diagonal
        ends = spec.ends(given.distances, diagonal, name)
        if not ends[0] < ends[1]:
            raise UsageError(f"{name}: it ends at {ends[1]:g} mm, which is not farther than {ends[0]:g} mm", spec.FADE)
        return cls(cloud, cloud.far(_edge(room, given.edge, name, spec.FADE, cloud.step)), ends, given.factors)

    def at(self, spots: Spots) -> Array:
        """Factors at places."""
        hit, weight = self.cloud.near(spots)
        far = (weight * np.minimum(self.far[hit], 2 * self.ends[1])).sum(axis=1)
        return np.asarray(np.interp(far, self.ends, self.factors))


def _edge(room: Room, number: int, name: str, hint: str, step: float) -> Spots:
    """Points along an edge of the ground, by its number; raises UsageError and EditError."""
    edge_of(room.ground, number, name, hint)
    return along(room.ground, room.parts, number - 1, step / 2)


def filled(ground: Ground, feature: Feature, options: Repeat, wishes: Wishes) -> list[Place]:
    """Places all over the ground.

    Raises
    ------
    UsageError
        For invalid options.
    EditError
        If no place is as far from all borders as it must be.
    MracadError
        If there are too many places.
    """
    given = spec.fill(options.fill or "", "fill")
    spacing, far = (length(given.spacing, ground.model.diagonal, "fill: spacing"), _kept(ground, options))
    room = Room.of(ground, wishes, options.edges == "coupled", options.seed)
    _bounded(room, spacing)
    cloud, own = room.cloud(spacing), _own(room, feature)
    fades = [
        Sizes.of(room, cloud, text, name).at if text else _plain
        for text, name in ((options.size_by, "size-by"), (options.height_by, "height-by"))
    ]

    def open_(spots: Spots) -> Array:
        if far is None:
            return np.ones(len(spots), bool)
        return room.clear(spots, far + feature.reach * options.size * fades[0](spots))

    if given.kind == "poisson":
        found = random(room, spacing, open_, own)
    else:
        inner = room.clear(cloud.spots, np.full(len(cloud.spots), spacing))
        field = _field(room, cloud, spacing, options.align, COUNTS[given.kind])
        found = Rows(cloud, field, spacing, inner).over(own).only(slice(len(own), None))
        found = found.only(open_(found))
    if not len(found):
        raise EditError(
            "fill: no place on the faces is as far from their borders as a copy reaches, or as its margin",
            "give a smaller --margin or --size, or let borders cut copies off with --clip",
        )
    ways = _directions(room, cloud, spacing, options.align, found)
    sizes, heights = (each(found).tolist() for each in fades)
    return [
        Place(
            f"place {k + 1} of {len(found)}",
            found.points[k],
            int(found.face[k]),
            found.uv[k],
            size=sizes[k],
            height=heights[k],
            direction=ways[k],
        )
        for k in range(len(found))
    ]


def _plain(spots: Spots) -> Array:
    return np.ones(len(spots))


def _field(room: Room, cloud: Cloud, spacing: float, align: str | None, count: int) -> Field:
    """Directions of rows, of which ``count`` are alike; raises UsageError and EditError."""
    from scipy.spatial import cKDTree

    if align is None:
        return cloud.field(count)
    given = spec.align(align, "align")
    if given.way is not None:
        way = np.array(given.way) / np.linalg.norm(given.way)
        normals = cloud.spots.normals
        lying = np.linalg.norm(way - (normals @ way)[:, None] * normals, axis=1)
        return cloud.field(count, np.broadcast_to(way, normals.shape), TIED * (cloud.step / spacing) ** 2 * lying**2)
    rim = _edge(room, given.edge, "align", spec.ALIGN, cloud.step)
    beside = np.isfinite(nearest(cloud.spots, rim, EDGED * cloud.step)[0])
    edge = room.ground.model.edges[given.edge - 1]
    ways = edge.tangents[cKDTree(edge.points).query(cloud.spots.points)[1]]
    return cloud.field(count, ways, np.where(beside, FIRM, 0.0))


def _directions(room: Room, cloud: Cloud, spacing: float, align: str | None, found: Spots) -> Array:
    """Directions of copies ``(m, 3)``."""
    frames = framed(room.ground, found)
    angle = _field(room, cloud, spacing, align, 1).angles(found, frames)[:, None]
    return np.asarray(np.cos(angle) * frames[:, 0] + np.sin(angle) * frames[:, 1])


def _kept(ground: Ground, options: Repeat) -> float | None:
    """Distance of copies from borders, mm; None if they may lie anywhere."""
    if options.margin is None and options.clip:
        return None
    return sum(
        0.0 if text is None else length(text, ground.model.diagonal, name)
        for text, name in ((options.margin, "margin"), (options.jitter, "jitter"))
    )


def _bounded(room: Room, spacing: float) -> None:
    """Raise MracadError if there is room for more places than one edit takes."""
    most = sum(area.total for area in room.areas) / spacing**2
    if most > spec.MOST_FILLED:
        raise MracadError(
            f"fill: there is room for about {most:.2g} places, more than {spec.MOST_FILLED}",
            "give a greater spacing, or select fewer faces with --faces",
            Code.LIMIT,
        )


def _own(room: Room, feature: Feature) -> Spots:
    """The feature's own place, if it has one."""
    feet = feature.origin.feet if feature.origin is not None else None
    surface, uv = (np.empty(0, int), np.empty((0, 2))) if feet is None else (feet.surface, feet.uv)
    return Spots.on(room.ground, room.parts, surface, uv)


def random(room: Room, spacing: float, open_: Callable[[Spots], Array], own: Spots) -> Spots:
    """Places at random where it is open, none nearer to another or to the feature's own than ``spacing`` along the
    ground, with hardly any room left for more."""
    found = own
    for _ in range(WAVES):
        spots = room.thrown(DENSITY / spacing**2)
        if len(found):
            spots = spots.only(nearest(spots, found, spacing)[0] >= spacing)
        spots = spots.only(open_(spots))
        found = found.and_(spots.only(apart(spots, spacing)))
    return found.only(slice(len(own), None))
