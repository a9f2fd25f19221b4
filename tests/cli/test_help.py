"""The help of every command: options under titles, and an example that goes through."""

import json
import shlex

import click
import pytest
from mracad_cli.__main__ import group

from tests.cli import declared


def helped(command, mracad):
    result = mracad(*command.split(), "--help")
    assert result.code == 0 and result.err == ""
    return result.out


@pytest.mark.parametrize("command", declared.commands())
def test_options_stand_under_titles_each_once(command, mracad):
    lines = helped(command, mracad).splitlines()
    titles = [line for line in lines if line.endswith(":") and line[0] != " "]
    assert titles[-2:] == ["Running:", "Example:"]
    for option in declared.options(declared.commands()[command], ()).values():
        flag = max(option.opts, key=len)
        found = [line.replace(",", " ").split() for line in lines if line.startswith("  -")]
        assert sum(flag in words[:2] for words in found) == 1, flag


def test_what_lengths_mean_is_told_where_they_are_taken(mracad):
    said = "Plain numbers and coordinates are millimetres, whatever the unit of the file."
    assert said in " ".join(helped("smooth", mracad).split()) and said not in " ".join(helped("env", mracad).split())


def test_plain_numbers_are_millimetres_in_a_file_in_inches(mracad, small):
    result = mracad("offset", small[0], "--input-unit", "in", "--distance", "1", "--dry-run", "--json")
    assert result.code == 0, result.err
    assert max(face["largest"] for face in json.loads(result.out)["deviation"]) == pytest.approx(1.0, rel=0.05)


def test_titles_tell_what_options_are_about(mracad):
    lines = helped("smooth", mracad).splitlines()

    def title(flag):
        at = next(i for i, line in enumerate(lines) if line.split()[:1] == [flag] or flag in line.split()[:2])
        return next(line for line in reversed(lines[:at]) if line.endswith(":") and line[0] != " ")

    shown = {flag: title(flag) for flag in ("--scale", "--faces", "--refine", "--encoding", "--output", "--chord")}
    assert list(shown.values()) == [
        "Options:", "Faces and edges:", "Seams and limits:", "Input:", "Output:", "Meshes:",
    ]  # fmt: skip
    assert lines.index("Options:") < lines.index("Faces and edges:") < lines.index("Input:") < lines.index("Running:")


@pytest.mark.parametrize("command", declared.commands())
def test_an_example_goes_through_up_to_its_files(command, mracad, tmp_path, monkeypatch):
    """All that it says is understood: the first that is wrong is that there are no such files here."""
    monkeypatch.chdir(tmp_path)
    example = helped(command, mracad).partition("Example:")[2].strip()
    word, *words = shlex.split(example.partition(">")[0])
    assert word == "mracad" and words[: len(command.split())] == command.split()
    result = mracad(*words)
    named = [word for word in words if (tmp_path / word).suffix in (".step", ".igs", ".toml")]
    if not named:
        assert result.code == 0, result
        return
    assert result.code == 3 and result.out == "", result
    assert any(name in result.err for name in named), result.err
    assert not [path for path in tmp_path.iterdir() if path.suffix != ".xml"]


def test_an_example_is_told_as_it_stands(mracad):
    """No line of it is wrapped: it can be copied."""
    context = click.Context(declared.commands()["repeat"])
    assert declared.commands()["repeat"].examples[0] in context.get_help()


def test_the_list_of_commands_says_what_their_helps_say(mracad):
    """It is made without the commands, which would take time to load."""
    listed = mracad("--help").out.partition("Commands:\n")[2]
    context = click.Context(group)
    for name in group.list_commands(context):
        line = next(line for line in listed.splitlines() if line.split()[0] == name)
        words = line.split(maxsplit=1)[1].removesuffix("...")
        assert " ".join(group.get_command(context, name).help.split()).startswith(words)
