"""What smoothing says of its result: curvature jumps of seams, roughness of faces, and what could not be done."""

import json
import re

import numpy as np
import pytest
from scipy.interpolate import make_interp_spline

from tests.occ import shapes
from tests.roughness import compared

BEND = 0.02
"""Curvature, 1/mm, of one side of a seam; the other side is flat."""


@pytest.fixture
def folded(tmp_path):
    """z = 0 for x < 0 and z = BEND x² / 2 beyond: tangent along the seam, with a curvature jump of BEND."""
    y = np.linspace(0.0, 10.0, 4)
    nets = []
    for start, heights in ((-10.0, np.zeros(4)), (0.0, BEND / 2 * np.array([0, 0, 100 / 3, 100]))):
        x = start + np.linspace(0.0, 10.0, 4)
        nets.append(np.stack(np.broadcast_arrays(x[:, None], y, heights[:, None]), axis=-1))
    return shapes.save(shapes.sewn(*(shapes.face_on(shapes.bspline(net)) for net in nets)), tmp_path / "folded.step")


def test_the_curvature_jump_of_seams_is_told(mracad, folded, tmp_path):
    report = tmp_path / "report.json"
    result = mracad("smooth", folded, "--scale", "2mm", "-o", tmp_path / "out.step", "--report", report)
    assert result.code == 0, result.err
    assert f"curvature jump ≤ {BEND} 1/mm (was {BEND})" in result.out.splitlines()[2]
    seams = json.loads(report.read_text())["seams"]
    (seam,) = seams["each"]
    figures = seams["before"]["bend"], seams["after"]["bend"], seam["bend"], seam["after"]["bend"]
    assert figures == pytest.approx([BEND] * 4, rel=1e-9)
    assert f"curvature jump ≤ {BEND} 1/mm" in mracad("info", folded).out


HEIGHT, WAVE, SIZE = 0.05, 10.0, 60.0
"""Of ripples on a sheet, mm, and its side."""


@pytest.fixture
def rippled(tmp_path):
    """z = HEIGHT sin(2π x / WAVE), with 24 spans a wave."""
    spans = round(24 * SIZE / WAVE)
    knots = np.concatenate([[0.0] * 3, np.linspace(0.0, SIZE, spans + 1), [SIZE] * 3])
    middles = (knots[1:-3] + knots[2:-2] + knots[3:-1]) / 3
    heights = make_interp_spline(middles, HEIGHT * np.sin(2 * np.pi * middles / WAVE), 3, t=knots).c
    net = np.stack([*np.meshgrid(middles, middles[:: spans // 12], indexing="ij")], axis=-1)
    net = np.concatenate([net, np.broadcast_to(heights[:, None, None], (*net.shape[:2], 1))], axis=-1)
    return shapes.save(shapes.face_on(shapes.bspline(net)), tmp_path / "rippled.step")


def test_roughness_before_and_after_is_what_the_files_have(mracad, rippled, tmp_path):
    """Before, in closed form; after, as an evaluator of the tests' own finds it in the file."""
    out, k = tmp_path / "out.step", 2 * np.pi / WAVE
    result = mracad("smooth", rippled, "--scale", "25mm", "-o", out, "--json")
    (face,) = json.loads(result.out)["faces"]
    before, after = face["roughness"]
    assert face["status"] == "edited" and face["amount"] > 0.5
    area = SIZE**2
    assert before["bending"] == pytest.approx(HEIGHT**2 * k**4 / 2 * area, rel=0.02)
    assert before["variation"] == pytest.approx(HEIGHT**2 * k**6 / 8 * area, rel=0.02)
    assert before["curvature"] == pytest.approx(HEIGHT * k**2, rel=0.02)
    (found,) = compared(rippled, out)
    for name, figure in (("bending", "bending"), ("variation", "variation"), ("curvature", "largest")):
        assert after[name] == pytest.approx(getattr(found.after, figure), rel=0.05), name
    assert after["bending"] < before["bending"] / 2
    line = mracad("smooth", rippled, "--scale", "25mm", "--dry-run").out.splitlines()[1]
    figures = re.search(r"bending (\S+) → (\S+), curvature variation (\S+) → (\S+) 1/mm²", line).groups()
    told = [each[name] for name in ("bending", "variation") for each in (before, after)]
    assert [float(figure) for figure in figures] == pytest.approx(told, rel=1e-2)
    assert f"curvature ≤ {after['curvature']:.3g} (was {before['curvature']:.3g}) 1/mm" in line


@pytest.fixture
def strips(tmp_path):
    """Three strips side by side under one wavy profile; the tangents along its seams take all of #2."""
    return shapes.save(shapes.zigzag_strips(9, 4, 9), tmp_path / "strips.step")


def test_what_was_asked_for_one_by_one_and_cannot_be_done_is_an_error(mracad, strips, tmp_path):
    out, report = tmp_path / "out.step", tmp_path / "report.json"
    words = ["smooth", strips, "--scale", "8mm", "--refine", "never", "-o", out, "--report", report]
    for face in ("#2", "near:30,18,0"):
        result = mracad(*words, "--faces", face)
        assert result.code == 4 and result.out == "" and not out.exists() and not report.exists()
        assert result.err.count("\n") == 1 and "strips.step: #2: no free control points" in result.err
    result = mracad(*words, "--hold", "#1", "--hold", "#3")
    assert result.code == 0 and out.exists(), result.err
    assert "1 left (#2: no free control points)" in result.out.splitlines()[0]
    assert result.out.splitlines()[0].endswith("; nothing changed")
    face = json.loads(report.read_text())["faces"][1]
    assert (face["status"], face["reason"], face["amount"]) == ("left", "no free control points", 0)
    several = mracad(*words, "--faces", "#1", "--faces", "#2", "--edges", "frozen", "--overwrite")
    assert several.code == 0 and "1 smoothed at 8mm" in several.out and "1 left (#2: " in several.out
