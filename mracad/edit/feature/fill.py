"""Places all over the ground, by distances along it and over smooth seams.

No copy comes nearer to a border than the margin.  The feature's own place, if it has one, is among the places.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from mracad.edit.feature.clear import borders, parts
from mracad.edit.feature.detail import Feature
from mracad.edit.feature.ground import Ground
from mracad.edit.feature.locate import Place
from mracad.edit.feature.spread import Area, Spots, apart, nearest, thrown
from mracad.errors import Code, EditError, MracadError
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

FULL = 1.5
"""Squares of the distance per place, at most: fewer places do not leave room for another."""


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

    def clear(self, spots: Spots, far: float) -> Array:
        """Which of the points are at least ``far`` (mm) from borders."""
        if far == 0:
            return np.ones(len(spots), bool)
        return np.asarray(np.isinf(nearest(spots, self._borders(far / FINE), far)[0]))

    def _borders(self, step: float) -> Spots:
        return borders(self.ground, self.joined, self.parts, step)


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
    spacing, far = (length(given.spacing, ground.model.diagonal, "fill: spacing"), _far(ground, feature, options))
    room = Room.of(ground, wishes, options.edges == "coupled", options.seed)
    _bounded(room, spacing)
    own = _own(room, feature)
    found = random(room, spacing, far, own)
    if not len(found):
        raise EditError(
            f"fill: no place on the faces is {far:.3g} mm away from their borders",
            "give a smaller --margin or --size, or let borders cut copies off with --clip",
        )
    return [
        Place(f"place {k + 1} of {len(found)}", found.points[k], int(found.face[k]), found.uv[k])
        for k in range(len(found))
    ]


def _far(ground: Ground, feature: Feature, options: Repeat) -> float:
    """Distance of places from borders, mm."""
    if options.margin is None and options.clip:
        return 0.0
    diagonal = ground.model.diagonal
    margin, jitter = (
        0.0 if text is None else length(text, diagonal, name)
        for text, name in ((options.margin, "margin"), (options.jitter, "jitter"))
    )
    return margin + jitter + feature.reach * options.size


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


def random(room: Room, spacing: float, far: float, own: Spots) -> Spots:
    """Places at random, none nearer to another or to the feature's own than ``spacing`` along the ground, or than
    ``far`` to a border, and no room left for more."""
    found = own
    for _ in range(WAVES):
        spots = room.thrown(DENSITY / spacing**2)
        spots = spots.only(room.clear(spots, far))
        found = found.and_(spots.only(apart(spots, spacing, found)))
    return found.only(slice(len(own), None))
