"""Options of edits that copy a feature."""

from __future__ import annotations

from typing import Annotated, ClassVar, Literal

from msgspec import Meta

from mracad.errors import UsageError
from mracad.spec import places, sources
from mracad.spec.fields import Begins
from mracad.spec.fill import FILLS
from mracad.spec.fill import align as read_align
from mracad.spec.fill import fade as read_fade
from mracad.spec.fill import fill as read_fill
from mracad.spec.quantity import Angle, Length, band_of
from mracad.spec.steps.base import Options, Selection

_Feature = Annotated[
    places.Feature,
    Meta(
        description="The feature: near:X,Y,Z,radius:R (a disc, mm), #3@u0:u1,v0:v1 (a rectangle of parameters), "
        "a .feature file made by mracad feature extract, or a source as for mracad feature make: "
        "logo.png,width:30mm,height:0.4mm."
    ),
]
Taper = Annotated[
    Length | None,
    Meta(
        description="Width over which the feature fades out beyond its window. Default: a quarter of the window's "
        "radius, or of the shorter side of a rectangle. Heightmaps and textures that are not level at their border "
        "fade out inside it, by default over an eighth of their shorter side."
    ),
]
Base = Annotated[
    Literal["surroundings", "level"],
    Meta(
        description="What the feature is measured from: surroundings is a smooth surface fitted around it; "
        "level is the face without its --band."
    ),
]
Band = Annotated[
    str | None,
    Meta(description="Wavelengths of the detail to take, such as 0.5mm:20mm; 0mm:20mm takes everything up to 20 mm."),
]
Rotate = Annotated[Angle, Meta(description="Rotation of each copy about the outward normal (degrees).")]
Size = Annotated[
    float, Meta(description="Scale factor of each copy along the face; its height does not change.", gt=0.0)
]
Height = Annotated[
    float, Meta(description="Scale factor of the height of each copy; a negative one turns a bump into a dent.")
]
Mirror = Annotated[bool, Meta(description="Mirror each copy.")]
Clip = Annotated[
    bool, Meta(description="Let fixed edges and holes cut off parts of copies, instead of refusing such copies.")
]


def separable(base: str, band: str | None) -> None:
    """Raise UsageError for a band that is malformed, or missing where the base is a level."""
    if band is not None:
        band_of(band, None)
    if base == "level" and band is None:
        raise UsageError("base: a level needs a band", "give --band 0.5mm:20mm", "base")


def not_flat(height: float) -> None:
    """Raise UsageError for a height of zero."""
    if height == 0:
        raise UsageError("height: it must not be zero", "give --height 0.5, or a negative one for a dent", "height")


