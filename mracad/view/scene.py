"""One model or two, seen by cameras that stand still or go round."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from mracad.errors import UsageError
from mracad.model.facets import Body
from mracad.spec.pictures import AXES, Picture, section_of, size_of
from mracad.view.camera import MARGIN, Camera, axes, fitted, round_about
from mracad.view.lines import Lines
from mracad.view.looks import Look
from mracad.view.panel import panel
from mracad.view.section import STEP, Comb, Curve, combed, curves, lines
from mracad.view.seen import Stage
from mracad.view.sheet import Pane, boxes, grid

Array = np.ndarray

TURNS = 36
"""Pictures of a model that turns once."""

_COMBED = 0.15  # share of a panel that stays free on each side for combs


@dataclass(frozen=True, eq=False)
class Scene:
    """What is seen.

    Attributes
    ----------
    picture : Picture
    bodies : sequence of Body
        The last is the model; another one before it is shown on the left.
    looks : sequence of Look
        One for each body.
    cameras : list of list of Camera
        For each turn, one for each view.
    boxes : list of (int, int, int, int)
        The places of all panels.
    lines : sequence of sequence of Lines
        For each body.
    comb : Comb, optional
    """

    picture: Picture
    bodies: Sequence[Body]
    looks: Sequence[Look]
    cameras: list[list[Camera]]
    boxes: list[tuple[int, int, int, int]]
    lines: Sequence[Sequence[Lines]]
    comb: Comb | None = None

    @classmethod
    def of(
        cls, picture: Picture, bodies: Sequence[Body], looks: Sequence[Look], points: Array, strip: int, turns: int
    ) -> Scene:
        """A scene around points ``(n, 3)`` in sheets with a strip at the right.

        Raises
        ------
        UsageError
            When a section does not meet any body.
        """
        views, size, beside = picture.views, size_of(picture.size), len(bodies) > 1 and not picture.wipe
        rows, columns = (len(views), 2) if beside else grid(len(views), size)
        places = boxes(size, rows, columns, strip)
        sizes = [place[2:] for place in places[:: 1 + beside]][: len(views)]
        cameras = _cameras(views, points, sizes, turns, _COMBED if picture.comb else MARGIN)
        camera = cameras[0][0]
        cut = _cut(picture, bodies, STEP * camera.pixel)
        every = [curve for each in cut for curve in each]
        comb = combed(every, _COMBED * min(camera.size) * camera.pixel) if picture.comb else None
        return cls(picture, bodies, looks, cameras, places, [lines(each, comb) if each else () for each in cut], comb)

    def panes(self, turn: int) -> list[Pane]:
        """What is on the sheet of a turn."""
        views = self.picture.views
        names = [body.name if len(self.bodies) > 1 else "" for body in self.bodies]
        found = []
        for view, camera in zip(views if len(views) > 1 else [""], self.cameras[turn], strict=True):
            panels = [
                panel(Stage.of(body, camera), look, drawn)
                for body, look, drawn in zip(self.bodies, self.looks, self.lines, strict=True)
            ]
            captions = ["  ".join(filter(None, [name, view])) for name in names]
            parts = [slice(None)] if self.picture.wipe else [slice(k, k + 1) for k in range(len(panels))]
            found += [(panels[part], captions[part]) for part in parts]
        return [Pane(box, *each) for box, each in zip(self.boxes, found, strict=False)]


def _cameras(
    views: Sequence[str], points: Array, sizes: Sequence[tuple[int, int]], turns: int, margin: float
) -> list[list[Camera]]:
    """Cameras for each turn and view, all at the same scale; those of several turns go round an axis of their own."""
    middle = 0.5 * (points.min(axis=0) + points.max(axis=0)) if turns > 1 else None
    found = [
        [
            fitted(round_about(axes(view), k / turns), points, size, margin, middle)
            for view, size in zip(views, sizes, strict=True)
        ]
        for k in range(turns)
    ]
    pixel = max(camera.pixel for each in found for camera in each)
    return [[Camera(camera.axes, camera.centre, pixel, camera.size) for camera in each] for each in found]


def _cut(picture: Picture, bodies: Sequence[Body], spacing: float) -> list[list[Curve]]:
    """The curves of all sections on each body."""
    found: list[list[Curve]] = [[] for _ in bodies]
    for text in picture.section:
        axis, place = section_of(text)
        own = [curves(body, axis, place, spacing) for body in bodies]
        if not any(own):
            low, high = bodies[-1].extent[:, axis]
            where = f"the model is between {AXES[axis]}={low:.6g}mm and {high:.6g}mm"
            raise UsageError(f"section: {text} does not cut the model", where)
        for each, more in zip(found, own, strict=True):
            each += more
    return found
