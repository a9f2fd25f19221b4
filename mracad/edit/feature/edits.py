"""Detail features: move one, repeat it, carry it from another model (METHOD: a feature is a displacement).

A feature is told from what it stands above (:mod:`~mracad.edit.feature.extract`), tabulated in geodesic coordinates of
its place, and laid on other places (:mod:`~mracad.edit.feature.copies`); seams between edited faces hold.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import replace

import numpy as np

from mracad.constraint.seam import Treatment
from mracad.constraint.wishes import Wishes
from mracad.edit.feature.detail import Feature, load
from mracad.edit.feature.extract import above_surroundings, between_levels
from mracad.edit.feature.fit import NARROWEST
from mracad.edit.feature.ground import Ground, axes
from mracad.edit.feature.ideal import copies
from mracad.edit.feature.lay import Laid, laid
from mracad.edit.feature.locate import Place, face_number, patch_of, place, standing, window
from mracad.edit.feature.pattern import along, grid, listed, polar, scattered
from mracad.edit.feature.transfer import laid_on
from mracad.edit.result import Edit, FaceOutcome, Reason, spared
from mracad.errors import EditError, UsageError
from mracad.model.brep import Face, Model
from mracad.model.displacement import Displacement
from mracad.spec.quantity import band_of, length
from mracad.spec.select import Scope
from mracad.spec.select import scope as scope_of
from mracad.spec.steps import Featured, Move, Repeat, Single, Transfer
from mracad.wavelet.project import band

Array = np.ndarray

FACE = "write a face as #3, or its name"


def move(
    model: Model,
    options: Move,
    *,
    scope: Scope | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> Edit:
    """Move a feature; parameters as for :func:`mracad.edit.smooth.smooth`.

    Raises
    ------
    EditError
        For a place or a window off the faces, or a feature that does not fit where it is or is to go.
    """
    scope = scope or scope_of(model, options)
    chosen = _movable(model, scope)
    feature = extract(model, options, chosen)
    assert feature.origin is not None
    removed = {i: -offset for i, offset in feature.origin.offsets.items()}
    ground = _cleared(model, chosen, feature)
    done = _laid(ground, feature, [_target(ground, options.to, options)], options, "add", removed, scope.edges)
    return _edit(model, done, scope)


def repeat(
    model: Model,
    options: Repeat,
    *,
    scope: Scope | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> Edit:
    """Lay copies of a feature; parameters and errors as for :func:`move`."""
    scope = scope or scope_of(model, options)
    chosen = _movable(model, scope)
    feature = extract(model, options, chosen)
    ground = _cleared(model, chosen, feature)
    done = _laid(ground, feature, _places(ground, feature, options), options, options.overlap, {}, scope.edges)
    return _edit(model, done, scope)


def transfer(
    model: Model,
    options: Transfer,
    source: Model,
    *,
    scope: Scope | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> Edit:
    """Carry the detail of a face, or a feature, of another model onto this one.

    Parameters
    ----------
    source : Model
        The other one; the rest, and errors, as for :func:`move`.
    """
    scope = scope or scope_of(model, options)
    chosen = _movable(model, scope)
    ground = Ground.of(model, chosen)
    every = {f.index for f in source.faces if f.surface is not None}
    if _is_window(options.from_):
        feature = extract(source, options, every, options.from_)
        feature = replace(feature, origin=None)
        done = _laid(ground, feature, [_target(ground, options.to, options)], options, "add", {}, scope.edges)
        return _edit(model, done, scope)
    if options.band is None:
        raise UsageError("band: the detail of a face needs one", "give --band 0mm:20mm")
    one = patch_of(Ground.of(source, every), face_number(source, options.from_, "from", FACE), "from")
    two = patch_of(ground, face_number(model, options.to, "to", FACE), "to")
    width = None if options.taper is None else length(options.taper, model.diagonal, "taper")
    return _edit(model, laid_on(model, two, one, band_of(options.band, source.diagonal), options, width), scope)


def _is_window(text: str) -> bool:
    """Whether a text names a feature, and not a face."""
    return text.startswith("near:") or "@" in text or text.endswith(".feature")


def _target(ground: Ground, text: str, options: Featured) -> Place:
    found = place(ground, text, "place")
    return replace(found, rotate=math.radians(options.rotate), size=options.size, height=options.height)


def extract(model: Model, options: Featured, chosen: Collection[int], text: str = "") -> Feature:
    """The feature that options name: from a file, or from a window of the model."""
    text = text or (options.feature if isinstance(options, Single) else "")
    if text.endswith(".feature"):
        return load(text)
    if not chosen:
        raise EditError(f"{model.name}: there is no NURBS face to edit", "select faces with --faces")
    ground = Ground.of(model, chosen)
    taper = None if options.taper is None else length(options.taper, model.diagonal, "taper")
    area = window(ground, text, taper)
    label = f"feature {text}"
    if options.base == "surroundings":
        return above_surroundings(ground, area, area.width, options.keep, label, text)
    low, high = band_of(options.band or "", model.diagonal)
    parts = {i: band(model.surfaces[i].net, low, high) for i in ground.patches}
    bands = {i: fine.poles for i, (_, fine) in parts.items()}
    clear = Ground.of(model, chosen, {i: coarse.poles for i, (coarse, _) in parts.items()})
    return between_levels(clear, bands, area, area.width, options.keep, label, text)


def _movable(model: Model, scope: Scope) -> set[int]:
    return {i for i in scope.chosen if model.faces[i].surface is not None}


def _cleared(model: Model, chosen: Collection[int], feature: Feature) -> Ground:
    """The ground without the feature."""
    if feature.origin is None:
        return Ground.of(model, chosen)
    return Ground.of(model, chosen).without(feature.origin.offsets)


def _places(ground: Ground, feature: Feature, options: Repeat) -> list[Place]:
    """All places, each with what turns and scales the copy there."""
    found = listed(ground, options.at)
    if options.grid or options.polar:
        own = feature.origin is not None and not found
        if own and feature.origin is not None:
            frame = feature.origin.axes
            origin = ground.standing(feature.origin.feet.surface, feature.origin.feet.uv, np.zeros(1)).points[0]
        elif found:
            foot = standing(ground, found[:1], feature.reach)
            origin, frame = foot.points[0], axes(foot.normals, foot.along)[0]
        else:
            raise EditError("a feature from a file has no place of its own to begin at", "give --at, too")
        if options.grid:
            pattern = grid(ground, options.grid, origin, frame, own)
        else:
            pattern = polar(options.polar or "", origin, frame, own)
        first = found[0] if found else None
        if first is not None:
            pattern = [replace(p, rotate=first.rotate, size=first.size, height=first.height) for p in pattern]
        found = pattern + found[1:]
    if options.along:
        found = found + along(ground, options.along)
    turn = math.radians(options.rotate)
    found = [
        replace(p, rotate=p.rotate + turn, size=p.size * options.size, height=p.height * options.height) for p in found
    ]
    if options.jitter is not None or options.spin:
        jitter = 0.0 if options.jitter is None else length(options.jitter, ground.model.diagonal, "jitter")
        feet = standing(ground, found, feature.reach)
        found = scattered(found, feet, jitter, math.radians(options.spin), options.seed)
    return found


def _laid(
    ground: Ground,
    feature: Feature,
    places: Sequence[Place],
    options: Featured,
    overlap: str,
    removed: Mapping[int, Array],
    hold: frozenset[int],
) -> Laid:
    _refuse_small(places, feature)
    feet = standing(ground, places, feature.reach)
    every = copies(ground, feature, places, feet, overlap, options.mirror)
    return laid(every, Wishes(options.keep, hold=hold), options.edges == "coupled", options.clip, removed)


def _refuse_small(places: Sequence[Place], feature: Feature) -> None:
    """Raise EditError for a copy that would need knots which nearly meet."""
    least = min(places, key=lambda p: p.size, default=None)
    if least is not None and feature.spacing * least.size < NARROWEST:
        raise EditError(
            f"{least.label}: a copy of {2 * feature.radius * least.size:.3g} mm would need knots closer than "
            f"{NARROWEST:g} mm",
            "make it larger with --size",
        )


def _edit(model: Model, laid: Laid, scope: Scope) -> Edit:
    """The edit with an outcome for every face and every edge of those under copies."""
    chosen, touched = _movable(model, scope), {f for copy in laid.copies for f in copy.faces}
    outcomes = tuple(_outcome(model, face, laid, scope, chosen, touched) for face in model.faces)
    ways = {
        **dict.fromkeys(laid.frozen, "frozen"),
        **dict.fromkeys(laid.loose, "to tolerance"),
        **dict.fromkeys(laid.moving, "coupled"),
    }
    edges = tuple(
        Treatment(e, tuple(s.face for s in model.edges[e].sides), how, laid.frozen[e] if how == "frozen" else None)
        for e, how in sorted(ways.items())
    )
    return Edit(Displacement(laid.offsets), outcomes, edges=edges, copies=laid.copies)


def _outcome(
    model: Model, face: Face, laid: Laid, scope: Scope, chosen: Collection[int], touched: Collection[int]
) -> FaceOutcome:
    """What became of a face; copies lie on those ``touched``."""
    outcome = spared(face, scope, chosen)
    if outcome:
        return outcome
    assert face.surface is not None
    surface, offset = model.surfaces[face.surface], laid.offsets.get(face.surface)
    points = int(np.prod(surface.net.poles.shape[:2]))
    moved = 0.0 if offset is None else float(np.linalg.norm(offset.poles, axis=-1).max())
    if offset is None or (len(surface.faces) > 1 and face.index not in touched and not moved):
        return FaceOutcome(face.index, "unchanged", Reason.NO_COPY, points=points)
    inserted = len(offset.u_knots) + len(offset.v_knots)
    return FaceOutcome(face.index, "edited", moved=moved, points=points, inserted=inserted)
