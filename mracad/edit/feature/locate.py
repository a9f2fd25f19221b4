"""Places and windows, from text to geometry on a model."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass

import numpy as np

from mracad.brief import line
from mracad.bspline.surface import Net
from mracad.edit.feature.ground import SIDEWAYS, Feet, Ground
from mracad.edit.feature.patch import Patch
from mracad.errors import EditError, UsageError
from mracad.model.brep import Face, Model
from mracad.seam.trace import Trace, trace_of
from mracad.spec.places import FEATURE, PLACE, Disc, OnFace, Point, Rectangle, whole

Array = np.ndarray

ON = "give a point on one of them, or select others with --faces"

NAMED = 5
"""Number of places that a message names."""


def face_number(model: Model, text: str, what: str, hint: str) -> int:
    """A face by its number ``#3`` or its name; raises UsageError."""
    if text.startswith("#"):
        number = whole(text[1:]) or 0
        if not 1 <= number <= len(model.faces):
            raise UsageError(f"{what}: {text!r}: the model has faces #1 to #{len(model.faces)}", hint)
        return number - 1
    found = [face.index for face in model.faces if text and text in (face.name, face.product)]
    if len(found) != 1:
        raise UsageError(f"{what}: {len(found) or 'no'} faces are named {text!r}", hint)
    return found[0]


@dataclass(frozen=True, eq=False)
class Place:
    """A place as given.

    Attributes
    ----------
    label : str
        Its name in messages.
    point : ndarray (3,)
        In space, mm; for parameters the point there.
    face : int or None
        The face, for a place given by its parameters ``uv``.
    rotate, size, height : float
        Angle (radians) and factors of the copy there.
    direction : ndarray (3,) or None
        Direction of the copy's x; None for S_u.
    """

    label: str
    point: Array
    face: int | None = None
    uv: Array | None = None
    rotate: float = 0.0
    size: float = 1.0
    height: float = 1.0
    direction: Array | None = None

    __repr__ = line


def place(ground: Ground, given: Point | OnFace, label: str) -> Place:
    """A place on the ground; raises UsageError and EditError."""
    if isinstance(given, Point):
        return Place(label, ground.brought(np.array([given.xyz]))[0])
    face, uv = face_number(ground.model, given.face, label, PLACE), np.array(given.uv)
    patch = patch_of(ground, face, label)
    if not patch.within(uv) or not patch.inside(ground.model.faces[face], uv[None])[0]:
        raise EditError(f"{label} is outside the face: {_domain(patch)}", "give parameters inside the face")
    return Place(label, np.asarray(patch.net.evaluate(uv[None]))[0], face, uv)


def patch_of(ground: Ground, face: int, label: str) -> Patch:
    """The patch of a face; raises EditError if the face does not belong to the ground."""
    surface = ground.model.faces[face].surface
    if surface is None:
        raise EditError(
            f"{label}: #{face + 1} ({ground.model.faces[face].kind}) is not a NURBS face", "name another face"
        )
    if face not in ground.chosen:
        raise EditError(f"{label}: #{face + 1} is not among the faces to edit", f"select it with --faces '#{face + 1}'")
    return ground.patches[surface]


def standing(ground: Ground, places: Sequence[Place], far: float, hint: str = ON) -> Feet:
    """The feet of places; raises EditError that names those farther than ``far`` (mm) from the ground."""
    feet, off = stood(ground, places, far)
    if off:
        raise EditError(told(off), hint)
    return feet


def told(off: Collection[str]) -> str:
    """Words about places, those about the first of them in full."""
    more = f"; and {len(off) - NAMED} more" if len(off) > NAMED else ""
    return "; ".join(list(off)[:NAMED]) + more


def stood(ground: Ground, places: Sequence[Place], far: float) -> tuple[Feet, dict[str, int]]:
    """The feet of places, and words about those farther than ``far`` (mm) from the ground, or at its poles, with their
    indices."""
    points = np.array([p.point for p in places]).reshape(-1, 3)
    given = np.array([p.face is not None for p in places], bool)
    feet = ground.feet(points[~given])
    surface, uv, apart = np.zeros(len(places), int), np.zeros((len(places), 2)), np.zeros(len(places))
    surface[~given], uv[~given], apart[~given] = feet.surface, feet.uv, feet.apart
    for i in np.flatnonzero(given).tolist():
        surface[i], uv[i] = ground.model.faces[places[i].face or 0].surface, places[i].uv
    feet = ground.standing(surface, uv, apart)
    on = np.isfinite(apart) & (ground.faces(surface, uv) >= 0)
    bad = ~on | ~(given | ((apart <= far) & (feet.beside(points) <= SIDEWAYS * far)))
    poles = on & (np.linalg.norm(feet.normals, axis=1) < 0.5)
    off = {}
    for i in np.flatnonzero(bad | poles).tolist():
        name = places[i].label
        if "(" not in name:
            name += f" ({','.join(f'{round(x, 6) + 0.0:g}' for x in points[i])})"
        where = f"{apart[i]:.3g} mm away from" if on[i] else "not on"
        off[f"{name} is at a pole" if poles[i] else f"{name} is {where} the faces to edit"] = i
    return feet, off


