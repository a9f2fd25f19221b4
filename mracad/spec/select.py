"""Selectors, by which users name faces and edges of a model, and what an edit may move."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace

import numpy as np

from mracad.errors import UsageError
from mracad.model.brep import Face, Model
from mracad.spec.places import Zone, is_zone, zone
from mracad.spec.steps import Selection

HINT = "select by #3, a product or face name, type:bspline, colour:#ff0000, near:X,Y,Z or cq:'>Z'; see mracad info"
NURBS = frozenset({"bspline", "bezier"})

CadQuery = Callable[[str], "set[int]"]


@dataclass(frozen=True)
class Selected:
    """Indices of the faces and edges that a list of selectors names."""

    faces: frozenset[int]
    edges: frozenset[int]


@dataclass(frozen=True)
class Scope:
    """What an edit may move, as indices of faces and edges.

    Attributes
    ----------
    faces : frozenset of int
        Faces to change.
    held : frozenset of int
        Faces that must not move.
    edges : frozenset of int
        Edges that must not move.
    named : frozenset of int
        Faces that were selected individually, by number or place.
    zones : tuple of Zone
        Regions in which nothing may move.
    firm : frozenset of int
        Edges that must not slide.
    """

    faces: frozenset[int]
    held: frozenset[int] = frozenset()
    edges: frozenset[int] = frozenset()
    named: frozenset[int] = frozenset()
    zones: tuple[Zone, ...] = ()
    firm: frozenset[int] = frozenset()

    @property
    def chosen(self) -> frozenset[int]:
        """Faces that it may move."""
        return self.faces - self.held

    def movable(self, model: Model) -> set[int]:
        """Faces on NURBS surfaces that it may move."""
        return {i for i in self.chosen if model.faces[i].surface is not None}

    def holding(self, faces: Iterable[int], firm: Iterable[int] = ()) -> Scope:
        """This scope with more faces held, and more edges that must not slide."""
        return replace(self, held=self.held | frozenset(faces), firm=self.firm | frozenset(firm))


def scope(
    model: Model, options: Selection, cadquery: CadQuery | None = None, nurbs: Iterable[int] | None = None
) -> Scope:
    """What an edit may move according to its options.

    Parameters
    ----------
    model : Model
    options : Selection
    cadquery : callable, optional
        As for :func:`select`.
    nurbs : iterable of int, optional
        The faces to edit by default; all NURBS faces if not given.

    Raises
    ------
    UsageError
        For a selector that is malformed or matches nothing.
    """
    if options.instance and cadquery is None:
        message = f"instance: {options.instance!r} needs the document, not just the model"
        raise UsageError(message, "use mracad.job.document.run")
    default = every_nurbs(model) if nurbs is None else list(nurbs)
    faces = select(model, options.faces, default, cadquery)
    if faces.edges:
        raise UsageError(f"faces: edge#{min(faces.edges) + 1} is not a face", "only --hold takes edges")
    regions = [word for word in options.hold if is_zone(word)]
    held = select(model, (word for word in options.hold if word not in regions), default, cadquery)
    named = select(model, (word for word in options.faces if word.startswith(("#", "near:"))), (), cadquery)
    chosen = faces.faces if options.faces else frozenset(default)
    zones = tuple(zone(word, "hold", model.diagonal) for word in regions)
    return Scope(chosen, held.faces, held.edges, named.faces & chosen, zones)


def every_nurbs(model: Model) -> list[int]:
    """Indices of the NURBS faces, including converted ones."""
    return [face.index for face in model.faces if face.surface is not None or face.kind in NURBS]


def select(
    model: Model, selectors: Iterable[str], everything: Iterable[int], cadquery: CadQuery | None = None
) -> Selected:
    """Union of the selectors, less those that start with ``!``; only exclusions start from ``everything``.

    Parameters
    ----------
    model : Model
    selectors : iterable of str
    everything : iterable of int
        All faces that can be selected.
    cadquery : callable, optional
        Resolves ``cq:`` selectors to face indices.

    Raises
    ------
    UsageError
        For a selector that is malformed or matches nothing.
    """
    chosen: set[int] = set()
    dropped: set[int] = set()
    edges: set[int] = set()
    words = list(selectors)
    for word in words:
        exclude = word.startswith("!")
        text = word.removeprefix("!")
        if text.startswith("edge#"):
            if exclude:
                raise UsageError(f"{word!r}: edges cannot be left out", "name the edges to hold instead, as edge#4")
            edges.add(_number(text, text[5:], len(model.edges), "edges"))
            continue
        found = _faces(model, text, cadquery)
        if not found:
            raise UsageError(f"no face matches {word!r} in {model.name}", HINT)
        (dropped if exclude else chosen).update(found)
    if not any(not w.startswith(("!", "edge#")) for w in words):
        chosen = set(everything) if any(w.startswith("!") for w in words) else set()
    return Selected(frozenset(chosen - dropped), frozenset(edges))


def _faces(model: Model, text: str, cadquery: CadQuery | None) -> set[int]:
    if text.startswith("#") and text[1:].isdecimal():
        return {_number(text, text[1:], len(model.faces), "faces")}
    if text.startswith("#"):
        raise UsageError(f"{text!r} is not a face number", HINT)
    if text.startswith("type:"):
        kind = text[5:].lower()
        return _where(model, lambda face: face.kind == kind or (kind == "nurbs" and face.kind in NURBS))
    if text.startswith(("colour:", "color:")):
        colour = text.split(":", 1)[1].lower()
        return _where(model, lambda face: colour in {face.colour, face.colour[:7]})
    if text.startswith("near:"):
        return {_nearest(model, text)}
    if text.startswith("cq:"):
        if cadquery is None:
            raise UsageError(f"{text!r} needs the document, not just the model", HINT)
        return cadquery(text[3:])
    return _where(model, lambda face: text in {face.name, face.product})


def _where(model: Model, test: Callable[[Face], bool]) -> set[int]:
    return {face.index for face in model.faces if test(face)}


def _number(word: str, digits: str, count: int, what: str) -> int:
    number = int(digits) if digits.isdecimal() and len(digits) < 10 else 0
    if not 1 <= number <= count:
        raise UsageError(
            f"{word!r}: the model has {what} #1 to #{count}" if count else f"{word!r}: the model has no {what}", HINT
        )
    return number - 1


def _nearest(model: Model, text: str) -> int:
    """The face whose surface sample (or box, when it is not NURBS) is nearest to the point."""
    try:
        point = np.array([float(x) for x in text[5:].split(",")])
    except ValueError:
        point = np.empty(0)
    if point.shape != (3,) or not np.isfinite(point).all():
        raise UsageError(f"{text!r} is not a point", "write near:X,Y,Z in millimetres, near:10,0,5.5")
    if not model.faces:
        raise UsageError(f"{model.name} has no faces", HINT)
    return min(model.faces, key=lambda face: _distance(model, face, point)).index


def _distance(model: Model, face: Face, point: np.ndarray) -> float:
    if face.surface is None:
        return float(np.linalg.norm(np.maximum(np.maximum(face.box[0] - point, point - face.box[1]), 0.0)))
    net = model.surfaces[face.surface].net
    corners = np.array([k.domain for k in (net.u, net.v)]).T
    if face.trims:
        uv = np.concatenate([trim.curve.poles for trim in face.trims])
        corners = np.clip([uv.min(axis=0), uv.max(axis=0)], *corners)
    local = face.local(point)
    grid = net.grid(*np.linspace(corners[0], corners[1], 40).T)
    return float(np.linalg.norm(grid - local, axis=-1).min())
