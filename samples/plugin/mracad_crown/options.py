"""The options of the edit; nothing here loads numpy, so that ``mracad --help`` stays quick."""

from __future__ import annotations

from typing import Annotated, ClassVar

from msgspec import Meta

from mracad.spec.quantity import Length
from mracad.spec.steps import Fitting
from mracad.spec.steps.base import Edges


class Crown(Fitting, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Raise NURBS faces towards their middles; their edges stay."""

    function: ClassVar[str] = "mracad_crown.edit:crown"

    height: Annotated[Length, Meta(description="How far the middles rise, outward.")]
    edges: Edges = "frozen"

    @property
    def done(self) -> str:
        return f"crowned by {self.height}"

    @property
    def quiet(self) -> str:
        return "unchanged: amount 0"
