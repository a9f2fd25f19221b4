"""Faces that fill a picture: which they are, how they are marked, and from where they are seen."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from mracad.bspline.vectors import cross
from mracad.errors import FileError, UsageError
from mracad.model.facets import Body
from mracad.spec.pictures import VIEWS
from mracad.spec.select import select
from mracad.view.camera import Camera, axes, fitted
from mracad.view.colours import rgb
from mracad.view.lines import Stroke
from mracad.view.seen import Stage, layers

if TYPE_CHECKING:
    from mracad.occ.document import Document

Array = np.ndarray

ZOOM = 20.0
"""Largest factor by which triangles get finer where a few faces fill the picture."""

OUTLINE = Stroke(tuple(rgb("#e8590c").tolist()), 1.3, 1.0, 0.45)
"""Of the faces; paler where others hide them."""

SEEN = 1e-3
"""Share of a picture below which faces that are to fill it are not seen."""

_TRIED = 160  # pixels of the larger side of pictures in which faces are sought
_NAMED = 0.7  # a view with a name is preferred where it shows so much of what the best one does


def wanted(document: Document, chosen: Sequence[str]) -> tuple[frozenset[int] | None, float]:
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


def points(body: Body, faces: Collection[int] | None) -> Array:
    """The points of faces (None for all) ``(n, 3)``, as placed."""
    found = [
        body.facets[face].points @ place.frame[:3, :3].T + place.frame[:3, 3]
        for place in body.placed
        for face in place.faces
        if face in body.facets and (faces is None or face in faces)
    ]
    if not found:
        raise FileError(f"'{body.name}': the faces to fit in cannot be meshed", "choose others")
    return np.concatenate(found)


def outlines(body: Body, faces: Collection[int]) -> dict[int, Stroke]:
    """How the edges of faces are drawn."""
    return dict.fromkeys((edge for face in faces if face in body.facets for edge in body.facets[face].rims), OUTLINE)


def shown_from(body: Body, faces: Collection[int]) -> str:
    """The view from which most of some faces is seen, as for ``--view``; ``""`` if others hide them from all sides."""
    around = points(body, faces)
    toward = _facing(body, faces)
    own = ",".join(f"{each:.2g}" for each in toward) if np.linalg.norm(toward) > 0.0 else "iso"
    corners = [f"{x},{y},{z}" for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)]
    area = {
        view: seen_share(body, faces, fitted(axes(view), around, (_TRIED, _TRIED)))
        for view in dict.fromkeys([*VIEWS, own, *corners])
    }
    most = max(area.values())
    if most < SEEN:
        return ""
    return next(view for view in area if area[view] >= (_NAMED if view in VIEWS else 1.0) * most)


def seen_share(body: Body, faces: Collection[int], camera: Camera) -> float:
    """The share of a picture in which faces are seen; measured in a small one."""
    wide, tall = (max(1, round(side * _TRIED / max(camera.size))) for side in camera.size)
    small = replace(camera, pixel=camera.pixel * camera.size[0] / wide, size=(wide, tall))
    stage = Stage.of(body, small)
    nearest = layers(stage, (0, tall), lambda place, k: False)[0]
    own = np.array([facets.face in faces for _, _, facets in stage.entries])
    return float(own[stage.entry[nearest[nearest >= 0]]].sum() / nearest.size)


def _facing(body: Body, faces: Collection[int]) -> Array:
    """The direction to which faces turn on the whole, of length 1 or 0, rounded."""
    total = np.zeros(3)
    for place in body.placed:
        for facets in (body.facets[face] for face in place.faces if face in faces and face in body.facets):
            a, b, c = np.moveaxis(facets.points[facets.corners] @ place.frame[:3, :3].T, 1, 0)
            total += np.sign(np.linalg.det(place.frame[:3, :3])) * cross(b - a, c - a).sum(axis=0)
    length = float(np.linalg.norm(total))
    return np.round(total / length, 2) if length else total
