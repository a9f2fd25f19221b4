"""The commands on the samples: what they print, what they write, what they leave alone."""

import contextlib
import io
import json
import os
import re
import subprocess
import sys

import numpy as np
import pytest

from tests.judge import judge


@pytest.fixture(scope="module")
def smoothed(samples, tmp_path_factory):
    """A panel smoothed at 16 mm, the report, and what was said."""
    from mracad_cli.__main__ import main

    folder = tmp_path_factory.mktemp("smoothed")
    out, report = folder / "out.step", folder / "report.json"
    with contextlib.redirect_stdout(io.StringIO()) as told, contextlib.redirect_stderr(io.StringIO()) as noted:
        words = ["smooth", samples / "panel.step", "--scale", "16mm", "-o", out, "--report", report]
        assert main([str(word) for word in words]) == 0
    return out, json.loads(report.read_text()), told.getvalue(), noted.getvalue()


def test_the_four_lines(smoothed):
    *_, told, noted = smoothed
    assert noted == ""
    found, deviation, seams, valid = told.splitlines()
    assert found == "panel.step: 6 NURBS faces: 6 smoothed at 16mm"
    assert deviation.startswith("deviation: max 0.") and " on #" in deviation
    assert seams.startswith("seams of NURBS faces: 7 smooth of 7, angle ≤ ") and "(was " in seams
    assert valid.startswith("valid: yes, as read back (was yes); wrote out.step, ")


def test_coupled_seams_move_and_are_counted(samples, smoothed):
    out, _, told, _ = smoothed
    assert told.splitlines()[2].endswith("; 7 of 17 edges moved with both faces (stayed: 10 × free edge)")
    after = judge(out)
    assert after.validity.valid and len(after.seams) == 7
    assert max(m.gap for m in after.seams) <= 1e-9 and max(m.angle for m in after.seams) <= 1e-5
    for a, b in zip(judge(samples / "panel.step").model.surfaces, after.model.surfaces, strict=True):
        border = outside(b.net)
        assert np.abs(a.net.over(b.net.u, b.net.v).poles[border] - b.net.poles[border]).max() > 1e-3


def outside(net):
    """The control points of the edges of a face that is all of its surface."""
    border = np.ones(net.poles.shape[:2], bool)
    border[1:-1, 1:-1] = False
    return border


@pytest.mark.parametrize(("words", "off", "scale"), [(["--refine", "never"], 0.0, "16mm"), ([], 1e-12, "10mm")])
def test_frozen_edges_stay_in_the_file(mracad, samples, tmp_path, words, off, scale):
    """Bit for bit, or where knots were put in to rounding."""
    source, out = samples / "panel.step", tmp_path / "out.step"
    assert mracad("smooth", source, "--scale", scale, "--edges", "frozen", *words, "-o", out).code == 0
    finer = []
    for a, b in zip(judge(source).model.surfaces, judge(out).model.surfaces, strict=True):
        change = np.abs(a.net.over(b.net.u, b.net.v).poles - b.net.poles)
        assert change[outside(b.net)].max() <= off * np.abs(a.net.poles).max() and change.max() > 1e-3
        finer.append(a.net.poles.shape != b.net.poles.shape)
    assert any(finer) != bool(words)
    assert all(seam.angle <= 1e-5 and seam.bend <= 1e-9 for seam in judge(out).seams)


@pytest.mark.parametrize("name", ["panel", "trimmed", "bottle", "blade", "assembly"])
def test_every_sample_smooths_and_stays_valid(mracad, samples, tmp_path, name):
    out, report = tmp_path / "out.step", tmp_path / "report.json"
    source = samples / f"{name}.step"
    result = mracad("smooth", source, "--scale", "5%", "-o", out, "--report", report)
    assert result.code == 0, result.err
    body = json.loads(report.read_text())
    assert body["counts"]["edited"] >= 1 and body["deviation"]
    new, old = judge(out), judge(source)
    assert new.validity.valid and old.validity.valid
    assert new.tolerance <= old.tolerance + 1e-7
    for field in ("solids", "shells", "faces", "free_edges"):
        assert getattr(new.validity, field) == getattr(old.validity, field)
    assert max(m.gap for m in new.seams) <= max(m.gap for m in old.seams) + 1e-7


