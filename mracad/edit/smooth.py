"""Smoothing: remove detail finer than a scale, or a number of levels, from NURBS faces."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

from mracad.edit.bound import widest
from mracad.edit.fair import Filter
from mracad.edit.heading import lead
from mracad.edit.level import Coarser
from mracad.edit.result import Edit, Reason
from mracad.edit.tolerances import tolerances
from mracad.edit.whole import edited, wished
from mracad.model.brep import Model
from mracad.spec.places import heading
from mracad.spec.quantity import length
from mracad.spec.select import Scope
from mracad.spec.select import scope as scope_of
from mracad.spec.steps import Smooth


def smooth(
    model: Model,
    options: Smooth,
    *,
    scope: Scope | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> Edit:
    """Smooth the NURBS faces of a model; parameters and errors as for :func:`mracad.edit.whole.edited`."""
    scope = scope or scope_of(model, options)
    if options.level is not None:
        return edited(model, options, Coarser(options.level), scope, progress)
    if options.scale is None:
        return _within(model, options, scope, progress)
    scale = length(options.scale, model.diagonal, "scale")
    limited = options.limit_by_curvature
    if options.across is None:
        return edited(model, options, Filter(scale, limited=limited), scope, progress)
    across, found = length(options.across, model.diagonal, "across"), _leads(model, options, scope)
    askew = {i for surface, lead in found.items() if lead is None for i in model.surfaces[surface].faces}
    leads = {surface: lead for surface, lead in found.items() if lead is not None}
    wish = Filter(scale, across, leads, limited)
    edit = edited(model, options, wish, replace(scope, faces=scope.faces - askew), progress)
    left = askew & scope.chosen
    said = f"none within 30° of {options.along}"
    outcomes = (
        replace(each, status="left", reason=Reason.ASKEW, said=said) if each.face in left else each
        for each in edit.outcomes
    )
    return replace(edit, outcomes=tuple(outcomes))


def _within(model: Model, options: Smooth, scope: Scope, progress: Callable[[int, int], None] | None) -> Edit:
    """Smoothing at the largest scale that stays within the bound."""
    allowed, limited = tolerances(model, options), options.limit_by_curvature
    movable = scope.movable(model)

    def edit(scale: float) -> Edit:
        return edited(model, options, Filter(scale, limited=limited), scope, progress)

    return widest(model, movable, limited, wished(model, options, scope), allowed, edit)


def _leads(model: Model, options: Smooth, scope: Scope) -> dict[int, int | None]:
    """The parameter that follows the direction (0 for u, 1 for v, None for neither), by surface with faces to edit."""
    along = None if options.along is None else heading(options.along, "along")
    faces = {s.index: [model.faces[i] for i in s.faces if i in scope.chosen] for s in model.surfaces}
    return {surface: lead(model, each, along) for surface, each in faces.items() if each}
