"""Write the page of all commands and exit codes, from their declarations.

Usage: python docs/commands.py > docs/commands.md
"""

from __future__ import annotations

import inspect
from collections.abc import Iterator

import click
from mracad_cli.__main__ import group
from mracad_cli.command import Command, every

from mracad.errors import MEANINGS

HEAD = """# Commands

Made by `make docs` from the declarations of the commands; `mracad COMMAND --help` says the same. A `FILE` may be
`-` for a stream, or a [URL](batch.md#in-object-stores). [Formats](formats.md),
[defaults of options](shell.md#defaults), [steps of recipes](steps.md).

A `LENGTH` is `5mm`, `0.2in` or `2%` (of the diagonal of the model). Plain numbers and coordinates are millimetres,
whatever the unit of the file: for a file in inches, too, `--scale 5` is 5 mm.

Results go to standard output, everything else to standard error. An error is one line: what, where, what to do. Nothing
is written then.

## Exit codes

| code | meaning |
|---|---|
"""

Row = tuple[str, str]


def page() -> str:
    """The page as Markdown."""
    root = group.make_context("mracad", [], resilient_parsing=True)
    lines = [f"| {int(code)} | {meaning} |" for code, meaning in MEANINGS.items()]
    first: dict[tuple[Row, ...], str] = {}
    for name, command in every(group).items():
        lines += ["", f"## {name}", "", *_described(command)]
        context = click.Context(command, parent=root, info_name=name)
        lines += ["", "```text", " ".join([f"mracad {name}", *command.collect_usage_pieces(context)]), "```"]
        for title, rows in _tables(command, context):
            if (known := first.setdefault((*rows, (title, "")), name)) == name:
                lines += ["", f"**{title}**", "", "| option | |", "|---|---|"]
                lines += [f"| `{option}` | {text} |" for option, text in rows]
            else:
                lines += ["", f"**{title}**: those of [{known}](#{known.replace(' ', '-')})."]
        if isinstance(command, Command):
            lines += ["", "```sh", *command.examples, "```"]
    return HEAD + "\n".join(lines) + "\n"


def _described(command: click.Command) -> Iterator[str]:
    """The help in paragraphs; lines that click is to keep are a block."""
    for number, part in enumerate(inspect.cleandoc(command.help or "").split("\n\n")):
        yield from [""] * (number > 0)
        if part.startswith("\b"):
            yield from ("```text", *part.splitlines()[1:], "```")
        else:
            yield " ".join(part.split())


def _tables(command: click.Command, context: click.Context) -> Iterator[tuple[str, list[Row]]]:
    """The options under the titles of the help."""
    if isinstance(command, Command):
        for title, params in command.sections(context).items():
            records = (param.get_help_record(context) for param in params)
            yield str(title), [_row(*record) for record in records if record]


def _row(option: str, text: str) -> Row:
    """An option and its text, which begins with the values to choose from."""
    option, _, choices = option.partition(" [")
    words = ", ".join(f"`{word}`" for word in choices.rstrip("]").split("|") if word)
    return option, f"{words}: {text}".removeprefix(": ").replace("|", "\\|")


if __name__ == "__main__":
    print(page(), end="")
