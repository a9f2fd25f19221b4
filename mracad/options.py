"""The options of every step, declared once: command line, recipes, schemas and documentation come from here.

A ``Struct`` per edit or check, listed in ``STEPS``; a field's ``Meta`` carries its help.  This module imports no
numerical library, so that the command line can show its help at once.
"""

from __future__ import annotations

import math
import re
import types
import typing
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from typing import Annotated, Any, ClassVar, Literal

from msgspec import Meta, Struct, structs

from mracad.errors import UsageError

MILLIMETRES = {"um": 1e-3, "mm": 1.0, "cm": 10.0, "m": 1000.0, "in": 25.4, "ft": 304.8, "yd": 914.4, "mi": 1609344.0}
"""Length units by name, in millimetres."""

_QUANTITY = re.compile(r"\s*([-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?)\s*([a-zA-Z]*|%)\s*")


def length(text: str, diagonal: float, name: str) -> float:
    """A positive length in millimetres from ``"5"``, ``"5mm"``, ``"0.2in"`` or ``"2%"`` of ``diagonal``.

    Raises
    ------
    UsageError
        When it is not a positive finite length.
    """
    match = _QUANTITY.fullmatch(str(text))
    hint = f"write {name} as 5mm, 0.2in or 2% (of the model's diagonal)"
    if not match or (match[2] not in {"", "%"} and match[2] not in MILLIMETRES):
        raise UsageError(f"{name}: {text!r} is not a length", hint)
    value = float(match[1]) * (diagonal / 100 if match[2] == "%" else MILLIMETRES[match[2] or "mm"])
    if not (math.isfinite(value) and value > 0):
        raise UsageError(f"{name}: {text!r} is not greater than zero", hint)
    return value


SECONDS = {"s": 1.0, "min": 60.0, "h": 3600.0}
"""Units of time by name, in seconds."""


LONGEST = 1e8
"""The longest time that can be given, in seconds: three years."""


def duration(text: str, name: str) -> float:
    """Seconds from ``"90"``, ``"90s"``, ``"10min"`` or ``"2h"``; raises UsageError."""
    match = _QUANTITY.fullmatch(text)
    units = {"": 1.0, **SECONDS}
    found = float(match[1]) * units.get(match[2], 0.0) if match else 0.0
    if not 0 < found <= LONGEST:
        raise UsageError(f"{name}: {text!r} is not a time", "write it as 90s, 10min or 2h")
    return found


Length = Annotated[
    str,
    Meta(extra_json_schema={"pattern": rf"^\s*\+?(\d+\.?\d*|\.\d+)([eE][-+]?\d+)?\s*({'|'.join(MILLIMETRES)}|%)?\s*$"}),
]
"""The type of a field that :func:`length` reads."""


@dataclass(frozen=True)
class Naming:
    """How the text of an option names a file: what stands before the path, how it ends where it is one at all, and
    whether digits alone name none."""

    prefix: str = ""
    ending: str = ""
    or_number: bool = False

    def file(self, text: str) -> str | None:
        """The path in a text; None where it names no file."""
        named = text.startswith(self.prefix) and text.endswith(self.ending)
        return text[len(self.prefix) :] if named and not (self.or_number and text.isdecimal()) else None

    def renamed(self, text: str, files: Mapping[str, str]) -> str:
        """The text with its path replaced, where it has one that ``files`` knows."""
        file = self.file(text)
        return text if file is None else self.prefix + files.get(file, file)


File = Annotated[str, Naming()]
"""The type of a field that names a file."""

FeatureText = Annotated[str, Naming(ending=".feature")]
"""The type of a field that is a feature, or names the file of one."""

CountText = Annotated[str, Naming(or_number=True)]
"""The type of a field that is a number, or names a file that holds it."""

PlaceText = Annotated[str, Naming(prefix="@")]
"""The type of a field that is a place, or names a file of places."""


def dashed(name: str) -> str:
    """An option's name as on the command line; one that is a word of Python ends in _ there."""
    return name.rstrip("_").replace("_", "-")


@cache
def lengths(struct: type[Struct]) -> frozenset[str]:
    """The fields of a struct that hold a length."""
    return frozenset(name for name, kind in plain_types(struct).items() if kind is Length)


@cache
def namings(struct: type[Struct]) -> dict[str, Naming]:
    """The fields of a struct that name files, and how."""
    hints = typing.get_type_hints(struct, include_extras=True)
    found = ((name, _naming(hints[name])) for name in struct.__struct_fields__)
    return {name: naming for name, naming in found if naming}


