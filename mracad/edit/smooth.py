"""Smoothing: remove detail finer than a scale, or a number of levels, from NURBS faces."""

from __future__ import annotations

from collections.abc import Callable

from mracad.edit.fair import Filter
from mracad.edit.level import Level
from mracad.edit.result import Edit
from mracad.edit.target import Wish
from mracad.edit.whole import edited
from mracad.model.brep import Model
from mracad.spec.quantity import length
from mracad.spec.select import Scope
from mracad.spec.steps import Smooth


def smooth(
    model: Model,
    options: Smooth,
    *,
    scope: Scope | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> Edit:
    """Smooth the NURBS faces of a model; parameters and errors as for :func:`mracad.edit.whole.edited`."""
    return edited(model, options, wish(model, options), scope, progress)


def wish(model: Model, options: Smooth) -> Wish:
    """What is asked for."""
    if options.scale is not None:
        return Filter(length(options.scale, model.diagonal, "scale"))
    assert options.level is not None
    return Level(options.level)