@pytest.mark.parametrize("name", ["assembly", "bottle", "panel"])
def test_amount_zero_changes_nothing(mracad, samples, tmp_path, name):
    out, source = tmp_path / "out.step", samples / f"{name}.step"
    result = mracad("smooth", source, "--scale", "5%", "--amount", "0", "-o", out)
    assert result.code == 0 and "nothing changed" in result.out
    assert re.search(r"; 0 of \d+ edges moved", result.out)
    new, old = judge(out).model, judge(source).model
    assert (new.unit, new.products, len(new.faces)) == (old.unit, old.products, len(old.faces))
    for a, b in zip(new.faces, old.faces, strict=True):
        assert (a.name, a.product, a.colour, a.kind, a.instances) == (b.name, b.product, b.colour, b.kind, b.instances)
    for a, b in zip(new.surfaces, old.surfaces, strict=True):
        assert np.array_equal(a.net.poles, b.net.poles)


def test_selection_and_hold(mracad, samples, tmp_path):
    panel, out = samples / "panel.step", tmp_path / "out.step"
    for words, edited in (
        (["--faces", "#2"], {1}),
        (["--faces", "!#2", "--faces", "!#3"], {0, 3, 4, 5}),
        (["--faces", "near:10,10,40"], None),
        (["--hold", "#1", "--hold", "#6"], {1, 2, 3, 4}),
        (["--faces", "type:bspline"], set(range(6))),
    ):
        result = mracad("smooth", panel, "--scale", "16mm", *words, "--dry-run", "--json", "-o", out)
        assert result.code == 0 and not out.exists()
        found = {face["face"] - 1 for face in json.loads(result.out)["faces"] if face["status"] == "edited"}
        assert found == edited if edited is not None else len(found) == 1


def test_dry_run_writes_only_the_report(mracad, small, tmp_path):
    out, report = tmp_path / "out.step", tmp_path / "report.json"
    words = ["smooth", small[0], "--scale", "4mm", "--dry-run", "-o", out]
    result = mracad(*words, "--report", report)
    assert result.code == 0 and "dry run, nothing written" in result.out
    assert report.exists() and not out.exists()
    out.touch()
    assert mracad(*words).code == 0 and not out.read_bytes()
    assert mracad(*words, "--report", report).code == 2


def test_the_report_says_everything(smoothed):
    _, body, *_ = smoothed
    assert body["written"] == ["out.step"] and body["options"]["scale"] == "16mm"
    assert body["valid"]["before"]["valid"] is True and body["valid"]["after"]["valid"] is True
    assert len(body["faces"]) == 6
    for face in body["faces"]:
        before, after = face["roughness"]
        assert after["bending"] < before["bending"] and after["variation"] < before["variation"]
    assert body["control_points"]["after"] >= body["control_points"]["before"] > 0
    assert len(body["seams"]["each"]) == 7 and {"gap", "angle", "after"} <= body["seams"]["each"][0].keys()
    assert len(body["deviation"]) == 6 and all(d["largest"] <= d["bound"] + 1e-12 for d in body["deviation"])


def test_info(mracad, samples):
    result = mracad("info", samples / "trimmed.step", "--scale", "5%")
    assert result.code == 0 and result.err == ""
    assert "unit mm" in result.out and "valid: yes" in result.out and "changes by" in result.out
    body = json.loads(mracad("info", samples / "bottle.step", "--json").out)
    nurbs = [face for face in body["faces"] if face["kind"] == "bspline"]
    assert any(face["periodic"][0] or face["periodic"][1] for face in nurbs)
    assert all(face["reason"] or face["smoothing"] == "changes" for face in body["faces"])
    assert "nothing" not in result.out


def test_info_at_a_place(mracad, samples):
    places = ("--at", "150,100,60", "--at", "-40,0,0", "--at", "#1@50,40")
    result = mracad("info", samples / "panel_clean.step", *places)
    *_, first, frame, second, _, third, _ = result.out.splitlines()
    assert re.match(r"#1 \(bspline\) at u 50, v 40: [\d.,]+, 0 mm away", third), third
    assert re.match(r"#\d \(bspline\) at u [\d.]+, v [\d.]+: [\d.,]+, [\d.]+ mm away", first), first
    assert "normal" in frame and "u runs along" in frame and "1/mm along" in frame
    assert re.search(r"[4-9]\d(\.\d+)? mm away", second), second
    body = json.loads(mracad("info", samples / "panel_clean.step", "--at", "150,100,60", "--json").out)
    (place,) = body["places"]
    assert abs(np.linalg.norm(np.subtract(place["point"], (150, 100, 60))) - place["distance"]) < 1e-9
    assert sum(face["area"] for face in body["faces"]) > 300 * 200
    assert mracad("info", samples / "panel.step", "--at", "1,2").code == 2
    outside = mracad("info", samples / "panel_clean.step", "--at", "#1@500,40")
    assert outside.code == 4 and "u 0 to 100" in outside.err


