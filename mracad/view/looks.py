"""What pictures show of places that are seen: colours, or numbers for a map."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

import numpy as np

from mracad.bspline.vectors import unit
from mracad.spec.pictures import Show
from mracad.view.colours import CLAY, rgb, several
from mracad.view.fields import Field
from mracad.view.lines import Stroke
from mracad.view.seen import Seen, Stage

Array = np.ndarray

_WHITE, _DARK = np.array([0.97, 0.97, 0.965]), np.array([0.24, 0.27, 0.31])  # of stripes
_KEY = np.array([-0.42, 0.58, 0.70])  # directions to the lights: right, up, to the viewer


def shaded(stage: Stage, seen: Seen) -> Array:
    """The document's colours in soft light."""
    table = np.array([rgb(place.colours[k] or CLAY) for place, k, _ in stage.entries])
    return _lit(stage, seen, table[seen.entry])


def faces(stage: Stage, seen: Seen) -> Array:
    """Every face in a colour of its own."""
    table = several(max(facets.face for _, _, facets in stage.entries) + 1)
    own = np.array([facets.face for _, _, facets in stage.entries])
    return tinted(stage, seen, table[own[seen.entry]])


def tinted(stage: Stage, seen: Seen, colours: Array) -> Array:
    """Colours ``(q, 3)``, a little darker where faces turn away."""
    facing = np.clip(stage.camera.toward @ seen.facing, 0.0, 1.0)
    return np.asarray(colours * (0.74 + 0.26 * facing)[:, None])


def _lit(stage: Stage, seen: Seen, colours: Array) -> Array:
    n = stage.camera.axes @ seen.facing
    key = unit(_KEY)
    half = unit(np.add(key, [0.0, 0.0, 1.0]))
    soft = 0.46 + 0.14 * n[1] + 0.34 * np.maximum(key @ n, 0.0) + 0.16 * np.maximum(n[2], 0.0)
    gloss = 0.10 * np.maximum(half @ n, 0.0) ** 24
    side = np.where(seen.front, 1.0, 0.86)
    return np.asarray(np.clip(colours * (soft * side)[:, None] + gloss[:, None], 0.0, 1.0))


def zebra(stage: Stage, seen: Seen, stripes: int) -> Array:
    """Reflected stripes: dark and light in turn with the angle of the normal above the horizontal of the picture."""
    return _striped(stage, seen, stage.camera.axes[1], stripes)


def isophotes(stage: Stage, seen: Seen, stripes: int) -> Array:
    """Lines of equal brightness under a light at the viewer: stripes in turn with the angle of the normal to it."""
    return _striped(stage, seen, stage.camera.toward, stripes)


def _striped(stage: Stage, seen: Seen, pole: Array, stripes: int) -> Array:
    """Stripes by the angle between normal and equator, filtered to the width of a pixel."""
    height = np.clip(pole @ seen.facing, -1.0, 1.0)
    phase = np.arcsin(height) * (stripes / np.pi)
    slope = np.hypot(*(pole @ seen.turning)) / np.sqrt(np.maximum(1.0 - height * height, 1e-12))
    wide = np.clip(slope * (stripes / np.pi), 1e-6, 1e6)
    light = (_folded(phase + 0.5 * wide, 0.5 * stripes) - _folded(phase - 0.5 * wide, 0.5 * stripes)) / wide
    facing = np.clip(stage.camera.toward @ seen.facing, 0.0, 1.0)
    colours = _DARK + light[:, None] * (_WHITE - _DARK)
    return np.asarray(colours * (0.80 + 0.20 * facing)[:, None])


def _folded(phase: Array, top: float) -> Array:
    """The integral of a wave that turns back at the poles, where the angle does."""
    inner = np.clip(phase, -top, top)
    return np.asarray(2.0 * _under(inner) - _under(2.0 * inner - phase))


def _under(phase: Array) -> Array:
    """The integral of a wave that is 1 in the first half of each period and 0 in the second."""
    whole = np.floor(phase)
    return np.asarray(0.5 * whole + np.minimum(phase - whole, 0.5))


@dataclass(frozen=True)
class Look:
    """A way to look at a stage.

    Attributes
    ----------
    at : callable
        ``at(stage, seen)`` gives colours ``(q, 3)``, or numbers ``(q,)``, of places.
    order : {1, 2}
        The derivatives of surfaces that it needs.
    coloured : bool
        Whether it shows the document's colours, and through transparent ones.
    strokes : mapping of int to Stroke
        Of edges that are not drawn as usual.
    """

    at: Callable[[Stage, Seen], Array]
    order: int = 2
    coloured: bool = False
    strokes: Mapping[int, Stroke] = field(default_factory=dict)


def look(show: Show, stripes: int, numbers: Field | None) -> Look:
    """How to look for what ``--show`` asks for; ``numbers`` are those of a map."""
    if numbers is not None:
        order = 2 if show.kind == "curvature" else 1  # others at the places on the surface itself, not moved
        return Look(lambda stage, seen: numbers(seen), order)
    if show.kind in ("zebra", "isophotes"):
        drawn = {"zebra": zebra, "isophotes": isophotes}[show.kind]
        return Look(lambda stage, seen: drawn(stage, seen, stripes))
    return Look(shaded, 1, coloured=True) if show.kind == "shaded" else Look(faces, 1)
