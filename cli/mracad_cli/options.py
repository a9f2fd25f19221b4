"""Options that commands share, and options made from the structs of :mod:`mracad.options`."""

from __future__ import annotations

import types
import typing
from collections.abc import Callable
from typing import Any, Literal

import click
from msgspec import Meta, Struct, structs

from mracad.errors import UsageError

Command = Callable[..., Any]

SHORT = {
    "max_deviation": "LENGTH",
    "scale": "LENGTH",
    "faces": "SEL",
    "hold": "SEL",
    "fit_g1": "DEG",
    "gap_tolerance": "LENGTH",
}
"""Placeholders in the help."""


def of(struct: type[Struct]) -> Callable[[Command], Command]:
    """Add one option for each field of a struct, its own before the inherited ones, under the same names."""

    def decorate(command: Command) -> Command:
        hints = typing.get_type_hints(struct, include_extras=True)
        base = struct.__base__
        shared = len(structs.fields(base)) if base is not None and base is not Struct else 0
        fields = structs.fields(struct)
        for field in reversed(fields[shared:] + fields[:shared]):
            command = _option(field.name, hints[field.name], field.default)(command)
        return command

    return decorate


def _option(name: str, hint: Any, default: Any) -> Callable[[Command], Command]:
    kind, meta = hint.__origin__, next(m for m in hint.__metadata__ if isinstance(m, Meta))
    members = [t for t in typing.get_args(kind) if t is not type(None)] if isinstance(kind, types.UnionType) else []
    if members:
        kind = members[0]
    flag = f"--{name.replace('_', '-')}"
    settings: dict[str, Any] = {"help": meta.description, "default": default, "metavar": SHORT.get(name)}
    if kind is bool:
        return click.option(flag, is_flag=True, help=meta.description, default=default)
    if typing.get_origin(kind) is tuple:
        return click.option(flag, type=str, multiple=True, metavar=SHORT.get(name), help=meta.description)
    if typing.get_origin(kind) is Literal:
        settings |= {"type": click.Choice(typing.get_args(kind)), "show_default": True}
    else:
        settings |= {"type": kind, "show_default": default is not None}
    return click.option(flag, **settings)


def apply(*decorators: Callable[[Command], Command]) -> Callable[[Command], Command]:
    """Several option decorators as one, in the order of the help."""

    def decorate(command: Command) -> Command:
        for decorator in reversed(decorators):
            command = decorator(command)
        return command

    return decorate


source = click.argument("source", metavar="IN", type=click.Path(allow_dash=True))
outputs = click.option(
    "-o",
    "--output",
    "outputs",
    metavar="OUT",
    multiple=True,
    required=True,
    type=click.Path(allow_dash=True),
    help="File to write; its ending says the format (.step .stp .stl); repeatable; - for STEP on standard output.",
)
input_unit = click.option(
    "--input-unit",
    metavar="UNIT",
    help="Length unit of the numbers in IN, where the file names a wrong one: mm, m, in …",
)
schema = click.option(
    "--schema",
    type=click.Choice(["AP203", "AP214", "AP242"], case_sensitive=False),
    default="AP214",
    show_default=True,
    help="STEP schema to write.",
)
chord = click.option(
    "--chord",
    metavar="LENGTH",
    default="0.02%",
    show_default=True,
    help="STL: largest distance of triangles from the surface.",
)
angle = click.option(
    "--angle",
    type=float,
    default=12.0,
    show_default=True,
    metavar="DEG",
    help="STL: largest turn along a triangle's edge.",
)
ascii_stl = click.option("--ascii", "ascii_stl", is_flag=True, help="STL: write text instead of binary.")
overwrite = click.option("--overwrite", is_flag=True, help="Replace an existing output.")
as_json = click.option("--json", "as_json", is_flag=True, help="Print the result as JSON.")
debug = click.option("--debug", is_flag=True, expose_value=False, help="Show the traceback of an error.")

limiting = apply(
    click.option(
        "--time-limit",
        metavar="SECONDS",
        expose_value=False,
        help="End the command after this time: exit code 5.",
    ),
    click.option(
        "--memory-limit", metavar="SIZE", expose_value=False, help="Memory that the command may hold: 500MB, 2GB."
    ),
)
reading = apply(source, input_unit)
writing = apply(outputs, schema, chord, angle, ascii_stl, overwrite)
printing = apply(as_json, limiting, debug)
reports = apply(
    click.option("--junit", metavar="F.xml", type=click.Path(), help="Write the verdict as JUnit, a case a layer."),
    click.option("--sarif", metavar="F.sarif", type=click.Path(), help="Write the findings as SARIF."),
    click.option("--overwrite", is_flag=True, help="Replace existing reports."),
)
editing = apply(
    click.option("--report", metavar="F.json", type=click.Path(), help="Write the full report (JSON) to a file."),
    click.option("--dry-run", is_flag=True, help="Say what would be done; write nothing but the report."),
)


def limits(arguments: list[str]) -> tuple[float | None, int | None]:
    """Seconds and bytes that ``--time-limit`` and ``--memory-limit`` allow: needed before the command itself runs."""
    from mracad.guard import size

    time, memory = (_given(arguments, flag) for flag in ("--time-limit", "--memory-limit"))
    if time is None:
        return None, None if memory is None else size(memory)
    try:
        seconds = float(time)
    except ValueError:
        seconds = 0.0
    if not 0 < seconds < float("inf"):
        raise UsageError(f"time-limit: {time!r} is not a time", "give seconds, greater than zero")
    return seconds, None if memory is None else size(memory)


def _given(arguments: list[str], flag: str) -> str | None:
    """The last value of an option."""
    value = None
    for i, word in enumerate(arguments):
        if word == flag and i + 1 < len(arguments):
            value = arguments[i + 1]
        elif word.startswith(flag + "="):
            value = word.partition("=")[2]
    return value
