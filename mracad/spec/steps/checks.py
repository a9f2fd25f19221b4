"""Options of checks and comparisons."""

from __future__ import annotations

from typing import Annotated, ClassVar, Literal

from msgspec import Meta

from mracad.spec.files import CountText, File
from mracad.spec.quantity import Angle, Length, Share, Time
from mracad.spec.steps.base import Options


class Check(Options, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Check validity and continuity; a failure stops a recipe, with exit code 1."""

    function: ClassVar[str] = "mracad.job.check:check"
    example: ClassVar[str] = "mracad check part.step --max-gap 0.01mm --junit check.xml"

    max_gap: Annotated[Length | None, Meta(description="Largest gap along any seam.")] = None
    max_angle: Annotated[
        Annotated[Angle, Meta(ge=0.0)] | None,
        Meta(description="Largest angle (degrees) along seams that are meant to be smooth."),
    ] = None
    kink: Annotated[Angle, Meta(description="Seams with a smaller angle (degrees) are meant to be smooth.", ge=0.0)] = (
        1.0
    )
    expect: Annotated[
        CountText | None,
        Meta(
            description="Expected number of smooth seams: a number, or the report (JSON) of an earlier check or edit."
        ),
    ] = None
    max_tolerance: Annotated[Length | None, Meta(description="Largest tolerance of edges and vertices.")] = None
    min_wall: Annotated[Length | None, Meta(description="Smallest wall thickness of solids.")] = None
    layer_limit: Annotated[
        Annotated[Time, Meta(gt=0.0)] | None,
        Meta(description="Time limit of each layer (90s, 2min); a layer that exceeds it gives no result."),
    ] = None
    fail_on: Annotated[
        tuple[
            Literal["invalid", "unknown", "free-edges", "unsewn", "file", "self-intersection", "mesh", "nothing"], ...
        ],
        Meta(description="What fails the check, besides the limits; repeatable."),
    ] = ("invalid",)


class Compare(Options, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Compare with a reference; a difference beyond its limit stops a recipe, with exit code 1."""

    function: ClassVar[str] = "mracad.job.compare:compare"
    example: ClassVar[str] = "mracad compare old.step new.step --max-deviation 0.05mm"

    reference: Annotated[File | None, Meta(description="File to compare with; by default the input of the recipe.")] = (
        None
    )
    reference_unit: Annotated[
        str | None,
        Meta(description="Length unit of the reference, if it states the wrong one: mm, m, in …"),
    ] = None
    max_deviation: Annotated[
        Length, Meta(description="Largest distance between matched faces and between their outlines.")
    ] = "1e-6mm"
    max_gap_growth: Annotated[Length | None, Meta(description="Largest growth of the gap of any seam.")] = None
    max_angle_growth: Annotated[
        Annotated[Angle, Meta(ge=0.0)] | None,
        Meta(description="Largest growth of the angle (degrees) of any seam."),
    ] = None
    max_volume_change: Annotated[
        Annotated[Share, Meta(ge=0.0)] | None, Meta(description="Largest change of the volume (percent).")
    ] = None
    ignore: Annotated[
        tuple[
            Literal[
                "faces", "deviation", "seams", "topology", "validity", "size", "assembly", "names", "colours",
                "layers", "materials", "annotations",
            ],
            ...,
        ],
        Meta(description="What to leave out of the comparison; repeatable."),
    ] = ()  # fmt: skip
