"""Entry point: the group of commands, and the one place for errors and exit codes."""

from __future__ import annotations

import contextlib
import importlib
import io
import os
import sys
from collections.abc import Sequence
from pathlib import Path

import click

import mracad
from mracad.errors import Code, FileError, MracadError
from mracad_cli import commands
from mracad_cli.command import Group, run
from mracad_cli.say import json_text, printable, say, voice


class Commands(Group):
    """A group whose commands are the modules of ``mracad_cli.commands`` and the edits of ``mracad.spec.steps``."""

    def list_commands(self, ctx: click.Context) -> list[str]:
        return sorted({*_modules(), *_edits()})

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        if cmd_name not in self.list_commands(ctx):
            return None
        if cmd_name not in _modules():
            from mracad_cli.steps import edit_command

            return edit_command(cmd_name)
        command = importlib.import_module(f"mracad_cli.commands.{cmd_name}").command
        return command if isinstance(command, click.Command) else None

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        names = self.list_commands(ctx)
        limit = formatter.width - 6 - max(map(len, names))
        with formatter.section("Commands"):
            formatter.write_dl(
                [(name, click.Command(name, help=_help(name)).get_short_help_str(limit)) for name in names]
            )

    def resolve_command(
        self, ctx: click.Context, args: list[str]
    ) -> tuple[str | None, click.Command | None, list[str]]:
        known = self.list_commands(ctx)
        if args and not args[0].startswith("-") and args[0] not in known:
            from mracad.spec.fields import nearest

            near = nearest(args[0], known, " ")
            raise click.UsageError(f"no command {args[0]!r}" + f", {near}".rstrip(", "))
        return super().resolve_command(ctx, args)


def _edits() -> dict[str, str]:
    """Helps of the edits among the steps, by name; each is a command."""
    from mracad.spec.steps import STEPS, Selection

    return {use: struct.__doc__ or "" for use, struct in STEPS.items() if issubclass(struct, Selection)}


def _help(name: str) -> str:
    """The help of a command: the docstring of its module, which is not run for that, or of its struct."""
    if name not in _modules():
        return _edits()[name]
    text = Path(commands.__path__[0], f"{name}.py").read_text(encoding="utf-8")
    return text.split('"""')[1]


def _modules() -> set[str]:
    files = os.listdir(commands.__path__[0])
    return {name.removesuffix(".py") for name in files if name.endswith(".py") and name[0] != "_"}


@click.group(cls=Commands, context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 120})
@click.version_option(mracad.__version__, prog_name="mracad")
def group() -> None:
    """Multiresolution editing for CAD models: B-spline wavelets on STEP and IGES files."""


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line and return its exit code."""
    if isinstance(sys.stdout, io.TextIOWrapper):
        sys.stdout.reconfigure(errors="backslashreplace")  # for characters that its encoding lacks
    words = list(sys.argv[1:] if arguments is None else arguments)
    voice.quiet, voice.as_json, voice.debug = False, "--json" in words, "--debug" in words
    try:
        return run(group, words, guarded=arguments is None)
    except MracadError as error:
        if voice.debug:
            import traceback

            traceback.print_exception(error)
        failure = error
    except KeyboardInterrupt:
        failure = MracadError("interrupted", "nothing was written", Code.INTERRUPTED)
    except MemoryError as error:
        from mracad.job.wire import internal

        failure = internal(error)

    if voice.as_json:
        body = {"code": int(failure.code), "message": failure.message, "hint": failure.hint}
        with contextlib.suppress(FileError):
            say(json_text({"error": body}))
    print(printable(f"mracad: {' '.join(str(failure).split())}"), file=sys.stderr)
    return int(failure.code)


if __name__ == "__main__":
    sys.exit(main())