def _domain(patch: Patch) -> str:
    u, v = patch.knots
    return f"u goes from {u.domain[0]:g} to {u.domain[1]:g}, v from {v.domain[0]:g} to {v.domain[1]:g}"


def edge_of(ground: Ground, number: int, name: str, hint: str) -> tuple[Face, Trace]:
    """A face of the ground that an edge bounds, by its number, and its trace; raises UsageError and EditError."""
    model = ground.model
    if not 1 <= number <= len(model.edges):
        known = f"edges edge#1 to edge#{len(model.edges)}" if model.edges else "no edges"
        raise UsageError(f"{name}: edge#{number}: the model has {known}", hint)
    edge = model.edges[number - 1]
    side = next((s for s in edge.sides if s.face in ground.chosen and s.uv is not None), None)
    if side is None or edge.degenerate:
        raise EditError(f"{name}: edge#{number} bounds no face to edit", "select one of its faces with --faces")
    face = model.faces[side.face]
    return face, trace_of(model, face, face.trim(edge.index))


@dataclass(frozen=True, eq=False)
class Window:
    """The part of the ground that a feature covers: a geodesic disc, or a rectangle in parameters.

    Attributes
    ----------
    name : str
        The text as given.
    feet : Feet
        Its middle.
    point : ndarray (3,)
    radius, width : float
        Radius of the disc, or half the diagonal of the rectangle, and width of the taper beyond it, mm.
    box : ndarray (2, 2) or None
        Smallest and largest parameters of a rectangle.
    patch : Patch or None
        Its surface.
    """

    name: str
    feet: Feet
    point: Array
    radius: float
    width: float
    box: Array | None = None
    patch: Patch | None = None

    @property
    def label(self) -> str:
        """Its name in messages."""
        return f"feature {self.name}"

    @property
    def reach(self) -> float:
        """Its radius with the taper, mm."""
        return self.radius + self.width

    def shares(self, patch: Patch, points: Array, xy: Array) -> Array:
        """Position of the Greville points ``(nu, nv)`` of a patch in the taper: 0 and less inside it, 1 and more
        beyond.

        Only ``points`` (flat indices) with normal coordinates ``xy (q, 2)`` can lie inside.
        """
        if self.box is None:
            beyond = np.linalg.norm(xy, axis=1) - self.radius
        elif patch is not self.patch:
            beyond = np.full(len(points), np.inf)
        else:
            beyond = _beyond(patch.net, self.box)[points]
        found = np.full(patch.net.poles.shape[:2], np.inf)
        found.ravel()[points] = beyond / self.width if self.width else np.where(beyond > 0, np.inf, 0.0)
        return found


def _beyond(net: Net, box: Array) -> Array:
    """Distance (mm, along the parameter lines) of the Greville points from a rectangle, ``(nu nv,)``; 0 inside."""
    apart = []
    for axis, kv in enumerate((net.u, net.v)):
        line = np.concatenate([kv.greville(), box[:, axis]])
        order = np.argsort(line)
        uv = np.tile(box.mean(axis=0), (len(line), 1))
        uv[:, axis] = line[order]
        steps = np.linalg.norm(np.diff(np.asarray(net.evaluate(uv)), axis=0), axis=1)
        length = np.zeros(len(line))
        length[order] = np.append(0.0, np.cumsum(steps))
        apart.append(np.maximum(np.maximum(length[-2] - length[:-2], length[:-2] - length[-1]), 0.0))
    return np.asarray(np.hypot(apart[0][:, None], apart[1]).ravel())


def window(ground: Ground, given: Disc | Rectangle, text: str, width: float | None) -> Window:
    """A window on the ground, named by its text; raises UsageError and EditError.

    The ``width`` of the taper (mm) is by default a quarter of the radius, or of the shorter side of a rectangle.
    """
    label = f"feature {text}"
    if isinstance(given, Disc):
        middle = place(ground, given.middle, label.partition(",radius")[0])
        feet = standing(ground, [middle], given.radius)
        return Window(text, feet, middle.point, given.radius, given.radius / 4 if width is None else width)
    face = face_number(ground.model, given.face, label, FEATURE)
    return _rectangle(ground, face, np.array([given.low, given.high]), text, width)


def _rectangle(ground: Ground, face: int, corners: Array, text: str, width: float | None) -> Window:
    """The window between two corners ``(2, 2)`` in the parameters of a face."""
    label = f"feature {text}"
    patch = patch_of(ground, face, label)
    if not patch.within(corners).all():
        raise EditError(f"{label}: the window is outside the face: {_domain(patch)}", "give parameters inside the face")
    middle = corners.mean(axis=0)
    if not patch.inside(ground.model.faces[face], middle[None])[0]:
        raise EditError(f"{label}: the middle of the window is outside the face", "move it onto the face")
    feet = ground.standing(np.array([patch.index]), middle[None], np.zeros(1))
    (u0, v0), (u1, v1) = corners
    points = np.asarray(patch.net.evaluate(np.array([[u0, v0], [u1, v0], [u1, v1], [u0, v1]])))
    sides = np.linalg.norm(points - np.roll(points, 1, axis=0), axis=1)
    radius = float(np.linalg.norm(points - feet.points[0], axis=1).max())
    width = float(sides.min()) / 4 if width is None else width
    return Window(text, feet, feet.points[0], radius, width, corners, patch)
