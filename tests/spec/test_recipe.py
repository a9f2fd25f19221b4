"""Recipes: what is wrong in them and where, what they resolve to, how they run."""

from __future__ import annotations

import json
import tomllib
from pathlib import Path
from typing import Annotated, ClassVar

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from mracad_cli.__main__ import main
from msgspec import Meta

from mracad.errors import UsageError
from mracad.spec import recipe, schema
from mracad.spec.places import Place
from mracad.spec.steps import STEPS, Check, Repeat, Selection, Smooth
from mracad.spec.text import toml
from tests.job.batch.runs import models

TEXT = """# a recipe
[[step]]
use = "smooth"
id = "fair"
scale = "2%"
faces = "#1"

[[step]]
use = "check"
max_gap = 0.01
fail-on = ["invalid", "unsewn"]
"""
LINE = "smooth --faces '#1' --scale 2% ! check --max-gap 0.01 --fail-on invalid --fail-on unsewn"


def written(folder: Path, text: str = TEXT) -> Path:
    path = folder / "r.toml"
    path.write_text(text)
    return path


@pytest.mark.parametrize(
    ("old", "new", "place", "hint"),
    [
        ('"smooth"', '"smoth"', "r.toml:3", "'smooth'"),
        ("scale =", "scal =", "r.toml:5", "'scale'"),
        ('"2%"', '"2 parsec"', "r.toml:5", "5mm"),
        ('"2%"', '"{nme}"', "r.toml:5", "'name'"),
        ('"2%"', "[1]", "r.toml:5", "smooth --help"),
        ("0.01", "-1", "r.toml:10", "5mm"),
        ('"unsewn"', '"unsewm"', "r.toml:11", "'unsewn'"),
        ('use = "check"', "", "r.toml:8", "use ="),
        ('id = "fair"', "amount = 3", "r.toml:4", "smooth --help"),
        ('id = "fair"', "level = 3", "r.toml:2", "--level"),
        ('id = "fair"', 'id = "fair', "r.toml:4", "TOML"),
        ("[[step]]", "[[stepp]]", "r.toml:2", "'step'"),
        ('use = "check"', 'use = "check"\nid = "fair"', "r.toml:10", "another"),
        (TEXT, "", "r.toml:1", "[[step]]"),
        ("# a recipe", 'note = """\n[[step]]\nuse = 3\n"""', "r.toml:1", "[[step]]"),
    ],
)
def test_what_is_wrong_is_named_with_its_line_before_anything_is_read(tmp_path, capsys, old, new, place, hint):
    path = written(tmp_path, TEXT.replace(old, new, 1))
    assert main(["run", str(path), str(tmp_path / "missing.step"), "-o", str(tmp_path / "out.step")]) == 2
    said = capsys.readouterr()
    assert place in said.err and hint in said.err and said.err.count("\n") == 1 and not said.out
    assert main(["recipe", "check", str(path)]) == 2


@pytest.mark.parametrize(
    ("text", "hint"),
    [
        ("smooth --scal 2%", "'scale'"),
        ("smoth", "'smooth'"),
        ("smooth --scale", "--help"),
        ("smooth 5mm", "--help"),
        ("smooth --scale 2% !", "smooth --scale 5mm ! check"),
        ("smooth --scale '2%", "quotes"),
    ],
)
def test_a_wrong_pipeline_is_named_with_its_step(capsys, text, hint):
    assert main(["pipeline", text, "missing.step", "-o", "out.step"]) == 2
    assert hint in capsys.readouterr().err


def test_recipe_pipeline_record_and_schema_agree(tmp_path):
    steps = recipe.load(written(tmp_path)).steps("model.step")
    assert [step.id for step in steps] == ["fair", "check"]
    assert recipe.title(steps) == LINE
    assert [step.options for step in recipe.pipeline(LINE).steps("-")] == [step.options for step in steps]
    record = recipe.record_of(steps, tmp_path / "out.toml")
    again = recipe.load(written(tmp_path, record))
    assert again.steps("other.step") == steps
    definitions = schema.schema()["$defs"]
    for step in tomllib.loads(record)["step"]:
        assert set(step) <= set(definitions[step["use"]]["properties"])


def test_options_are_set_and_variables_filled(tmp_path):
    found = recipe.load(written(tmp_path)).with_values(
        ["fair.faces=['{name}', '!#2']", "fair.refine=never", "check.kink=2"]
    )
    fair, check = (step.options for step in found.steps("models/lid.step"))
    assert (fair.faces, fair.refine, check.kink) == (("lid", "!#2"), "never", 2.0)
    for wrong, hint in (("fair.scal=1", "scale"), ("fai.scale=1", "fair"), ("scale", "step.option=value")):
        with pytest.raises(UsageError, match=hint):
            found.with_values([wrong])


