"""Running a command in a child process within its limits; every failure becomes a MracadError.

What only a command that runs needs is imported then: help is to be quick.
"""

from __future__ import annotations

import contextlib
import re
from collections.abc import Collection, Iterable, Iterator
from functools import partial
from typing import TYPE_CHECKING, Any

import click
from click.core import ParameterSource

from mracad.errors import Code, MracadError, UsageError
from mracad_cli.say import voice

if TYPE_CHECKING:
    from mracad_cli.defaults import Default
    from mracad_cli.journal import Ended, Journal
    from mracad_cli.running import Kept


LENGTHS = (
    "LENGTH is 5mm, 0.2in or 2% (of the model's diagonal). Plain numbers and coordinates are millimetres, whatever the "
    "unit of the file."
)


class Command(click.Command):
    """A command that reports a crash of the kernel, or an exceeded limit, as an error.

    Parameters
    ----------
    examples : str
        Calls of the command for its help, one per line.
    """

    guarded = True
    defaulted = True
    replaces = False
    edits = True

    def __init__(self, *args: Any, examples: str, **how: Any) -> None:
        super().__init__(*args, **how)
        self.examples = examples.splitlines()

    def sections(self, ctx: click.Context) -> dict[str, list[click.Parameter]]:
        """The options by the titles under which the help lists them, in its order."""
        from mracad_cli.params import Title

        found: dict[str, list[click.Parameter]] = {}
        for param in self.get_params(ctx):
            if isinstance(param, click.Option):
                found.setdefault(getattr(param, "section", Title.RUNNING) or "Options", []).append(param)
        last = [title for title in Title if title in found]
        return {title: found[title] for title in [*(title for title in found if title not in last), *last]}

    def format_options(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        for title, params in self.sections(ctx).items():
            with formatter.section(title):
                formatter.write_dl([record for param in params if (record := param.get_help_record(ctx))])

    def notes(self, ctx: click.Context) -> list[str]:
        """What the help says about the values of options."""
        lengths = any(param.make_metavar(ctx) == "LENGTH" for param in self.get_params(ctx))
        return [LENGTHS] if lengths else []

    def format_epilog(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        for note in self.notes(ctx):
            formatter.write_paragraph()
            formatter.write_text(note)
        with formatter.section("Examples" if len(self.examples) > 1 else "Example"):
            for line in self.examples:
                formatter.write(f"  {line}\n")

    def parse_args(self, ctx: click.Context, args: list[str]) -> list[str]:
        ctx.meta["mracad.arguments"] = [*ctx.command_path.split()[1:], *args]
        if self.defaulted and not ctx.resilient_parsing:
            self._take_defaults(ctx, {*args} & {*ctx.help_option_names})
            self._refuse_repeated(ctx, args)
        return super().parse_args(ctx, args)

    def _refuse_repeated(self, ctx: click.Context, args: list[str]) -> None:
        """Refuse an option that is given twice though it has one value: the first would be ignored."""
        given = self.make_parser(ctx).parse_args(args=[*args])[2]
        for param in given:
            single = isinstance(param, click.Option) and not (param.multiple or param.is_flag or param.count)
            if single and given.count(param) > 1:
                name = next(word for word in param.opts if any(arg.startswith(word) for arg in args))
                raise UsageError(f"{name} is given {given.count(param)} times", f"give {name} once")

    def _take_defaults(self, ctx: click.Context, helped: Collection[str]) -> None:
        """Give the context the defaults of files and the environment; help is shown even where these are wrong."""
        from mracad_cli.defaults import chosen, options_of

        try:
            found = chosen(self.words(ctx), self, lambda: every(ctx.find_root().command))
        except MracadError:
            if not helped:
                raise
            return
        options = {str(option.name): option for option in options_of(self).values()}
        ctx.default_map, ctx.meta["mracad.defaults"] = {}, found
        for name, default in found.items():
            ctx.default_map[name] = partial(_valued, ctx, default, options[name], lenient=bool(helped))
            if helped and ctx.lookup_default(name) is not None:
                ctx.default_map[name] = ctx.lookup_default(name)

    def invoke(self, ctx: click.Context) -> int:
        from mracad_cli.journal import Journal, subject_of
        from mracad_cli.outputs import check_junit
        from mracad_cli.running import Kept

        kept = Kept.of(ctx)
        voice.as_json = bool(ctx.params.get("as_json"))
        voice.quiet, voice.debug = bool(kept.quiet) and not voice.as_json, bool(kept.debug)
        path = kept.junit or str(ctx.params.get("junit") or "")
        replaced = self.replaces or bool(ctx.params.get("overwrite", True))
        if kept.junit:
            check_junit(kept.junit, replaced)
        used = {name: d for name, d in ctx.meta.get("mracad.defaults", {}).items() if _used(ctx, name)}
        journal = Journal(
            self.words(ctx), kept.log, verbose=bool(kept.verbose) and not kept.quiet, keeps=bool(kept.log or kept.junit)
        )
        journal.began(ctx.meta["mracad.arguments"], used)
        failure: MracadError | None = None
        try:
            with journal.listening():
                ended = self._work(ctx, kept, journal)
            journal.said = ended.said
            code = ended.code
        except MracadError as error:
            failure, code = explained(error, used.values()), int(error.code)
        journal.ended(code, failure)
        if kept.junit or (path and failure and not refused(path, replaced)):
            from mracad.output import put_all

            put_all({path: journal.junit(subject_of(ctx), code, failure).encode()})
        if failure:
            raise failure
        return code

    def _work(self, ctx: click.Context, kept: Kept, journal: Journal) -> Ended:
        """Do the work of the command, in a child process where it is guarded."""
        from mracad.job import guard
        from mracad_cli.journal import Ended
        from mracad_cli.progress import compiling

        def work() -> Ended:
            try:
                with told(), compiling():
                    code = click.Command.invoke(self, ctx)
            finally:
                journal.leave()
            return Ended(code if isinstance(code, int) else 0, journal.said)

        seconds, memory = kept.time_limit, kept.memory_limit
        if seconds is None and memory is None and not (self.guarded and ctx.obj and not kept.debug):
            return work()
        return guard.run(work, Ended, seconds, None if memory is None else max(1, int(memory)))

    @staticmethod
    def words(ctx: click.Context) -> str:
        """The words that name the command."""
        return " ".join(ctx.command_path.split()[1:])


def refused(path: str, replaced: bool) -> bool:
    """Whether a report for CI could not be written."""
    from mracad_cli.outputs import check_junit

    try:
        check_junit(path, replaced)
    except MracadError:
        return True
    return False


def _valued(ctx: click.Context, default: Default, its: click.Option, *, lenient: bool) -> Any:
    """The value of a default, read where the command line gives none; forgotten if only others take it."""
    from mracad_cli.defaults import taken, value

    try:
        return value(default, its, ctx)
    except UsageError:
        if not lenient and (default.command or not taken(default, every(ctx.find_root().command))):
            raise
    assert ctx.default_map is not None
    ctx.default_map.pop(str(its.name))
    return None


def _used(ctx: click.Context, name: str) -> bool:
    return ctx.get_parameter_source(name) is ParameterSource.DEFAULT_MAP


def explained(error: MracadError, used: Iterable[Default]) -> MracadError:
    """An error of usage, with the places of the defaults that its message names."""
    named = [d for d in used if re.search(rf"\b{re.escape(d.option)}\b", error.message)]
    if error.code == Code.USAGE and named:
        said = "; ".join(f"{d.option} is set in {d.place}" for d in named)
        error.hint = f"{error.hint}; {said}".removeprefix("; ")
    return error


def every(group: click.Command) -> dict[str, click.Command]:
    """The commands of a group by their words, those of groups in it among them."""
    context = click.Context(group)
    found: dict[str, click.Command] = {}
    for name in group.list_commands(context) if isinstance(group, click.Group) else ():
        command = group.get_command(context, name)  # type: ignore[attr-defined]
        if isinstance(command, click.Group):
            found |= {f"{name} {below}": each for below, each in every(command).items()}
        elif command:
            found[name] = command
    return found


def groups(root: click.Command) -> dict[str, click.Group]:
    """The groups of commands in a group, by name."""
    context = click.Context(root)
    names = root.list_commands(context) if isinstance(root, click.Group) else []
    found = {name: root.get_command(context, name) for name in names}  # type: ignore[attr-defined]
    return {name: each for name, each in found.items() if isinstance(each, click.Group)}


class Unedited(Command):
    """A command that shows or writes a model as it is."""

    edits = False


class Unguarded(Command):
    """A command that does its work in worker processes, to which its limits apply; it replaces its reports."""

    guarded = False
    replaces = True


class Plain(Unguarded):
    """A command that touches no model: no default can keep it from its work."""

    defaulted = False


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
    except Exception as error:
        from mracad import note
        from mracad.job.wire import internal, out_of_memory

        if out_of_memory(error):
            raise MemoryError from error
        if not type(error).__module__.startswith("OCP"):
            raise internal(error) from error
        what = f"{type(error).__name__}: {error}"
        hint = "the model may be damaged: see mracad check, or export it again"
        raise MracadError(f"the CAD kernel failed{note.now()} ({what})", hint) from error


def _unknown(error: click.NoSuchOption) -> tuple[str, str]:
    """The message of an option that does not exist, and the options that end in it, or else look like it."""
    ctx, given = error.ctx, error.option_name
    known = [name for param in ctx.command.params for name in param.opts] if ctx else []
    near = [name for name in known if name.endswith(given.removeprefix("-"))] if given.startswith("--") else []
    help = f"see {ctx.command_path if ctx else 'mracad'} --help"
    if not near:
        return error.format_message().rstrip("."), help
    return f"No such option {given!r}", f"did you mean {' or '.join(map(repr, near))}? {help}"


def run(group: click.Group, arguments: list[str], *, guarded: bool) -> int:
    """Run a command of a group; returns its exit code, and raises every failure as a MracadError."""
    try:
        with told():
            code: Any = group.main(arguments, prog_name="mracad", standalone_mode=False, obj=guarded)
    except click.exceptions.NoArgsIsHelpError as error:
        click.echo(error.format_message(), err=True)
        return int(Code.USAGE)
    except click.exceptions.Exit as error:
        return error.exit_code
    except click.NoSuchOption as error:
        raise MracadError(*_unknown(error), Code.USAGE) from error
    except click.ClickException as error:
        command = error.ctx.command_path if isinstance(error, click.UsageError) and error.ctx else "mracad"
        raise MracadError(error.format_message().rstrip("."), f"see {command} --help", Code.USAGE) from error
    return code if isinstance(code, int) else 0
