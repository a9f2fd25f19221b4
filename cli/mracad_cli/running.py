"""Options that control how commands run and what they tell; see :mod:`mracad_cli.command`."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import click

from mracad.spec.quantity import MEMORY, TIME
from mracad_cli.params import File, Quantity, Title, apply, option, section


@dataclass(frozen=True)
class Kept:
    """What these options ask for."""

    debug: bool | None
    time_limit: float | None
    memory_limit: float | None
    verbose: bool | None
    quiet: bool | None
    log: str | None
    junit: str | None

    @classmethod
    def of(cls, ctx: click.Context) -> Kept:
        """What was asked for in a context."""
        return cls(**{name: ctx.meta.get(f"mracad.{name}") for name in cls.__annotations__})


def _kept(ctx: click.Context, param: click.Parameter, value: Any) -> None:
    """Keep an option for :class:`Kept`."""
    ctx.meta[f"mracad.{param.name}"] = value


debug = option("--debug", is_flag=True, expose_value=False, callback=_kept, help="Show the traceback of an error.")
limits = apply(
    option(
        "--time-limit",
        type=Quantity(TIME),
        expose_value=False,
        callback=_kept,
        help="Time limit of the command: 90s, 10min. Exit code 5 when exceeded.",
    ),
    option(
        "--memory-limit",
        type=Quantity(MEMORY),
        expose_value=False,
        callback=_kept,
        help="Memory limit of the command: 500MB, 2GB.",
    ),
)
telling = apply(
    option(
        "-q",
        "--quiet",
        is_flag=True,
        expose_value=False,
        callback=_kept,
        help="Print no results and no progress, only warnings and errors, even with -v; --json is printed.",
    ),
    option(
        "-v",
        "--verbose",
        is_flag=True,
        expose_value=False,
        callback=_kept,
        help="Tell on standard error what is done, how long it takes, and which defaults are used.",
    ),
    option(
        "--log",
        metavar="F.log",
        type=File((".log", ".jsonl")),
        expose_value=False,
        callback=_kept,
        help="Add to a file what was asked, versions, phases with their times, warnings and the end (JSON lines).",
    ),
    debug,
)
ending = section(
    Title.REPORTS,
    option(
        "--junit",
        metavar="F.xml",
        type=File((".xml",)),
        expose_value=False,
        callback=_kept,
        help="Write how the command ended as JUnit, with one case.",
    ),
)
judging = section(
    Title.RUNNING, option("--json", "as_json", is_flag=True, help="Print the result as JSON."), limits, telling
)
printing = apply(ending, judging)
