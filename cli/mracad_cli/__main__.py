"""Entry point: the group of commands, and the one place for errors and exit codes."""

from __future__ import annotations

import importlib
import io
import os
import sys
import traceback
from collections.abc import Sequence

import click

import mracad
from mracad.errors import Code, MracadError
from mracad.job.wire import internal
from mracad.spec.fields import nearest
from mracad_cli import commands
from mracad_cli.command import Group, run
from mracad_cli.say import json_text, printable, say, voice
from mracad_cli.steps import edit_command, edits


class Commands(Group):
    """A group whose commands are the modules of ``mracad_cli.commands`` and the edits of ``mracad.spec.steps``."""

    def list_commands(self, ctx: click.Context) -> list[str]:
        return sorted({*_modules(), *edits()})

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        if cmd_name not in self.list_commands(ctx):
            return None
        if cmd_name not in _modules():
            return edit_command(cmd_name)
        command = importlib.import_module(f"mracad_cli.commands.{cmd_name}").command
        return command if isinstance(command, click.Command) else None

    def resolve_command(
        self, ctx: click.Context, args: list[str]
    ) -> tuple[str | None, click.Command | None, list[str]]:
        known = self.list_commands(ctx)
        if args and not args[0].startswith("-") and args[0] not in known:
            near = nearest(args[0], known, " ")
            raise click.UsageError(f"no command {args[0]!r}" + f", {near}".rstrip(", "))
        return super().resolve_command(ctx, args)


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
            traceback.print_exception(error)
        failure = error
    except KeyboardInterrupt:
        failure = MracadError("interrupted", "nothing was written", Code.INTERRUPTED)
    except MemoryError as error:
        failure = internal(error)

    if voice.as_json:
        body = {"code": int(failure.code), "message": failure.message, "hint": failure.hint}
        say(json_text({"error": body}))
    print(printable(f"mracad: {' '.join(str(failure).split())}"), file=sys.stderr)
    return int(failure.code)


if __name__ == "__main__":
    sys.exit(main())
