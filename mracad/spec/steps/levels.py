"""Options of edits that separate and restore levels of detail."""

from __future__ import annotations

from typing import Annotated, ClassVar

from msgspec import Meta

from mracad.errors import UsageError
from mracad.spec.files import File
from mracad.spec.quantity import Length, worded
from mracad.spec.steps.base import Edges
from mracad.spec.steps.smooth import Fitting


class Shaped(Fitting, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Options of edits that change a whole shape, including its free edges."""

    edges: Edges = "coupled"


class Level(Shaped, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Reduce the NURBS faces of a model to a level: the coarse shape that they form together, without its details."""

    function: ClassVar[str] = "mracad.edit.level:level"
    example: ClassVar[str] = "mracad level part.step --scale 20mm -o coarse.step --details part.mra"

    level: Annotated[
        Annotated[float, Meta(gt=0.0)] | None,
        Meta(
            description="How many levels of the faces' own knot ladders to remove; 2.5 is halfway between two and "
            "three."
        ),
    ] = None
    scale: Annotated[
        Length | None,
        Meta(
            description="Instead of --level: a wavelength (5mm, or 2% of the model's diagonal). Knots are then half to "
            "one wavelength apart."
        ),
    ] = None

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.level is None and self.scale is None:
            raise UsageError("level needs a level or a scale", "give --level 2.5 or --scale 5mm")
        if self.level is not None and self.scale is not None:
            raise UsageError("level takes a level or a scale, not both", "leave out --level or --scale")

    @property
    def done(self) -> str:
        return f"reduced to {worded(self.scale or '')}" if self.level is None else f"reduced to level {self.level:g}"

    @property
    def quiet(self) -> str:
        return "without detail to remove" if self.amount else "unchanged: amount 0"


class Compose(Shaped, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Put the details that mracad level saved back on the coarse model, or on one that was edited since."""

    function: ClassVar[str] = "mracad.edit.compose:compose"
    example: ClassVar[str] = "mracad compose coarse.step part.mra -o whole.step"

    details: Annotated[File, Meta(description="File with the details (.mra).")]

    @property
    def done(self) -> str:
        return "given their details"

    @property
    def quiet(self) -> str:
        return "without details" if self.amount else "unchanged: amount 0"
