"""Edits that change whole faces: a wish taken through the driver, and the outcome for each face and edge."""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Mapping
from dataclasses import replace

from mracad.edit.fair import faired
from mracad.edit.moved import Moved, Result
from mracad.edit.pose import Scene
from mracad.edit.result import Edit, FaceOutcome, Reason, Status, untouched
from mracad.edit.slid import cannot_slide, settled
from mracad.edit.target import Wish
from mracad.edit.tolerances import tolerances
from mracad.inspect.roughness import Rougher, Worse
from mracad.model.brep import Face, Model
from mracad.seam.cause import Cause, Still
from mracad.seam.natural import Treatment
from mracad.seam.wishes import Wishes
from mracad.spec.select import Scope
from mracad.spec.select import scope as scope_of
from mracad.spec.steps import Fairing, Fitting, Shaped

ROUNDS = 3
"""How often an edit is done at most with edges that slide: edges that cannot slide stay the next time, at last all."""


def edited(
    model: Model,
    options: Fitting,
    wish: Wish,
    scope: Scope | None,
    progress: Callable[[int, int], None] | None,
    *,
    restored: bool = False,
) -> Edit:
    """Apply a wish to the NURBS faces of a model, as far as the judge allows.

    Parameters
    ----------
    model : Model
    options : Fitting
    wish : Wish
    scope : Scope, optional
        Faces to edit, faces and edges to hold; by default those that the options name.
    progress : callable, optional
        Called with surfaces done and surfaces in all.
    restored : bool
        Whether the wish is what was there before: then seams may be as they come.

    Raises
    ------
    UsageError
        For options that name parts this model does not have, or that need the document.
    """
    scope = scope or scope_of(model, options)
    movable = scope.movable(model)
    allowed = tolerances(model, options)
    if restored:
        allowed = replace(allowed, gap=math.inf, least=math.inf, angle=math.inf, bend=math.inf)
    wishes = replace(wished(model, options, scope), jumps=math.isfinite(wish.growth.curvature))
    lost = {edge: cannot_slide(model, edge) for edge in scope.firm}
    for left in range(ROUNDS, -1, -1):
        result = faired(
            model,
            movable,
            wish,
            replace(wishes, slide=wishes.slide - lost.keys()),
            replace(allowed, growth=wish.growth, fairer=wish.fairs, whole=wish.whole),
            refine=options.refine == "auto",
            progress=progress,
        )
        result = replace(result, moved=_amounts(result, wish, options))
        scene = Scene(model, result.sheets, result.joints, allowed, options.refine == "auto")
        result, failed = settled(scene, result)
        if not failed:
            break
        every_one = (slide.edge for slide in result.joints.slides)
        lost |= {edge: cannot_slide(model, edge) for edge in (failed if left > 1 else every_one)}
    outcomes = tuple(_outcome(face, result, scope, options, wish) for face in model.faces)
    edges = treatments(model, movable, result, options, lost)
    return Edit(result.displacement(), outcomes, edges=edges, restored=restored)


def _amounts(result: Result, wish: Wish, options: Fitting) -> dict[int, Moved]:
    """Every change, multiplied by the amount that was asked for."""
    amounts = {i: moved.scaled(options.amount * moved.amount) for i, moved in result.moved.items()}
    if not wish.whole:
        return amounts
    return {
        i: now if result.moved[i].amount == 1.0 else replace(now.undone(), limits=now.limits)
        for i, now in amounts.items()
    }


def _beside(model: Model, scope: Scope) -> frozenset[int]:
    """The edges of held faces."""
    return frozenset(edge.index for edge in model.edges if any(side.face in scope.held for side in edge.sides))


