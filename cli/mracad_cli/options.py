"""Options that commands share, and options made from the structs of :mod:`mracad.spec.steps`; parsed once, by click."""

from __future__ import annotations

import dataclasses
import functools
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any

import click
import msgspec
from msgspec import Struct

from mracad.formats import FORMATS, READABLE
from mracad.spec.fields import Field, dashed, fields
from mracad.spec.pictures import Picture, Scalars
from mracad.spec.quantity import ANGLE, LENGTH
from mracad_cli.params import (
    SHORT,
    Command,
    Declared,
    File,
    Folder,
    Quantity,
    Title,
    apply,
    option,
    section,
)

PAGES = ".html", ".htm"
"""Extensions of pages."""

PICTURES = {field: field for field in fields(Picture)} | {"size": "picture_size"}
"""Options of pictures where models are written, by field: edits have sizes of their own."""

METAVARS = {"faces": "SEL", "instance": "PATH", "hold": "SEL"}
"""Placeholders of other options."""


def of(
    struct: type[Struct],
    name: str,
    without: str = "",
    arguments: Mapping[str, str] = MappingProxyType({}),
    called: Mapping[str, str] = MappingProxyType({}),
) -> Callable[[Command], Command]:
    """Add one option per field of a struct, those of its step alone first; the command gets the struct.

    Parameters
    ----------
    struct : type
    name : str
        Name of the command's parameter.
    without : str
        Fields that get no option, separated by blanks.
    arguments : mapping
        Placeholders of the fields that are arguments.
    called : mapping
        Names of the options of fields that differ from the fields' own.
    """
    known = {name: field for name, field in fields(struct).items() if name not in without.split()}

    def decorate(command: Command) -> Command:
        @functools.wraps(command)
        def collected(*args: Any, **given: Any) -> Any:
            values = {field: given.pop(called.get(field, field)) for field in known}
            return command(*args, **given, **{name: struct(**{k: v for k, v in values.items() if v is not None})})

        placed = [
            click.argument(field, metavar=metavar, type=Declared(known[field])) for field, metavar in arguments.items()
        ]
        given = [field for field in known.values() if field.name not in arguments]
        own = [_option(field, called.get(field.name, field.name)) for field in given if not field.section]
        rest = [_option(field, called.get(field.name, field.name)) for field in given if field.section]
        return apply(*placed, *own, *rest)(collected)

    return decorate


def gathered(name: str, kind: type, *options: Callable[[Command], Command]) -> Callable[[Command], Command]:
    """Options that the command gets as one parameter: a dataclass with a field for each."""

    def decorate(command: Command) -> Command:
        @functools.wraps(command)
        def collected(*args: Any, **given: Any) -> Any:
            own = {field.name: given.pop(field.name) for field in dataclasses.fields(kind) if field.name in given}
            return command(*args, **given, **{name: kind(**own)})

        return apply(*options)(collected)

    return decorate


def _option(field: Field, name: str) -> Callable[[Command], Command]:
    flag, missing = f"--{dashed(name)}", field.default is msgspec.NODEFAULT
    default = None if missing else field.default
    if field.type is bool:
        flag = f"{flag}/--no-{dashed(field.name)}" if default else flag
        made = option(name, flag, is_flag=True, help=field.help, default=default)
        return section(field.section, made)
    kind: Any = click.Choice(field.choices) if field.choices else Declared(field)
    metavar = SHORT.get(field.quantity) if field.quantity else METAVARS.get(field.name)
    if metavar is None and not field.choices:
        metavar = {float: "FLOAT", int: "INTEGER"}.get(field.type, "TEXT")
    shown = default not in (None, (), "")
    known: dict[str, Any] = {"required": True} if missing else {"default": default}  # a default of None counts
    made = option(
        name, flag, help=field.help, metavar=metavar, multiple=field.many, type=kind, show_default=shown, **known
    )
    return section(field.section, made)


@dataclass(frozen=True)
class Reading:
    """How a model is read; ``-`` is standard input."""

    file: str
    input_unit: str | None = None
    encoding: str | None = None


@dataclass(frozen=True)
class Writing:
    """How models are written; ``-`` is standard output."""

    outputs: tuple[str, ...]
    format: str
    schema: str | None
    chord: str
    angle: float
    ascii_stl: bool
    verify: bool
    picture: Picture
    scalars: Scalars
    overwrite: bool
    if_changed: bool


