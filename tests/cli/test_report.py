"""mracad report: what it says, and what it refuses."""

import json

import pytest

from tests.cli.test_errors import one_line
from tests.conftest import CORPUS


def test_a_model_is_compared_with_a_reference(mracad, samples, tmp_path, monkeypatch):
    monkeypatch.setattr("mracad.report.figures.SIZE", "96x64")
    out = tmp_path / "a.html"
    result = mracad("report", samples / "panel.step", samples / "panel_clean.step", "-o", out)
    assert result.code == 0 and "valid: yes" in result.out and "compared with panel_clean.step: failed" in result.out
    text = out.read_text(encoding="utf-8")
    assert "Deviation from panel_clean.step" in text and "comparison: failed" in text
    blade = samples / "blade.step"
    same = mracad("report", blade, blade, "-o", tmp_path / "b.html", "--json")
    assert json.loads(same.out)["compare"]["passed"] is True


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
