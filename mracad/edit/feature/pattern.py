"""Patterns: the places of copies from the options."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from mracad.edit.feature.detail import Feature
from mracad.edit.feature.fill import filled
from mracad.edit.feature.ground import SIDEWAYS, Feet, Ground, axes
from mracad.edit.feature.locate import ON, Place, edge_of, place, standing, stood, told
from mracad.edit.feature.patch import Patch
from mracad.errors import EditError
from mracad.model.brep import Face
from mracad.seam.trace import EVENLY, Trace
from mracad.seam.wishes import Wishes
from mracad.spec import places as spec
from mracad.spec.fill import fill
from mracad.spec.quantity import length
from mracad.spec.steps import Repeat

Array = np.ndarray

STRIDES = 4
"""Steps from one place of a grid to the next."""


def places(ground: Ground, feature: Feature, options: Repeat, wishes: Wishes) -> tuple[list[Place], tuple[str, ...]]:
    """All places of copies, each with the rotation and scales of the copy there, and notes on those left out.

    Raises
    ------
    UsageError
        For invalid options.
    EditError
        For a place off the ground.
    FileError
        For an invalid file of places.
    """
    found = filled(ground, feature, options, wishes) if options.fill else listed(ground, options.at)
    if options.grid or options.polar:
        first = found[0] if found else None
        own = feature.origin is not None and first is None
        origin, frame = _beginning(ground, feature, first)
        if options.grid:
            laid = grid(ground, spec.grid(options.grid, "grid"), origin, frame, own)
        else:
            laid = polar(spec.polar(options.polar or "", "polar"), origin, frame, own)
        if first is not None:
            laid = [replace(p, rotate=first.rotate, size=first.size, height=first.height) for p in laid]
        found = laid + found[1:]
    if options.along:
        found = found + along(ground, spec.along(options.along, "along"))
    turn = math.radians(options.rotate)
    found = [
        replace(p, rotate=p.rotate + turn, size=p.size * options.size, height=p.height * options.height) for p in found
    ]
    feet, off = stood(ground, found, feature.reach)
    if off and not options.skip_off:
        raise EditError(told(off), f"{ON}, or leave such places out with --skip-off")
    if len(off) == len(found):
        raise EditError(f"no place is on the faces to edit: {told(off)}", ON)
    skipped = (f"{len(off)} of {len(found)} places left out: {told(off)}",) if off else ()
    if off:
        on = np.setdiff1d(np.arange(len(found)), list(off.values()))
        found, feet = [found[i] for i in on], feet.part(on)
    if options.jitter is not None or options.spin:
        jitter = 0.0 if options.jitter is None else length(options.jitter, ground.model.diagonal, "jitter")
        found = scattered(found, feet, jitter, math.radians(options.spin), options.seed)
    return found, skipped + (_crowded(ground, feature, options, found) if options.fill else ())


def _crowded(ground: Ground, feature: Feature, options: Repeat, found: Sequence[Place]) -> tuple[str, ...]:
    """A note if copies that fill the faces overlap."""
    spacing = length(fill(options.fill or "", "fill").spacing, ground.model.diagonal, "fill: spacing")
    wide = 2 * feature.radius * max(p.size for p in found)
    if wide <= spacing * (1 + 1e-9):
        return ()
    return (f"copies are up to {wide:.3g} mm wide and {spacing:.3g} mm apart: they overlap",)


def _beginning(ground: Ground, feature: Feature, first: Place | None) -> tuple[Array, Array]:
    """Where a pattern begins, and its frame: at the first place if there is one, else at the feature's own."""
    if first is not None:
        foot = standing(ground, [first], feature.reach)
        return foot.points[0], axes(foot.normals, foot.along)[0]
    if feature.origin is None:
        raise EditError("a feature from a file has no place of its own", "give its place with --at")
    feet = feature.origin.feet
    return ground.standing(feet.surface, feet.uv, np.zeros(1)).points[0], feature.origin.axes


def listed(ground: Ground, words: Sequence[str]) -> list[Place]:
    """Places from ``--at``; raises UsageError, EditError and FileError."""
    found: list[Place] = []
    for word in words:
        given = spec.place(word, "at")
        if not isinstance(given, spec.Listed):
            found.append(place(ground, given, f"place {len(found) + 1} ({word})"))
            continue
        for name, row in spec.table(given.path):
            rotate, size, height = (*row[3:], *(0.0, 1.0, 1.0)[len(row) - 3 :])
            label = f"{name} ({','.join(f'{x:g}' for x in row[:3])})"
            point = ground.brought(np.array([row[:3]]))[0]
            found.append(Place(label, point, None, None, np.radians(rotate), size, height))
    return found


