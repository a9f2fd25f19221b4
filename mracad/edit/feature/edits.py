"""Detail features: move one, repeat it, transfer it from another model.

A feature is separated from the surface under it (:mod:`~mracad.edit.feature.extract`), tabulated in geodesic
coordinates of its place, and copied elsewhere (:mod:`~mracad.edit.feature.lay`); seams between edited faces are kept.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import replace

import numpy as np

from mracad import note
from mracad.edit.feature.detail import Feature
from mracad.edit.feature.extract import feature_of
from mracad.edit.feature.fit import NARROWEST
from mracad.edit.feature.ground import Ground
from mracad.edit.feature.ideal import copies
from mracad.edit.feature.lay import Laid, laid
from mracad.edit.feature.locate import Place, place, standing, told
from mracad.edit.feature.pattern import places
from mracad.edit.feature.score import CUT_OFF, HELD_BADLY, Unfit, lumpy
from mracad.edit.result import Edit, FaceOutcome, Reason, untouched
from mracad.errors import EditError
from mracad.model.brep import Face, Model
from mracad.model.displacement import Displacement
from mracad.seam.natural import Treatment
from mracad.seam.wishes import Wishes
from mracad.seam.zones import zoned
from mracad.spec.places import spot
from mracad.spec.select import Scope
from mracad.spec.select import scope as scope_of
from mracad.spec.steps import Copied, Move, Repeat, Transfer

Array = np.ndarray

PIECES = 64
"""Largest number of pieces of the law of a joint that moves with copies."""

ROUNDS = 4
"""How often a fill is laid at most: each time without the places that cannot take a copy."""

LARGE, BYTES = 100_000, 115
"""Control points that a surface grows by beyond which a note says so, and what one takes in a STEP file."""

FILLED = {
    HELD_BADLY: "make copies smaller with --size, or select other faces",
    CUT_OFF: "make copies smaller with --size, keep borders clear with --margin, or allow that with --clip",
}

FACE = "write a face as #3, or its name"


def move(
    model: Model,
    options: Move,
    *,
    scope: Scope | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> Edit:
    """Move a feature; parameters as for :func:`mracad.edit.whole.edited`.

    Raises
    ------
    EditError
        For a place or a window that is not on the faces, or a feature that does not fit its old or new place.
    """
    scope = scope or scope_of(model, options)
    chosen = scope.movable(model)
    feature = feature_of(model, options, chosen, options.feature)
    assert feature.origin is not None
    _refuse_held(model, feature.origin.offsets, scope)
    ground = Ground.of(model, chosen).without(feature.origin.offsets)
    removed = {i: -offset for i, offset in feature.origin.offsets.items()}
    return _edit(model, scope, _laid(ground, feature, [_target(ground, options.to, options)], options, scope, removed))


def repeat(
    model: Model,
    options: Repeat,
    *,
    scope: Scope | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> Edit:
    """Copy a feature; parameters and errors as for :func:`move`."""
    scope = scope or scope_of(model, options)
    chosen = scope.movable(model)
    feature = feature_of(model, options, chosen, options.feature)
    ground = Ground.of(model, chosen).without(feature.origin.offsets if feature.origin else {})
    note.doing("finding places")
    found, skipped = places(ground, feature, options, _wishes(options, scope))
    laid, left = _filled(ground, feature, found, options, scope)
    edit = _edit(model, scope, laid)
    return replace(edit, notes=(*feature.notes, *skipped, *left, *edit.notes))


def transferred(model: Model, options: Transfer, source: Model, scope: Scope) -> Edit:
    """Copy a feature of another model (``source``) to this one; errors as for :func:`move`."""
    assert options.from_ is not None
    assert options.to is not None
    every = {f.index for f in source.faces if f.surface is not None}
    feature = replace(feature_of(source, options, every, options.from_), origin=None)
    ground = Ground.of(model, scope.movable(model))
    found = [_target(ground, options.to, options)]
    edit = _edit(model, scope, _laid(ground, feature, found, options, scope, {}))
    return replace(edit, notes=(*feature.notes, *edit.notes))


def _refuse_held(model: Model, offsets: Mapping[int, Array], scope: Scope) -> None:
    """Raise EditError if a region holds part of a feature (offsets by surface) that is to be removed."""
    for i, offset in offsets.items():
        surface = model.surfaces[i]
        held = zoned(surface.net, [model.faces[face] for face in surface.faces], scope.zones)
        if np.any(offset[held]):
            raise EditError("feature: a region of --hold keeps part of it", "move another feature, or hold less")


def _target(ground: Ground, text: str, options: Copied | Transfer) -> Place:
    found = place(ground, spot(text, "to"), f"place ({text})")
    return replace(found, rotate=math.radians(options.rotate), size=options.size, height=options.height)


def _filled(
    ground: Ground, feature: Feature, found: Sequence[Place], options: Repeat, scope: Scope
) -> tuple[Laid, tuple[str, ...]]:
    """Copies, for a fill at those places that can take them, and notes on the others; raises EditError."""
    left: dict[str, list[str]] = {}
    rest = found
    for again in reversed(range(ROUNDS)):
        try:
            laid = _laid(ground, feature, rest, options, scope, {})
            break
        except Unfit as error:
            if not options.fill:
                raise
            bad = {k for some in error.bad.values() for k in some}
            if not again or len(bad) == len(rest):
                raise EditError(error.message, FILLED[next(why for why, some in error.bad.items() if some)]) from error
            for why, some in error.bad.items():
                left.setdefault(why, []).extend(some.values())
            rest = [each for k, each in enumerate(rest) if k not in bad]
    count = len(found)
    return laid, tuple(f"{len(x)} of {count} places left out, because {why}: {told(x)}" for why, x in left.items() if x)


def _laid(
    ground: Ground,
    feature: Feature,
    found: Sequence[Place],
    options: Copied | Transfer,
    scope: Scope,
    removed: Mapping[int, Array],
) -> Laid:
    """Copies at places, with the offsets that remove the source's feature."""
    least = min(found, key=lambda p: p.size, default=None)
    if least is not None and feature.spacing * least.size < NARROWEST:
        raise EditError(
            f"{least.label}: a copy of {2 * feature.radius * least.size:.3g} mm would need knots closer than "
            f"{NARROWEST:g} mm",
            "make it larger with --size",
        )
    overlap = options.overlap if isinstance(options, Repeat) else "add"
    note.doing("laying copies")
    every = copies(ground, feature, found, standing(ground, found, feature.reach), overlap, options.mirror)
    return laid(every, _wishes(options, scope), options.edges == "coupled", options.clip, removed)


