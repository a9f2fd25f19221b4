"""The example of make example: its figures."""

import json
from pathlib import Path

import numpy as np
import pytest
from mracad_cli.__main__ import main

from samples.example import make

FOLDER = Path(make.__file__).parent
PANEL = FOLDER.parent / "panel.step"


@pytest.fixture(scope="module")
def steps(tmp_path_factory):
    """The report of each step of the recipe."""
    folder = tmp_path_factory.mktemp("example")
    report = folder / "report.json"
    target = folder / "out.step"
    assert main(["run", str(FOLDER / "recipe.toml"), str(PANEL), "-o", str(target), "--report", str(report)]) == 0
    assert target.exists()
    return {step["step"]: step for step in json.loads(report.read_text())["steps"]}


def test_seams_hold_through_all_steps(steps):
    edits = [step for step in steps.values() if "seams" in step]
    assert len(edits) == 5 and "check" in steps
    for step in edits:
        seams = step["seams"]["after"]
        print(f"{step['step']}: gap {seams['gap']:.1e} mm, angle {seams['angle']:.1e}°")
        assert step["valid"]["after"]["valid"]
        assert seams["gap"] <= 1e-7 and seams["angle"] <= 0.01 and seams["smooth"] == 7


def test_copies_are_near_their_ideal(steps):
    copies = steps["repeat"]["copies"]
    worst = max(copy["deviation"] for copy in copies)
    print(f"{len(copies)} copies, off by {worst:.1e} mm at most; over {max(len(c['faces']) for c in copies)} faces")
    assert len(copies) == 7 and worst <= 3e-3 * 1.5
    assert sum(len(copy["faces"]) > 1 for copy in copies) >= 3
    for name in ("emboss", "move"):
        (copy,) = steps[name]["copies"]
        assert copy["deviation"] <= 3e-3 * 1.5 and copy["lost"] <= 1e-6


def test_the_moved_emboss_left_no_trace(steps):
    """What moving takes away is what carrying it there had put: the sum is small against the emboss."""
    there = {d["face"]: d["largest"] for d in steps["move"]["deviation"]}
    here = {d["face"]: d["largest"] for d in steps["emboss"]["deviation"]}
    assert abs(there[1] - here[1]) <= 1e-2 * here[1]


def test_the_details_are_what_makes_them(tmp_path):
    make.main(tmp_path)
    assert (tmp_path / "details.step").read_bytes() == (FOLDER / "details.step").read_bytes()


def test_the_knurl_has_its_height(steps):
    (moved,) = steps["knurl"]["deviation"]
    print(f"knurl: {moved['largest']:.3f} mm high")
    assert moved["face"] == 2 and np.isclose(moved["largest"], 0.15, atol=0.02)
