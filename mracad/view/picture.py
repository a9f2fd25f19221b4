"""A picture of a document."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from mracad.errors import FileError, UsageError
from mracad.model.facets import Body
from mracad.occ.facets import facets
from mracad.spec.pictures import Picture, Show, show_of, size_of
from mracad.spec.select import every_nurbs
from mracad.view.fields import map_of, numbers_of
from mracad.view.film import packed
from mracad.view.fit import SEEN, outlines, points, seen_share, shown_from, wanted
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
        The extreme numbers in its pixels.
    rings : int, optional
        Number of features, where these are shown.
    note : str
        What is not seen, and what to do; ``""`` for nothing.
    """

    data: bytes = field(repr=False)
    title: str = ""
    unit: str = ""
    lowest: float = 0.0
    highest: float = 0.0
    rings: int | None = None
    note: str = ""


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
        What an edit did to the document, which ``show="treatment"`` shows.
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
    picture.check(format)
    show, size = show_of(picture.show), size_of(picture.size)
    if show.kind == "deviation" and reference is None:
        raise UsageError("show: deviation needs what it is measured from", "write deviation:REF.step")
    if show.kind == "treatment" and told is None:
        raise UsageError("show: treatment is what an edit did", "give it with -o OUT.png to an edit, such as smooth")
    if picture.wipe and before is None:
        raise UsageError("wipe: there is no other model", "add --before REF.step")
    rings = (_proposed(document) if rings is None else rings) if show.kind == "features" else None
    fit, closer = wanted(document, picture.fit)
    mesh = partial(_meshed, chord=CHORD / max(size) / closer)
    bodies = [mesh(each) for each in (before, document) if each]
    base = mesh(reference) if show.kind == "deviation" and reference else None
    marked = Rings.of(rings, bodies[-1]) if rings is not None else None
    drawn_told = told if show.kind == "treatment" else None
    looks = [_look(show, picture, body, base, drawn_told or marked) for body in bodies]
    if fit:
        looks[-1] = replace(looks[-1], strokes={**outlines(bodies[-1], fit), **looks[-1].strokes})
    legend = Legend(map_of(show, bodies[-1].diagonal), key=drawn_told.key if drawn_told else ())
    around = np.concatenate([points(body, fit) for body in (bodies if fit is None else bodies[-1:])])
    turns = 1 if format == "png" else TURNS
    scene = Scene.of(picture, _named(bodies, edited=told is not None), looks, around, strip(legend, size), turns)
    note = _unseen(scene, fit) if fit and turns == 1 else ""
    return replace(_drawn(scene, replace(legend, comb=scene.comb), marked, turns, format), note=note)


def _named(bodies: Sequence[Body], *, edited: bool) -> list[Body]:
    """Bodies with names that tell them apart, where there are two."""
    if len(bodies) == 1:
        return list(bodies)
    before, after = bodies
    if same := before.name == after.name:
        before = replace(before, name=f"{before.name}, before")
    return [before, replace(after, name=f"{after.name}, after") if same or edited else after]


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


def _unseen(scene: Scene, faces: Collection[int]) -> str:
    """What to say when faces that are to fill the picture are not seen in it."""
    body, views = scene.bodies[-1], ", ".join(scene.picture.views)
    if any(seen_share(body, faces, camera) >= SEEN for camera in scene.cameras[0]):
        return ""
    view = shown_from(body, faces)
    hint = f"add --view={view}" if view else "others hide them from all sides"
    which = ", ".join(scene.picture.fit)
    return f"fit: {which} is not seen from {views}; {hint}"


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
