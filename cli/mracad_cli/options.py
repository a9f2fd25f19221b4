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
from msgspec import Struct, structs

from mracad.formats import FORMATS
from mracad.spec.fields import Field, dashed, fields
from mracad.spec.pictures import Picture
from mracad.spec.quantity import ANGLE, LENGTH, MEMORY, TIME, Kind

Command = Callable[..., Any]

SHORT = {LENGTH: "LENGTH", ANGLE: "DEG", TIME: "TIME", MEMORY: "SIZE"}
"""Placeholders of quantities in the help."""

PICTURES = {field: field for field in fields(Picture)} | {"size": "picture_size"}
"""Options of pictures where models are written, by field: edits have sizes of their own."""

METAVARS = {"faces": "SEL", "instance": "PATH", "hold": "SEL"}
"""Placeholders of other options."""


class Quantity(click.ParamType):
    """A quantity, converted to its value; a length stays text, because it may be a share of the model."""

    def __init__(self, kind: Kind) -> None:
        self.kind, self.name = kind, SHORT.get(kind, "")

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        if not isinstance(value, str):
            return value
        found = self.kind.read(value, dashed(param.name or "") if param else "", 1.0 if self.kind is LENGTH else None)
        return value if self.kind is LENGTH else found


class Declared(click.ParamType):
    """The value of a field of a struct of options."""

    def __init__(self, field: Field) -> None:
        self.field, self.name = field, "text"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        return self.field.one(value)


