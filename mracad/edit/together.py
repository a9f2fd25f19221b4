"""Surfaces whose common edges move with them: which seams move, and what becomes of all edges."""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping
from dataclasses import replace

import numpy as np

from mracad import guard
from mracad.constraint.seam import TRIMMED, UNEVEN, Seam, Seams, Treatment, Wishes, seams
from mracad.constraint.trimmed import TrimmedSeam, beside, trimmed
from mracad.edit.group import CLUSTER, CROWDED, Group, Moved, Setting
from mracad.model import Edge

Array = np.ndarray

DEFECT = 1e-6, math.radians(1e-3)
"""Gap, mm, and angle from which on a seam is worth mending."""

IDLE = "nothing to smooth on either side"
LARGE = "too many faces there to move together"
SHORT = "knots of a face there nearly meet"


MOST_TOGETHER = 16_000
"""Most control points of surfaces that trimmed seams join: one factorisation of them all grows faster than they do."""


class Together:
    """The surfaces of a model that move together.

    Parameters
    ----------
    setting : Setting
    coarser : collection of int
        Surfaces that have something to be smoothed; seams between others stay.

    Attributes
    ----------
    found : list of Seam
    trimmed : list of TrimmedSeam
    closing : dict of int to (Border, Border)
        Closing edges that need no condition.
    frozen : dict of int to str
    """

    def __init__(self, setting: Setting, coarser: Collection[int]) -> None:
        self.setting, self.model = setting, setting.model
        options = setting.options
        self.wishes = Wishes(options.keep, math.radians(options.fit_g1 or 0.0), options.close_gaps, setting.held)
        self.trimmed: list[TrimmedSeam] = []
        self.freedom: dict[int, int] = {}
        known = seams(self.model, setting.movable, self.wishes) if options.edges == "coupled" else Seams()
        self.found, self.closing, self.frozen, self.twins = known.found, known.closing, known.frozen, known.twins
        self.coarser = set(coarser)
        self._try_trimmed()
        self._supplement()
        idle = (s for s in self._every() if not (self.coarser & {s.a.surface, s.b.surface} or self._to_mend(s)))
        self._freeze({seam.edge: IDLE for seam in idle})
        self._freeze(self._parting())

    def _try_trimmed(self) -> None:
        """Let seams that cannot move exactly move to the gap tolerance."""
        for index, reason in list(self.frozen.items()):
            edge = self.model.edges[index]
            twin = self.model.edges[self.twins.get(index, index)]
            if reason in (TRIMMED, UNEVEN, CROWDED) and len({edge.index, twin.index}) + len(edge.sides) == 3:
                seam = self._trimmed(edge, twin)
                if isinstance(seam, TrimmedSeam):
                    self.trimmed.append(seam)
                    self.frozen.pop(index)
                    self.frozen.pop(twin.index, None)
                else:
                    self.frozen[index] = seam

    def _trimmed(self, edge: Edge, twin: Edge) -> TrimmedSeam | str:
        surfaces = {self.model.faces[face].surface for face in (edge.sides[0].face, twin.sides[-1].face)}
        if not (surfaces & self.coarser or self.setting.mending):
            return IDLE
        if min(s.min() for i in surfaces if i is not None for s in self.setting.spans[i]) < CLUSTER[1]:
            return SHORT
        return trimmed(self.model, edge, twin, self.wishes)

    def _supplement(self) -> None:
        """Keep to the tolerance what the joints of seams do not keep by a law."""
        for seam in [seam for seam in self.found if seam.loose]:
            rest = beside(self.model, seam, self.wishes)
            if isinstance(rest, TrimmedSeam):
                self.trimmed.append(rest)
            else:
                self._freeze({seam.edge: rest})

    def _parting(self) -> dict[int, str]:
        """Trimmed seams that would join more surfaces than can be solved at once in time that grows with the model."""
        leader = {i: i for seam in self._every() for i in (seam.a.surface, seam.b.surface)}
        points = {i: self.model.surfaces[i].net.u.count * self.model.surfaces[i].net.v.count for i in leader}

        def root(i: int) -> int:
            while leader[i] != i:
                leader[i] = leader[leader[i]]
                i = leader[i]
            return i

        parted: dict[int, str] = {}
        for seam in self._every():
            one, other = root(seam.a.surface), root(seam.b.surface)
            if one == other:
                continue
            if isinstance(seam, TrimmedSeam) and points[one] + points[other] > MOST_TOGETHER:
                parted[seam.edge] = LARGE
            else:
                leader[other] = one
                points[one] += points[other]
        return parted

    @staticmethod
    def _to_mend(seam: Seam | TrimmedSeam) -> bool:
        """Whether a seam has a defect that is to be pulled shut."""
        if isinstance(seam, Seam):
            close, fit, gap, angle = seam.joint.close, seam.joint.fit, seam.gap, seam.angle
        else:
            close, fit, (gap, angle) = seam.close, seam.fit, seam.opening[:2]
        return bool((close and gap > DEFECT[0]) or (fit and angle > DEFECT[1]))

    @property
    def moving(self) -> set[int]:
        """Edges that move."""
        return set(self.closing) | {edge for seam in self._every() for edge in (seam.edge, seam.twin)}

    def treatments(self) -> tuple[Treatment, ...]:
        """What was done about each edge of a movable face, in edge order."""
        loose = {edge for seam in self.trimmed for edge in (seam.edge, seam.twin)}
        freedom = self.freedom | {seam.twin: self.freedom.get(seam.edge, 0) for seam in self._every()}

        def of(edge: int) -> Treatment:
            faces = tuple(side.face for side in self.model.edges[edge].sides)
            if edge in self.frozen:
                return Treatment(edge, faces, "frozen", self.frozen[edge])
            mended = self.setting.mending and edge not in self.closing
            how = "mended" if mended else "to tolerance" if edge in loose else "coupled"
            return Treatment(edge, faces, how, freedom=freedom.get(edge, 0))

        return tuple(of(edge) for edge in sorted(self.moving | set(self.frozen)))

    def smoothed(self, scale: float | None, bound: float | None) -> dict[int, Moved]:
        """Smooth the surfaces that seams join; where a seam does not hold it is frozen and its group done again.

        Parameters
        ----------
        scale : float or None
            Wavelength, mm; None for the level of the options.
        bound : float or None
            On the displacement of any control point, mm.
        """
        result: dict[int, Moved] = {}
        first = self._groups(sorted({side.surface for seam in self._every() for side in (seam.a, seam.b)}))
        for number, whole in enumerate(first, 1):
            waiting = [whole]
            while waiting:
                group = waiting.pop()
                guard.doing(f"smoothing group {number} of {len(first)}, round {group.allowance.rounds + 1}")
                moved, broken = group.smoothed(scale, bound) if group.affordable else ({}, group.give_up())
                result |= moved
                self.freedom |= group.freedom
                if broken:
                    self._freeze(broken)
                    self._try_trimmed()
                    waiting += self._parts(group)
        return result

    def _parts(self, group: Group) -> list[Group]:
        """The groups that are left of one, which share its allowance."""
        parts = self._groups(group.surfaces)
        total = sum(part.cost for part in parts)
        for part in parts:
            part.allowance = replace(group.allowance, work=group.allowance.work * part.cost / total)
        return parts

    def _groups(self, surfaces: Collection[int]) -> list[Group]:
        """The groups that seams make of some surfaces."""
        from scipy.sparse import coo_array
        from scipy.sparse.csgraph import connected_components

        number = {surface: k for k, surface in enumerate(surfaces)}
        pairs = [(number[s.a.surface], number[s.b.surface]) for s in self._every() if s.a.surface in number]
        if not pairs:
            return []
        one, other = np.transpose(pairs)
        graph = coo_array((np.ones(len(one)), (one, other)), shape=(len(number), len(number)))
        count, member = connected_components(graph, directed=False)
        found: list[list[Seam]] = [[] for _ in range(count)]
        trimmed: list[list[TrimmedSeam]] = [[] for _ in range(count)]
        for seam in self.found:
            if seam.a.surface in number:
                found[member[number[seam.a.surface]]].append(seam)
        for loose in self.trimmed:
            if loose.a.surface in number:
                trimmed[member[number[loose.a.surface]]].append(loose)
        groups = [Group(self.setting, *parts, self.closing) for parts in zip(found, trimmed, strict=True) if any(parts)]
        return groups

    def _every(self) -> list[Seam | TrimmedSeam]:
        return [*self.found, *self.trimmed]

    def _freeze(self, reasons: Mapping[int, str]) -> None:
        self.frozen |= reasons
        self.frozen |= {seam.twin: reasons[seam.edge] for seam in self._every() if seam.edge in reasons}
        self.found = [seam for seam in self.found if seam.edge not in reasons]
        self.trimmed = [seam for seam in self.trimmed if seam.edge not in reasons]