def _naming(hint: Any) -> Naming | None:
    return hint if isinstance(hint, Naming) else next(filter(None, map(_naming, typing.get_args(hint))), None)


@cache
def plain_types(struct: type[Struct]) -> dict[str, Any]:
    """The type of each field, without its help and without None."""
    hints = typing.get_type_hints(struct, include_extras=True)
    return {name: _plain(hints[name]) for name in struct.__struct_fields__}


def _plain(hint: Any) -> Any:
    """``T`` from ``Annotated[T | None, …]``; :data:`Length` stays what it is."""
    if hint is Length:
        return hint
    if typing.get_origin(hint) is Annotated:
        return _plain(hint.__origin__)
    if typing.get_origin(hint) in (types.UnionType, typing.Union):
        return _plain(next(member for member in typing.get_args(hint) if member is not type(None)))
    return hint


class Options(Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """What every step is asked with.

    Attributes
    ----------
    function : str
        Where the step is done, ``"module:function"``.
    """

    function: ClassVar[str]

    def __post_init__(self) -> None:
        for name in lengths(type(self)):
            if (text := getattr(self, name)) is not None:
                length(text, 1.0, dashed(name))

    def given(self) -> dict[str, Any]:
        """The options that differ from their defaults, by name."""
        every = {field.name: (getattr(self, field.name), field.default) for field in structs.fields(self)}
        return {name: value for name, (value, default) in every.items() if value != default}

    def files(self) -> tuple[str, ...]:
        """Files that the options name, beside the model: what the result depends on, too."""
        texts = ((naming, text) for name, naming in namings(type(self)).items() for text in self._texts(name))
        return tuple(file for naming, text in texts if (file := naming.file(text)))

    def relocated(self, files: Mapping[str, str]) -> typing.Self:
        """The options with the files that they name replaced by others."""
        changed: dict[str, Any] = {}
        for name, naming in namings(type(self)).items():
            texts = tuple(naming.renamed(text, files) for text in self._texts(name))
            changed[name] = texts if isinstance(getattr(self, name), tuple) else next(iter(texts), None)
        return structs.replace(self, **changed)

    def _texts(self, name: str) -> tuple[str, ...]:
        """The text or texts of a field."""
        value = getattr(self, name)
        return value if isinstance(value, tuple) else () if value is None else (value,)


class Selection(Options, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Which faces an edit may touch and how their edges are treated; shared by every edit."""

    faces: Annotated[
        tuple[str, ...],
        Meta(
            description="Faces to edit: #3, a product or face name, type:bspline, colour:#ff0000, near:X,Y,Z, "
            "cq:'>Z'; !SEL excludes. Default: all NURBS faces."
        ),
    ] = ()
    instance: Annotated[
        str | None,
        Meta(
            description="Edit one instance of a part that stands in several places, as plate/bolt#2 (see info --all); "
            "it becomes a part of its own. Default: a part is edited, wherever it stands."
        ),
    ] = None
    hold: Annotated[
        tuple[str, ...],
        Meta(description="Faces and edges (edge#4) that must not move; same selectors as --faces."),
    ] = ()
    keep: Annotated[
        Literal["as-is", "g0", "g1", "g2"],
        Meta(
            description="Continuity that every edge keeps: as-is, what it has; or position, tangent plane or curvature."
        ),
    ] = "as-is"
    edges: Annotated[
        Literal["coupled", "frozen"],
        Meta(
            description="Edges between two edited faces: coupled, they move and stay as smooth as they were where that "
            "is possible; frozen, none moves."
        ),
    ] = "coupled"

    @property
    def done(self) -> str:
        """What was done to an edited face, ``"smoothed at 5mm"``."""
        raise NotImplementedError

    @property
    def quiet(self) -> str:
        """What an unchanged face is, ``"already fair at 5mm"``."""
        raise NotImplementedError

    def models(self) -> tuple[str, ...]:
        """Other files whose models the edit needs."""
        return ()


class Fitting(Selection, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """How an edit that changes whole faces goes about it."""

    fit_g1: Annotated[
        Annotated[float, Meta(ge=0.0, le=45.0)] | None,
        Meta(description="Make seams tangent that are meant to be: those between edited faces under this angle (°)."),
    ] = None
    close_gaps: Annotated[
        bool,
        Meta(description="Pull gaps along seams between edited faces shut."),
    ] = False
    gap_tolerance: Annotated[
        Length,
        Meta(description="Gap (a length) that a seam along a trim curve may have after it moved, unless it was wider."),
    ] = "1e-4mm"
    refine: Annotated[
        Literal["auto", "never"],
        Meta(
            description="Control points where a face has too few of them for the edit: auto, knots are inserted "
            "there, exactly; never, the face makes do with its own."
        ),
    ] = "auto"
    amount: Annotated[
        float,
        Meta(description="How much of the edit: 1 is all of it, 0 none.", ge=0.0, le=1.0),
    ] = 1.0
    max_deviation: Annotated[
        Length | None,
        Meta(description="Bound on the deviation along the normal (a length): the edit is scaled back locally."),
    ] = None


class Smooth(Fitting, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Remove detail finer than a scale from the NURBS faces of a model."""

    function: ClassVar[str] = "mracad.edit.smooth:smooth"

    scale: Annotated[
        Length | None,
        Meta(
            description="Wavelength (5mm, 0.2in, or 2% of the model's diagonal): ripples up to half of it go, "
            "ripples of three times it stay."
        ),
    ] = None
    level: Annotated[
        Annotated[float, Meta(gt=0.0)] | None,
        Meta(
            description="Instead of --scale: how many levels of the face's own knot ladder to remove, 2.5 for two "
            "and a half."
        ),
    ] = None

    @property
    def done(self) -> str:
        return f"smoothed at {self._place}"

    @property
    def quiet(self) -> str:
        return f"already fair at {self._place}" if self.amount else "left as they are: amount 0"

    @property
    def _place(self) -> str:
        return self.scale if self.scale is not None else f"level {self.level:g}"

    def __post_init__(self) -> None:
        super().__post_init__()
        if (self.scale is None) == (self.level is None):
            raise UsageError("smooth needs either a scale or a level", "give --scale 5mm, --scale 2% or --level 2.5")
        if self.level is not None and not (math.isfinite(self.level) and self.level > 0):
            raise UsageError(f"level: {self.level} is not greater than zero", "give --level 1, 2 or 2.5")
        if not (math.isfinite(self.amount) and 0 <= self.amount <= 1):
            raise UsageError(f"amount: {self.amount} is not between 0 and 1", "give --amount 0.5")


class Featured(Selection, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """What edits that carry a feature share."""

    edges: Annotated[
        Literal["frozen", "coupled"],
        Meta(
            description="Edges between two edited faces: coupled, they move with a copy that lies over them and stay "
            "as smooth as they were, where that is possible; frozen, none moves."
        ),
    ] = "coupled"
    taper: Annotated[
        Length | None,
        Meta(
            description="Width (a length) over which a window fades out beyond its rim. Default: a quarter of its "
            "radius, or of the shorter side of a rectangle."
        ),
    ] = None
    base: Annotated[
        Literal["surroundings", "level"],
        Meta(
            description="What the feature stands above: surroundings, a thin plate through what lies around the "
            "window; level, the face without its --band."
        ),
    ] = "surroundings"
    band: Annotated[
        str | None,
        Meta(
            description="Wavelengths that belong to a feature above a level: 0.5mm:20mm; 0mm:20mm for all up to 20 mm."
        ),
    ] = None
    rotate: Annotated[float, Meta(description="Turn of each copy about the outward normal (degrees).")] = 0.0
    size: Annotated[
        float, Meta(description="Factor on the size of each copy along the face; its height stays.", gt=0.0)
    ] = 1.0
    height: Annotated[float, Meta(description="Factor on the height of each copy; negative makes a dent of it.")] = 1.0
    mirror: Annotated[bool, Meta(description="Mirror each copy.")] = False
    clip: Annotated[
        bool, Meta(description="Let edges and holes that do not move take parts of copies, instead of refusing them.")
    ] = False

    @property
    def quiet(self) -> str:
        return "without a copy"

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.band is not None:
            band_of(self.band, 1.0)
        if self.base == "level" and self.band is None:
            raise UsageError("base: a level needs a band", "give --band 0.5mm:20mm")
        if not (math.isfinite(self.size) and self.size > 0):
            raise UsageError(f"size: {self.size} is not greater than zero", "give --size 1.5")
        if not (math.isfinite(self.height) and self.height != 0 and math.isfinite(self.rotate)):
            raise UsageError(f"height: {self.height} makes nothing of a feature", "give --height 0.5")


class Single(Featured, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """What edits with a feature of the model itself share."""

    feature: Annotated[
        FeatureText,
        Meta(
            description="The feature: near:X,Y,Z,radius:R (a disc, mm), #3@u0:u1,v0:v1 (a rectangle of parameters) or "
            "a file made by mracad feature extract."
        ),
    ] = ""

    def __post_init__(self) -> None:
        super().__post_init__()
        if not self.feature:
            raise UsageError("feature: it is not said which", "give --feature near:X,Y,Z,radius:R")


class Move(Single, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Move a detail feature: the coarse surface is left clean at its place, and it is present at another one."""

    function: ClassVar[str] = "mracad.edit.features:move"

    to: Annotated[str, Meta(description="Where to: X,Y,Z (mm) or #face@u,v.")] = ""

    def __post_init__(self) -> None:
        super().__post_init__()
        if not self.to:
            raise UsageError("to: it is not said where the feature is to go", "give --to X,Y,Z or --to '#3@u,v'")
        if self.feature.endswith(".feature"):
            raise UsageError(f"feature: a file cannot be moved: {self.feature}", "lay copies of it with mracad repeat")

    @property
    def done(self) -> str:
        return "edited, the feature moved"


class Repeat(Single, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Repeat a detail feature at other places of the same or other faces, over seams where they lie in its way."""

    function: ClassVar[str] = "mracad.edit.features:repeat"

    at: Annotated[
        tuple[PlaceText, ...],
        Meta(
            description="A place: X,Y,Z (mm, brought to the nearest selected face), #face@u,v, or @places.csv with "
            "lines x,y,z[,rotate[,size[,height]]]; repeatable."
        ),
    ] = ()
    grid: Annotated[
        str | None,
        Meta(
            description="NxM,DX,DY: a grid of N by M places, DX and DY (mm) apart along the feature's own axes; its "
            "first one is the feature's place, or that of the first --at."
        ),
    ] = None
    polar: Annotated[
        str | None,
        Meta(
            description="N,AXIS: N places around an axis, the feature's among them: 6,z or 6,X,Y,Z,DX,DY,DZ (a point "
            "and a direction)."
        ),
    ] = None
    along: Annotated[
        str | None,
        Meta(description="EDGE,N[,OFFSET]: N places evenly along edge#4, OFFSET (mm) inside its first selected face."),
    ] = None
    overlap: Annotated[
        Literal["add", "max", "replace"],
        Meta(
            description="Where copies overlap: add them, take the one that is larger there, or let the later one "
            "replace the earlier."
        ),
    ] = "add"
    jitter: Annotated[
        Length | None, Meta(description="Move each copy at random by up to this length along the face.")
    ] = None
    spin: Annotated[
        float, Meta(description="Turn each copy at random by up to so many degrees either way.", ge=0.0)
    ] = 0.0
    seed: Annotated[int, Meta(description="Of the random numbers.", ge=0)] = 0

    def __post_init__(self) -> None:
        super().__post_init__()
        if not (self.at or self.grid or self.polar or self.along):
            raise UsageError("at: it is not said where the copies are to go", "give --at, --grid, --polar or --along")
        if sum(x is not None for x in (self.grid, self.polar, self.along)) > 1:
            raise UsageError("grid, polar and along exclude each other", "give one of them")
        if not math.isfinite(self.spin):
            raise UsageError(f"spin: {self.spin} is not an angle", "give --spin 180 for any turn")

    @property
    def done(self) -> str:
        return "edited with copies"


class Transfer(Featured, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Carry the detail of a face, or a feature, of another file onto this one; units may differ."""

    function: ClassVar[str] = "mracad.edit.features:transfer"

    source: Annotated[File, Meta(description="The file that the detail is taken from.")] = ""
    from_: Annotated[
        FeatureText,
        Meta(
            description="What to take: a face (#3 or its name) with all its detail in --band, or a feature as for "
            "mracad repeat."
        ),
    ] = ""
    to: Annotated[str, Meta(description="Where to: a face for the detail of a face; a place for a feature.")] = ""
    mode: Annotated[
        str,
        Meta(
            description="For the detail of a face: add it, replace the face's own detail in the band by it, or "
            "blend=0.3, a mix with so much of it."
        ),
    ] = "add"

    def __post_init__(self) -> None:
        super().__post_init__()
        for name in ("source", "from_", "to"):
            if not getattr(self, name):
                raise UsageError(f"{dashed(name)}: it is missing", f"give {dashed(name)}, see mracad transfer --help")
        self.share()

    def share(self) -> tuple[float, float]:
        """How much of the face's own detail stays, and how much of the other's comes."""
        if self.mode in ("add", "replace"):
            return (1.0, 1.0) if self.mode == "add" else (0.0, 1.0)
        match = re.fullmatch(r"blend=(\d+\.?\d*|\.\d+)", self.mode)
        if not match or not 0 <= float(match[1]) <= 1:
            raise UsageError(f"mode: {self.mode!r} is not known", "use add, replace or blend=0.3")
        return 1.0 - float(match[1]), float(match[1])

    def models(self) -> tuple[str, ...]:
        return (self.source,)

    @property
    def done(self) -> str:
        return "edited with detail of another"

    @property
    def quiet(self) -> str:
        return "left as they are"


def band_of(text: str, diagonal: float) -> tuple[float, float]:
    """The least and the largest wavelength of a band, mm; raises UsageError."""
    low, colon, high = text.partition(":")
    hint = "write a band as 0.5mm:20mm or 0mm:20mm"
    if not colon:
        raise UsageError(f"band: {text!r} is not a band", hint)
    zero = re.fullmatch(r"\s*0*\.?0*\s*[a-z]*\s*", low) is not None
    band = 0.0 if zero else length(low, diagonal, "band"), length(high, diagonal, "band")
    if band[0] >= band[1]:
        raise UsageError(f"band: {text!r} is empty", hint)
    return band


class Check(Options, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Check validity and continuity; what fails it stops a recipe, and a command ends with exit code 1."""

    function: ClassVar[str] = "mracad.judge:check"

    max_gap: Annotated[Length | None, Meta(description="Largest gap along any seam.")] = None
    max_angle: Annotated[
        Annotated[float, Meta(ge=0.0)] | None,
        Meta(description="Largest angle (degrees) along seams that are meant to be smooth."),
    ] = None
    kink: Annotated[float, Meta(description="A seam with a smaller angle (degrees) is meant to be smooth.", ge=0.0)] = (
        1.0
    )
    expect: Annotated[
        CountText | None,
        Meta(
            description="How many seams are to be smooth: a number, or the report (JSON) of an earlier check or edit."
        ),
    ] = None
    max_tolerance: Annotated[Length | None, Meta(description="Largest tolerance of edges and vertices.")] = None
    min_wall: Annotated[Length | None, Meta(description="Least thickness of the walls of solids.")] = None
    layer_limit: Annotated[
        Annotated[float, Meta(gt=0.0)] | None,
        Meta(description="Seconds for each layer; one that takes longer says nothing."),
    ] = None
    fail_on: Annotated[
        tuple[
            Literal["invalid", "unknown", "free-edges", "unsewn", "file", "self-intersection", "mesh", "nothing"], ...
        ],
        Meta(description="What fails the check beside the limits; repeatable."),
    ] = ("invalid",)


class Compare(Options, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Compare with a reference; what differs beyond its limit stops a recipe, and a command ends with exit code 1."""

    function: ClassVar[str] = "mracad.judge:compare"

    reference: Annotated[
        File | None, Meta(description="File to compare with; by default the model as it came into the recipe.")
    ] = None
    reference_unit: Annotated[
        str | None,
        Meta(description="Length unit of the numbers in the reference, where it names a wrong one: mm, m, in …"),
    ] = None
    max_deviation: Annotated[Length, Meta(description="How far any face or outline may lie from its partner.")] = (
        "1e-6mm"
    )
    max_gap_growth: Annotated[Length | None, Meta(description="How much wider the gap of any seam may become.")] = None
    max_angle_growth: Annotated[
        Annotated[float, Meta(ge=0.0)] | None,
        Meta(description="How much larger the angle (degrees) of any seam may become."),
    ] = None
    max_volume_change: Annotated[
        Annotated[float, Meta(ge=0.0)] | None, Meta(description="How much of the volume (percent) may come or go.")
    ] = None
    ignore: Annotated[
        tuple[
            Literal[
                "faces", "deviation", "seams", "topology", "validity", "size", "assembly", "names", "colours",
                "layers", "materials", "annotations",
            ],
            ...,
        ],
        Meta(description="What may differ in any way; repeatable."),
    ] = ()  # fmt: skip


STEPS: dict[str, type[Options]] = {
    "smooth": Smooth,
    "move": Move,
    "repeat": Repeat,
    "transfer": Transfer,
    "check": Check,
    "compare": Compare,
}
"""Every step by the name of its command: edits (subclasses of ``Selection``) and checks."""