def of(
    struct: type[Struct],
    name: str,
    without: str = "",
    arguments: Mapping[str, str] = MappingProxyType({}),
    called: Mapping[str, str] = MappingProxyType({}),
) -> Callable[[Command], Command]:
    """Add one option per field of a struct, its own fields before inherited ones; the command gets the struct.

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
    base = struct.__base__
    shared = len(structs.fields(base)) if base is not None and base is not Struct else 0
    inherited = list(fields(struct))[:shared]

    def decorate(command: Command) -> Command:
        @functools.wraps(command)
        def collected(*args: Any, **given: Any) -> Any:
            values = {field: given.pop(called.get(field, field)) for field in known}
            return command(*args, **given, **{name: struct(**{k: v for k, v in values.items() if v is not None})})

        every = {field: _option(known[field], called.get(field, field)) for field in known if field not in arguments}
        own = [option for field, option in every.items() if field not in inherited]
        rest = [option for field, option in every.items() if field in inherited]
        placed = [click.argument(field, metavar=metavar) for field, metavar in arguments.items()]
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
        return click.option(name, flag, is_flag=True, help=field.help, default=default)
    kind: Any = click.Choice(field.choices) if field.choices else Declared(field)
    metavar = SHORT.get(field.quantity) if field.quantity else METAVARS.get(field.name)
    if metavar is None and not field.choices:
        metavar = {float: "FLOAT", int: "INTEGER"}.get(field.type, "TEXT")
    shown = default not in (None, (), "")
    known: dict[str, Any] = {"required": True} if missing else {"default": default}  # a default of None counts
    return click.option(
        name, flag, help=field.help, metavar=metavar, multiple=field.many, type=kind, show_default=shown, **known
    )


def apply(*decorators: Callable[[Command], Command]) -> Callable[[Command], Command]:
    """Several option decorators as one, in the order of the help."""

    def decorate(command: Command) -> Command:
        for decorator in reversed(decorators):
            command = decorator(command)
        return command

    return decorate


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


path = click.Path()
input_unit = click.option(
    "--input-unit",
    metavar="UNIT",
    help="Length unit of the file, if it states the wrong one: mm, m, in …",
)
encoding = click.option(
    "--encoding",
    metavar="NAME",
    help="Character encoding of the file: utf-8, gb18030, cp932, latin-1 …  [default: UTF-8 if that fits, "
    "else the most likely one]",
)
schema = click.option(
    "--schema",
    type=click.Choice(["AP203", "AP214", "AP242"], case_sensitive=False),
    help="STEP schema to write.  [default: AP242 for a file in AP242, else AP214]",
)
overwrite = click.option("--overwrite", is_flag=True, help="Replace an existing output.")
if_changed = click.option(
    "--if-changed",
    is_flag=True,
    help="Replace an existing output only if its content changes, so that make sees no change.",
)
verify = click.option(
    "--verify",
    type=click.Choice(["on", "off"]),
    default="on",
    show_default=True,
    callback=lambda ctx, param, value: value == "on",
    help="Read each output back and check it before it is put in place. off: write without checking.",
)
depfile = click.option("--depfile", metavar="F.d", type=path, help="Write what the outputs depend on, for make.")
report_html = click.option(
    "--report-html", metavar="F.html", type=path, help="Write a report with pictures and the model to turn (HTML)."
)
record = click.option(
    "--record", is_flag=True, help="Write the recipe with all its options and versions beside the output (OUT.toml)."
)
assignments = click.option(
    "--set",
    "assignments",
    metavar="STEP.OPTION=VALUE",
    multiple=True,
    help="Set an option of a step, named by its id or its command; repeatable.",
)


def reading(metavar: str = "IN") -> Callable[[Command], Command]:
    """The model that a command reads, as ``reading``."""
    argument = click.argument("file", metavar=metavar, type=click.Path(allow_dash=True))
    return gathered("reading", Reading, argument, input_unit, encoding)


writing = gathered(
    "writing",
    Writing,
    click.option(
        "-o",
        "--output",
        "outputs",
        metavar="OUT",
        multiple=True,
        type=click.Path(allow_dash=True),
        help=f"File to write; its extension gives the format ({' '.join(f.extensions[0] for f in FORMATS.values())}); "
        "repeatable; - for standard output.",
    ),
    click.option(
        "--format",
        type=click.Choice(list(FORMATS)),
        default="step",
        show_default=True,
        help="Format of standard output.",
    ),
    schema,
    click.option(
        "--chord",
        type=Quantity(LENGTH),
        default="0.02%",
        show_default=True,
        help="Meshes: largest distance between triangles and surface.",
    ),
    click.option(
        "--angle",
        type=Quantity(ANGLE),
        default=12.0,
        show_default=True,
        help="Meshes: largest turn of the normal along a triangle's edge (degrees).",
    ),
    click.option("--ascii", "ascii_stl", is_flag=True, help="STL: write text instead of binary."),
    of(Picture, "picture", called=PICTURES),
    verify,
    overwrite,
    if_changed,
)
editing = gathered(
    "editing",
    Editing,
    click.option("--report", metavar="F.json", type=path, help="Write the full report (JSON) to a file."),
    report_html,
    depfile,
    click.option("--dry-run", is_flag=True, help="Report what would be done; write nothing but the report."),
)
reports = gathered(
    "reports",
    Reports,
    click.option("--junit", metavar="F.xml", type=path, help="Write the verdict as JUnit, one case per layer."),
    click.option("--sarif", metavar="F.sarif", type=path, help="Write the findings as SARIF."),
    report_html,
    click.option("--overwrite", is_flag=True, help="Replace existing reports."),
)


def _kept(ctx: click.Context, param: click.Parameter, value: Any) -> None:
    """Keep an option that controls how the command is run (see :mod:`mracad_cli.command`)."""
    ctx.meta[f"mracad.{param.name}"] = value


debug = click.option(
    "--debug", is_flag=True, expose_value=False, callback=_kept, help="Show the traceback of an error."
)
printing = apply(
    click.option("--json", "as_json", is_flag=True, help="Print the result as JSON."),
    click.option(
        "--time-limit",
        type=Quantity(TIME),
        expose_value=False,
        callback=_kept,
        help="Time limit of the command: 90s, 10min. Exit code 5 when exceeded.",
    ),
    click.option(
        "--memory-limit",
        type=Quantity(MEMORY),
        expose_value=False,
        callback=_kept,
        help="Memory limit of the command: 500MB, 2GB.",
    ),
    debug,
)
