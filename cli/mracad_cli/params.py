"""Kinds of options: how their texts are read, completed by shells and grouped in the help."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from mracad.spec.fields import Field, dashed
from mracad.spec.quantity import ANGLE, LENGTH, MEMORY, TIME, Kind
from mracad.store import is_url

if TYPE_CHECKING:
    from click.shell_completion import CompletionItem

Command = Callable[..., Any]

SHORT = {LENGTH: "LENGTH", ANGLE: "DEG", TIME: "TIME", MEMORY: "SIZE"}
"""Placeholders of quantities in the help."""


class Title(StrEnum):
    """Titles under which the help lists options, in its order; those of structs of options come before."""

    INPUT = "Input"
    OUTPUT = "Output"
    MESHES = "Meshes"
    PICTURES = "Pictures"
    REPORTS = "Reports"
    RUNNING = "Running"


class Option(click.Option):
    """An option with the title under which the help lists it, ``""`` for those of a command alone; the help tells where
    its default was set."""

    section = ""

    def get_help_record(self, ctx: click.Context) -> tuple[str, str] | None:
        record = super().get_help_record(ctx)
        default = ctx.meta.get("mracad.defaults", {}).get(self.name)
        if record is None or default is None:
            return record
        return record[0], f"{record[1]}  [{default.place}: {default.text}]"


def option(*names: str, **how: Any) -> Callable[[Command], Command]:
    """A decorator that adds an :class:`Option`."""
    return click.option(*names, cls=Option, **how)


def apply(*decorators: Callable[[Command], Command]) -> Callable[[Command], Command]:
    """Several option decorators as one, in the order of the help."""

    def decorate(command: Command) -> Command:
        for decorator in reversed(decorators):
            command = decorator(command)
        return command

    return decorate


def section(title: str, *decorators: Callable[[Command], Command]) -> Callable[[Command], Command]:
    """Several option decorators as one, whose options the help lists under a title unless they have one."""

    def decorate(command: Command) -> Command:
        had = len(getattr(command, "__click_params__", ()))
        command = apply(*decorators)(command)
        for param in getattr(command, "__click_params__", ())[had:]:
            if isinstance(param, Option):
                param.section = param.section or title
        return command

    return decorate


class Quantity(click.ParamType):
    """A quantity, converted to its value; a length stays text, because it may be a share of the model."""

    def __init__(self, kind: Kind) -> None:
        self.kind, self.name = kind, SHORT.get(kind, "")

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        if not isinstance(value, str):
            return value
        found = self.kind.read(value, dashed(param.name or "") if param else "", 1.0 if self.kind is LENGTH else None)
        return value if self.kind is LENGTH else found


def items(texts: Iterable[str]) -> list[CompletionItem[str]]:
    """Texts as completions."""
    from click.shell_completion import CompletionItem

    return [CompletionItem(text) for text in texts]


class File(click.Path):
    """A path; shells complete folders, and files with one of the extensions (all files where none is given).

    Parameters
    ----------
    extensions : iterable of str
        With the dot, in lower case.
    dash : bool
        Whether ``-`` stands for standard input or output.
    """

    def __init__(self, extensions: Iterable[str] = (), dash: bool = False) -> None:
        super().__init__(allow_dash=dash)
        self.extensions = tuple(extensions)

    def shell_complete(self, ctx: click.Context, param: click.Parameter, incomplete: str) -> list[CompletionItem[str]]:
        return items(paths(incomplete, self.extensions))


class Folder(File):
    """The path of a folder."""

    def shell_complete(self, ctx: click.Context, param: click.Parameter, incomplete: str) -> list[CompletionItem[str]]:
        return items(paths(incomplete, None))


def paths(start: str, extensions: tuple[str, ...] | None) -> list[str]:
    """Paths that begin with a text: folders, which end in a slash, and files with one of the extensions."""
    folder, _, begun = start.rpartition("/")
    root = f"{folder}/" if "/" in start else ""
    found = []
    try:
        with os.scandir(Path(root).expanduser() if root else ".") as entries:
            for entry in entries:
                if entry.name.startswith(begun) and (begun or not entry.name.startswith(".")):
                    if entry.is_dir():
                        found.append(f"{root}{entry.name}/")
                    elif extensions is not None and entry.name.lower().endswith(extensions or ""):
                        found.append(f"{root}{entry.name}")
    except OSError:
        return []
    return sorted(found)


class Declared(click.ParamType):
    """The value of a field of a struct of options."""

    def __init__(self, field: Field) -> None:
        self.field, self.name = field, "text"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        return self.field.one(value)

    def shell_complete(self, ctx: click.Context, param: click.Parameter, incomplete: str) -> list[CompletionItem[str]]:
        begins = self.field.begins
        kept = () if getattr(ctx.command, "edits", True) else begins.edited
        found = [text for text in begins.texts if text.startswith(incomplete) and text not in kept]
        naming = self.field.naming
        if naming and incomplete.startswith(naming.prefix):
            ending = (naming.ending,) if isinstance(naming.ending, str) else naming.ending
            found += [naming.prefix + path for path in paths(incomplete.removeprefix(naming.prefix), ending)]
        return items(found)


def relocated(kind: click.ParamType, text: str, folder: str) -> str:
    """The text of an option with a relative path in it taken from a folder."""
    if isinstance(kind, File):
        return text if text == "-" or is_url(text) else os.path.normpath(os.path.join(folder, text))
    if isinstance(kind, Declared) and (naming := kind.field.naming) and (file := naming.file(text)):
        return naming.renamed(text, {file: os.path.normpath(os.path.join(folder, file))})
    return text
