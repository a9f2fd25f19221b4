"""Manual pages (roff) from the declarations of commands."""

from __future__ import annotations

import inspect
import re
import textwrap
from collections.abc import Iterable, Iterator, Mapping

import click

from mracad.errors import MEANINGS
from mracad.version import __version__
from mracad_cli.command import Command

WIDTH = 64
"""Characters in a line of a page's source, before some are escaped."""

FILES = {
    "pyproject.toml": "Defaults of a project, in its tables [tool.mracad] and [tool.mracad.COMMAND].",
    "mracad.toml": "Defaults that go before these: options of all commands, and tables [COMMAND]. Both files are "
    "searched for from the working folder upward.",
}
VARIABLES = {
    "MRACAD_OPTION, MRACAD_COMMAND_OPTION": "Defaults that go before those of files, as in MRACAD_SMOOTH_SCALE=5mm.",
    "MRACAD_CACHE": "The folder of the cache of documents that were read, or off.",
    "MRACAD_WORKERS": "The largest number of processes of an edit, by default one for each processor.",
}


def page(name: str, command: click.Command, root: click.Context) -> str:
    """The page of a command, named by its words, with the context of the program."""
    context = click.Context(command, parent=root, info_name=name)
    options = command.sections(context) if isinstance(command, Command) else {}
    examples = command.examples if isinstance(command, Command) else []
    synopsis = " ".join([f"\\fBmracad {escaped(name)}\\fR", *map(escaped, command.collect_usage_pieces(context))])
    lines = [
        *_head(f"mracad-{name.replace(' ', '-')}", command),
        ".SH SYNOPSIS",
        synopsis,
        ".SH DESCRIPTION",
        *_paragraphs(command),
        ".SH OPTIONS",
    ]
    for title, params in options.items():
        lines.append(f".SS {escaped(title)}")
        lines += _terms(record for param in params if (record := param.get_help_record(context)))
    for note in command.notes(context) if isinstance(command, Command) else ():
        lines += [".PP", *_filled(note)]
    lines += [".SH EXAMPLES", *_block(examples)] if examples else []
    return "\n".join([*lines, *_end(["mracad(1)"])]) + "\n"


def overview(group: click.Command, commands: Mapping[str, click.Command], name: str = "") -> str:
    """The page of the program, or of the group of commands with a name."""
    words = f"mracad {name}".strip()
    lines = [
        *_head(words.replace(" ", "-"), group),
        ".SH SYNOPSIS",
        f"\\fB{escaped(words)}\\fR COMMAND [OPTIONS] [ARGS]...",
        ".SH DESCRIPTION",
        *_paragraphs(group),
        ".SH COMMANDS",
        *_terms((name, f"{_sentence(command)}.") for name, command in commands.items()),
    ]
    also = ["mracad(1)"] if name else []
    return "\n".join([*lines, *_end([*also, *(f"mracad-{each.replace(' ', '-')}(1)" for each in commands)])]) + "\n"


def escaped(text: str) -> str:
    """A text for roff, in ASCII."""
    text = text.replace("\\", "\\[rs]").replace("-", "\\-").replace("'", "\\[aq]").replace("`", "\\[ga]")
    text = re.sub(r"[^\x00-\x7f]", lambda match: f"\\[u{ord(match[0]):04X}]", text)
    return re.sub(r"^([.'])", r"\\&\1", text)


def _head(name: str, command: click.Command) -> list[str]:
    title = f'.TH {name.upper()} 1 "" "mracad {__version__}" "mracad manual"'
    return [title, ".SH NAME", f"{escaped(name)} \\- {escaped(_sentence(command))}"]


def _sentence(command: click.Command) -> str:
    """The first sentence of the help, without its full stop."""
    text = " ".join((command.help or "").split("\n\n")[0].split())
    return re.split(r"(?<=\w|\))\.(?:\s|$)|;\s", text)[0]


def _paragraphs(command: click.Command) -> Iterator[str]:
    """Paragraphs; those that begin with a mark of click keep their lines."""
    for number, part in enumerate(inspect.cleandoc(command.help or "").split("\n\n")):
        yield from [".PP"] * (number > 0)
        if part.startswith("\b"):
            yield from _block(part.splitlines()[1:])
        else:
            yield from _filled(part)


def _filled(text: str) -> list[str]:
    """A paragraph in lines that editors show whole; none begins with a control character."""
    return [escaped(line) for line in textwrap.wrap(text, WIDTH, break_long_words=False, break_on_hyphens=False)]


def _block(lines: Iterable[str]) -> list[str]:
    return [".RS 4", ".nf", *map(escaped, lines), ".fi", ".RE"]


def _terms(records: Iterable[tuple[str, str]]) -> Iterator[str]:
    for term, text in records:
        yield from (".TP", f"\\fB{escaped(term)}\\fR", *_filled(text))


def _end(also: Iterable[str]) -> list[str]:
    return [
        ".SH EXIT STATUS",
        *_terms((str(int(code)), meaning) for code, meaning in MEANINGS.items()),
        ".SH ENVIRONMENT",
        *_terms(VARIABLES.items()),
        ".SH FILES",
        *_terms(FILES.items()),
        ".SH SEE ALSO",
        *_filled(", ".join(also)),
    ]