class Featured(Selection, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Options that separate a feature from its surroundings."""

    about: ClassVar[str] = "Feature"

    taper: Taper = None
    base: Base = "surroundings"
    band: Band = None

    @property
    def quiet(self) -> str:
        return "without a copy"

    def __post_init__(self) -> None:
        super().__post_init__()
        separable(self.base, self.band)


class Extract(Featured, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Save a feature to a file, for mracad repeat and mracad transfer."""

    command: ClassVar[str] = "feature extract"
    example: ClassVar[str] = "mracad feature extract part.step --feature near:10,20,5,radius:8 -o bump.feature"

    feature: _Feature


class Make(Options, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Make a feature file from SOURCE: a heightmap, an outline, a texture or a formula.

    \b
    logo.png,width:30mm,height:0.4mm      heightmap: PNG, TIFF, .npy or .csv
    logo.svg,height:0.4mm,edge:0.3mm      outline: SVG or DXF; width: scales it
    texture:leather,width:40mm,height:0.2mm,pitch:2mm,seed:1
                                          or knurl, hammered, brushed, hexagons, dimples
    formula:'0.3*cos(x)*cos(y)',radius:10mm

    spacing:0.2mm sets how far apart its knots are; by default they are as far apart as its detail allows.
    """

    command: ClassVar[str] = "feature make"
    example: ClassVar[str] = "mracad feature make texture:leather,width:40mm,height:0.2mm -o leather.feature"

    source: Annotated[
        Annotated[str, places.NAMED, sources.source],
        Meta(description="A heightmap, an outline, a texture or a formula, with its sizes."),
    ]
    taper: Taper = None


class Copied(Featured, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Options of edits that make copies of a feature."""

    about: ClassVar[str] = "Copies"

    edges: Annotated[
        Literal["frozen", "coupled"],
        Meta(
            description="Edges between two edited faces: coupled lets them move with a copy that crosses them, as "
            "smooth as before where possible; frozen keeps them in place."
        ),
    ] = "coupled"
    rotate: Rotate = 0.0
    size: Size = 1.0
    height: Height = 1.0
    mirror: Mirror = False
    clip: Clip = False

    def __post_init__(self) -> None:
        super().__post_init__()
        not_flat(self.height)


class Single(Copied, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Options of edits that copy a feature of the model itself."""

    about: ClassVar[str] = ""

    feature: _Feature


class Move(Single, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Move a detail feature to another place; the surface that it leaves is clean."""

    function: ClassVar[str] = "mracad.edit.feature.edits:move"
    example: ClassVar[str] = "mracad move part.step --feature near:10,20,5,radius:8 --to 40,20,5 -o moved.step"

    to: Annotated[places.Spot, Meta(description="Where to: X,Y,Z (mm) or #face@u,v.")]

    def __post_init__(self) -> None:
        super().__post_init__()
        if places.is_made(self.feature):
            message = f"feature: one that is not in the model cannot be moved: {self.feature}"
            raise UsageError(message, "copy it with mracad repeat", "feature")

    @property
    def done(self) -> str:
        return "edited, the feature moved"


class Repeat(Single, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Copy a detail feature to other places, on the same or other faces and across seams."""

    function: ClassVar[str] = "mracad.edit.feature.edits:repeat"
    example: ClassVar[str] = "mracad repeat part.step --feature near:10,20,5,radius:8 --grid 3x2,30,30 -o grid.step"

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
    fill: Annotated[
        Annotated[str, read_fill, Begins(tuple(f"{kind},spacing:" for kind in FILLS))] | None,
        Meta(
            description="hexagons, grid or poisson (at random), with ,spacing:4mm: places all over the selected faces, "
            "this far apart along the surface, over smooth seams."
        ),
    ] = None
    margin: Annotated[
        Length | None,
        Meta(
            description="With --fill: width kept clear of copies along borders, which are free and held edges, creases "
            "and holes. Default: copies just fit, or with --clip may run over borders."
        ),
    ] = None
    align: Annotated[
        Annotated[str, read_align, Begins(("X", "Y", "Z", "edge#"))] | None,
        Meta(
            description="With --fill: direction of its rows and of each copy's x: X, Y or Z or three numbers, brought "
            "to the surface, or edge#4, whose direction goes on over the faces. Default: as even as can be, near u."
        ),
    ] = None
    size_by: Annotated[
        Annotated[str, read_fade] | None,
        Meta(
            description="With --fill: sizes of copies by their distance along the surface from an edge: "
            "distance-to:edge#4,from:2mm=0.4,to:30mm=1 (factors, even between and beyond these distances)."
        ),
    ] = None
    height_by: Annotated[
        Annotated[str, read_fade] | None,
        Meta(description="With --fill: heights of copies by their distance from an edge, written like --size-by."),
    ] = None
    skip_off: Annotated[
        bool, Meta(description="Leave out places that are not on the faces, instead of refusing them all.")
    ] = False
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
        if not (self.at or self.grid or self.polar or self.along or self.fill):
            hint = "give --at, --grid, --polar, --along or --fill"
            raise UsageError("at: no place is given for the copies", hint, "at")
        if sum(x is not None for x in (self.grid, self.polar, self.along, self.fill)) > 1:
            raise UsageError("grid, polar, along and fill cannot be combined", "give one of them")
        self._filled()

    def _filled(self) -> None:
        """Raise UsageError for places besides those that fill the faces, and for options that only these take."""
        if self.fill and (self.at or self.skip_off):
            name = "at" if self.at else "skip-off"
            raise UsageError(f"fill: it finds all places itself, without --{name}", f"leave --{name} out", "fill")
        alone = [name for name in ("margin", "align", "size_by", "height_by") if getattr(self, name) is not None]
        if alone and not self.fill:
            message = f"{alone[0].replace('_', '-')}: it goes with --fill only"
            raise UsageError(message, "give --fill hexagons,spacing:4mm", alone[0])

    @property
    def done(self) -> str:
        return "edited with copies"