def _wishes(options: Copied | Transfer, scope: Scope) -> Wishes:
    return Wishes(options.keep, hold=scope.edges, zones=scope.zones, pieces=PIECES)


def _edit(model: Model, scope: Scope, laid: Laid) -> Edit:
    """The edit with an outcome for every face and every edge of those under copies."""
    touched, movable = {f for copy in laid.copies for f in copy.faces}, scope.movable(model)
    outcomes = tuple(untouched(face, scope, movable) or _outcome(model, face, laid, touched) for face in model.faces)
    ways = {
        **dict.fromkeys(laid.frozen, "frozen"),
        **dict.fromkeys(laid.loose, "to tolerance"),
        **dict.fromkeys(laid.moving, "coupled"),
    }
    edges = tuple(
        Treatment(e, tuple(s.face for s in model.edges[e].sides), how, laid.frozen[e] if how == "frozen" else None)
        for e, how in sorted(ways.items())
    )
    notes = lumpy(laid.copies) + _large(outcomes, len(laid.copies))
    return Edit(Displacement(laid.offsets), outcomes, edges=edges, copies=laid.copies, notes=notes)


def _large(outcomes: Sequence[FaceOutcome], copies: int) -> tuple[str, ...]:
    """A note on the face that grows most, if copies make it large."""
    most = max(outcomes, key=lambda each: each.added)
    if most.added <= LARGE:
        return ()
    fewer = ", a larger spacing, or rows along its knot lines (--fill grid, --align)" if copies > 1 else ""
    return (
        f"#{most.face + 1} grows from {most.points - most.added} to {most.points} control points, by about "
        f"{most.added * BYTES / 1e6:.0f} MB in a STEP file: a larger or smoother feature{fewer} needs fewer",
    )


def _outcome(model: Model, face: Face, laid: Laid, touched: Collection[int]) -> FaceOutcome:
    """The outcome for a face that may move; copies lie on those ``touched``."""
    assert face.surface is not None
    surface, offset = model.surfaces[face.surface], laid.offsets.get(face.surface)
    points = int(np.prod(surface.net.poles.shape[:2]))
    moved = 0.0 if offset is None else float(np.linalg.norm(offset.poles, axis=-1).max())
    if offset is None or (len(surface.faces) > 1 and face.index not in touched and not moved):
        return FaceOutcome(face.index, "unchanged", Reason.NO_COPY, points=points)
    return FaceOutcome(face.index, "edited", moved=moved).grown(points, offset)
