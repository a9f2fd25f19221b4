"""mracad report: what it says, and what it refuses."""

import base64
import json

import pytest

from tests.cli.test_errors import one_line
from tests.conftest import CORPUS
from tests.report.test_page import Read


def test_a_model_is_compared_with_a_reference(mracad, samples, tmp_path, small_pictures):
    out = tmp_path / "a.html"
    result = mracad("report", samples / "panel.step", samples / "panel_clean.step", "-o", out)
    moved = "compared with panel_clean.step: deviation max 0.0633 mm on #2"
    assert result.code == 0 and "valid: yes" in result.out and moved in result.out
    text = out.read_text(encoding="utf-8")
    assert "Deviation from panel_clean.step" in text and "comparison: deviation max 0.0633 mm" in text
    page = Read(text)
    said = " ".join(page.texts)
    assert "outline moved by" in said and moved in said, "the lines of compare"
    assert "comparison: failed" not in said and "fail" not in page.texts, "a comparison without limits fails nothing"
    assert "noted" in page.texts and "seams of NURBS faces: 7 smooth of 7" in said
    blade = samples / "blade.step"
    same = mracad("report", blade, blade, "-o", tmp_path / "b.html", "--json")
    body = json.loads(same.out)
    assert body["compare"]["equal"] is True and "passed" not in body["compare"]
    page = Read((tmp_path / "b.html").read_text(encoding="utf-8"))
    assert "no differences" in " ".join(page.texts)
    faces = page.tables["faces"]
    waves = [row[faces["keys"].index("shortest_wavelength")] for row in faces["rows"] if row]
    analytic = [face["smoothing"] == "analytic" for face in body["faces"]]
    assert any(analytic) and all(wave == [None, "–"] for wave, flat in zip(waves, analytic, strict=True) if flat)


def test_models_are_equal_where_nothing_differs():
    from mracad_cli.render.report import _unjudged

    from mracad.inspect.verdict import Layer, Verdict

    def equal(*statuses):
        return _unjudged(Verdict("a.step", tuple(Layer(status, status) for status in statuses), True))["equal"]

    assert equal("pass", "skipped") and not equal("pass", "noted")


@pytest.fixture
def small_pictures(monkeypatch):
    for name in ("SIZE", "PAIR"):
        monkeypatch.setattr(f"mracad.report.figures.{name}", "96x64")
    monkeypatch.setattr("mracad.report.shades.SAMPLES", 500)


def agree(table, records):
    """How many numbers of a table there are, all of them those of the records."""
    rows = [row for row in table["rows"] if row]
    assert len(rows) == len(records)
    count = 0
    for row, record in zip(rows, records, strict=True):
        for key, (exact, _) in zip(table["keys"], row, strict=True):
            value = record
            for part in key.split("."):
                value = value[int(part)] if isinstance(value, list) else value[part]
            if exact is not None:
                assert json.loads(exact) == value
                count += 1
    return count


def test_an_edit_makes_a_report_of_what_it_did(mracad, samples, tmp_path, small_pictures):
    out = [tmp_path / name for name in ("a.html", "b.html")]
    words = ("smooth", samples / "panel.step", "--scale", "25mm", "--json")
    told = json.loads(mracad(*words, "-o", tmp_path / "a.step", "--report-html", out[0]).out)
    again = mracad(*words, "-o", tmp_path / "a.step", "--overwrite", "--report-html", out[1])
    assert again.code == 0 and out[0].read_bytes() == out[1].read_bytes()
    page = Read(out[0].read_text(encoding="utf-8"))
    said = " ".join(page.texts)
    assert "smooth --scale 25mm" in said and "valid: yes, as read back" in said and "wrote a.step" in said
    assert "Deviation from before, −0.0" in said and "Zebra stripes: before and after" in said
    assert "Height of waves by wavelength before and after, 6 faces that moved" in said
    plot = next(each for each in page.addresses if each.startswith("data:image/svg+xml;base64,"))
    drawn = base64.b64decode(plot.partition(",")[2]).decode()
    assert all(f">{word}</text>" in drawn for word in ("before", "after", "noise", "smooth at 25 mm"))
    assert agree(page.tables["faces"], told["faces"]) > 6 * 7
    assert agree(page.tables["seams"], told["seams"]["each"]) >= 7 * 7
    assert agree(page.tables["deviation"], told["deviation"]) == 6 * 5
    assert agree(page.tables["edges"], told["edges"]) == 17


