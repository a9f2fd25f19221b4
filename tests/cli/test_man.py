"""Manual pages: one for each command, with all that the help says, and roff that is understood."""

import re
import shutil
import subprocess

import pytest

from tests.cli import declared

MACROS = {"TH", "SH", "SS", "PP", "TP", "RS", "RE", "nf", "fi"}


@pytest.fixture(scope="module")
def pages(tmp_path_factory):
    from mracad_cli.__main__ import main

    folder = tmp_path_factory.mktemp("man")
    assert main(["man", str(folder)]) == 0
    return {path.stem: path for path in folder.iterdir()}


def test_there_is_a_page_for_each_command(pages):
    groups = {"mracad-feature", "mracad-recipe"}
    assert pages.keys() == {"mracad", *groups, *(f"mracad-{name.replace(' ', '-')}" for name in declared.commands())}
    overview = plain(pages["mracad"].read_text())
    for name in declared.commands():
        assert f"mracad-{name.replace(' ', '-')}(1)" in overview and f" {name} " in overview


def test_a_group_leads_to_its_commands(pages):
    text = plain(pages["mracad-feature"].read_text())
    assert "mracad feature COMMAND" in text and "mracad-feature-list(1)" in text and "mracad-smooth" not in text


def plain(text):
    """What a page says, without its markup."""
    text = re.sub(r"\\f[BR]|\\&|^\.\w+ ?", "", text, flags=re.M).replace("\\-", "-").replace("\\[aq]", "'")
    return " ".join(re.sub(r"\\\[u([0-9A-F]{4,})\]", lambda match: chr(int(match[1], 16)), text).split())


@pytest.mark.parametrize("name", ["smooth", "feature make", "batch"])
def test_a_page_says_what_the_help_says(pages, name):
    command = declared.commands()[name]
    text = plain(pages[f"mracad-{name.replace(' ', '-')}"].read_text())
    for option in declared.options(command, ()).values():
        assert max(option.opts, key=len) in text and " ".join(option.help.split()) in text
    assert command.examples[0] in text and "Exit".upper() in text


def test_roff_is_plain_and_its_blocks_are_closed(pages):
    for path in pages.values():
        lines = path.read_text(encoding="ascii").splitlines()
        assert lines[0].startswith(".TH MRACAD") and lines[1] == ".SH NAME"
        assert {line[1:].split()[0] for line in lines if line.startswith(".")} <= MACROS
        assert lines.count(".nf") == lines.count(".fi") and lines.count(".RS 4") == lines.count(".RE")
        assert not any(line.startswith("'") or "\b" in line for line in lines)


@pytest.mark.skipif(not shutil.which("mandoc"), reason="there is no mandoc")
def test_mandoc_finds_nothing_wrong(pages):
    words = ["mandoc", "-T", "lint", "-W", "warning", *map(str, pages.values())]
    said = subprocess.run(words, capture_output=True, text=True).stdout
    assert not [line for line in said.splitlines() if "missing date" not in line], said


def test_a_folder_is_made_where_there_is_none(mracad, tmp_path):
    assert mracad("man", tmp_path / "share" / "man1").code == 0
    assert (tmp_path / "share" / "man1" / "mracad.1").exists()
    result = mracad("man", tmp_path / "share" / "man1" / "mracad.1")
    assert result.code == 3 and "mracad.1" in result.err and result.err.count("\n") == 1
