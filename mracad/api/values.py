"""Keywords of Python as the options of a step, and the signatures of functions that take them."""

from __future__ import annotations

import os
import textwrap
from collections.abc import Collection, Iterable, Mapping
from inspect import Parameter, Signature
from numbers import Real
from typing import Any, TypeVar

import msgspec

from mracad.api.speech import explained
from mracad.api.things import Thing
from mracad.errors import UsageError
from mracad.spec.fields import Field, fields, nearest
from mracad.spec.steps.base import Options
from mracad.spec.text import options

Given = TypeVar("Given", bound=Options)

SELECTORS = "faces", "hold", "fit"
"""Options that select faces."""

LONGEST = 90
"""Longest list of choices in the line of a keyword, characters."""


def bound(function: str, taken: Signature, given: Mapping[str, Any], *things: Any) -> None:
    """Raise TypeError for arguments that a function does not take."""
    unknown = next((name for name in given if name not in taken.parameters), None)
    if unknown is not None:
        hint = nearest(unknown, list(taken.parameters)[len(things) :], f"see help(mracad.{function})")
        raise TypeError(f"{function}() has no option {unknown!r}; {hint}")
    try:
        taken.bind(*things, **given)
    except TypeError as error:
        raise TypeError(f"{function}(): {error}") from None


def chosen(struct: type[Given], given: Mapping[str, Any], thing: Thing) -> Given:
    """The options of a step from keywords; those that are None are left out."""
    known = fields(struct)
    values = {name: _plain(known[name], value, thing) for name, value in given.items() if value is not None}
    if "faces" in known and thing.faces:
        values.setdefault("faces", list(thing.faces))
    return options(struct, values)


def _plain(field: Field, value: Any, thing: Thing) -> Any:
    """A value as a recipe would hold it."""
    if field.name in SELECTORS:
        return thing.selectors(value, field.name)
    if isinstance(value, os.PathLike):
        return os.fspath(value)
    row = hasattr(value, "__len__") and not isinstance(value, str)
    if row and _takes_points(field) and all(isinstance(x, Real) for x in value):
        return ",".join(f"{float(x):.17g}" for x in value)
    if row and field.name == "size":
        return "x".join(map(str, value))
    if row and field.many:
        return [_plain(field, each, thing) for each in value]
    return str(value) if field.type is str and isinstance(value, Real) and not isinstance(value, bool) else value


def _takes_points(field: Field) -> bool:
    """Whether the texts of a field may be points or vectors."""
    try:
        return field.form is not None and field.form("0,0,1", field.name) is not None
    except UsageError:
        return False


def parameters(struct: type[Options], without: Collection[str] = ()) -> list[Parameter]:
    """The keywords of a struct, with their types as text: without a default, then its own, then inherited."""
    inherited = fields(struct.__base__) if struct.__base__ is not None and struct.__base__ is not Options else {}
    every = [field for name, field in fields(struct).items() if name not in without]
    ordered = sorted(every, key=lambda field: (field.default is not msgspec.NODEFAULT, field.name in inherited))
    return [
        Parameter(
            field.name,
            Parameter.KEYWORD_ONLY,
            default=Parameter.empty if field.default is msgspec.NODEFAULT else field.default,
            annotation=annotation(field),
        )
        for field in ordered
    ]


def annotation(field: Field) -> str:
    """The type of a keyword, as text."""
    if field.name in SELECTORS:
        return "Faces"
    one = _one(field)
    many = f"{one} | Sequence[{one}]" if field.many else one
    return f"{many} | None" if field.default is None else many


def _one(field: Field) -> str:
    if field.choices:
        return f"Literal[{', '.join(map(repr, field.choices))}]"
    if field.quantity:
        return "Quantity"
    if field.type is not str:
        return str(field.type.__name__)
    if field.naming and not field.form:
        return "Path"
    if field.name == "size":
        return "str | tuple[int, int]"
    return "str | Sequence[float]" if _takes_points(field) else "str"


def described(struct: type[Options], keywords: Iterable[Parameter]) -> str:
    """The description of keywords, in the form of numpydoc."""
    lines = []
    for each in keywords:
        field = fields(struct)[each.name]
        told, kind = explained(field.help), _kind(field)
        if len(kind) > LONGEST:
            told, kind = f"{told}  One of {', '.join(map(repr, field.choices))}.", "str, or sequence of str"
        if each.default not in (Parameter.empty, None, (), ""):
            told = f"{told}  Default: {each.default!r}."
        lines.append(f"{each.name} : {kind}{'' if each.default is Parameter.empty else ', optional'}")
        lines += textwrap.wrap(told, 116, initial_indent="    ", subsequent_indent="    ")
    return "\n".join(lines)


def _kind(field: Field) -> str:
    """The type of a keyword, as numpydoc says it."""
    if field.name in SELECTORS:
        return "selector, index or face, or sequence of these"
    points = field.type is str and _takes_points(field)
    if field.choices:
        one = f"{{{', '.join(map(repr, field.choices))}}}"
    elif field.quantity:
        one = f"{field.quantity.noun.split(maxsplit=1)[1]} (str or float)"
    else:
        one = (
            "str or numbers"
            if points or field.name == "size"
            else "path"
            if _one(field) == "Path"
            else field.type.__name__
        )
    return f"{one}, or sequence of these" if field.many else one