def grid(ground: Ground, given: spec.Grid, origin: Array, frame: Array, own: bool) -> list[Place]:
    """A grid that follows the ground along the axes of a frame (rows); the first place is left out if the feature
    is there already."""
    (wide, high), (dx, dy) = given.counts, given.steps
    rows = [(origin[None], frame[None])]
    for _ in range(wide - 1):
        rows.append(_walked(ground, *rows[-1], 0, dx))
    columns = [(np.concatenate([p for p, _ in rows]), np.concatenate([f for _, f in rows]))]
    for _ in range(high - 1):
        columns.append(_walked(ground, *columns[-1], 1, dy))
    return [
        Place(f"place {i + 1},{j + 1} of the grid", points[i], direction=frames[i, 0])
        for i in range(wide)
        for j, (points, frames) in enumerate(columns)
        if i or j or not own
    ]


def _walked(ground: Ground, points: Array, frames: Array, axis: int, distance: float) -> tuple[Array, Array]:
    """Points and frames (rows x, y, normal) after a walk over the ground, continued straight where it ends."""
    on = np.ones(len(points), bool)
    for _ in range(STRIDES):
        ahead = points + distance / STRIDES * frames[:, axis]
        feet = ground.feet(ahead)
        on &= feet.beside(ahead) <= SIDEWAYS * abs(distance)
        points = np.where(on[:, None], feet.points, ahead)
        frames = np.where(on[:, None, None], axes(feet.normals, frames[:, 0]), frames)
    return points, frames


def polar(given: spec.Polar, origin: Array, frame: Array, own: bool) -> list[Place]:
    """Places around an axis; the first one is left out if the feature is there already."""
    centre, axis, count = np.array(given.centre), np.array(given.axis), given.count
    size = float(np.linalg.norm(axis))
    found = []
    for k in range(1 if own else 0, count):
        turn = rotation(axis / size, 2 * np.pi * k / count)
        label = f"place {k + 1} of {count} around the axis"
        found.append(Place(label, centre + turn @ (origin - centre), direction=turn @ frame[0]))
    return found


def along(ground: Ground, given: spec.Along) -> list[Place]:
    """Places along an edge, in the middles of equal parts of it."""
    number, count, offset = given.edge, given.count, given.offset
    face, trace = edge_of(ground, number, "along", spec.ALONG)
    assert face.surface is not None
    points, tangents = _even(ground.patches[face.surface], trace, count)
    if offset:
        points = points + offset * _inward(ground, face, points, tangents)
    return [Place(f"place {k + 1} along edge#{number}", points[k], direction=tangents[k]) for k in range(count)]


def _even(patch: Patch, trace: Trace, count: int) -> tuple[Array, Array]:
    """Points and unit tangents in the middles of equal parts of a boundary curve."""
    points = np.asarray(patch.net.evaluate(trace.evenly))
    length = np.append(0.0, np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1)))
    share = np.interp(length[-1] * (np.arange(count) + 0.5) / count, length, EVENLY)
    found, su, sv, _ = patch.evaluate(trace.places(share))
    way = trace.way(share)
    tangents = su * way[:, :1] + sv * way[:, 1:]
    return found, tangents / np.linalg.norm(tangents, axis=1, keepdims=True)


def _inward(ground: Ground, face: Face, points: Array, tangents: Array) -> Array:
    """Directions into a face at points of an edge: the side of the tangent on which a small step stays on it."""
    way = np.cross(ground.feet(points).normals, tangents)
    size = 1e-2 * float(np.linalg.norm(np.ptp(points, axis=0)) or 1.0)
    middle = slice(len(points) // 2, len(points) // 2 + 1)
    for sign in (1.0, -1.0):
        at = ground.feet(points[middle] + sign * size * way[middle])
        if ground.faces(at.surface, at.uv)[0] == face.index and at.apart[0] < 0.2 * size:
            return sign * way
    return way


def scattered(places: Sequence[Place], feet: Feet, jitter: float, spin: float, seed: int) -> list[Place]:
    """Places moved at random by up to ``jitter`` (mm) along the ground and turned by up to ``spin`` (radians)."""
    rng = np.random.default_rng(seed)
    frames = axes(feet.normals, feet.along)
    radius = jitter * np.sqrt(rng.random(len(places)))
    angle = 2 * np.pi * rng.random(len(places))
    turn = spin * (2 * rng.random(len(places)) - 1)
    way = np.cos(angle)[:, None] * frames[:, 0] + np.sin(angle)[:, None] * frames[:, 1]
    return [
        replace(p, point=feet.points[i] + radius[i] * way[i], face=None, uv=None, rotate=p.rotate + turn[i])
        for i, p in enumerate(places)
    ]


def rotation(axis: Array, angle: float) -> Array:
    x, y, z = axis
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.asarray(np.eye(3) + np.sin(angle) * cross + (1 - np.cos(angle)) * cross @ cross)
