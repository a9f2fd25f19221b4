"""Jumps of curvature along seams that are only tangent: they remain, but must not grow."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from mracad.bspline.surface import Net
from mracad.edit.pose import Scene
from mracad.model.brep import Edge, Side
from mracad.seam.interface import Joints
from mracad.seam.sides import Bends

MORE = 0.1
"""Share by which a jump may grow, on top of what an edit may add where there is none."""


class Jumps:
    """The seams of surfaces that move, whether the seams move or not, where jumps are measured.

    Parameters
    ----------
    scene : Scene
    nets : mapping of int to Net
        The surfaces, by index, over the knots of their displacements.
    joined : Joints
        How their edges are joined.
    width : float
        Wavelength, mm.
    """

    def __init__(self, scene: Scene, nets: Mapping[int, Net], joined: Joints, width: float) -> None:
        self.seams, self.surfaces = [], []
        uses: list[tuple[Edge, Side]] = []
        for edge in scene.meeting(nets):
            meeting = joined.meetings[edge]
            beside = {scene.model.faces[face].surface for face in meeting.faces}
            if meeting.order == 1 and meeting.sides and joined.jumps and beside.intersection(nets):
                allowed = scene.tolerances.jump / width + MORE * meeting.bend
                apart = len(beside & scene.sheets.keys()) if edge not in joined.moving else 1
                uses += [(scene.model.edges[edge], side) for side in meeting.sides]
                self.seams.append((meeting.bend, meeting.bend + allowed / max(apart, 1)))
                self.surfaces.append(beside.intersection(nets))
        self.bends = Bends(scene.model, uses, nets, scene.still)

    def room(self, moved: Mapping[int, Net]) -> dict[int, float]:
        """The share of a displacement that each surface may make, 0 to 1, by index; surfaces that may make all are left
        out.

        Parameters
        ----------
        moved : mapping of int to Net
            The surfaces after the whole displacement.
        """
        bends = self.bends.after(moved)
        room: dict[int, float] = {}
        for (bend, most), beside, a, b in zip(self.seams, self.surfaces, bends[::2], bends[1::2], strict=True):
            jump = float(np.nanmax(np.abs(a - b), initial=0.0))
            if jump > most:
                share = (most - bend) / (jump - bend)
                room |= {i: min(share, room.get(i, 1.0)) for i in beside if i is not None}
        return room
