"""The points that a sweep moves: from its options to parameters of surfaces."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from mracad.edit.feature.ground import Feet, Ground
from mracad.edit.feature.locate import place
from mracad.edit.region import around, of_edge, turned
from mracad.errors import EditError
from mracad.model.brep import Face, Model
from mracad.spec import motions
from mracad.spec import places as spec
from mracad.spec.quantity import length
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
        bad = dict.fromkeys(label for label, each in zip(labels, wrong, strict=True) if each)
        if bad:
            raise EditError(f"{_listed(bad)} {why}", "choose other points, or a larger --scale")


@dataclass(frozen=True)
class _Given:
    label: str
    where: spec.Point | spec.OnFace | motions.Rim
    by: tuple[float, ...] | None
    to: tuple[float, ...] | None = None


def _given(options: Sweep) -> list[_Given]:
    """The points as given; raises FileError for an invalid file."""
    found: list[_Given] = []
    single = 0
    for text in options.at:
        where = motions.start(text, "at")
        if isinstance(where, spec.Listed):
            for name, row in spec.moves(where.path):
                label = f"{name} ({','.join(f'{x:g}' for x in row[:3])})"
                found.append(_Given(label, spec.Point(row[:3]), row[3:]))
            continue
        label = text if isinstance(where, motions.Rim) else f"point {single + 1} ({text})"
        if options.to:
            found.append(_Given(label, where, None, spec.vector(options.to[single], "to")))
        else:
            by = options.by[single if len(options.by) > 1 else 0] if options.by else "0,0,0"
            found.append(_Given(label, where, motions.step(by, "by")))
        single += 1
    return found


def led(model: Model, options: Sweep, scope: Scope, scale: float) -> Led:
    """The points of a sweep at a scale (mm).

    Raises
    ------
    EditError
        For points that are not on faces that may move; all of them are named.  For more than 500 points.
    FileError
        For an invalid file of points.
    """
    given = _given(options)
    ground = Ground.of(model, scope.movable(model))
    spots = [each for each in given if not isinstance(each.where, motions.Rim)]
    standing = iter(_standing(ground, scope, spots, scale))
    radius = length(options.radius, model.diagonal, "radius") if options.radius else 0.0
    feet, goals, labels = [], [], []
    for each in given:
        if isinstance(each.where, motions.Rim):
            own = of_edge(ground, each.where.number, scale)
            point = own.points[len(own.points) // 2]
        else:
            foot, point = next(standing)
            own = around(ground, foot, radius, scale) if radius else foot
        feet.append(own)
        goals.append(_goals(each, own, point, options))
        labels += [each.label] * len(own.points)
        if len(labels) > MOST:
            raise EditError(f"more than {MOST} points are too many for a sweep", "give fewer, or a larger --scale")
    return _led(ground, feet, np.concatenate(goals), labels)


def _led(ground: Ground, feet: Sequence[Feet], goals: Array, labels: Sequence[str]) -> Led:
    surface, uv, points = (np.concatenate([getattr(f, name) for f in feet]) for name in ("surface", "uv", "points"))
    every = {i: np.flatnonzero(surface == i) for i in dict.fromkeys(surface.tolist())}
    moves = {i: (goals - points)[own] @ ground.patches[i].turn for i, own in every.items()}
    return Led(
        {i: uv[own] for i, own in every.items()},
        moves,
        {i: [labels[k] for k in own.tolist()] for i, own in every.items()},
        points,
    )


def _standing(ground: Ground, scope: Scope, given: Sequence[_Given], scale: float) -> list[tuple[Feet, Array]]:
    """The foot of each point, and the point as given; raises EditError for those off the ground."""
    every = [place(ground, each.where, each.label) for each in given if not isinstance(each.where, motions.Rim)]
    if not every:
        return []
    points = np.array([each.point for each in every])
    feet = ground.feet(points)
    surface, uv = feet.surface.copy(), feet.uv.copy()
    off = np.where(ground.faces(surface, uv) >= 0, feet.apart, np.inf)
    for i, each in enumerate(every):
        if each.face is not None and each.uv is not None:
            surface[i], uv[i], off[i] = ground.model.faces[each.face].surface, each.uv, 0.0
    _refuse_off(ground.model, scope, given, points, off > max(NEAR[0] * scale, NEAR[1]))
    feet = ground.standing(surface, uv, off)
    return [(feet.part(slice(i, i + 1)), points[i]) for i in range(len(every))]


def _goals(given: _Given, feet: Feet, point: Array, options: Sweep) -> Array:
    """Where the points of one place go, ``(q, 3)``; ``point`` is the place as given."""
    middle = len(feet.points) // 2 if isinstance(given.where, motions.Rim) else 0
    alone = len(feet.points) == 1 and not options.turns
    found = point[None] if alone else turned(feet.points, feet.points[middle], feet.normals[middle], options)
    if given.to is not None:
        return np.asarray(found + (np.array(given.to) - point))
    assert given.by is not None
    return np.asarray(found + (given.by[0] * feet.normals if len(given.by) == 1 else np.array(given.by)))


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
