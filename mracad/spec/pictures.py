"""Options of pictures, and how they are written."""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import Annotated, ClassVar

from msgspec import Meta

from mracad.errors import UsageError
from mracad.spec.fields import Begins, nearest
from mracad.spec.files import File, Naming
from mracad.spec.quantity import NUMBER, PLACE, length
from mracad.spec.steps.base import Options

Direction = tuple[float, float, float]

VIEWS: dict[str, Direction] = {
    "iso": (1.0, -1.0, 1.0),
    "front": (0.0, -1.0, 0.0),
    "back": (0.0, 1.0, 0.0),
    "left": (-1.0, 0.0, 0.0),
    "right": (1.0, 0.0, 0.0),
    "top": (0.0, 0.0, 1.0),
    "bottom": (0.0, 0.0, -1.0),
}
"""Where the viewer is, from the model."""

SHOWS = "shaded", "zebra", "isophotes", "curvature", "deviation", "roughness", "faces", "features", "treatment"
"""What pictures show."""

ALONE = "features", "treatment"
"""Those that show no model beside another."""

EDITED = "deviation", "treatment"
"""Those that only an edit can show; deviation unless a file is named."""

STRIPED = "zebra", "isophotes"
"""Those with stripes."""

CURVATURES = "max", "mean", "gauss"
"""What maps of curvature show; the first by default."""

SHOWN = (*SHOWS, *(f"curvature:{kind}" for kind in CURVATURES), "deviation:")
"""How texts of --show begin."""

TURNING = "gif", "mp4"
"""Formats in which the model turns."""

AXES = "xyz"
"""Axes on which planes of sections stand."""

SCALARS = "curvature", "deviation", "roughness"
"""What the points of meshes show."""

LEAST, MOST = 16, 8192
"""Least and largest width and height, pixels."""

AREA = 16_000_000
"""Largest number of pixels."""

PANELS = 16
"""Largest number of views on a sheet."""

_NAME = re.compile(r"\s*([a-z]+)\s*(?:,|$)")
_VECTOR = re.compile(rf"\s*({NUMBER})\s*,\s*({NUMBER})\s*,\s*({NUMBER})\s*(?:,|$)")


@dataclass(frozen=True)
class Show:
    """What a picture shows.

    Attributes
    ----------
    kind : str
        One of ``SHOWS``.
    of : str
        Of curvature, one of ``CURVATURES``; of deviation, the file from which it is measured (``""`` for the input of
        an edit); of roughness, the length of the longest waves that count (``""`` for 5 % of the diagonal).
    """

    kind: str
    of: str = ""


def show_of(text: str, name: str = "show") -> Show:
    """What a text such as ``"zebra"`` or ``"deviation:ref.step"`` asks for; raises UsageError."""
    kind, colon, rest = text.partition(":")
    if kind not in SHOWS:
        raise UsageError(f"{name}: {text!r} is not known", nearest(kind, SHOWS))
    if kind == "curvature":
        if rest not in CURVATURES and colon:
            raise UsageError(f"{name}: there is no curvature {rest!r}", "use curvature:" + ", ".join(CURVATURES))
        return Show(kind, rest or CURVATURES[0])
    if colon and kind not in ("deviation", "roughness"):
        raise UsageError(f"{name}: {text!r}: {kind} takes nothing after a colon", f"write {kind}")
    if kind == "roughness" and colon:
        length(rest, 1.0, name)
    elif colon and not rest:
        raise UsageError(f"{name}: {text!r} names no file", "write deviation:REF.step")
    return Show(kind, rest)


def unedited(show: Show, name: str = "show", hint: str = "give it to an edit, such as smooth, with -o OUT.png") -> None:
    """Refuse what only an edit can show; raises UsageError."""
    if show.kind == "deviation" and not show.of:
        raise UsageError(f"{name}: deviation needs a file from which it is measured", "write deviation:REF.step")
    if show.kind == "treatment":
        raise UsageError(f"{name}: treatment is what an edit did", hint)


def scalar_of(text: str, name: str = "scalar") -> Show:
    """The numbers that a text such as ``"curvature:mean"`` asks for; raises UsageError."""
    kind = text.partition(":")[0]
    if kind not in SCALARS:
        raise UsageError(f"{name}: {kind!r} has no numbers", nearest(kind, SCALARS))
    return show_of(text, name)


def views_of(text: str, name: str = "view") -> tuple[str, ...]:
    """The views in a text such as ``"iso,top"`` or ``"1,-2,1"``; raises UsageError."""
    found: list[str] = []
    at = 0
    hint = "use " + ", ".join(VIEWS) + ", or X,Y,Z, which points to the viewer"
    while at < len(text) or not found:
        match = _NAME.match(text, at) or _VECTOR.match(text, at)
        if match is None or (match.re is _NAME and match[1] not in VIEWS):
            raise UsageError(f"{name}: {text!r} is not a view", hint)
        found.append(match[0].strip().rstrip(","))
        if not any(direction_of(found[-1])):
            raise UsageError(f"{name}: {found[-1]!r} has no direction", hint)
        at = match.end()
    return tuple(found)


def direction_of(view: str) -> Direction:
    """The direction to the viewer of one of :func:`views_of`."""
    if view in VIEWS:
        return VIEWS[view]
    x, y, z = map(float, view.split(","))
    return x, y, z