@dataclass(frozen=True)
class Editing:
    """Files that are written beside the models."""

    report: str | None
    report_html: str | None
    depfile: str | None
    dry_run: bool
    as_json: bool
    record: bool = False


@dataclass(frozen=True)
class Reports:
    """Files to which a verdict is written."""

    junit: str | None
    sarif: str | None
    report_html: str | None
    overwrite: bool
    as_json: bool


model = File(READABLE, dash=True)
page = File(PAGES)
recipe = File((".toml",))
data = File((".json",))
junit = File((".xml",))
feature = File((".feature",))
folder = Folder()
input_unit = option(
    "--input-unit",
    metavar="UNIT",
    help="Length unit of the file, if it states the wrong one: mm, m, in …",
)
encoding = option(
    "--encoding",
    metavar="NAME",
    help="Character encoding of the file: utf-8, gb18030, cp932, latin-1 …  [default: UTF-8 if that fits, "
    "else the most likely one]",
)
schema = option(
    "--schema",
    type=click.Choice(["AP203", "AP214", "AP242"], case_sensitive=False),
    help="STEP schema to write.  [default: AP242 for a file in AP242, else AP214]",
)
overwrite = option("--overwrite", is_flag=True, help="Replace an existing output.")
if_changed = option(
    "--if-changed",
    is_flag=True,
    help="Replace an existing output only if its content changes, so that make sees no change.",
)
verify = option(
    "--verify",
    type=click.Choice(["on", "off"]),
    default="on",
    show_default=True,
    callback=lambda ctx, param, value: value == "on",
    help="Read each output back and check it before it is put in place. off: write without checking.",
)
depfile = option("--depfile", metavar="F.d", type=File((".d",)), help="Write what the outputs depend on, for make.")
report_html = option(
    "--report-html", metavar="F.html", type=page, help="Write a report with pictures and the model to turn (HTML)."
)
record = option(
    "--record", is_flag=True, help="Write the recipe with all its options and versions beside the output (OUT.toml)."
)
assignments = option(
    "--set",
    "assignments",
    metavar="STEP.OPTION=VALUE",
    multiple=True,
    help="Set an option of a step, named by its id or its command; repeatable.",
)


def reading(metavar: str = "IN") -> Callable[[Command], Command]:
    """The model that a command reads, as ``reading``."""
    argument = click.argument("file", metavar=metavar, type=model)
    return gathered("reading", Reading, argument, section(Title.INPUT, input_unit, encoding))


_output = option(
    "-o",
    "--output",
    "outputs",
    metavar="OUT",
    multiple=True,
    type=File((extension for format in FORMATS.values() for extension in format.extensions), dash=True),
    help=f"File to write; its extension gives the format ({' '.join(f.extensions[0] for f in FORMATS.values())}); "
    "repeatable; - for standard output.",
)
_format = option(
    "--format",
    type=click.Choice(list(FORMATS)),
    default="step",
    show_default=True,
    help="Format of standard output.",
)
meshes = section(
    Title.MESHES,
    option(
        "--chord",
        type=Quantity(LENGTH),
        default="0.02%",
        show_default=True,
        help="Largest distance between triangles and surface.",
    ),
    option(
        "--angle",
        type=Quantity(ANGLE),
        default=12.0,
        show_default=True,
        help="Largest turn of the normal along a triangle's edge (degrees).",
    ),
    option("--ascii", "ascii_stl", is_flag=True, help="STL: write text instead of binary."),
    of(Scalars, "scalars"),
)
writing = gathered(
    "writing",
    Writing,
    section(Title.OUTPUT, _output, _format, schema, verify, overwrite, if_changed),
    meshes,
    section(Title.PICTURES, of(Picture, "picture", called=PICTURES)),
)
editing = section(
    Title.REPORTS,
    gathered(
        "editing",
        Editing,
        option("--report", metavar="F.json", type=data, help="Write the full report (JSON) to a file."),
        report_html,
        depfile,
        option("--dry-run", is_flag=True, help="Report what would be done; write nothing but the report."),
    ),
)
reports = section(
    Title.REPORTS,
    gathered(
        "reports",
        Reports,
        option("--junit", metavar="F.xml", type=junit, help="Write the verdict as JUnit, one case per layer."),
        option("--sarif", metavar="F.sarif", type=File((".sarif",)), help="Write the findings as SARIF."),
        report_html,
        option("--overwrite", is_flag=True, help="Replace existing reports."),
    ),
)
