"""Running a command in a child process within its limits; every failure becomes a MracadError."""

from __future__ import annotations

import contextlib
import os
import sys
from collections.abc import Iterator
from typing import Any

import click

from mracad import note
from mracad.errors import Code, MracadError
from mracad.job import guard
from mracad.job.wire import internal


class Command(click.Command):
    """A command that reports a crash of the kernel, or an exceeded limit, as an error."""

    guarded = True

    def invoke(self, ctx: click.Context) -> int:
        def work() -> int:
            with told():
                code = click.Command.invoke(self, ctx)
                sys.stdout.flush()
            return code if isinstance(code, int) else 0

        debug, seconds, memory = (ctx.meta.get(f"mracad.{name}") for name in ("debug", "time_limit", "memory_limit"))
        if seconds is None and memory is None and not (self.guarded and ctx.obj and not debug):
            return work()
        return guard.run(work, int, seconds, None if memory is None else max(1, int(memory)))


class Unguarded(Command):
    """A command that does its work in worker processes, to which its limits apply."""

    guarded = False


class Group(click.Group):
    """A group of such commands."""

    command_class = Command


@contextlib.contextmanager
def told() -> Iterator[None]:
    """Turn exceptions in the block into MracadErrors."""
    try:
        yield
    except (MracadError, MemoryError, click.ClickException, click.exceptions.Exit):
        raise  # the guard reports memory limits
    except (KeyboardInterrupt, click.Abort):
        raise KeyboardInterrupt from None
    except BrokenPipeError as error:
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())  # discard the rest of the output
        raise MracadError("standard output was closed", "", Code.FILE) from error
    except Exception as error:
        if not type(error).__module__.startswith("OCP"):
            raise internal(error) from error
        what = f"{type(error).__name__}: {error}"
        hint = "the model may be damaged: see mracad check, or export it again"
        raise MracadError(f"the CAD kernel failed{note.now()} ({what})", hint) from error


def run(group: click.Group, arguments: list[str], *, guarded: bool) -> int:
    """Run a command of a group; returns its exit code, and raises every failure as a MracadError."""
    try:
        with told():
            code: Any = group.main(arguments, prog_name="mracad", standalone_mode=False, obj=guarded)
            sys.stdout.flush()
    except click.exceptions.NoArgsIsHelpError as error:
        click.echo(error.format_message(), err=True)
        return int(Code.USAGE)
    except click.exceptions.Exit as error:
        return error.exit_code
    except click.ClickException as error:
        command = error.ctx.command_path if isinstance(error, click.UsageError) and error.ctx else "mracad"
        raise MracadError(error.format_message().rstrip("."), f"see {command} --help", Code.USAGE) from error
    return code if isinstance(code, int) else 0