def wished(model: Model, options: Fitting, scope: Scope) -> Wishes:
    """What options ask of seams and rims."""
    every = frozenset(edge.index for edge in model.edges)
    held = every if options.edges == "frozen" else scope.edges
    able = every - held - scope.firm - _beside(model, scope) if options.edges == "slide" else frozenset[int]()
    fit = math.radians(options.fit_g1 or 0.0)
    carried = isinstance(options, Shaped)
    free = carried or (isinstance(options, Fairing) and options.free_edges == "smooth")
    corners = carried or (isinstance(options, Fairing) and options.corners == "move")
    wishes = Wishes(options.keep, fit, options.close_gaps, held, scope.zones, free=free, corners=corners)
    return replace(wishes, slide=able, open=not isinstance(options, Fairing | Shaped))


def _outcome(face: Face, result: Result, scope: Scope, options: Fitting, wish: Wish) -> FaceOutcome:
    """The outcome for one face."""
    outcome = untouched(face, scope, scope.chosen)
    if outcome:
        return outcome
    assert face.surface is not None
    sheet, moved = result.sheets[face.surface], result.moved.get(face.surface)
    known = FaceOutcome(
        face.index,
        "unchanged",
        Reason.FAIR,
        detail=sheet.detail,
        points=sheet.origin.u.count * sheet.origin.v.count,
        creases=sum(map(len, sheet.creases)),
    )
    if moved is None:
        return known
    change = moved.changes[face.index]
    known = replace(known, free=moved.free, roughness=(change.before, change.after))
    if moved.amount:
        edited = replace(
            known,
            status="edited",
            reason=None,
            said=_figures(moved.limits),
            moved=moved.motion,
            amount=moved.amount,
        )
        return edited.grown(known.points, moved.displacement())
    status, reason, said = _left(moved, options, wish.fairs)
    return replace(known, status=status, reason=reason, said=said)


def _left(moved: Moved, options: Fitting, fairs: bool) -> tuple[Status, Reason, str]:
    """Status, reason and details of a face that has detail and stays, for an edit that must make it fairer or one that
    need not."""
    if options.amount == 0:
        return "unchanged", Reason.AMOUNT, ""
    if not moved.rough or not moved.wanted:
        return "unchanged", Reason.FAIR, ""
    if not moved.free:
        return "left", Reason.NO_FREE, ""
    if not fairs and any(limit.what is Rougher.FOLD for limit in moved.limits):
        return "left", Reason.FOLDED, ""
    if moved.limits:
        return "left", Reason.ROUGHER, _figures(moved.limits)
    return "left", Reason.RIM if fairs else Reason.STUCK, ""


def _figures(limits: Collection[Worse]) -> str:
    """The figures in which a face would get rougher."""
    return ", ".join(dict.fromkeys(limit.what.value for limit in limits))


def treatments(
    model: Model, movable: set[int], result: Result, options: Fitting, lost: Mapping[int, Cause]
) -> tuple[Treatment, ...]:
    """The treatment of each edge of a face that could move, in edge order; ``lost`` could not slide."""
    joints, frozen = result.joints, dict(result.joints.frozen)
    frozen |= {edge: lost[edge] for edge in frozen.keys() & lost.keys()}
    if options.edges == "frozen":
        frozen = {e: Cause(Still.FROZEN) if why.still is Still.HELD else why for e, why in frozen.items()}
    how = dict.fromkeys(joints.moving, "coupled")
    how |= {edge: "to tolerance" for seam in joints.loose for edge in (seam.edge, seam.twin)}
    how |= dict.fromkeys(result.mended, "mended")
    how |= {slide.edge: "slid" for slide in joints.slides}
    moved = {i for i, each in result.moved.items() if each.amount}
    still = {e for e in how if moved.isdisjoint(model.faces[side.face].surface for side in model.edges[e].sides)}
    how = {edge: way for edge, way in how.items() if edge not in still}
    frozen |= dict.fromkeys(still, Cause(Still.STAYS))
    frozen |= {slide.edge: slide.cause for slide in joints.slides if slide.edge in still}
    found = []
    for edge in model.edges:
        faces = tuple(side.face for side in edge.sides)
        if not movable.isdisjoint(faces):
            why = None if edge.index in how else frozen.get(edge.index, Cause(Still.IDLE))
            found.append(Treatment(edge.index, faces, how.get(edge.index, "frozen"), why))
    return tuple(found)
