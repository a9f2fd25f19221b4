"""Options of edits that change whole faces."""

from __future__ import annotations

from typing import Annotated, ClassVar, Literal

from msgspec import Meta

from mracad.errors import UsageError
from mracad.spec import places
from mracad.spec.quantity import Angle, Length, Share
from mracad.spec.steps.base import Selection


class Fitting(Selection, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """How an edit that changes whole faces goes about it."""

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
            description="Where a face has too few control points for the edit: auto inserts knots, without changing "
            "the face's shape; never uses only its own."
        ),
    ] = "auto"
    amount: Annotated[
        float,
        Meta(description="How much of the edit to apply: 1 is all of it, 0 none.", ge=0.0, le=1.0),
    ] = 1.0
    max_deviation: Annotated[
        Length | None,
        Meta(description="Largest deviation along the normal; where an edit would exceed it, it is scaled back."),
    ] = None


class Fairing(Fitting, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """How an edit that makes faces fairer goes about it."""

    edges: Annotated[
        Literal["coupled", "slide", "frozen"],
        Meta(
            description="Edges between two edited faces: coupled lets them move, as smooth as before where possible; "
            "frozen keeps them in place; slide also lets sharp edges move along a plane, cylinder, cone, sphere, torus "
            "or NURBS face that stays."
        ),
    ] = "coupled"

    free_edges: Annotated[
        Literal["hold", "smooth"],
        Meta(
            description="Edges of one face alone: hold, they stay; smooth, they move with their face, but for the "
            "corners between two of them."
        ),
    ] = "hold"
    corners: Annotated[
        Literal["hold", "move"],
        Meta(description="Corners between two free edges that move: hold, they stay; move, they move along."),
    ] = "hold"

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.corners == "move" and self.free_edges == "hold":
            raise UsageError("corners: they stay where free edges do", "add --free-edges smooth", "corners")


class Smooth(Fairing, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Remove detail finer than a scale from the NURBS faces of a model."""

    function: ClassVar[str] = "mracad.edit.smooth:smooth"

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
            description="Scale across the direction of --along: --scale then counts along it. Waves along a blade go, "
            "its profile stays."
        ),
    ] = None
    along: Annotated[
        Annotated[str, places.heading] | None,
        Meta(
            description="Direction in which --scale counts, with --across: X, Y, Z, edge#4, or the face's u or v. "
            "Default: the one in which each face is longer."
        ),
    ] = None
    limit_by_curvature: Annotated[
        bool,
        Meta(
            description="Where a face bends with a radius too small for the scale (noses, fillets), the wavelength "
            "follows the radius, and the round stays."
        ),
    ] = True
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
        if self.level is not None:
            return f"level {self.level:g}"
        if self.scale is None:
            return f"the largest scale within {self.max_deviation}"
        return f"{self.scale} and {self.across} across" if self.across else self.scale

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
            raise UsageError("smooth needs a scale, a level or a bound of the deviation", hint)
        if self.amount < 1.0:
            raise UsageError("amount: a bound alone is reached by the scale", "leave it out, or give --scale", "amount")


class Denoise(Fairing, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Take the noise from the NURBS faces of a model and leave their shape: no scale to choose."""

    function: ClassVar[str] = "mracad.edit.denoise:denoise"

    noise: Annotated[
        Length | None,
        Meta(
            description="Standard deviation of each coordinate of the control points (a length); by default it is "
            "measured, face by face."
        ),
    ] = None
    method: Annotated[
        Literal["wiener", "spline"],
        Meta(
            description="wiener: shrink details in wavelet space about a smoothing spline, or take the spline alone "
            "where that is expected to be nearer; spline: a smoothing spline, its wavelengths by cross-validation."
        ),
    ] = "wiener"
    strength: Annotated[
        float,
        Meta(description="What the noise counts for, times what it is: above 1 more is taken.", gt=0.0, le=10.0),
    ] = 1.0

    outliers: Annotated[
        Annotated[Share, Meta(ge=0.0, le=10.0)],
        Meta(
            description="Share of the control points that may be wrong (0.5%): those farther off than noise explains "
            "go where the others put them."
        ),
    ] = 0.0

    @property
    def done(self) -> str:
        return "denoised"

    @property
    def quiet(self) -> str:
        return "without noise that can be told from shape" if self.amount else "left as they are: amount 0"


class OffsetFaces(Fitting, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Move NURBS faces along their normals by a length, with the seams between them and their free edges."""

    function: ClassVar[str] = "mracad.edit.offset:offset"

    distance: Annotated[Length, Meta(description="How far outward (a length).")]
    edges: Annotated[
        Literal["coupled", "frozen"],
        Meta(
            description="Edges between two edited faces: coupled lets them move, as smooth as before where possible; "
            "frozen keeps them in place."
        ),
    ] = "coupled"
    inward: Annotated[bool, Meta(description="Move them inward instead.")] = False

    @property
    def done(self) -> str:
        return f"offset {'inward' if self.inward else 'outward'} by {self.distance}"

    @property
    def quiet(self) -> str:
        return "left as they are"
