"""Jumps of curvature along seams that are only tangent: they remain, but must not grow."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import replace

import numpy as np

from mracad.bspline.surface import Net
from mracad.edit.pose import Scene
from mracad.seam.interface import Joints
from mracad.seam.sides import views

MORE = 0.1
"""Share by which a jump may grow, on top of what an edit may add where there is none."""


class Jumps:
    """The seams of surfaces that move, whether the seams move or not, where jumps are measured.

    Parameters
    ----------
    scene : Scene
    members : collection of int
        The surfaces.
    joined : Joints
        How their edges are joined.
    width : float
        Wavelength, mm.
    """

    def __init__(self, scene: Scene, members: Collection[int], joined: Joints, width: float) -> None:
        self.model, self.scene = scene.model, scene
        self.seams, self.surfaces, self.most = [], [], []
        for edge, meeting in joined.meetings.items():
            beside = {self.model.faces[face].surface for face in meeting.faces}
            if meeting.order == 1 and meeting.sides and joined.jumps and beside.intersection(members):
                allowed = scene.tolerances.jump / width + MORE * meeting.bend
                apart = len(beside & set(scene.sheets)) if edge not in joined.moving else 1
                self.seams.append((self.model.edges[edge], meeting))
                self.surfaces.append(beside.intersection(members))
                self.most.append(meeting.bend + allowed / max(apart, 1))

    def room(self, moved: Mapping[int, Net]) -> dict[int, float]:
        """The share of a displacement that each surface may make, 0 to 1, by index; surfaces that may make all are left
        out.

        Parameters
        ----------
        moved : mapping of int to Net
            The surfaces after the whole displacement.
        """
        surfaces = [replace(s, net=moved[s.index]) if s.index in moved else s for s in self.model.surfaces]
        model = replace(self.model, surfaces=tuple(surfaces))
        looks = views(model, [(edge, side) for edge, meeting in self.seams for side in meeting.sides])
        room: dict[int, float] = {}
        both = zip(self.seams, self.surfaces, self.most, looks[::2], looks[1::2], strict=True)
        for (_, meeting), beside, most, a, b in both:
            jump = float(np.nanmax(np.abs(a[:, 6] - b[:, 6]), initial=0.0))
            if jump > most:
                share = (most - meeting.bend) / (jump - meeting.bend)
                room |= {i: min(share, room.get(i, 1.0)) for i in beside if i is not None}
        return room
