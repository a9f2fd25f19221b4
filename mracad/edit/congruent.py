"""Surfaces congruent to others get the same result without a search.

The problem of such a surface alone is that of the other in other coordinates.  So what was found for the first is moved
likewise, and only judged.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace

from mracad.edit.jumps import Jumps
from mracad.edit.moved import Moved, closely
from mracad.edit.pose import Scene
from mracad.edit.target import Sheet, Wish
from mracad.edit.watch import Tried, displaced
from mracad.model.congruence import Congruence, Figures
from mracad.seam.interface import Joints

ENOUGH = 0.95
"""Least share of the amount of the first surface that the judge must allow."""


class Congruent:
    """The surfaces of a scene for which a result was found alone, and those congruent to them.

    Parameters
    ----------
    scene : Scene
    wish : Wish
    """

    def __init__(self, scene: Scene, wish: Wish) -> None:
        joints = scene.joints
        self.scene = scene
        self.able = wish.alike and not joints.zones
        mended = {side.surface for seam in joints.mended for side in (seam.a, seam.b)}
        self.others = mended | {slide.trace.surface for slide in joints.slides}
        self.found: Figures[Moved] = Figures()
        self.first: Figures[int] = Figures()
        self.known: dict[tuple[int, int], Congruence | None] = {}

    def firsts(self, surfaces: Iterable[int]) -> list[int]:
        """Those of some surfaces that are congruent to none before them, of these and of earlier calls."""
        found = []
        for i in surfaces:
            figure = self.scene.sheets[i].figure
            if not self._takes_part(i):
                found.append(i)
            elif not any(self._between(k, i) for k in self.first.near(figure)):
                self.first.keep(figure, i)
                found.append(i)
        return found

    def keep(self, moved: Moved) -> None:
        """Remember a result."""
        if self._takes_part(moved.sheet.index):
            self.found.keep(moved.sheet.figure, moved.done())

    def result(self, i: int) -> Moved | None:
        """The result for a surface, if it is congruent to one for which it is known."""
        sheet = self.scene.sheets[i]
        if self._takes_part(i):
            for known in self.found.near(sheet.figure):
                between = self._between(known.sheet.index, i)
                moved = self._moved(known, sheet, between) if between else None
                if moved is not None:
                    return moved
        return None

    def _takes_part(self, i: int) -> bool:
        return self.able and i not in self.others

    def _between(self, k: int, i: int) -> Congruence | None:
        """How a surface is congruent to another with edges held alike, if it is."""
        if (k, i) not in self.known:
            first, sheet = self.scene.sheets[k], self.scene.sheets[i]
            ways = sheet.congruences(first)
            self.known[k, i] = next((way for way in ways if self._joined_alike(first, sheet, way)), None)
        return self.known[k, i]

    def _moved(self, known: Moved, sheet: Sheet, between: Congruence) -> Moved | None:
        """The known result, moved to a congruent surface; None where the judge allows clearly less of it there."""
        net = between.finer(sheet.net, known.net)
        if net.poles.shape != between.arranged(known.net.poles).shape:
            return None
        tried = Tried(closely(sheet, net), [net], [between.offset(known.tried.parts[0])])
        if not known.amount:
            return replace(known, sheet=sheet, tried=tried, changes=tried.watch.still[0])
        moved = replace(known, sheet=sheet, tried=tried).confirmed(self.scene.tolerances)
        jumps = Jumps(self.scene, {sheet.index: net}, self.scene.joints.among({sheet.index}), sheet.wavelength)
        room = jumps.room({sheet.index: displaced(net, moved.offset)})
        return moved if moved.amount >= ENOUGH * known.amount and not room else None

    def _joined_alike(self, first: Sheet, sheet: Sheet, between: Congruence) -> bool:
        """Whether all edges of a surface are held as those of the first."""
        both = [self.scene.joints.among({each.index}) for each in (first, sheet)]
        moving = [each.moving for each in both]
        pairs = between.edges()
        return pairs is not None and all(self._held_alike(both, moving, pair) for pair in pairs)

    def _held_alike(self, joined: list[Joints], moving: list[frozenset[int]], edges: tuple[int, int]) -> bool:
        said = []
        for joint, movable, edge in zip(joined, moving, edges, strict=True):
            meeting = joint.meetings.get(edge)
            beside = () if meeting is None else meeting.faces
            movers = sum(self.scene.model.faces[face].surface in self.scene.sheets for face in beside)
            said.append((edge in movable, str(joint.frozen.get(edge)), meeting and meeting.order, movers))
        if said[0] != said[1]:
            return False
        meetings = [joint.meetings.get(edge) for joint, edge in zip(joined, edges, strict=True)]
        room = [
            self.scene.tolerances.wider(self.scene.model.edges[edge], meeting.gap if meeting else 0.0)
            for edge, meeting in zip(edges, meetings, strict=True)
        ]
        return room[1] >= ENOUGH * room[0]
