"""Defaults of options from files and the environment; what is given on the command line goes before them all.

``pyproject.toml`` (its table ``tool.mracad``) comes first, then ``mracad.toml``, then environment variables; later
ones go before earlier ones, and in each of them an option of one command before that of all commands. A default for all
commands counts where an option takes its value: some commands have fewer choices than others.
"""

from __future__ import annotations

import contextlib
import json
import os
import re
import shlex
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import click

from mracad.errors import FileError, MracadError, UsageError
from mracad.spec.fields import nearest
from mracad_cli.params import relocated

NAME, PROJECT, TABLE = "mracad.toml", "pyproject.toml", ("tool", "mracad")
PREFIX = "MRACAD_"
RESERVED = frozenset({"MRACAD_CORPUS", "MRACAD_CACHE", "MRACAD_WORKERS"})
"""Variables that hold no option."""

GIVEN = frozenset({"set", "help"})
"""Options without defaults: steps of a recipe must not change without a word."""

Commands = Mapping[str, click.Command]


@dataclass(frozen=True)
class Default:
    """A default as written.

    Attributes
    ----------
    command : str
        Its words, ``"feature list"``; ``""`` for all commands that have the option. The environment tells no more than
        ``option``, in which the command may come first.
    option : str
        Its long name on the command line, without the dashes.
    value : object
        A text, true or false, or a list; ``""`` takes an earlier default away.
    place : str
        File and line, or the variable.
    folder : str or None
        The folder of its file, to which paths are relative; None for a variable.
    """

    command: str
    option: str
    value: Any
    place: str
    folder: str | None

    @property
    def text(self) -> str:
        """Its value as JSON."""
        return json.dumps(self.value, default=str, ensure_ascii=False)

    @property
    def key(self) -> str:
        """The option with the command that it is for."""
        return f"{self.command} {self.option}".strip()


def found() -> list[Default]:
    """All defaults that hold in the working folder, the strongest last."""
    place = Path.cwd()
    above = [place, *place.parents]
    every: list[Default] = []
    for name, table in ((PROJECT, TABLE), (NAME, ())):
        every += next((own for folder in above if (own := _in_file(folder / name, table)) is not None), [])
    return every + _in_environment()


def chosen(command: str, own: click.Command, commands: Callable[[], Commands]) -> dict[str, Default]:
    """The defaults of a command by the name of its parameter.

    Parameters
    ----------
    command : str
        Its words.
    own : click.Command
    commands : callable
        Gives all commands by their words, where a default is for others.

    Raises
    ------
    UsageError
        For a default of an option or a command that does not exist, with its place; not for those of other commands.
    """
    options = options_of(own)
    result: dict[str, Default] = {}
    for default in found():
        name = option(default, command, options)
        if name is None:
            if not _of_another(default, command, commands()):
                check(default, commands())
        elif name in GIVEN:
            raise UsageError(f"{default.place}: {name} has no default", "give it on the command line")
        else:
            its = command if name != default.option else default.command
            result[str(options[name].name)] = replace(default, command=its, option=name)
    return {name: default for name, default in result.items() if default.value != ""}


def value(default: Default, its: click.Option, ctx: click.Context) -> Any:
    """The value of a default as click takes it.

    Raises
    ------
    UsageError
        For a value that the option does not take, with its place.
    """
    try:
        plain = _plain(default, its)
        its.type_cast_value(ctx, plain)
    except (MracadError, click.UsageError) as error:
        message = error.message if isinstance(error, MracadError) else error.format_message()
        hint = error.hint if isinstance(error, MracadError) else ""
        says = message if message.startswith(default.option) else f"{default.option}: {message.rstrip('.')}"
        raise UsageError(f"{default.place}: {says}", hint) from error
    return plain


def taken(default: Default, commands: Commands) -> bool:
    """Whether some command takes the value of a default for all commands."""
    for name, command in commands.items():
        options = options_of(command)
        own = option(default, name, options)
        with contextlib.suppress(UsageError):
            if own is not None:
                value(default, options[own], click.Context(command))
                return True
    return False


def _of_another(default: Default, command: str, commands: Commands) -> bool:
    """Whether a default is for a command, or a group of them, other than this one; variables begin with its words."""
    others = {*commands, *(name.partition(" ")[0] for name in commands)} - {command, command.partition(" ")[0]}
    if default.folder is None:
        return any(default.option.startswith(f"{name.replace(' ', '-')}-") for name in others)
    return default.command in others