def size_of(text: str, name: str = "size") -> tuple[int, int]:
    """Width and height from ``"1200x800"``; raises UsageError."""
    match = re.fullmatch(r"\s*(\d{1,6})\s*[x×]\s*(\d{1,6})\s*", text)
    if match is None:
        raise UsageError(f"{name}: {text!r} is not a size", "write width and height in pixels, 1200x800")
    width, height = int(match[1]), int(match[2])
    if min(width, height) < LEAST or max(width, height) > MOST or width * height > AREA:
        limits = f"give {LEAST} to {MOST} pixels each way, {AREA // 1_000_000} million in all"
        raise UsageError(f"{name}: a picture of {width} × {height} pixels is out of bounds", limits)
    return width, height


def section_of(text: str, name: str = "section") -> tuple[int, float]:
    """The axis (0 to 2) and the position on it, mm, of a plane such as ``"z=120mm"``; raises UsageError."""
    axis, equals, place = text.partition("=")
    if not equals or axis.strip() not in AXES:
        raise UsageError(f"{name}: {text!r} is not a plane", "write z=120mm; x and y are the other axes")
    return AXES.index(axis.strip()), PLACE.read(place, name)


ShowText = Annotated[str, Naming(prefix="deviation:"), show_of, Begins(SHOWN, EDITED)]
"""The type of a field that tells what a picture shows."""

ScalarText = Annotated[str, Naming(prefix="deviation:"), scalar_of, Begins((*SCALARS, "deviation:"), EDITED)]
"""The type of a field that tells which numbers the points of a mesh have."""

ViewText = Annotated[str, views_of, Begins(tuple(VIEWS))]
"""The type of a field that holds views."""

SectionText = Annotated[str, section_of]
"""The type of a field that is a plane."""

SizeText = Annotated[str, size_of]
"""The type of a field that is the size of a picture."""


class Picture(Options, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """What a picture shows, from where."""

    command: ClassVar[str] = "render"
    example: ClassVar[str] = "mracad render part.step -o part.png --show zebra --view iso,top"

    show: Annotated[
        ShowText,
        Meta(
            description="What to show: shaded, zebra, isophotes, curvature:max (or :mean, :gauss), deviation:REF (from "
            "another file; for edits deviation alone, from the input), roughness (or roughness:10mm, by waves up to a "
            "length), faces (their numbers), features (as mracad feature list finds them; of edits that copy some, the "
            "copies), treatment (of edits: what became of faces and edges)."
        ),
    ] = "shaded"
    view: Annotated[
        tuple[ViewText, ...],
        Meta(
            description="Where to look from: iso, front, back, left, right, top, bottom or X,Y,Z, a vector to the "
            "viewer; several (iso,top or repeated) make a sheet."
        ),
    ] = ("iso",)
    fit: Annotated[
        tuple[str, ...],
        Meta(description="Faces that fill the picture, by the selectors of --faces in edits. Default: all faces."),
    ] = ()
    size: Annotated[SizeText, Meta(description="Width and height, pixels.")] = "1200x800"
    stripes: Annotated[
        int,
        Meta(description="Zebra and isophotes: number of dark stripes in half a turn of the normal.", ge=1, le=2000),
    ] = 36
    before: Annotated[File | None, Meta(description="Another file to show on the left, from the same place.")] = None
    wipe: Annotated[
        bool,
        Meta(
            description="One picture: its left half of the file of --before (for edits alone, of the input), its right "
            "half of the model."
        ),
    ] = False
    section: Annotated[
        tuple[SectionText, ...],
        Meta(description="Draw the curve in which a plane cuts the model: z=120mm, x=0 …; repeatable."),
    ] = ()
    comb: Annotated[
        bool,
        Meta(
            description="Draw the curvature of sections as a comb: teeth on the outer side of the bend, as long as "
            "the curvature, to the scale that is stated."
        ),
    ] = False

    def __post_init__(self) -> None:
        super().__post_init__()
        if not 1 <= len(self.views) <= PANELS:
            raise UsageError(f"view: {len(self.views)} views", f"give 1 to {PANELS}")
        if (self.before or self.wipe) and show_of(self.show).kind in ALONE:
            raise UsageError(f"show: {self.show} is of one model", "leave out before and wipe")
        if self.comb and not self.section:
            raise UsageError("comb: there is no section", "add --section z=120mm")
        if "stripes" in self.given() and show_of(self.show).kind not in STRIPED:
            raise UsageError(f"stripes: {self.show} has none", "add --show zebra or --show isophotes")

    def check(self, format: str) -> None:
        """Refuse what a format of pictures cannot show; raises UsageError."""
        if format in TURNING and len(self.views) > 1:
            raise UsageError(f"view: a .{format} turns the model in one view", "give one view, or write .png")

    @property
    def views(self) -> tuple[str, ...]:
        """All views, one by one."""
        return tuple(view for text in self.view for view in views_of(text))


class Scalars(Options, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """The numbers that the points of meshes have."""

    command: ClassVar[str] = "convert"

    scalar: Annotated[
        tuple[ScalarText, ...],
        Meta(
            description="Numbers at points, as --show of pictures: curvature:max (or :mean, :gauss), "
            "deviation:REF (for edits deviation alone, from the input), roughness:10mm; repeatable, the first gives "
            "the colours."
        ),
    ] = ()

    def __post_init__(self) -> None:
        super().__post_init__()
        every = [(show.kind, show.of if show.kind == "curvature" else "") for show in self.shows]
        if len(set(every)) < len(every):
            raise UsageError("scalar: the same numbers are asked for twice", "give each once")

    @property
    def shows(self) -> tuple[Show, ...]:
        """What the numbers are."""
        return tuple(map(scalar_of, self.scalar))