def test_info_lists_everything_on_request(mracad, samples):
    short, long = (mracad("info", samples / "assembly.step", *words).out for words in ([], ["--all"]))
    assert len(long.splitlines()) > len(short.splitlines()) and "edge#" in long
    assert "unit in" in short


def test_check(mracad, samples, tmp_path):
    panel = samples / "panel.step"
    assert mracad("check", panel).code == 0
    failed = mracad("check", panel, "--max-angle", "1e-12", "--max-gap", "1e-15mm")
    assert failed.code == 1 and "failed: " in failed.out
    assert mracad("check", panel, "--fail-on", "free-edges").code == 1
    body = json.loads(mracad("check", samples / "bottle.step", "--fail-on", "free-edges", "--json").out)
    layers = {layer["name"]: layer for layer in body["layers"]}
    assert body["passed"] and body["valid"] is True and layers["shells"]["figures"]["solids"] == 1


def test_convert(mracad, samples, tmp_path):
    stl, text, ap = tmp_path / "a.stl", tmp_path / "b.stl", tmp_path / "c.stp"
    assert mracad("convert", samples / "bottle.step", "-o", stl, "-o", ap, "--schema", "AP242").code == 0
    assert (
        mracad("convert", samples / "bottle.step", "-o", text, "--ascii", "--chord", "1mm", "--angle", "30").code == 0
    )
    assert text.read_bytes().startswith(b"solid") and b"AP242" in ap.read_bytes()[:2000]
    triangles = np.frombuffer(stl.read_bytes()[84:], np.dtype([("n", "<f4", 3), ("p", "<f4", (3, 3)), ("a", "<u2")]))[
        "p"
    ]
    assert text.read_text().count("facet normal") < len(triangles)
    sides = np.concatenate([triangles[:, [i, (i + 1) % 3]] for i in range(3)]).reshape(-1, 6)
    _, uses = np.unique(np.concatenate([sides, sides[:, [3, 4, 5, 0, 1, 2]]]), axis=0, return_counts=True)
    assert (uses == 2).all()  # watertight: each side once in each direction


def run(*words, **settings):
    return subprocess.run([sys.executable, "-m", "mracad_cli", *map(str, words)], capture_output=True, **settings)


def test_streams_and_equal_bytes_in_any_process(samples, smoothed, tmp_path):
    words = ["smooth", "-", "--scale", "16mm", "-o", "-"]
    data, settings = (samples / "panel.step").read_bytes(), {**os.environ, "PYTHONHASHSEED": "7"}
    here, there = run(*words, input=data, env=settings), smoothed[0].read_bytes()
    assert here.returncode == 0 and here.stdout.startswith(b"ISO-10303-21;")
    assert b"smoothed at 16mm" in here.stderr and str(tmp_path).encode() not in here.stdout
    (header, *shape), (_, *same) = (each.partition(b"DATA;") for each in (here.stdout, there))
    assert shape == same and b"--scale 16mm" in header and b"mracad" in header


HEAVY = "'OCP', 'numpy', 'scipy', 'cadquery', 'numba', 'matplotlib', 'rich', 'mracad_cli.options'"


@pytest.mark.parametrize("words", [["--help"], ["--version"], []])
def test_help_is_quick_and_loads_no_kernel(words):
    """Not even the options of commands."""
    probe = (
        f"import sys; from mracad_cli.__main__ import main; main({words}); "
        f"sys.exit(any(m in sys.modules for m in ({HEAVY})))"
    )
    assert subprocess.run([sys.executable, "-c", probe], capture_output=True).returncode == 0


def test_help_of_a_command_loads_no_kernel():
    probe = (
        "import sys; from mracad_cli.__main__ import main; code = main(['smooth', '--help']); "
        "sys.exit(code or any(m in sys.modules for m in ('OCP', 'numpy', 'scipy', 'cadquery', 'numba')))"
    )
    assert subprocess.run([sys.executable, "-c", probe], capture_output=True).returncode == 0


def test_importing_the_library_loads_no_numerical_library():
    probe = "import sys, mracad; dir(mracad); sys.exit(bool({'OCP', 'numpy', 'cadquery'} & {*sys.modules}))"
    assert subprocess.run([sys.executable, "-c", probe]).returncode == 0


def test_the_library_does_what_the_command_does(samples, smoothed, tmp_path):
    import mracad as library

    library.smooth(samples / "panel.step", scale="16mm").write(tmp_path / "library.step")
    assert smoothed[0].read_bytes() == (tmp_path / "library.step").read_bytes()
