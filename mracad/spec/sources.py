"""Sources of features besides models, as texts: heightmaps, outlines, textures and formulas, with their sizes.

A source is written ``WHAT,key:value,…``; what it becomes says :mod:`mracad.edit.feature.source`.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass

from mracad.errors import UsageError
from mracad.spec.files import keys_apart
from mracad.spec.quantity import MILLIMETRES, Kind

IMAGES, GRIDS, OUTLINES = (".png", ".tif", ".tiff"), (".npy", ".csv"), (".svg", ".dxf")
"""Extensions of heightmaps with levels and with numbers, and of outlines."""

TEXTURES = ("leather", "knurl", "hammered", "brushed", "hexagons", "dimples")

SOURCE = (
    "write logo.png,width:30mm,height:0.4mm, logo.svg,height:0.4mm,edge:0.3mm, "
    "texture:leather,width:40mm,height:0.2mm or formula:'cos(x)*cos(y)',radius:10mm"
)

_LENGTH = Kind("a length", "5mm or 0.2in", {"": 1.0, **MILLIMETRES}, most=1e6)

_KEYS = {"heightmap": "width height spacing", "outline": "width height edge spacing",
         "texture": "width height pitch seed spacing", "formula": "radius spacing"}  # fmt: skip
_NEEDED = {"heightmap": "width", "outline": "height", "texture": "width height", "formula": "radius"}


@dataclass(frozen=True)
class Heightmap:
    """A grid of heights in a file; lengths in mm.

    Attributes
    ----------
    path : str
    width : float
        Of all its columns.
    height : float or None
        Of the full range of its levels; None where its numbers are millimetres.
    spacing : float or None
        Width of knot spans; None for what its spectrum needs.
    """

    path: str
    width: float
    height: float | None = None
    spacing: float | None = None


@dataclass(frozen=True)
class Outline:
    """A flat top within the curves of a file, with flanks around it; lengths in mm.

    Attributes
    ----------
    path : str
    height : float
    edge : float or None
        Least radius of its flanks; None for its height.
    width : float or None
        Of the whole outline; None for that in the file.
    spacing : float or None
        As in :class:`Heightmap`.
    """

    path: str
    height: float
    edge: float | None = None
    width: float | None = None
    spacing: float | None = None


@dataclass(frozen=True)
class Texture:
    """A built-in texture: its name, its side, height and pitch (None for a share of the side), mm, and a seed."""

    name: str
    width: float
    height: float
    pitch: float | None = None
    seed: int = 0
    spacing: float | None = None


@dataclass(frozen=True)
class Formula:
    """A formula of x and y (mm) for heights (mm) within a radius (mm)."""

    text: str
    radius: float
    spacing: float | None = None


Source = Heightmap | Outline | Texture | Formula


def split(text: str) -> tuple[str, dict[str, str]]:
    """A text without the ``key:value`` at its end, and these."""
    what, rest = keys_apart(text)
    pairs = (part.partition(":") for part in rest.split(",")[1:])
    return what, {key.strip(): value.strip() for key, _, value in pairs}


def path_of(text: str) -> str | None:
    """The file that the text of a source names; None where it names none."""
    what, _ = split(text)
    return what if what.lower().endswith(IMAGES + GRIDS + OUTLINES) and not _built_in(what) else None


def is_source(text: str) -> bool:
    """Whether a text means a source."""
    return _built_in(text) or path_of(text) is not None


def _built_in(text: str) -> bool:
    return text.startswith(("texture:", "formula:"))


def source(text: str, name: str) -> Source:
    """A source from its text; raises UsageError."""
    if not is_source(text):
        raise UsageError(f"{name}: {text!r} is not a source of a feature", SOURCE)
    if _built_in(text):
        kind, _, text = text.partition(":")
        what, given = split(text)
    else:
        what, given = split(text)
        kind = "outline" if what.lower().endswith(OUTLINES) else "heightmap"
    _known(kind, given, name)
    sizes = {key: _size(key, value, name) for key, value in given.items() if key != "seed"}
    if kind == "outline":
        return Outline(what, **sizes)
    if kind == "formula":
        return Formula(what.strip().strip("'\""), **sizes)
    if kind == "texture":
        return _texture(what, sizes, given.get("seed", "0"), name)
    if "height" not in sizes and what.lower().endswith(IMAGES):
        raise UsageError(f"{name}: the height of {what!r} is missing", "give that of white over black: height:0.4mm")
    return Heightmap(what, **sizes)


def _known(kind: str, given: Mapping[str, str], name: str) -> None:
    """Raise UsageError for keys that a kind of source does not take, and for those that are missing."""
    keys = _KEYS[kind].split()
    for key in given:
        if key not in keys:
            raise UsageError(
                f"{name}: {'an' if kind == 'outline' else 'a'} {kind} takes no {key!r}", f"it takes {', '.join(keys)}"
            )
    for key in _NEEDED[kind].split():
        if key not in given:
            raise UsageError(f"{name}: the {key} of the {kind} is missing", f"give it, as {key}:5mm")


def _size(key: str, value: str, name: str) -> float:
    """A length of a source, mm; raises UsageError."""
    try:
        return _LENGTH.read(value, f"{name}: {key}")
    except UsageError as error:
        hint = f"write {key}:5mm or {key}:0.2in"
        if key == "height" and value.startswith("-"):
            hint += ", and turn copies inwards with --height -1"
        raise UsageError(error.message, hint) from error


def _texture(what: str, sizes: Mapping[str, float], seed: str, name: str) -> Texture:
    if what not in TEXTURES:
        raise UsageError(f"{name}: there is no texture {what!r}", f"use one of {', '.join(TEXTURES)}")
    if not re.fullmatch(r"[0-9]{1,9}", seed):
        raise UsageError(f"{name}: seed {seed!r} is not a whole number", "write seed:1")
    return Texture(what, seed=int(seed), **sizes)
