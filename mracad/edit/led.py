"""The points that a sweep moves: from its options to parameters of surfaces."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from mracad.edit.feature.ground import Ground
from mracad.edit.feature.locate import place
from mracad.errors import EditError
from mracad.model.brep import Face, Model
from mracad.spec import places as spec
from mracad.spec.select import Scope
from mracad.spec.steps.shape import Sweep

Array = np.ndarray

NEAR = 1e-3, 0.01
"""Largest distance of a point from a surface: a share of the scale, and at least a length (mm)."""

MOST = 500
"""Largest number of points of a sweep, each of which takes a separate solve."""

NAMED = 5
"""Largest number of points that a message names."""


@dataclass(frozen=True, eq=False)
class Led:
    """Points of surfaces, and how far they move.

    Attributes
    ----------
    places : mapping of int to ndarray (k, 2)
        Parameters by surface.
    moves : mapping of int to ndarray (k, 3)
        Displacements of the points in the frame of the surface, mm.
    labels : mapping of int to sequence of str
        Their names in messages.
    points : ndarray (m, 3)
        All points in the part's frame, mm.
    """

    places: Mapping[int, Array]
    moves: Mapping[int, Array]
    labels: Mapping[int, Sequence[str]]
    points: Array

    @property
    def largest(self) -> float:
        """The largest move, mm."""
        return max(float(np.linalg.norm(each, axis=1).max()) for each in self.moves.values())

    def times(self, share: float) -> Led:
        """The same points, moved a share of the way."""
        return replace(self, moves={i: share * each for i, each in self.moves.items()})

    def away(self, faces: Sequence[Face], points: Array) -> Array:
        """Distances of points ``(…, 3)``, in the frame of the surface of faces, from the nearest of these, mm."""
        from scipy.spatial import KDTree

        tree = KDTree(self.points)
        return np.asarray(np.min([tree.query(face.placed(points))[0] for face in faces], axis=0))

    def refuse(self, places: Mapping[int, Array], wrong: Array, why: str) -> None:
        """Raise EditError for points in ``places`` for which ``wrong`` is true."""
        labels = [label for i in places for label in self.labels[i]]
        bad = [label for label, each in zip(labels, wrong, strict=True) if each]
        if bad:
            raise EditError(f"{_listed(bad)} {why}", "choose other points, or a larger --scale")


@dataclass(frozen=True)
class _Given:
    label: str
    where: spec.Point | spec.OnFace
    by: tuple[float, ...] | None
    to: tuple[float, ...] | None = None


def _given(options: Sweep) -> list[_Given]:
    """The points as given; raises FileError for an invalid file, and EditError for too many."""
    found: list[_Given] = []
    single = 0
    for text in options.at:
        where = spec.place(text, "at")
        if isinstance(where, spec.Listed):
            for name, row in spec.moves(where.path):
                label = f"{name} ({','.join(f'{x:g}' for x in row[:3])})"
                found.append(_Given(label, spec.Point(row[:3]), row[3:]))
            continue
        label = f"point {single + 1} ({text})"
        if options.by:
            by = options.by[single if len(options.by) > 1 else 0]
            found.append(_Given(label, where, spec.vector(by, "by")))
        else:
            found.append(_Given(label, where, None, spec.vector(options.to[single], "to")))
        single += 1
    if len(found) > MOST:
        raise EditError(f"{len(found)} points are too many for a sweep", f"give {MOST} at most: others follow")
    return found


def led(model: Model, options: Sweep, scope: Scope, scale: float) -> Led:
    """The points of a sweep at a scale (mm).

    Raises
    ------
    EditError
        For points that are not on faces that may move; all of them are named.
    FileError
        For an invalid file of points.
    """
    given = _given(options)
    movable = scope.movable(model)
    ground = Ground.of(model, movable)
    every = [place(ground, each.where, each.label) for each in given]
    points = np.array([each.point for each in every])
    feet = ground.feet(points)
    surface, uv = feet.surface.copy(), feet.uv.copy()
    off = np.where(ground.faces(surface, uv) >= 0, feet.apart, np.inf)
    for i, each in enumerate(every):
        if each.face is not None and each.uv is not None:
            surface[i], uv[i], off[i] = model.faces[each.face].surface, each.uv, 0.0
    _refuse_off(model, scope, given, points, off > max(NEAR[0] * scale, NEAR[1]))
    feet = ground.standing(surface, uv, off)
    places, moves, labels = {}, {}, {}
    for i in dict.fromkeys(surface.tolist()):
        own = np.flatnonzero(surface == i)
        turn = ground.patches[i].turn
        goals = [_goal(given[k], points[k]) - feet.points[k] for k in own]
        places[i], moves[i] = uv[own], np.array(goals) @ turn
        labels[i] = [given[k].label for k in own]
    return Led(places, moves, labels, feet.points)


def _goal(given: _Given, point: Array) -> Array:
    return np.array(given.to) if given.to is not None else point + np.array(given.by)


def _refuse_off(model: Model, scope: Scope, given: Sequence[_Given], points: Array, off: Array) -> None:
    """Raise EditError for points that are not on the faces to edit, with the faces on which they are, or distances."""
    bad = np.flatnonzero(off)
    if not len(bad):
        return
    nurbs = {face.index for face in model.faces if face.surface is not None}
    ground = Ground.of(model, nurbs)
    feet = ground.feet(points[bad])
    faces = ground.faces(feet.surface, feet.uv)
    words = []
    for k, i in enumerate(bad.tolist()):
        name, face = given[i].label, int(faces[k])
        if face >= 0 and face not in scope.chosen and feet.apart[k] <= NEAR[1]:
            why = "held" if face in scope.held else "not selected"
            words.append(f"{name} is on #{face + 1}, which is {why}")
        elif np.isfinite(feet.apart[k]):
            words.append(f"{name} is {feet.apart[k]:.3g} mm away from the model's NURBS faces")
        else:
            words.append(f"{name} is not on the model's NURBS faces")
    raise EditError(_listed(words), "give points on faces that may move")


def _listed(words: Collection[str]) -> str:
    every = list(words)
    more = [f"and {len(every) - NAMED} more"] if len(every) > NAMED else []
    return ", ".join([*every[:NAMED], *more])