def test_a_dry_run_makes_a_report_of_the_input(mracad, samples, tmp_path, small_pictures):
    words = ("smooth", samples / "panel.step", "--scale", "25mm", "--dry-run", "--report-html", tmp_path / "a.html")
    assert mracad(*words).code == 0
    said = " ".join(Read((tmp_path / "a.html").read_text(encoding="utf-8")).texts)
    assert "dry run, nothing written" in said and "Deviation from" not in said


def test_a_recipe_tells_each_of_its_steps(mracad, samples, tmp_path, small_pictures):
    steps = "offset --distance 0.5mm ! offset --distance 0.2mm ! check --fail-on free-edges"
    words = ("-o", tmp_path / "a.step", "--report-html", tmp_path / "a.html", "--json")
    result = mracad("pipeline", steps, samples / "panel.step", *words)
    assert result.code == 1 and not (tmp_path / "a.step").exists()
    page, parts = Read((tmp_path / "a.html").read_text(encoding="utf-8")), json.loads(result.out)["steps"]
    said = " ".join(page.texts)
    assert "check: failed" in said and "nothing written" in said and "offset-2: Faces" in said
    assert agree(page.tables["deviation"], parts[1]["deviation"]) == agree(
        page.tables["deviation1"], parts[0]["deviation"]
    )
    assert page.tables["deviation"] != page.tables["deviation1"]


def test_checks_and_comparisons_make_reports(mracad, samples, tmp_path, small_pictures):
    panel, clean = samples / "panel.step", samples / "panel_clean.step"
    for number, (words, code, says) in enumerate(
        ((("check", panel), 0, "check: passed"), (("compare", clean, panel), 1, "Deviation from panel_clean.step"))
    ):
        out = tmp_path / f"{number}.html"
        assert mracad(*words, "--report-html", out).code == code
        assert says in " ".join(Read(out.read_text(encoding="utf-8")).texts)


@pytest.mark.parametrize("words", [["--report-html", "a.pdf"], ["--report-html", "there.html"]])
@pytest.mark.parametrize("command", [["check"], ["smooth", "--scale", "25mm", "-o", "a.step"]])
def test_pages_are_refused_before_the_work(mracad, samples, tmp_path, monkeypatch, command, words):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "there.html").write_text("precious")
    one_line(mracad(*command, samples / "panel.step", *words), 2)
    assert [path.name for path in tmp_path.iterdir()] == ["there.html"]


@pytest.mark.parametrize(
    ("words", "code", "says"),
    [
        (["trimmed.step", "-o", "a.pdf"], 2, ".html"),
        (["trimmed.step", "-o", "there.html"], 2, "--overwrite"),
        (["trimmed.step", "-o", "nowhere/a.html"], 3, "no folder"),
        (["none.step", "-o", "a.html"], 3, "none.step"),
        (["trimmed.step", "none.step", "-o", "a.html"], 3, "none.step"),
        (["trimmed.step", "there.html", "-o", "a.html"], 3, "there.html"),
        (["trimmed.step"], 2, "--output"),
    ],
)
def test_what_is_refused(mracad, samples, tmp_path, monkeypatch, words, code, says):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "there.html").write_text("precious")
    (tmp_path / "trimmed.step").symlink_to(samples / "trimmed.step")
    result = mracad("report", *words)
    one_line(result, code)
    assert says in result.err
    assert (tmp_path / "there.html").read_text() == "precious" and len(list(tmp_path.iterdir())) == 2


@pytest.mark.skipif(CORPUS is None, reason="MRACAD_CORPUS does not name a folder of STEP models")
def test_a_real_model_takes_no_more_than_6_mb(mracad, tmp_path):
    out = tmp_path / "a.html"
    assert mracad("report", CORPUS / "robot_palm_shell_onshape.step", "-o", out).code == 0
    assert 1e5 < out.stat().st_size <= 6e6
