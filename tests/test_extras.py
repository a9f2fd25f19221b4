"""Packages that only some commands need: without them, one line names the extra before any work; no file is written."""

import sys
import tomllib
from pathlib import Path

import pytest

PROJECT = tomllib.loads((Path(__file__).parents[1] / "pyproject.toml").read_text())["project"]


@pytest.mark.parametrize(
    ("missing", "extra", "words"),
    [
        ("cadquery", "cadquery", ["smooth", "panel.step", "--scale", "9mm", "--faces", "cq:>Z", "-o", "a.step"]),
        ("matplotlib", "view", ["spectrum", "panel.step", "-o", "b.svg"]),
        ("jinja2", "view", ["smooth", "panel.step", "--scale", "9mm", "-o", "a.step", "--report-html", "a.html"]),
        ("imageio_ffmpeg", "video", ["smooth", "panel.step", "--scale", "9mm", "-o", "a.mp4"]),
        ("svgelements", "features", ["feature", "make", "a.svg,height:1mm", "-o", "a.feature"]),
        ("ezdxf", "features", ["feature", "make", "a.dxf,height:1mm", "-o", "a.feature"]),
        ("fsspec", "stores", ["smooth", "s3://b/panel.step", "--scale", "9mm", "-o", "a.step"]),
        ("s3fs", "stores", ["batch", "r.toml", "s3://b/*.step", "-O", "out"]),
        ("gcsfs", "stores", ["convert", "panel.step", "-o", "gs://b/a.step"]),
        ("distributed", "cluster", ["batch", "r.toml", "panel.step", "-O", "out", "--cluster", "local"]),
    ],
)
def test_a_missing_package_is_named_with_its_extra(mracad, samples, tmp_path, monkeypatch, missing, extra, words):
    (tmp_path / "r.toml").write_text('[[step]]\nuse = "check"\n')
    (tmp_path / "a.svg").write_text('<svg xmlns="http://www.w3.org/2000/svg"><circle r="3"/></svg>')
    (tmp_path / "a.dxf").write_text("0\nEOF\n")
    (tmp_path / "panel.step").write_bytes((samples / "panel.step").read_bytes())
    before = set(tmp_path.glob("*.*"))
    monkeypatch.chdir(tmp_path)
    for name in (missing, f"{missing}.figure"):
        monkeypatch.setitem(sys.modules, name, None)
    result = mracad(*words)
    assert result.code == 2 and result.err.count("\n") == 1, result.err
    assert f"{missing} is not installed; pip install 'mracad[{extra}]'" in result.err
    assert set(tmp_path.glob("*.*")) == before and not (tmp_path / "out").exists()
    assert missing in [name.replace("-", "_") for name in PROJECT["optional-dependencies"][extra]]