def check(default: Default, commands: Commands) -> None:
    """Raise UsageError for a default that no command has."""
    if default.command and default.command not in commands:
        groups = {name.partition(" ")[0] for name in commands}
        if default.command not in groups:
            hint = nearest(default.command, [*commands, *groups], "see mracad --help")
            raise UsageError(f"{default.place}: there is no command {default.command!r}", hint)
    every = {name: options_of(command) for name, command in commands.items() if default.command in ("", name)}
    if not any(option(default, name, options) for name, options in every.items()):
        names = {option for options in every.values() for option in options}
        what = f"{default.command} has no option" if default.command else "no command has an option"
        raise UsageError(f"{default.place}: {what} {default.option!r}", nearest(default.option, names, "see --help"))


def options_of(command: click.Command) -> dict[str, click.Option]:
    """The options of a command by their long names."""
    options = (param for param in command.params if isinstance(param, click.Option))
    return {max(option.opts, key=len).lstrip("-"): option for option in options}


def option(default: Default, command: str, options: Mapping[str, click.Option]) -> str | None:
    """The long name of a command's option that a default is for; None if it is for others."""
    if default.command not in ("", command):
        return None
    own = default.option.removeprefix(f"{command.replace(' ', '-')}-")
    if default.folder is None and own in options:
        return own
    return default.option if default.option in options else None


def _plain(default: Default, its: click.Option) -> Any:
    """The value as a text, for a flag true or false, for many a list of texts; paths are from the working folder."""
    given = default.value
    if its.is_flag:
        if default.folder is not None and not isinstance(given, bool):
            raise UsageError(f"{default.option}: {given!r} is neither true nor false", "write true or false")
        return given
    if isinstance(given, bool) or (isinstance(given, list) and not its.multiple):
        raise UsageError(f"{default.option}: it takes one value, not {given!r}", f'write {default.option} = "…"')
    if default.folder is None:
        return _words(default) if its.multiple else given
    texts = [relocated(its.type, str(text), default.folder) for text in (given if isinstance(given, list) else [given])]
    return texts if its.multiple else texts[0]


def _words(default: Default) -> list[str]:
    try:
        return shlex.split(default.value)
    except ValueError as error:
        raise UsageError(f"{default.option}: {error}", "close the quotes") from error


def _in_environment() -> list[Default]:
    names = sorted(name for name in os.environ if name.startswith(PREFIX) and name not in RESERVED)
    common_first = sorted(names, key=len)  # the same option with a command has a longer name
    return [
        Default("", name.removeprefix(PREFIX).lower().replace("_", "-"), os.environ[name], name, None)
        for name in common_first
    ]


def _in_file(path: Path, table: tuple[str, ...]) -> list[Default] | None:
    """The defaults in a table of a file; None where there is no such table."""
    try:
        data = path.read_bytes()
    except (FileNotFoundError, NotADirectoryError):
        return None
    except OSError as error:
        raise FileError(f"cannot read '{path}': {error.strerror}", "it may hold defaults") from error
    if table and table[-1].encode() not in data:
        return None
    import tomllib

    from mracad.spec.text import places_of_keys

    name = os.path.relpath(path)
    try:
        text = data.decode()
        body = tomllib.loads(text)
    except (UnicodeDecodeError, tomllib.TOMLDecodeError) as error:
        line = re.search(r"\(at line (\d+)", str(error))
        where = f"{name}:{line[1]}" if line else name
        raise UsageError(f"{where}: {str(error).split(' (at')[0]}", "write it as TOML") from error
    for key in table:
        body = body.get(key) or {} if isinstance(body, dict) else {}
    if not isinstance(body, dict):
        raise UsageError(f"{name}: {'.'.join(table)} is no table", f"write [{'.'.join(table)}]")
    places = places_of_keys(text)
    lines = {key[len(table) :]: f"{name}:{line}" for key, line in places.items() if key[: len(table)] == table}
    folder = str(path.parent)
    own = [
        Default(" ".join(words[:-1]), words[-1], value, lines.get(words, name), folder)
        for words, value in _values(body)
    ]
    return sorted(own, key=lambda default: default.command != "") if body or not table else None


def _values(body: Mapping[str, Any], above: tuple[str, ...] = ()) -> Iterator[tuple[tuple[str, ...], Any]]:
    for key, value in body.items():
        if isinstance(value, dict):
            yield from _values(value, (*above, key))
        else:
            yield (*above, key), value
