"""A picture of a document."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from mracad.errors import FileError, UsageError
from mracad.model.facets import Body
from mracad.occ.facets import facets
from mracad.spec.pictures import Picture, show_of, size_of
from mracad.spec.select import select
from mracad.view.camera import Camera, axes, fitted
from mracad.view.fields import map_of, numbers_of
from mracad.view.looks import look
from mracad.view.panel import panel
from mracad.view.seen import Stage
from mracad.view.sheet import boxes, grid, png

if TYPE_CHECKING:
    from mracad.occ.document import Document

Array = np.ndarray


CHORD = 0.25
"""Largest distance of triangles from the surface, pixels of the larger side when the whole model is shown."""

ZOOM = 20.0
"""Largest factor by which triangles get finer where a few faces fill the picture."""

ANGLE = 30.0
"""Largest turn between triangles, degrees: only outlines depend on it."""


@dataclass(frozen=True)
class Rendered:
    """A picture, and what its colours stand for.

    Attributes
    ----------
    data : bytes
        PNG.
    title, unit : str
        What a map shows, and in which unit; ``""`` for pictures that show no numbers.
    lowest, highest : float
        The extreme numbers in the picture.
    """

    data: bytes = field(repr=False)
    title: str = ""
    unit: str = ""
    lowest: float = 0.0
    highest: float = 0.0


def render(
    document: Document,
    picture: Picture | None = None,
    *,
    before: Document | None = None,
    reference: Document | None = None,
) -> Rendered:
    """A picture of a document.

    Parameters
    ----------
    document : Document
    picture : Picture, optional
    before : Document, optional
        Shown on the left, from the same place.
    reference : Document, optional
        What ``show="deviation"`` is measured from.

    Raises
    ------
    UsageError
        When faces to fit in do not exist, or deviation has no reference.
    FileError
        When nothing can be drawn.
    """
    picture = picture or Picture()
    show, size = show_of(picture.show), size_of(picture.size)
    if show.kind == "deviation" and reference is None:
        raise UsageError("show: deviation needs what it is measured from", "write deviation:REF.step")
    wanted, closer = _wanted(document, picture.fit)
    mesh = partial(_meshed, chord=CHORD / max(size) / closer)
    bodies = [mesh(each) for each in (before, document) if each]
    base = mesh(reference) if show.kind == "deviation" and reference else None
    eyes = [look(show, picture.stripes, numbers_of(show, bodies[-1].diagonal, body.facets, base)) for body in bodies]
    legend = map_of(show, bodies[-1].diagonal)
    rows, columns = (len(picture.views), 2) if before else grid(len(picture.views), size)
    places = boxes(size, rows, columns, legend is not None)
    points = np.concatenate([_points(body, wanted) for body in (bodies if wanted is None else bodies[-1:])])
    cameras = _cameras(picture.views, points, places[:: len(bodies)])
    pairs = [(body, eye, camera) for camera in cameras for body, eye in zip(bodies, eyes, strict=True)]
    panels = [panel(Stage.of(body, camera), eye) for body, eye, camera in pairs]
    shown = np.concatenate([each.shown for each in panels])
    key = (legend, legend.scale(shown)) if legend else None
    names = [body.name for body in bodies] if before else [""]
    views = picture.views if len(picture.views) > 1 else [""]
    captions = ["  ".join(filter(None, [name, view])) for view in views for name in names]
    data = png(size, places[: len(panels)], panels, captions, key, show.kind == "faces")
    if legend is None or not len(shown):
        return Rendered(data)
    return Rendered(data, legend.title, legend.unit, float(shown.min()), float(shown.max()))


def _meshed(document: Document, chord: float) -> Body:
    found = facets(document, chord, ANGLE)
    if not found.facets:
        raise FileError(f"'{document.name}' cannot be meshed", "check its geometry")
    return found


def _wanted(document: Document, chosen: Sequence[str]) -> tuple[frozenset[int] | None, float]:
    """The faces that fill the picture (None for all), and how much larger the whole model is than these."""
    if not chosen:
        return None, 1.0
    from mracad.occ.select import select_cq
    from mracad.occ.view import view

    model = view(document)
    found = select(model, chosen, range(len(model.faces)), partial(select_cq, document)).faces
    if not found:
        raise UsageError("fit: no face is selected", "select faces by #3, a name, type:plane or near:X,Y,Z")
    low, high = np.array([model.faces[face].box for face in found]).swapaxes(0, 1)
    own = float(np.linalg.norm(high.max(axis=0) - low.min(axis=0)))
    return found, float(np.clip(model.diagonal / max(own, 1e-300), 1.0, ZOOM))


def _points(body: Body, wanted: frozenset[int] | None) -> Array:
    """The points of faces, as placed."""
    found = [
        body.facets[face].points @ place.frame[:3, :3].T + place.frame[:3, 3]
        for place in body.placed
        for face in place.faces
        if face in body.facets and (wanted is None or face in wanted)
    ]
    if not found:
        raise FileError(f"'{body.name}': the faces to fit in cannot be meshed", "choose others")
    return np.concatenate(found)


def _cameras(views: Sequence[str], points: Array, places: Sequence[tuple[int, int, int, int]]) -> list[Camera]:
    """A camera for each view; all at the same scale."""
    found = [fitted(axes(view), points, place[2:]) for view, place in zip(views, places, strict=False)]
    pixel = max(camera.pixel for camera in found)
    return [Camera(each.axes, each.centre, pixel, each.size) for each in found]
