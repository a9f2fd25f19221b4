"""Numbered rings on a model: where faces are as far from a middle as the radius says."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass

import numpy as np

from mracad.bspline.vectors import cross, unit
from mracad.model.facets import Body
from mracad.view.labels import Label
from mracad.view.looks import shaded
from mracad.view.panel import Panel
from mracad.view.seen import Seen, Stage

Array = np.ndarray

COLOUR = np.array([0.74, 0.12, 0.36])
HALF = 1.1
"""Half the width of rings, pixels."""


@dataclass(frozen=True)
class Ring:
    """A ring on a face of a part.

    Attributes
    ----------
    face : int
    middle : (float, float, float)
        In the part's frame, mm.
    radius : float
    on : collection of int, optional
        The faces on which it is drawn; all if not given.
    """

    face: int
    middle: tuple[float, float, float]
    radius: float
    on: Collection[int] | None = None


@dataclass(frozen=True, eq=False)
class Rings:
    """Rings as placed.

    Attributes
    ----------
    rings : sequence of Ring
        What is placed.
    number : ndarray of int (n,)
        Which of them, from 1.
    middles, normals : ndarray (n, 3)
    radii : ndarray (n,)
    """

    rings: Sequence[Ring]
    number: Array
    middles: Array
    normals: Array
    radii: Array

    @classmethod
    def of(cls, rings: Sequence[Ring], body: Body) -> Rings:
        """The rings on every instance of their parts."""
        number, middles, normals, radii = [], [], [], []
        for place in body.placed:
            turn = place.frame[:3, :3].T
            for k, ring in enumerate(rings):
                if ring.face in place.faces and ring.face in body.facets:
                    facets = body.facets[ring.face]
                    near = ((facets.points - ring.middle) ** 2).sum(axis=1).argmin()
                    _, su, sv = (each @ turn for each in facets.ground.jets(facets.uv[near : near + 1], 1))
                    number.append(k + 1)
                    middles.append(np.array(ring.middle) @ turn + place.frame[:3, 3])
                    normals.append((facets.outward * unit(cross(su, sv)))[0])
                    radii.append(ring.radius)
        return cls(
            rings, np.array(number, int), np.reshape(middles, (-1, 3)), np.reshape(normals, (-1, 3)), np.array(radii)
        )

    def look(self, stage: Stage, seen: Seen) -> Array:
        """The document's colours, with rings."""
        colours = shaded(stage, seen)
        pixel, (width, _) = stage.camera.pixel, stage.camera.size
        row, column = np.divmod(seen.pixel, width)
        at = stage.camera.project(self.middles)
        face = np.array([place.faces[own] for place, own, _ in stage.entries])[seen.entry]
        for k, radius in enumerate(self.radii):
            reach = radius / pixel + HALF + 1.0
            near = np.flatnonzero((np.abs(row - at[k, 1]) <= reach) & (np.abs(column - at[k, 0]) <= reach))
            near = near[self.normals[k] @ seen.normal[:, near] > 0.0]
            on = self.rings[self.number[k] - 1].on
            near = near if on is None else near[np.isin(face[near], list(on))]
            arm = seen.point[:, near] - self.middles[k][:, None]
            away = np.sqrt((arm * arm).sum(axis=0))
            slope = _slope(stage, seen.normal[:, near], arm / np.maximum(away, 1e-300))
            cover = np.clip(HALF + 0.5 - np.abs(away - radius) / (slope * pixel), 0.0, 1.0)
            colours[near] += cover[:, None] * (COLOUR - colours[near])
        return colours

    def labels(self, panel: Panel) -> tuple[list[Label], int]:
        """The numbers of rings whose middle is seen."""
        width, height = panel.stage.camera.size
        at = panel.stage.camera.project(self.middles)
        face = np.full(width * height, -1)
        face[panel.pixel] = np.array([place.faces[own] for place, own, _ in panel.stage.entries])[panel.entry]
        found: dict[int, Label] = {}
        for k, (x, y, _) in enumerate(at.tolist()):
            inside = 0 <= x < width and 0 <= y < height
            ring = self.rings[self.number[k] - 1]
            seen = inside and face[int(y) * width + int(x)] in (ring.face, *(ring.on or ()))
            if seen and self.normals[k] @ panel.stage.camera.toward > 0:
                found.setdefault(self.number[k], Label(str(self.number[k]), at[k : k + 1, :2]))
        return [found[number] for number in sorted(found)], 0


def _slope(stage: Stage, normal: Array, arm: Array) -> Array:
    """How a distance changes along a surface from a pixel to the next, for unit vectors along it, per mm."""
    n, a = stage.camera.axes @ normal, stage.camera.axes @ arm
    steep = np.where(np.abs(n[2]) > 1e-3, n[2], 1e-3)
    return np.asarray(np.maximum(np.hypot(a[0] - a[2] * n[0] / steep, a[1] - a[2] * n[1] / steep), 1e-6))