class Engrave(Selection, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Engrave a text."""

    function: ClassVar[str] = "mracad.edit.smooth:smooth"
    quiet: ClassVar[str] = "blank"

    stencil: Annotated[Place, Meta(description="Its outline.")]


def test_a_new_edit_is_known_everywhere_by_its_declaration(tmp_path, monkeypatch, capsys):
    monkeypatch.setitem(STEPS, "engrave", Engrave)
    assert main(["engrave", "--help"]) == 0
    assert "--stencil" in capsys.readouterr().out
    assert schema.schema()["$defs"]["engrave"]["required"] == ["use", "stencil"]
    assert "| `stencil` |" in schema.page()
    (step,) = recipe.pipeline("engrave --stencil @marks/a.csv").steps("-")
    assert step.text() == "engrave --stencil @a.csv"
    path = written(tmp_path, '[[step]]\nuse = "engrave"\nstencil = "@a.csv"\n')
    (step,) = recipe.load(path).steps("-")
    assert step.options.files() == (str(tmp_path / "a.csv"),)


def test_one_read_and_one_write_for_the_whole_recipe(tmp_path, capsys, monkeypatch):
    from mracad.occ import files

    source = models(tmp_path / "in", 1) / "part000.step"
    calls = []
    for name in ("read", "write"):
        real = getattr(files, name)
        monkeypatch.setattr(files, name, lambda *a, real=real, name=name, **k: (calls.append(name), real(*a, **k))[1])
    two = "smooth --scale 20% ! smooth --level 1 --amount 0.5 ! check --max-angle 90"
    words = ["pipeline", two, str(source), "-o", str(tmp_path / "out.step"), "--record"]
    assert main([*words, "--depfile", str(tmp_path / "out.d")]) == 0
    assert calls == ["read", "write", "read"]  # the last one is to judge what was written
    said = capsys.readouterr().out
    assert (
        said.startswith("smooth: part000.step: 1 NURBS face") and "\nsmooth-2: " in said and "\ncheck: passed" in said
    )
    assert "smooth --scale 20% ! smooth --amount 0.5 --level 1 ! check" in header(tmp_path / "out.step")
    assert (tmp_path / "out.d").read_text().startswith(f"{tmp_path / 'out.step'}: {source}\n")
    again = ["run", str(tmp_path / "out.step.toml"), str(source), "-o", str(tmp_path / "again.step")]
    assert main(again) == 0
    assert (tmp_path / "again.step").read_bytes() == (tmp_path / "out.step").read_bytes()
    stamp = (tmp_path / "out.step").stat().st_mtime_ns
    assert main([*again[:-1], str(tmp_path / "out.step"), "--if-changed"]) == 0
    assert (tmp_path / "out.step").stat().st_mtime_ns == stamp


def test_an_error_names_the_step_where_there_are_several(tmp_path, capsys):
    source = models(tmp_path / "in", 1) / "part000.step"
    sweep = "sweep --at 900,0,0 --by 0,0,1 --scale 9mm"
    for steps, start in ((f"smooth --scale 20% ! {sweep}", "sweep: point 1 (900"), (sweep, "point 1 (900")):
        assert main(["pipeline", steps, str(source), "--dry-run"]) == 4
        assert capsys.readouterr().err.startswith(f"mracad: {start}")


def test_a_failed_check_stops_the_run(tmp_path, capsys):
    source = models(tmp_path / "in", 1) / "part000.step"
    words = ["check --fail-on free-edges ! smooth --scale 20%", str(source), "-o", str(tmp_path / "out.step")]
    assert main(["pipeline", *words, "--json"]) == 1
    body = json.loads(capsys.readouterr().out)
    assert body["written"] == [] and not (tmp_path / "out.step").exists()
    assert [(step["step"], step["failed"]) for step in body["steps"]] == [("check", ["shells"])]
    assert main(["pipeline", "smooth --scale 20%", *words[1:], "--dry-run"]) == 0
    assert "1. smooth: smooth --scale 20%" in capsys.readouterr().out and not (tmp_path / "out.step").exists()


def test_a_result_is_compared_with_what_came_in_or_with_a_file(tmp_path):
    source = models(tmp_path / "in", 1) / "part000.step"

    def code(line: str) -> int:
        return main(["pipeline", line, str(source), "-o", str(tmp_path / "out.step"), "--overwrite"])

    assert code("smooth --scale 20% ! compare --max-deviation 20%") == 0
    (tmp_path / "out.step").rename(tmp_path / "ref.step")
    assert code("smooth --scale 20% ! compare --max-deviation 1um") == 1
    assert not (tmp_path / "out.step").exists()
    path = written(
        tmp_path, '[[step]]\nuse = "smooth"\nscale = "20%"\n[[step]]\nuse = "compare"\nreference = "ref.step"\n'
    )
    assert (
        main(["run", str(path), str(source), "-o", str(tmp_path / "out.step"), "--depfile", str(tmp_path / "d")]) == 0
    )
    assert f" {path} {tmp_path / 'ref.step'}\n" in (tmp_path / "d").read_text()


def test_the_page_of_steps_is_up_to_date():
    page = Path(__file__).parents[2] / "docs" / "steps.md"
    assert page.read_text(encoding="utf-8") == schema.page(), "run make docs"


def header(path: Path) -> str:
    """The header of a STEP file, its lines joined."""
    return path.read_text().partition("ENDSEC;")[0].replace("\n", "")


TEXTS = st.text(st.characters(exclude_categories=("Cs",)), max_size=8)
FLOATS = st.floats(min_value=0, allow_nan=False)
calm = settings(max_examples=60, deadline=None, suppress_health_check=[HealthCheck.too_slow])


@calm
@given(
    st.builds(Smooth, scale=st.just("2%"), faces=st.lists(TEXTS).map(tuple), instance=st.none() | TEXTS),
    st.builds(Check, max_angle=st.none() | FLOATS, kink=FLOATS),
    TEXTS.filter(bool),
)
def test_a_record_is_a_recipe_whatever_the_options(tmp_path_factory, smooth, check, name):
    """Control characters, quotes, braces of variables, numbers without end."""
    folder = tmp_path_factory.mktemp("record", numbered=True)
    steps = (recipe.Step(name, "smooth", smooth), recipe.Step(f"{name}2", "check", check))
    again = recipe.load(written(folder, recipe.record_of(steps, folder / "recipe.toml")))
    assert again.steps("other.step") == steps


@calm
@given(st.recursive(TEXTS | FLOATS | st.booleans() | st.integers(), lambda x: st.lists(x, max_size=3), max_leaves=5))
def test_values_are_toml(value):
    assert tomllib.loads(f"value = {toml(value)}")["value"] == value


def test_a_record_in_another_folder_finds_its_files(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "out").mkdir()
    steps = recipe.pipeline("compare --reference models/ref.step").steps("-")
    path = tmp_path / "out" / "made.toml"
    path.write_text(recipe.record_of(steps, "out/made.toml"))
    assert recipe.load(path).steps("-")[0].options.files() == (str(tmp_path / "models" / "ref.step"),)


def test_a_record_refuses_what_toml_cannot_hold():
    steps = recipe.pipeline("smooth --scale 2% --faces 'caf\udce9'").steps("-")
    with pytest.raises(UsageError, match="not Unicode"):
        recipe.record_of(steps, "out.toml")


@pytest.mark.parametrize(
    ("line", "files", "there"),
    [
        (
            "transfer --source wood --from wood --to panel --band 0mm:9mm",
            ("wood",),
            ("x/wood", "wood", "panel"),
        ),
        (
            "transfer --source a.step --from b.feature --to 1,1,1",
            ("a.step", "b.feature"),
            ("x/a.step", "x/b.feature", "1,1,1"),
        ),
        ("transfer --source 1 --from #1 --to 1 --band 0mm:9mm", ("1",), ("x/1", "#1", "1")),
    ],
)
def test_the_files_of_a_transfer_are_told_by_their_options(line, files, there):
    """Not by how their names look in others."""
    (step,) = recipe.pipeline(line.replace("#", "'#'")).steps("-")
    assert step.options.files() == files
    moved = step.options.relocated({file: f"x/{file}" for file in files})
    assert (moved.source, moved.from_, moved.to) == there


def test_a_count_is_no_file():
    for text, files in (("7", ()), ("7.json", ("7.json",)), (None, ())):
        step = Check(expect=text)
        assert step.files() == files and step.relocated({"7": "x/7", "7.json": "x/7.json"}).files() == tuple(
            f"x/{file}" for file in files
        )


def test_the_files_of_copies_are_told_by_their_options():
    step = recipe.Step("r", "repeat", Repeat(feature="@b.feature", at=("@a.csv", "1,2,3", "a.csv@0,0")))
    assert step.options.files() == ("@b.feature", "a.csv")
    assert step.options.relocated({"a.csv": "x/c.csv"}).at == ("@x/c.csv", "1,2,3", "a.csv@0,0")
