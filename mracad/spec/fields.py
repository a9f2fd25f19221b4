"""Fields of structs of options, as they are declared: what they take, how that is read, where it names files."""

from __future__ import annotations

import math
import re
import types
import typing
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from functools import cache
from typing import Annotated, Any, Literal

import msgspec
from msgspec import Meta, Struct, structs

from mracad.errors import UsageError
from mracad.spec.files import Naming
from mracad.spec.quantity import LENGTH, NUMBER, Kind

_NOUNS = {float: "a number", int: "a whole number", bool: "true or false", str: "a text"}


def dashed(name: str) -> str:
    """An option's name as on the command line; one that is a word of Python ends in _ there."""
    return name.rstrip("_").replace("_", "-")


def nearest(word: str, known: Iterable[str], otherwise: str = "") -> str:
    """``did you mean 'scale'?``, or what else to do."""
    import difflib

    names = list(known)
    near = difflib.get_close_matches(word, names, n=1)
    return f"did you mean {near[0]!r}?" if near else otherwise or "use one of " + ", ".join(names)


@dataclass(frozen=True)
class Begins:
    """How the texts of a field may begin, or be, for completion in shells; some only where something is edited."""

    texts: tuple[str, ...]
    edited: tuple[str, ...] = ()


@dataclass(frozen=True)
class Field:
    """A field of a struct of options.

    Attributes
    ----------
    owner : str
        The command whose option it is.
    name : str
    type : type
        Of the value, or of each of ``many``: a plain type or a ``Literal``; it may be None, too, where that is the
        default.
    many : bool
    default : object
        ``msgspec.NODEFAULT`` where a value must be given.
    help : str
    quantity : Kind or None
    naming : Naming or None
        How it names a file.
    bounds : tuple of Meta
    form : callable or None
        ``form(text, name)`` reads its texts, or raises UsageError.
    begins : Begins
    section : str
        What it is about, as a title in the help; ``""`` if its step alone has it.
    """

    owner: str
    name: str
    type: Any
    many: bool
    default: Any
    help: str
    quantity: Kind | None
    naming: Naming | None
    bounds: tuple[Meta, ...]
    form: Callable[[str, str], object] | None
    begins: Begins
    section: str

    @property
    def hint(self) -> str:
        """Where to read what it takes."""
        return f"see mracad {self.owner} --help"

    @property
    def choices(self) -> tuple[str, ...]:
        """The values that it takes; empty where they cannot be listed."""
        return typing.get_args(self.type) if typing.get_origin(self.type) is Literal else ()

    def read(self, value: Any) -> Any:
        """The value as the struct holds it, from a text or another plain value; raises UsageError."""
        if not self.many:
            return self.one(value)
        return tuple(map(self.one, value if isinstance(value, list | tuple) else [value]))

    def one(self, value: Any) -> Any:
        """The same for one of many."""
        name = dashed(self.name)
        if self.quantity and isinstance(value, int | float) and not isinstance(value, bool):
            value = str(value) if self.type is str else float(value)
        elif self.quantity and self.type is float and isinstance(value, str):
            value = self.quantity.read(value, name)
        elif self.choices and value not in self.choices:
            hint = nearest(str(value), self.choices, "use one of " + ", ".join(self.choices))
            raise UsageError(f"{name}: {value!r} is not known", hint)
        elif self.type is float and isinstance(value, str) and re.fullmatch(NUMBER, value):  # also .5, 5. and +5
            value = float(value)
        try:
            found = msgspec.convert(value, self.type, strict=False)
        except msgspec.ValidationError as error:
            noun = self.quantity.noun if self.quantity else _NOUNS[self.type]
            raise UsageError(f"{name}: {value!r} is not {noun}", self.hint) from error
        self.check(found)
        return found

    def check(self, value: Any) -> None:
        """Raise UsageError for a value out of bounds, and for a text that is not what it should be."""
        name = dashed(self.name)
        if value is None and self.default is msgspec.NODEFAULT:
            raise UsageError(f"{name}: a value is missing", self.hint, name)
        if isinstance(value, tuple):
            for member in value:
                self.check(member)
        elif self.quantity is LENGTH and value is not None:
            LENGTH.read(value, name, 1.0)
        elif self.form and value is not None:
            self.form(value, name)
        elif isinstance(value, int | float) and not self._within(value):
            span = " and ".join(map(_span, self.bounds)) or "a finite number"
            raise UsageError(f"{name}: {value:g} is not {span}", self.hint)

    def _within(self, value: float) -> bool:
        limit = any(meta.ge is not None for meta in self.bounds)
        return (math.isfinite(value) or (limit and value > 0)) and all(
            (meta.gt is None or value > meta.gt)
            and (meta.ge is None or value >= meta.ge)
            and (meta.le is None or value <= meta.le)
            for meta in self.bounds
        )


def _span(meta: Meta) -> str:
    if meta.ge is not None and meta.le is not None:
        return f"between {meta.ge:g} and {meta.le:g}"
    return f"greater than {meta.gt or 'zero'}" if meta.gt is not None else f"{meta.ge:g} or more"


def named(known: Mapping[str, Field], key: str) -> Field | None:
    """The field that a key means, written as on the command line or in Python."""
    name = key.replace("-", "_")
    return known.get(name) or known.get(f"{name}_")


@cache
def fields(struct: type[Struct]) -> dict[str, Field]:
    """The fields of a struct by name, in its order."""
    hints = typing.get_type_hints(struct, include_extras=True)
    named = getattr(struct, "command", "") or getattr(struct, "function", "").partition(":")[2]
    owner = named or struct.__name__.lower()
    return {
        field.name: _field(owner, _section(struct, field.name), field, hints[field.name])
        for field in structs.fields(struct)
    }


def _section(struct: type[Struct], name: str) -> str:
    """The section of the class that first declares a field, where it is not the struct itself."""
    first = next(base for base in reversed(struct.__mro__) if name in vars(base).get("__annotations__", ()))
    return "" if first is struct else str(vars(first).get("about", ""))


def _field(owner: str, section: str, field: structs.FieldInfo, hint: Any) -> Field:
    notes: list[Any] = []
    many = False
    while True:
        origin = typing.get_origin(hint)
        if origin is Annotated:
            notes += hint.__metadata__
            hint = hint.__origin__
        elif origin in (types.UnionType, typing.Union):
            hint = next(member for member in typing.get_args(hint) if member is not type(None))
        elif origin is tuple:
            many, hint = True, typing.get_args(hint)[0]
        else:
            break
    metas = [note for note in notes if isinstance(note, Meta)]
    return Field(
        owner,
        field.name,
        hint,
        many,
        field.default,
        next((meta.description for meta in metas if meta.description), ""),
        next((note for note in notes if isinstance(note, Kind)), None),
        next((note for note in notes if isinstance(note, Naming)), None),
        tuple(meta for meta in metas if (meta.gt, meta.ge, meta.le) != (None, None, None)),
        next((note for note in notes if callable(note)), None),
        next((note for note in notes if isinstance(note, Begins)), Begins(())),
        section,
    )
