"""A picture of a document."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from mracad.errors import FileError, UsageError
from mracad.model.facets import Body
from mracad.occ.facets import facets
from mracad.spec.pictures import Picture, Show, show_of, size_of
from mracad.spec.select import every_nurbs, select
from mracad.view.fields import map_of, numbers_of
from mracad.view.film import packed
from mracad.view.labels import of_faces
from mracad.view.legend import Legend, strip
from mracad.view.looks import Look, look
from mracad.view.rings import Ring, Rings
from mracad.view.scene import TURNS, Scene
from mracad.view.sheet import Numbers, Pane, drawn
from mracad.view.treatment import Told

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
        PNG, GIF or MP4.
    title, unit : str
        What a map shows, and in which unit; ``""`` for pictures that show no numbers.
    lowest, highest : float
        The extreme numbers in the picture.
    rings : int, optional
        Number of features, where these are shown.
    """

    data: bytes = field(repr=False)
    title: str = ""
    unit: str = ""
    lowest: float = 0.0
    highest: float = 0.0
    rings: int | None = None


def render(
    document: Document,
    picture: Picture | None = None,
    *,
    before: Document | None = None,
    reference: Document | None = None,
    told: Told | None = None,
    rings: Sequence[Ring] | None = None,
    format: str = "png",
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
    told : Told, optional
        What ``show="treatment"`` shows.
    rings : sequence of Ring, optional
        What ``show="features"`` shows, unless features are to be found.
    format : {"png", "gif", "mp4"}
        The last two turn the model.

    Raises
    ------
    UsageError
        When faces to fit in do not exist, a section does not meet the model, or what is to be shown is not given.
    FileError
        When nothing can be drawn.
    """
    picture = picture or Picture()
    show, size = show_of(picture.show), size_of(picture.size)
    show = show_of(picture.show)
    if show.kind == "deviation" and reference is None:
        raise UsageError("show: deviation needs what it is measured from", "write deviation:REF.step")
    if show.kind == "treatment" and told is None:
        raise UsageError("show: treatment is what an edit did", "give it with -o OUT.png to an edit, such as smooth")
    if picture.wipe and before is None:
        raise UsageError("wipe: there is no other model", "add --before REF.step")
    told = told if show.kind == "treatment" else None
    rings = (_proposed(document) if rings is None else rings) if show.kind == "features" else None
    wanted, closer = _wanted(document, picture.fit)
    mesh = partial(_meshed, chord=CHORD / max(size) / closer)
    bodies = [mesh(each) for each in (before, document) if each]
    base = mesh(reference) if show.kind == "deviation" and reference else None
    marked = Rings.of(rings, bodies[-1]) if rings is not None else None
    looks = [_look(show, picture, body, base, told or marked) for body in bodies]
    legend = Legend(map_of(show, bodies[-1].diagonal), key=told.key if told else ())
    points = np.concatenate([_points(body, wanted) for body in (bodies if wanted is None else bodies[-1:])])
    turns = 1 if format == "png" else TURNS
    scene = Scene.of(picture, bodies, looks, points, strip(legend, size), turns)
    return _drawn(scene, replace(legend, comb=scene.comb), marked, turns, format)


def _look(show: Show, picture: Picture, body: Body, base: Body | None, marks: Told | Rings | None) -> Look:
    """How to look at a body."""
    if isinstance(marks, Told):
        return marks.look()
    if isinstance(marks, Rings):
        return Look(marks.look, 1)
    return look(show, picture.stripes, numbers_of(show, body.diagonal, body.facets, base))


def _drawn(scene: Scene, legend: Legend, rings: Rings | None, turns: int, format: str) -> Rendered:
    """The file of a scene; a map has one range of colours for all turns."""
    size, kind = size_of(scene.picture.size), show_of(scene.picture.show).kind
    numbers: Numbers | None = of_faces if kind == "faces" else rings.labels if rings else None
    noun = "feature" if rings else "small face"
    first = scene.panes(0)
    span = (0.0, 0.0)
    if legend.map:
        seen = [_values(first), *(_values(scene.panes(k)) for k in range(1, turns))]
        values = np.concatenate(seen)
        legend = replace(legend, scale=legend.map.scale(values))
        span = (float(values.min()), float(values.max())) if len(values) else span
    frames = [drawn(size, scene.panes(k) if k else first, legend, numbers, noun) for k in range(turns)]
    data = packed(frames, format)
    if rings:
        return Rendered(data, rings=int(rings.number.max(initial=0)))
    return Rendered(data, legend.map.title, legend.map.unit, *span) if legend.map else Rendered(data)


def _values(panes: Sequence[Pane]) -> Array:
    """The numbers on a sheet."""
    return np.concatenate([panel.shown for pane in panes for panel in pane.panels])


def _proposed(document: Document) -> list[Ring]:
    """The features of all NURBS faces, the highest first."""
    from mracad.edit.feature.find import found
    from mracad.occ.view import view

    model = view(document)
    return [Ring(each.face, each.place, 0.5 * each.size) for each in found(model, every_nurbs(model))]


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
