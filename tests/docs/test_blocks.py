"""What pages show is true: commands parse, recipes load, scripts and Python run."""

import itertools
import re
import shlex
import shutil
from pathlib import Path

import click
import mracad_cli.__main__ as cli
import pytest

from mracad.spec import recipe

ROOT = Path(__file__).parents[2]
DOCS = ROOT / "docs"
PAGES = [ROOT / "README.md", *sorted(DOCS.rglob("*.md"))]
SCRIPTS = sorted((DOCS / "scripts").iterdir())
STARTS = {path.stem: path.read_text() for path in (DOCS / "start").iterdir()}
NAMED = {"part": "cadquery", "levels": "research"}
"""Pages of scripts that have other names."""

MODELS = {
    "edits.md": {"panel.step": "panel"},
    "checks.md": {"part.step": "panel", "old.step": "panel", "new.step": "panel"},
    "mra.md": {"panel.step": "panel", "coarse.edited.step": "panel_clean"},
    "recipes.md": {"panel.step": "panel"},
    "python.md": {"assembly.step": "assembly"},
    "wavelets.md": {"panel.step": "panel"},
}
"""Samples that stand for the models that pages name."""


def blocks(text, *kinds):
    """The blocks of a page in these languages."""
    return re.findall(rf"^```(?:{'|'.join(kinds)})\n(.*?)^```", text, re.DOTALL | re.MULTILINE)


def commands(text):
    """The words of every mracad command in a page's blocks, up to a pipe or another file."""
    found = []
    for block in blocks(text, "sh", "console", "yaml"):
        lines = block.replace("\\\n", " ").splitlines()
        for line in [line[2:] for line in lines if line.startswith("$ ")] if "$ " in block else lines:
            lexer = shlex.shlex(re.sub(r"^ *- run: |(^|\s)#\s.*", "", line), posix=True, punctuation_chars="|<>&")
            lexer.whitespace_split, lexer.commenters = True, ""
            words = list(itertools.takewhile(lambda word: word not in {"|", "<", ">", "&&"}, lexer))
            found += [words] if words[:1] == ["mracad"] else []
    return found


def page_id(path):
    return str(path.relative_to(ROOT))


@pytest.mark.parametrize("path", PAGES, ids=page_id)
def test_commands_of_a_page_are_right(path, monkeypatch, tmp_path):
    monkeypatch.chdir(tmp_path)
    for words in commands(path.read_text()):
        parsed(words[1:])


def parsed(words):
    """The context of a command, as parsed and not run."""
    context = cli.group.make_context("mracad", list(words))
    command = cli.group
    while isinstance(command, click.Group):
        name, command, rest = command.resolve_command(context, [*context._protected_args, *context.args])
        context = command.make_context(name, rest, parent=context)
    if name == "pipeline":
        recipe.pipeline(context.params["steps"])
    return context


@pytest.mark.parametrize("path", PAGES, ids=page_id)
def test_recipes_and_python_of_a_page_are_right(path, tmp_path):
    for block in blocks(path.read_text(), "toml"):
        if "[[step]]" in block:
            (tmp_path / "recipe.toml").write_text(block)
            assert recipe.load(tmp_path / "recipe.toml").tables
    for block in blocks(path.read_text(), "python"):
        compile(block, str(path), "exec")


def test_files_and_targets_that_pages_name_are_there():
    made = (ROOT / "Makefile").read_text()
    for path in [*PAGES, ROOT / "CONTRIBUTING.md"]:
        text = path.read_text()
        files = re.findall(r"\b(?:tests|benchmarks)/[\w/]++(?:\.py)?(?!<)", text)
        assert [name for name in files if not (ROOT / name).exists()] == [], path
        shown = "\n".join([*blocks(text, "sh"), *re.findall(r"`make [^`]+`|^ {4}make .*", text, re.MULTILINE)])
        targets = re.findall(r"^[` ]*make ([a-z][a-z ]*[a-z])", shown, re.MULTILINE)
        assert [name for name in " ".join(targets).split() if f"\n{name}: " not in made] == [], path


@pytest.fixture
def folder(request, samples, tmp_path, monkeypatch):
    """A folder with the samples that a page names, in which it runs."""
    for name, sample in MODELS[request.param].items():
        shutil.copy(samples / f"{sample}.step", tmp_path / name)
    monkeypatch.chdir(tmp_path)
    return request.param, tmp_path


def run(words, mracad):
    """Run a command, which is to end well."""
    result = mracad(*words)
    assert result.code == 0, (words, result.err)


@pytest.mark.parametrize("script", SCRIPTS, ids=lambda path: path.name)
def test_scripts_run(script, samples, tmp_path, monkeypatch, mracad):
    for name in "panel", "panel_clean", "assembly":
        (tmp_path / f"{name}.step").symlink_to(samples / f"{name}.step")
    (tmp_path / "models").mkdir()
    shutil.copy(samples / "assembly.step", tmp_path / "models")
    shutil.copy(samples / "batch" / "recipe.toml", tmp_path)
    monkeypatch.chdir(tmp_path)
    text = script.read_text()
    assert len(text.splitlines()) <= 12
    if script.suffix == ".py":
        exec(compile(text, script.name, "exec"), {})
    for words in commands(f"```sh\n{text}```"):
        run(words[1:], mracad)


@pytest.mark.parametrize("script", SCRIPTS, ids=lambda path: path.name)
def test_scripts_are_those_of_the_pages(script):
    kind = {".py": "python", ".sh": "sh"}[script.suffix]
    assert blocks(STARTS[NAMED.get(script.stem, script.stem)], kind) == [script.read_text()]


@pytest.mark.parametrize("folder", ["python.md", "wavelets.md", "recipes.md"], indirect=True)
def test_the_python_of_a_page_runs(folder, request):
    name, place = folder
    if name == "recipes.md" and not request.config.getoption("--long"):
        pytest.skip("seconds: pytest --long takes it")
    text = (DOCS / name).read_text()
    for block in blocks(text, "toml")[:1]:
        (place / "fair.toml").write_text(block)
    names = {}
    for block in blocks(text, "python"):
        exec(block, names)
    assert all((place / name).exists() for name in re.findall(r'write\("([^"]+)"', (DOCS / name).read_text()))


@pytest.mark.parametrize("folder", ["edits.md", "checks.md", "mra.md", "recipes.md"], indirect=True)
def test_the_commands_of_a_page_run(folder, request, mracad):
    if not request.config.getoption("--long"):
        pytest.skip("a minute: pytest --long takes it")
    name, place = folder
    for block in blocks((DOCS / name).read_text(), "toml")[:1]:
        (place / "fair.toml").write_text(block)
    for words in commands((DOCS / name).read_text()):
        outputs = [place / word for word, before in zip(words[1:], words, strict=False) if before == "-o"]
        for output in outputs:
            output.unlink(missing_ok=True)
        run(words[1:], mracad)
