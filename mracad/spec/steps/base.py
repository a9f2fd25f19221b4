"""What the options of every step have in common."""

from __future__ import annotations

import types
import typing
from collections.abc import Mapping
from functools import cache
from typing import Annotated, Any, ClassVar, Literal

from msgspec import Meta, Struct, structs

from mracad.spec.files import namings
from mracad.spec.quantity import Length, length


def dashed(name: str) -> str:
    """An option's name as on the command line; one that is a word of Python ends in _ there."""
    return name.rstrip("_").replace("_", "-")


@cache
def lengths(struct: type[Struct]) -> frozenset[str]:
    """The fields of a struct that hold a length."""
    return frozenset(name for name, kind in plain_types(struct).items() if kind is Length)


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
