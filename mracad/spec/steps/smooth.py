"""Options of edits that change whole faces."""

from __future__ import annotations

from typing import Annotated, ClassVar, Literal

from msgspec import Meta

from mracad.errors import UsageError
from mracad.spec import places
from mracad.spec.fields import Begins
from mracad.spec.quantity import Angle, Length, Share, worded
from mracad.spec.steps.base import Edges, Selection

Sliding = Annotated[
    Literal["coupled", "slide", "frozen"],
    Meta(
        description="Edges between two edited faces: coupled lets them move, as smooth as before where possible; "
        "frozen keeps them in place; slide also lets sharp edges move along a plane, cylinder, cone, sphere, torus "
        "or NURBS face that stays."
    ),
]
"""The type of ``edges`` for edits whose edges may slide."""


class Fitting(Selection, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Options of edits that change whole faces."""

    about: ClassVar[str] = "Seams and limits"

    fit_g1: Annotated[
        Annotated[Angle, Meta(ge=0.0, le=45.0)] | None,
        Meta(description="Make seams between edited faces tangent where their angle (°) is below this."),
    ] = None
    close_gaps: Annotated[
        bool,
        Meta(description="Close gaps along seams between edited faces."),
    ] = False
    gap_tolerance: Annotated[
        Length,
        Meta(
            description="Largest gap that a seam along a trim curve may have after the edit, unless it was wider "
            "before."
        ),
    ] = "1e-4mm"
    refine: Annotated[
        Literal["auto", "never"],
        Meta(
            description="Where a face has too few control points for the edit: auto inserts knots, which does not "
            "change its shape; never keeps its knots."
        ),
    ] = "auto"
    amount: Annotated[
        float,
        Meta(description="How much of the edit to apply: 1 all of it, 0 none.", ge=0.0, le=1.0),
    ] = 1.0
    max_deviation: Annotated[
        Length | None,
        Meta(description="Largest deviation along the normal; where an edit would exceed it, it is scaled back."),
    ] = None


class Fairing(Fitting, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Options of edits that make faces fairer."""

    about: ClassVar[str] = "Faces and edges"

    edges: Sliding = "coupled"
    free_edges: Annotated[
        Literal["hold", "smooth"],
        Meta(
            description="Edges of only one face: hold keeps them in place; smooth moves them with their face, except "
            "the corners between two of them."
        ),
    ] = "hold"
    corners: Annotated[
        Literal["hold", "move"],
        Meta(description="Corners between two free edges that move: hold keeps them in place; move moves them too."),
    ] = "hold"

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.corners == "move" and self.free_edges == "hold":
            raise UsageError("corners: they cannot move while free edges stay", "add --free-edges smooth", "corners")


class Smooth(Fairing, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Remove detail finer than a scale from the NURBS faces of a model."""

    function: ClassVar[str] = "mracad.edit.smooth:smooth"
    example: ClassVar[str] = "mracad smooth part.step --scale 5mm -o fair.step"

    scale: Annotated[
        Length | None,
        Meta(
            description="Wavelength (5mm, 0.2in, or 2% of the model's diagonal): ripples up to half as long are "
            "removed, ripples three times as long stay. Default: the largest within --max-deviation."
        ),
    ] = None
    across: Annotated[
        Length | None,
        Meta(
            description="Scale across the direction of --along; --scale then counts along it. For example, to remove "
            "waves along a blade and keep its profile."
        ),
    ] = None
    along: Annotated[
        Annotated[str, places.heading, Begins(("X", "Y", "Z", "u", "v", "edge#"))] | None,
        Meta(
            description="Direction of --scale, with --across: X, Y, Z, edge#4, or the face's u or v. Default: the "
            "direction in which each face is longer."
        ),
    ] = None
    limit_by_curvature: Annotated[
        bool,
        Meta(
            description="Use shorter wavelengths where a face bends with a radius too small for the scale, so that "
            "noses and fillets stay."
        ),
    ] = True
    level: Annotated[
        Annotated[float, Meta(gt=0.0)] | None,
        Meta(description="Instead of --scale: how many levels of the face's own knot ladder to remove, such as 2.5."),
    ] = None

    @property
    def done(self) -> str:
        return f"smoothed at {self._place}"

    @property
    def quiet(self) -> str:
        return f"already fair at {self._place}" if self.amount else "unchanged: amount 0"

    @property
    def _place(self) -> str:
        if self.level is not None:
            return f"level {self.level:g}"
        if self.scale is None:
            return f"the largest scale within {worded(self.max_deviation or '')}"
        scale = worded(self.scale)
        return f"{scale} and {worded(self.across)} across" if self.across else scale

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.scale is not None and self.level is not None:
            raise UsageError("smooth takes a scale or a level, not both", "leave out --scale or --level")
        if self.across is not None and self.scale is None:
            raise UsageError("across: it needs a scale", "add --scale, for waves along the direction", "across")
        if self.along is not None and self.across is None:
            raise UsageError("along: it needs a scale across it", "add --across", "along")
        if self.scale is None and self.level is None:
            self._check_bound()
        if self.level is not None and not self.limit_by_curvature:
            message = "limit-by-curvature: levels are not limited by it"
            raise UsageError(message, "leave it out, or give --scale", "limit_by_curvature")

    def _check_bound(self) -> None:
        """Raise UsageError where the options leave no scale to be found."""
        if self.max_deviation is None:
            hint = "give --scale 5mm, --scale 2%, --level 2.5 or --max-deviation 0.2mm"
            raise UsageError("smooth needs a scale, a level or a limit of the deviation", hint)
        if self.amount < 1.0:
            raise UsageError("amount: it needs a scale or a level", "leave it out, or give --scale", "amount")


class Denoise(Fairing, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Remove noise from the NURBS faces of a model and keep their shape, with no scale to choose."""

    function: ClassVar[str] = "mracad.edit.denoise:denoise"
    example: ClassVar[str] = "mracad denoise scan.step --noise 0.05mm -o clean.step"

    edges: Sliding = "slide"
    noise: Annotated[
        Length | None,
        Meta(
            description="Standard deviation of each coordinate of the control points; by default it is measured for "
            "each face."
        ),
    ] = None
    method: Annotated[
        Literal["wiener", "spline"],
        Meta(
            description="wiener shrinks details in wavelet space about a smoothing spline, or takes the spline alone "
            "where it is expected to be more accurate; spline takes one with wavelengths found by cross-validation."
        ),
    ] = "wiener"
    strength: Annotated[
        float,
        Meta(description="Factor on the noise: above 1, more is removed.", gt=0.0, le=10.0),
    ] = 1.0

    outliers: Annotated[
        Annotated[Share, Meta(ge=0.0, le=10.0)],
        Meta(
            description="Largest share of control points to treat as wrong, such as 0.5%: those too far off for noise "
            "are replaced by what the others suggest."
        ),
    ] = 0.0

    @property
    def done(self) -> str:
        return "denoised"

    @property
    def quiet(self) -> str:
        return "without noise that can be told from shape" if self.amount else "unchanged: amount 0"


class OffsetFaces(Fitting, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Move NURBS faces along their normals by a length, with the seams between them and their free edges."""

    function: ClassVar[str] = "mracad.edit.offset:offset"
    example: ClassVar[str] = "mracad offset part.step --distance 0.2mm -o thicker.step"

    distance: Annotated[Length, Meta(description="How far to move, outward.")]
    edges: Edges = "coupled"
    inward: Annotated[bool, Meta(description="Move inward instead.")] = False

    @property
    def done(self) -> str:
        return f"offset {'inward' if self.inward else 'outward'} by {worded(self.distance)}"

    @property
    def quiet(self) -> str:
        return "unchanged"
