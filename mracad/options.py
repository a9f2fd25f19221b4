"""The options of every edit, declared once: command line, recipes, schemas and documentation come from here.

A ``Struct`` per edit; a field's ``Meta`` carries its help.  This module imports no numerical library, so that the
command line can show its help at once.
"""

from __future__ import annotations

import math
import re
from typing import Annotated, Literal

from msgspec import Meta, Struct

from mracad.errors import UsageError

MILLIMETRES = {"um": 1e-3, "mm": 1.0, "cm": 10.0, "m": 1000.0, "in": 25.4, "ft": 304.8, "yd": 914.4, "mi": 1609344.0}
"""Length units by name, in millimetres."""

_LENGTH = re.compile(r"\s*([-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?)\s*([a-zA-Z]*|%)\s*")


def length(text: str, diagonal: float, name: str) -> float:
    """A positive length in millimetres from ``"5"``, ``"5mm"``, ``"0.2in"`` or ``"2%"`` of ``diagonal``.

    Raises
    ------
    UsageError
        When it is not a positive finite length.
    """
    match = _LENGTH.fullmatch(str(text))
    hint = f"write {name} as 5mm, 0.2in or 2% (of the model's diagonal)"
    if not match or (match[2] not in {"", "%"} and match[2] not in MILLIMETRES):
        raise UsageError(f"{name}: {text!r} is not a length", hint)
    value = float(match[1]) * (diagonal / 100 if match[2] == "%" else MILLIMETRES[match[2] or "mm"])
    if not (math.isfinite(value) and value > 0):
        raise UsageError(f"{name}: {text!r} is not greater than zero", hint)
    return value


class Selection(Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Which faces an edit may touch and how their edges are treated; shared by every edit."""

    faces: Annotated[
        tuple[str, ...],
        Meta(
            description="Faces to edit: #3, a product or face name, type:bspline, colour:#ff0000, near:X,Y,Z, "
            "cq:'>Z'; !SEL excludes. Default: all NURBS faces."
        ),
    ] = ()
    hold: Annotated[
        tuple[str, ...],
        Meta(description="Faces and edges (edge#4) that must not move; same selectors as --faces."),
    ] = ()
    keep: Annotated[
        Literal["g0", "g1", "g2"],
        Meta(description="Continuity that every edge keeps: position, tangent plane or curvature."),
    ] = "g1"
    edges: Annotated[
        Literal["frozen", "coupled"],
        Meta(
            description="Edges between two edited faces: frozen, none moves; coupled, they move and stay as smooth as "
            "they were, where both sides are natural boundaries and that is possible."
        ),
    ] = "frozen"
    fit_g1: Annotated[
        float | None,
        Meta(
            description="Make seams tangent that are meant to be: those between edited faces under this angle (°).",
            ge=0.0,
        ),
    ] = None
    close_gaps: Annotated[
        bool,
        Meta(description="Pull gaps along seams between edited faces shut."),
    ] = False
    gap_tolerance: Annotated[
        str,
        Meta(description="Gap (a length) that a seam along a trim curve may have after it moved, unless it was wider."),
    ] = "1e-4mm"
    refine: Annotated[
        bool,
        Meta(description="Insert knots (exactly) where a face has too few free control points."),
    ] = False
    amount: Annotated[
        float,
        Meta(description="How much of the edit: 1 is all of it, 0 none.", ge=0.0, le=1.0),
    ] = 1.0
    max_deviation: Annotated[
        str | None,
        Meta(description="Bound on the displacement (a length): the edit is blended back locally until it holds."),
    ] = None


class Smooth(Selection, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Remove detail finer than a scale from NURBS faces."""

    scale: Annotated[
        str | None,
        Meta(
            description="Wavelength (5mm, 0.2in, or 2% of the model's diagonal): ripples up to half of it go, "
            "ripples of three times it stay."
        ),
    ] = None
    level: Annotated[
        float | None,
        Meta(
            description="Instead of --scale: how many levels of the face's own knot ladder to remove, 2.5 for two "
            "and a half.",
            gt=0.0,
        ),
    ] = None

    def __post_init__(self) -> None:
        if (self.scale is None) == (self.level is None):
            raise UsageError("smooth needs either a scale or a level", "give --scale 5mm, --scale 2% or --level 2.5")
        if self.level is not None and not (math.isfinite(self.level) and self.level > 0):
            raise UsageError(f"level: {self.level} is not greater than zero", "give --level 1, 2 or 2.5")
        if not (math.isfinite(self.amount) and 0 <= self.amount <= 1):
            raise UsageError(f"amount: {self.amount} is not between 0 and 1", "give --amount 0.5")
