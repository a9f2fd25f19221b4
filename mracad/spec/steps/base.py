"""Common base of the options of all steps."""

from __future__ import annotations

import typing
from collections.abc import Mapping
from typing import Annotated, Any, ClassVar, Literal

from msgspec import Meta, Struct, structs

from mracad.spec.fields import Begins, fields

Edges = Annotated[
    Literal["coupled", "frozen"],
    Meta(
        description="Edges between two edited faces: coupled lets them move, as smooth as before where possible; "
        "frozen keeps them in place."
    ),
]
"""The type of ``edges`` for edits whose edges do not slide."""

_Faces = Annotated[str, Begins(("#", "!#", "type:bspline", "colour:#", "near:", "cq:"))]
_Held = Annotated[str, Begins(("#", "edge#", "type:bspline", "colour:#", "near:", "box:", "radius<", "cq:"))]


class Options(Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Options of a step.

    Attributes
    ----------
    function : str
        The function that does the step, ``"module:function"``.
    example : str
        A call of its command.
    about : str
        What the options that a class adds for its subclasses are about, as a title.
    """

    function: ClassVar[str]
    example: ClassVar[str] = ""
    about: ClassVar[str] = ""

    def __post_init__(self) -> None:
        for name, field in fields(type(self)).items():
            field.check(getattr(self, name))

    def given(self) -> dict[str, Any]:
        """The options that differ from their defaults, by name."""
        every = ((name, getattr(self, name), field.default) for name, field in fields(type(self)).items())
        return {name: value for name, value, default in every if value != default}

    def files(self) -> tuple[str, ...]:
        """Files that the options name besides the model; the result depends on them too."""
        texts = ((field.naming, text) for field in fields(type(self)).values() for text in self._texts(field.name))
        return tuple(file for naming, text in texts if naming and (file := naming.file(text)))

    def relocated(self, files: Mapping[str, str]) -> typing.Self:
        """The options with the files that they name replaced by others."""
        changed: dict[str, Any] = {}
        for name, field in fields(type(self)).items():
            if field.naming:
                texts = tuple(field.naming.renamed(text, files) for text in self._texts(name))
                changed[name] = texts if field.many else next(iter(texts), None)
        return structs.replace(self, **changed)

    def _texts(self, name: str) -> tuple[Any, ...]:
        """The value or values of a field."""
        value = getattr(self, name)
        return value if isinstance(value, tuple) else () if value is None else (value,)


class Selection(Options, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Which faces an edit may touch and how their edges are treated; shared by every edit."""

    about: ClassVar[str] = "Faces and edges"

    faces: Annotated[
        tuple[_Faces, ...],
        Meta(
            description="Faces to edit: #3, a product or face name, type:bspline, colour:#ff0000, near:X,Y,Z, "
            "cq:'>Z'; !SEL excludes. Default: all NURBS faces."
        ),
    ] = ()
    instance: Annotated[
        str | None,
        Meta(
            description="Edit only one instance of a shared part, such as plate/bolt#2 (see info --all); it becomes "
            "a separate part. Default: edit the part everywhere."
        ),
    ] = None
    hold: Annotated[
        tuple[_Held, ...],
        Meta(
            description="Faces and edges (edge#4) that must not move, by the selectors of --faces; or regions: "
            "near:X,Y,Z,radius:R, box:X,Y,Z,X,Y,Z, or 'radius<25mm', where faces bend more tightly."
        ),
    ] = ()
    keep: Annotated[
        Literal["as-is", "g0", "g1", "g2"],
        Meta(
            description="Continuity to keep along edges: as-is keeps what each edge has; g0 position, g1 tangent "
            "plane, g2 curvature."
        ),
    ] = "as-is"
    edges: Annotated[
        Literal["coupled", "slide", "frozen"],
        Meta(
            description="Edges between two edited faces: coupled lets them move, as smooth as before where possible; "
            "frozen keeps them in place."
        ),
    ] = "coupled"

    @property
    def done(self) -> str:
        """What reports say of an edited face, ``"smoothed at 5mm"``."""
        raise NotImplementedError

    @property
    def quiet(self) -> str:
        """What reports say of an unchanged face, ``"already fair at 5mm"``."""
        raise NotImplementedError

    def models(self) -> tuple[str, ...]:
        """Other files whose models the edit needs."""
        return ()
