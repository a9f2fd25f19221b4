"""Options of edits that change the shape of whole faces by wavelength."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from typing import Annotated, ClassVar

from msgspec import Meta

from mracad.errors import UsageError
from mracad.spec import motions, places
from mracad.spec.quantity import Length, gain_of, worded
from mracad.spec.steps.levels import Shaped
from mracad.spec.steps.smooth import Fairing


def _band(text: str, name: str) -> None:
    """Raise UsageError for a text that is not a band with a gain."""
    gain_of(text, None)


class Equalize(Fairing, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Weaken or amplify the waves of NURBS faces, band by band of wavelength."""

    function: ClassVar[str] = "mracad.edit.equalize:equalize"
    example: ClassVar[str] = "mracad equalize part.step --band 2mm:10mm=0 -o even.step"

    band: Annotated[
        tuple[Annotated[str, _band], ...],
        Meta(
            description="A band of wavelengths and its gain: 2mm:10mm=0 removes waves between 2 and 10 mm, :10mm=3 "
            "makes waves up to 10 mm three times as high; repeatable. Waves in no band stay."
        ),
    ] = ()
    amount: Annotated[
        float,
        Meta(
            description="How much of the edit to apply: a gain g counts as 1 + amount (g - 1). 0 is none; above 1 "
            "exaggerates.",
            ge=0.0,
        ),
    ] = 1.0

    def __post_init__(self) -> None:
        super().__post_init__()
        if not self.band:
            raise UsageError("band: no band is given", "give --band 2mm:10mm=0", "band")
        bands = self.gains(None)
        least = min(gain for *_, gain in bands)
        if 1.0 + self.amount * (least - 1.0) < 0.0:
            most = 1.0 / (1.0 - least)
            message = f"amount: {self.amount:g} would invert waves: a gain of {least:g} allows up to {most:g}"
            raise UsageError(message, "give a smaller amount, or gains above 1", "amount")
        if not any("%" in text for text in self.band):
            bands_apart(bands)

    def gains(self, diagonal: float | None) -> list[tuple[float, float, float]]:
        """Smallest and largest wavelength (mm) and gain of each band, in ascending order, for a model with a diagonal;
        see :func:`mracad.spec.quantity.band_of`."""
        return sorted(gain_of(text, diagonal) for text in self.band)

    @property
    def done(self) -> str:
        return "equalized"

    @property
    def quiet(self) -> str:
        return "without waves in these bands" if self.amount else "unchanged: amount 0"


def bands_apart(bands: Sequence[tuple[float, float, float]]) -> None:
    """Raise UsageError if bands in ascending order overlap."""
    for (_, high, _), (low, _, _) in pairwise(bands):
        if low < high:
            message = f"band: one begins at {low:g}mm, before another ends at {high:g}mm"
            raise UsageError(message, "let each begin where another ends, or beyond", "band")


class Sweep(Shaped, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Move points of NURBS faces; the shape around them follows smoothly, and details turn with it."""

    function: ClassVar[str] = "mracad.edit.sweep:sweep"
    example: ClassVar[str] = "mracad sweep part.step --at 10,20,5 --by 0,0,2 --scale 80mm -o swept.step"

    at: Annotated[
        tuple[motions.Start, ...],
        Meta(
            description="A point of the model: X,Y,Z (mm) on a selected face, #face@u,v, or @points.csv with lines "
            "x,y,z,dx,dy,dz; or a whole edge, edge#4; repeatable."
        ),
    ] = ()
    by: Annotated[
        tuple[motions.Step, ...],
        Meta(
            description="DX,DY,DZ (mm): how far the point moves, or one number: along the outward normal; one for each "
            "--at in their order, or for all."
        ),
    ] = ()
    to: Annotated[
        tuple[places.Vector, ...],
        Meta(description="X,Y,Z (mm): where the point goes, instead of --by; one for each --at in their order."),
    ] = ()
    radius: Annotated[
        Length | None,
        Meta(description="Radius of a region around each point, along the surface, that moves as a whole with it."),
    ] = None
    rotate: Annotated[
        motions.Turn | None,
        Meta(
            description="AXIS,ANGLE (degrees): rotates regions and edges about their middle; AXIS is x, y, z, normal, "
            "DX,DY,DZ, or X,Y,Z,DX,DY,DZ: a point and a direction."
        ),
    ] = None
    stretch: Annotated[
        motions.Stretch | None,
        Meta(description="FACTOR, or AXIS,FACTOR: stretches regions and edges from their middle, before they rotate."),
    ] = None
    scale: Annotated[
        Length,
        Meta(
            description="Wavelength of the sweep (80mm, or 10% of the model's diagonal): half of a move is left at 0.4 "
            "of it from the point, a twentieth at one, and nothing at two. Finer detail moves along unchanged."
        ),
    ]

    def __post_init__(self) -> None:
        super().__post_init__()
        if not self.at:
            raise UsageError("at: no point is given", "give --at X,Y,Z --by DX,DY,DZ", "at")
        self._check_moves()
        rims = [isinstance(motions.start(text, "at"), motions.Rim) for text in self.at]
        if self.radius and all(rims):
            raise UsageError("radius: an edge is no region", "give points with --at", "radius")
        if self.turns and not self.radius and not all(rims):
            raise UsageError("radius: no region is given to rotate or stretch", "give --radius 20mm", "radius")

    def _check_moves(self) -> None:
        """Raise UsageError unless there is a move for each point."""
        single = sum(not text.startswith("@") for text in self.at)
        if self.by and self.to:
            raise UsageError("by and to cannot be combined", "give one of them")
        if not (self.by or self.to) and (self.turns or not single):
            return
        if single and not (self.by or self.to):
            raise UsageError("by: no move is given for the points", "give --by DX,DY,DZ, or --to X,Y,Z", "by")
        given, name = (self.by, "by") if self.by else (self.to, "to")
        if len(given) != single and not (len(self.by) == 1 and single):
            message = f"{name}: {len(given)} for {single} points"
            raise UsageError(message, f"give --{name} for each --at that names no file", name)

    @property
    def turns(self) -> bool:
        """Whether regions and edges rotate or stretch."""
        return bool(self.rotate or self.stretch)

    @property
    def done(self) -> str:
        return f"swept at {worded(self.scale)}"

    @property
    def quiet(self) -> str:
        return "out of reach" if self.amount else "unchanged: amount 0"
