"""A seam that breaks is found by a comparison, by its faces; and by a check that was told what to expect."""

import json

import numpy as np
import pytest

from mracad.occ.files import write
from tests.occ import shapes
from tests.occ.shapes import bspline, face_on, sewn

SPREAD = ("--max-deviation", "100mm")


def strip(start, stop):
    """A flat B-spline face along a line from ``start`` to ``stop``, (x, z), ten wide."""
    along = np.linspace(start, stop, 6)
    poles = np.stack([np.stack([along[:, 0], np.full(6, y), along[:, 1]], -1) for y in np.linspace(0, 10, 5)], 1)
    return face_on(bspline(poles))


def panel(path, *angles, order=(0, 1, 2)):
    """Three flat strips with a turn by some degrees at each of the two seams."""
    headings = np.radians(np.cumsum([0.0, *angles]))
    corners = np.concatenate([[[0.0, 0.0]], np.cumsum(10 * np.stack([np.cos(headings), np.sin(headings)], -1), axis=0)])
    strips = [strip(corners[i], corners[i + 1]) for i in range(3)]
    write(shapes.document(sewn(*(strips[i] for i in order)), names={0: "panel"}), path)
    return path


@pytest.fixture
def flat(tmp_path):
    return panel(tmp_path / "flat.step", 0, 0)


@pytest.fixture
def bent(tmp_path):
    return panel(tmp_path / "bent.step", 15, 15, order=(2, 0, 1))


def layer(result, name):
    return next(x for x in json.loads(result.out)["layers"] if x["name"] == name)


def test_seams_that_are_no_longer_smooth_fail_a_comparison(mracad, flat, bent):
    result = mracad("compare", flat, bent, *SPREAD, "--json")
    assert result.code == 1 and json.loads(result.out)["failed"] == ["seams"]
    found = layer(result, "seams")["findings"]
    assert [f["rule"] for f in found] == ["crease", "crease"]
    for finding in found:
        assert finding["figures"]["was"] == pytest.approx(0, abs=1e-6)
        assert finding["figures"]["now"] == pytest.approx(15, abs=1e-6)
        edge = f"edge#{finding['edge']} between #{finding['faces'][0]} and #{finding['faces'][1]}"
        assert finding["text"].startswith(f"{edge} is no longer smooth: 15°, was ")
    assert len(set(found[0]["faces"]) & set(found[1]["faces"])) == 1  # the middle strip, whatever its number
    assert mracad("compare", bent, flat, *SPREAD).code == 0  # a seam may become smooth
    assert mracad("compare", bent, bent).code == 0  # and a crease stay one
    assert mracad("compare", flat, bent, *SPREAD, "--ignore", "seams").code == 0


def test_a_smooth_seam_may_turn_a_little(mracad, tmp_path, flat):
    assert mracad("compare", flat, panel(tmp_path / "new.step", 0.9, 0), *SPREAD).code == 0
    assert mracad("compare", flat, panel(tmp_path / "more.step", 1.1, 0), *SPREAD).code == 1


def test_a_check_counts_smooth_seams(mracad, tmp_path, flat):
    one = panel(tmp_path / "one.step", 1.3, 0.2)
    result = mracad("check", one)
    assert result.code == 0 and "1 smooth of 2 seams of all faces; the next at 1.3°" in result.out
    assert "2 smooth of 2 seams of all faces; angle" in mracad("check", flat).out
    assert mracad("check", one, "--expect", "1").code == mracad("check", flat, "--expect", "2").code == 0
    result = mracad("check", one, "--expect", "2", "--json")
    assert result.code == 1 and json.loads(result.out)["failed"] == ["seams"]
    count, nearest = layer(result, "seams")["findings"]
    assert count["text"] == "1 seams are smooth, 2 were expected"
    assert nearest["rule"] == "not-smooth" and nearest["figures"]["angle"] == pytest.approx(1.3, abs=1e-6)
    assert nearest["edge"] and len(nearest["faces"]) == 2
    assert mracad("check", one, "--expect", "2", "--kink", "2").code == 0


def test_what_is_expected_may_be_an_earlier_report(mracad, tmp_path, samples, flat, bent):
    report = tmp_path / "check.json"
    report.write_text(mracad("check", flat, "--json").out)
    assert mracad("check", flat, "--expect", report).code == 0
    assert mracad("check", bent, "--expect", report).code == 1

    smoothed, report = tmp_path / "smoothed.step", tmp_path / "edit.json"
    assert mracad("smooth", samples / "panel.step", "--scale", "16mm", "-o", smoothed, "--report", report).code == 0
    assert mracad("check", smoothed, "--expect", report).code == 0
    assert mracad("check", flat, "--expect", report).code == 1  # two of seven

    for text in ("{}", "no json", '{"layers": []}'):
        report.write_text(text)
        assert mracad("check", flat, "--expect", report).code == 3
    assert mracad("check", flat, "--expect", tmp_path / "none.json").code == 3


def test_a_pipeline_expects_too(mracad, tmp_path, flat, bent):
    words = ("-o", tmp_path / "out.step")
    assert mracad("pipeline", "check --expect 2", bent, *words).code == 1
    assert mracad("pipeline", "check --expect 2", flat, *words).code == 0
