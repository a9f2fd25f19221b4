"""Options of edits that copy a feature or the detail of a face."""

from __future__ import annotations

import re
from typing import Annotated, ClassVar, Literal

from msgspec import Meta

from mracad.errors import UsageError
from mracad.spec import places
from mracad.spec.files import File, Naming
from mracad.spec.quantity import Angle, Length, band_of
from mracad.spec.steps.base import Selection

_Feature = Annotated[
    places.Feature,
    Meta(
        description="The feature: near:X,Y,Z,radius:R (a disc, mm), #3@u0:u1,v0:v1 (a rectangle of parameters) or "
        "a file made by mracad feature extract."
    ),
]


class Featured(Selection, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Options that separate a feature from its surroundings."""

    taper: Annotated[
        Length | None,
        Meta(
            description="Width over which the feature fades out beyond its window. Default: a quarter of the window's "
            "radius, or of the shorter side of a rectangle."
        ),
    ] = None
    base: Annotated[
        Literal["surroundings", "level"],
        Meta(
            description="What the feature is measured from: surroundings is a smooth surface fitted around it; "
            "level is the face without its --band."
        ),
    ] = "surroundings"
    band: Annotated[
        str | None,
        Meta(
            description="Wavelengths of the detail to take, such as 0.5mm:20mm; 0mm:20mm takes everything up to 20 mm."
        ),
    ] = None

    @property
    def quiet(self) -> str:
        return "without a copy"

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.band is not None:
            band_of(self.band, None)
        if self.base == "level" and self.band is None:
            raise UsageError("base: a level needs a band", "give --band 0.5mm:20mm", "base")


class Extract(Featured, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Save a feature to a file, for mracad repeat and mracad transfer."""

    command: ClassVar[str] = "feature extract"

    feature: _Feature


class Copied(Featured, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Options of edits that make copies of a feature."""

    edges: Annotated[
        Literal["frozen", "coupled"],
        Meta(
            description="Edges between two edited faces: coupled lets them move with a copy that crosses them, as "
            "smooth as before where possible; frozen keeps them in place."
        ),
    ] = "coupled"
    rotate: Annotated[Angle, Meta(description="Rotation of each copy about the outward normal (degrees).")] = 0.0
    size: Annotated[
        float, Meta(description="Scale factor of each copy along the face; its height does not change.", gt=0.0)
    ] = 1.0
    height: Annotated[
        float, Meta(description="Scale factor of the height of each copy; a negative one turns a bump into a dent.")
    ] = 1.0
    mirror: Annotated[bool, Meta(description="Mirror each copy.")] = False
    clip: Annotated[
        bool, Meta(description="Let fixed edges and holes cut off parts of copies, instead of refusing such copies.")
    ] = False

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.height == 0:
            raise UsageError("height: it must not be zero", "give --height 0.5, or a negative one for a dent", "height")


class Single(Copied, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Options of edits that copy a feature of the model itself."""

    feature: _Feature


class Move(Single, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Move a detail feature to another place; the surface that it leaves is clean."""

    function: ClassVar[str] = "mracad.edit.feature.edits:move"

    to: Annotated[places.Spot, Meta(description="Where to: X,Y,Z (mm) or #face@u,v.")]

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.feature.endswith(".feature"):
            message = f"feature: a file cannot be moved: {self.feature}"
            raise UsageError(message, "copy it with mracad repeat", "feature")

    @property
    def done(self) -> str:
        return "edited, the feature moved"


class Repeat(Single, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Copy a detail feature to other places, on the same or other faces and across seams."""

    function: ClassVar[str] = "mracad.edit.feature.edits:repeat"

    at: Annotated[
        tuple[places.Place, ...],
        Meta(
            description="A place: X,Y,Z (mm, brought to the nearest selected face), #face@u,v, or @places.csv with "
            "lines x,y,z[,rotate[,size[,height]]]; repeatable."
        ),
    ] = ()
    grid: Annotated[
        Annotated[str, places.grid] | None,
        Meta(
            description="NxM,DX,DY: a grid of N by M places, DX and DY (mm) apart along the feature's own axes; its "
            "first one is the feature's place, or that of the first --at."
        ),
    ] = None
    polar: Annotated[
        Annotated[str, places.polar] | None,
        Meta(
            description="N,AXIS: N places around an axis, the feature's among them: 6,z or 6,X,Y,Z,DX,DY,DZ (a point "
            "and a direction)."
        ),
    ] = None
    along: Annotated[
        Annotated[str, places.along] | None,
        Meta(description="EDGE,N[,OFFSET]: N places evenly along edge#4, OFFSET (mm) inside its first selected face."),
    ] = None
    overlap: Annotated[
        Literal["add", "max", "replace"],
        Meta(
            description="Where copies overlap: add them, keep the larger one, or let later copies replace earlier ones."
        ),
    ] = "add"
    jitter: Annotated[
        Length | None, Meta(description="Move each copy at random by up to this length along the face.")
    ] = None
    spin: Annotated[
        Angle, Meta(description="Turn each copy at random by up to this angle (degrees) either way.", ge=0.0, le=360.0)
    ] = 0.0
    seed: Annotated[int, Meta(description="Seed of the random numbers.", ge=0)] = 0

    def __post_init__(self) -> None:
        super().__post_init__()
        if not (self.at or self.grid or self.polar or self.along):
            raise UsageError("at: no place is given for the copies", "give --at, --grid, --polar or --along", "at")
        if sum(x is not None for x in (self.grid, self.polar, self.along)) > 1:
            raise UsageError("grid, polar and along cannot be combined", "give one of them")

    @property
    def done(self) -> str:
        return "edited with copies"


class Transfer(Copied, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Copy the detail of a face, or a feature, from another file to this one; units may differ."""

    function: ClassVar[str] = "mracad.edit.feature.edits:transfer"

    source: Annotated[File, Meta(description="The file that the detail is taken from.")]
    from_: Annotated[
        Annotated[str, Naming(ending=".feature")],
        Meta(
            description="What to take: a face (#3 or its name) with all its detail in --band, or a feature as for "
            "mracad repeat."
        ),
    ]
    to: Annotated[str, Meta(description="Where to: a face for the detail of a face; a place for a feature.")]
    mode: Annotated[
        str,
        Meta(
            description="How the detail of a face is applied: add it; replace the face's own detail in the band; or "
            "blend=0.3 for a mix with 30% of it."
        ),
    ] = "add"

    def __post_init__(self) -> None:
        super().__post_init__()
        if places.is_feature(self.from_):
            places.feature(self.from_, "from")
            places.spot(self.to, "to")
        elif self.band is None:
            message = "band: the detail of a face cannot be transferred without one"
            raise UsageError(message, "give --band 0mm:20mm", "band")
        self.share()

    def share(self) -> tuple[float, float]:
        """Shares of the face's own detail that is kept, and of the other face's detail that is added."""
        if self.mode in ("add", "replace"):
            return (1.0, 1.0) if self.mode == "add" else (0.0, 1.0)
        match = re.fullmatch(r"blend=(\d+\.?\d*|\.\d+)", self.mode)
        if not match or not 0 <= float(match[1]) <= 1:
            raise UsageError(f"mode: {self.mode!r} is not known", "use add, replace or blend=0.3", "mode")
        return 1.0 - float(match[1]), float(match[1])

    def models(self) -> tuple[str, ...]:
        return (self.source,)

    @property
    def done(self) -> str:
        return "edited with transferred detail"

    @property
    def quiet(self) -> str:
        return "unchanged"
