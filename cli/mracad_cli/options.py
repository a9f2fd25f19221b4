"""Options that commands share, and options made from the structs of :mod:`mracad.spec.steps`."""

from __future__ import annotations

import typing
from collections.abc import Callable
from typing import Any, Literal

import click
from msgspec import Meta, Struct, structs

from mracad.formats import FORMATS
from mracad.spec.quantity import Length, duration
from mracad.spec.steps.base import dashed, plain_types

Command = Callable[..., Any]

SHORT = {"faces": "SEL", "instance": "PATH", "hold": "SEL", "max_angle": "DEG", "kink": "DEG", "fit_g1": "DEG"}
"""Placeholders in the help."""


def of(struct: type[Struct], without: str = "") -> Callable[[Command], Command]:
    """Add one option for each field of a struct, its own before the inherited ones, under the same names; not for
    those whose names stand, between blanks, in ``without``."""

    def decorate(command: Command) -> Command:
        hints, kinds = typing.get_type_hints(struct, include_extras=True), plain_types(struct)
        base = struct.__base__
        shared = len(structs.fields(base)) if base is not None and base is not Struct else 0
        fields = structs.fields(struct)
        for field in reversed(fields[shared:] + fields[:shared]):
            if field.name in without.split():
                continue
            meta = next(m for m in hints[field.name].__metadata__ if isinstance(m, Meta) and m.description)
            command = _option(field.name, meta.description or "", kinds[field.name], field.default)(command)
        return command

    return decorate


def _option(name: str, help: str, kind: Any, default: Any) -> Callable[[Command], Command]:
    flag = f"--{dashed(name)}"
    settings: dict[str, Any] = {"help": help, "metavar": SHORT.get(name), "default": default}
    if kind is bool:
        return click.option(name, flag, is_flag=True, help=help, default=default)
    if kind is Length:
        settings |= {"metavar": "LENGTH"}
    if typing.get_origin(kind) is tuple:
        settings |= {"multiple": True}
        kind = typing.get_args(kind)[0]
    if typing.get_origin(kind) is Literal:
        settings |= {"type": click.Choice(typing.get_args(kind))}
    else:
        settings |= {"type": kind if kind in (int, float) else str}
    return click.option(name, flag, **settings, show_default=default not in (None, (), ""))


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
    type=click.Path(allow_dash=True),
    help="File to write; its ending says the format (" + " ".join(f.endings[0] for f in FORMATS.values()) + "); "
    "repeatable; - for standard output.",
)
input_unit = click.option(
    "--input-unit",
    metavar="UNIT",
    help="Length unit of the file's numbers, where it names a wrong one: mm, m, in …",
)
encoding = click.option(
    "--encoding",
    metavar="NAME",
    help="Character set of the file's texts: utf-8, gb18030, cp932, latin-1 …  [default: UTF-8 where that fits, else "
    "the most likely one]",
)
format = click.option(
    "--format",
    type=click.Choice(list(FORMATS)),
    default="step",
    show_default=True,
    help="Format of what goes to standard output.",
)
schema = click.option(
    "--schema",
    type=click.Choice(["AP203", "AP214", "AP242"], case_sensitive=False),
    help="STEP schema to write.  [default: AP242 for a file in AP242, else AP214]",
)
chord = click.option(
    "--chord",
    metavar="LENGTH",
    default="0.02%",
    show_default=True,
    help="Meshes: largest distance of triangles from the surface.",
)
angle = click.option(
    "--angle",
    type=float,
    default=12.0,
    show_default=True,
    metavar="DEG",
    help="Meshes: largest turn along a triangle's edge.",
)
ascii_stl = click.option("--ascii", "ascii_stl", is_flag=True, help="STL: write text instead of binary.")
overwrite = click.option("--overwrite", is_flag=True, help="Replace an existing output.")
if_changed = click.option(
    "--if-changed", is_flag=True, help="Replace an existing output only where its content changes, as make likes it."
)
verify = click.option(
    "--verify",
    type=click.Choice(["on", "off"]),
    default="on",
    show_default=True,
    help="Read outputs back before they take their place, and judge them; off: write them as they come.",
)
as_json = click.option("--json", "as_json", is_flag=True, help="Print the result as JSON.")
debug = click.option("--debug", is_flag=True, expose_value=False, help="Show the traceback of an error.")

limiting = apply(
    click.option(
        "--time-limit",
        metavar="TIME",
        expose_value=False,
        help="End the command after this time (90s, 10min): exit code 5.",
    ),
    click.option(
        "--memory-limit", metavar="SIZE", expose_value=False, help="Memory that the command may hold: 500MB, 2GB."
    ),
)
reading = apply(source, input_unit, encoding)
writing = apply(outputs, format, schema, chord, angle, ascii_stl, verify, overwrite, if_changed)
printing = apply(as_json, limiting, debug)
reports = apply(
    click.option("--junit", metavar="F.xml", type=click.Path(), help="Write the verdict as JUnit, a case a layer."),
    click.option("--sarif", metavar="F.sarif", type=click.Path(), help="Write the findings as SARIF."),
    click.option("--overwrite", is_flag=True, help="Replace existing reports."),
)
editing = apply(
    click.option("--report", metavar="F.json", type=click.Path(), help="Write the full report (JSON) to a file."),
    click.option("--depfile", metavar="F.d", type=click.Path(), help="Write what the outputs depend on, for make."),
    click.option("--dry-run", is_flag=True, help="Say what would be done; write nothing but the report."),
)
assignments = click.option(
    "--set",
    "assignments",
    metavar="STEP.OPTION=VALUE",
    multiple=True,
    help="Set an option of a step, named by its id or its command; repeatable.",
)
record = click.option(
    "--record", is_flag=True, help="Write the recipe with all its options and versions beside the output (OUT.toml)."
)


def limits(arguments: list[str]) -> tuple[float | None, int | None]:
    """Seconds and bytes that ``--time-limit`` and ``--memory-limit`` allow: needed before the command itself runs."""
    from mracad.job.guard import size

    time, memory = (_given(arguments, flag) for flag in ("--time-limit", "--memory-limit"))
    seconds = None if time is None else duration(time, "time-limit")
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
