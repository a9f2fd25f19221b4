"""Entry point: the group of commands, and the one place for errors and exit codes."""

from __future__ import annotations

import importlib
import io
import os
import sys
from collections.abc import Sequence
from functools import partial

import click

import mracad
from mracad import note
from mracad.errors import Code, MracadError
from mracad.job import guard
from mracad.job.wire import internal
from mracad_cli import commands, options
from mracad_cli.steps import edit_command, edits


class Commands(click.Group):
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
        if args and not args[0].startswith("-") and args[0] not in self.list_commands(ctx):
            import difflib

            near = difflib.get_close_matches(args[0], self.list_commands(ctx), n=1)
            raise click.UsageError(f"no command {args[0]!r}" + (f", did you mean {near[0]!r}?" if near else ""))
        return super().resolve_command(ctx, args)

    def invoke(self, ctx: click.Context) -> object:
        try:
            return super().invoke(ctx)
        except BrokenPipeError as error:  # before click takes it for exit code 1
            raise _unread() from error


def _unread() -> MracadError:
    """The error for output that nobody reads; what is left of it goes nowhere."""
    os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
    return MracadError("the reader of standard output went away", "", Code.FILE)


def _modules() -> set[str]:
    files = os.listdir(commands.__path__[0])
    return {name.removesuffix(".py") for name in files if name.endswith(".py") and name[0] != "_"}


@click.group(cls=Commands, context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 120})
@click.version_option(mracad.__version__, prog_name="mracad")
def group() -> None:
    """Multiresolution editing for CAD models: B-spline wavelets on STEP and IGES files."""


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line and return its exit code."""
    guarded = arguments is None
    if isinstance(sys.stdout, io.TextIOWrapper):
        sys.stdout.reconfigure(errors="backslashreplace")  # a name or sign that its encoding lacks
    arguments = list(sys.argv[1:] if arguments is None else arguments)
    try:
        return _limited(arguments, guarded)
    except MracadError as error:
        if "--debug" in arguments:
            raise
        failure = error
    except KeyboardInterrupt:
        failure = MracadError("interrupted", "nothing was written", Code.INTERRUPTED)
    except MemoryError as error:
        failure = internal(error)
    from mracad_cli.render import json_text, say

    if "--json" in arguments:
        body = {"code": int(failure.code), "message": failure.message, "hint": failure.hint}
        say(json_text({"error": body}))
    say(f"mracad: {' '.join(str(failure).split())}", file=sys.stderr)
    return int(failure.code)


def _limited(arguments: list[str], guarded: bool) -> int:
    """Run a command; in a child process when it has a limit, or when a crash must not be the end of this one."""
    work = partial(_done, arguments)
    if arguments[:1] == ["batch"]:  # its limits are those of each file, and its workers are its guard
        return work()
    seconds, memory = options.limits(arguments)
    working = bool(arguments) and arguments[0] in group.list_commands(click.Context(group))
    if seconds is None and memory is None and not (guarded and working and "--debug" not in arguments):
        return work()
    return guard.run(work, int, seconds, memory)


def _done(arguments: list[str]) -> int:
    """Run a command; its exit code, or what went wrong as a MracadError."""
    try:
        result = group.main(arguments, prog_name="mracad", standalone_mode=False)
        sys.stdout.flush()
    except click.exceptions.NoArgsIsHelpError as error:
        click.echo(error.format_message(), err=True)
        return int(Code.USAGE)
    except click.exceptions.Exit as error:
        return error.exit_code
    except click.ClickException as error:
        command = error.ctx.command_path if isinstance(error, click.UsageError) and error.ctx else "mracad"
        raise MracadError(error.format_message().rstrip("."), f"see {command} --help", Code.USAGE) from error
    except (KeyboardInterrupt, click.Abort):
        raise KeyboardInterrupt from None
    except BrokenPipeError as error:
        raise _unread() from error
    except Exception as error:
        if "--debug" in arguments or isinstance(error, MracadError | MemoryError):
            raise  # a limit of memory is known to the guard
        if not type(error).__module__.startswith("OCP"):
            raise internal(error) from error
        what = f"{type(error).__name__}: {error}"
        hint = "the model may be damaged: see mracad check, or export it again"
        raise MracadError(f"the CAD kernel failed{note.now()} ({what})", hint) from error
    return result if isinstance(result, int) else 0


if __name__ == "__main__":
    sys.exit(main())
