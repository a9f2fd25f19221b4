"""The sample plug-in adds an edit everywhere: command, recipe, schema, Python."""

import os
import subprocess
import sys
import tomllib
from pathlib import Path

import numpy as np
import pytest

import mracad

PLUGIN = Path(__file__).parents[2] / "samples" / "plugin"


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    """Run Python with the plug-in as pip installs it."""
    place = tmp_path_factory.mktemp("installed")
    project = tomllib.loads((PLUGIN / "pyproject.toml").read_text())["project"]
    points = "\n".join(f"{name} = {value}" for name, value in project["entry-points"]["mracad.edits"].items())
    info = place / "mracad_crown-1.0.dist-info"
    info.mkdir()
    (info / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {project['name']}\nVersion: {project['version']}\n")
    (info / "entry_points.txt").write_text(f"[mracad.edits]\n{points}\n")
    paths = os.pathsep.join([str(place), str(PLUGIN), *sys.path])

    def run(*words):
        environment = os.environ | {"PYTHONPATH": paths}
        return subprocess.run([sys.executable, *words], capture_output=True, text=True, cwd=place, env=environment)

    run.place = place
    return run


def test_the_edit_is_a_command_and_a_step(run, samples):
    panel = samples / "panel.step"
    script = f"""
from mracad_cli.__main__ import main
import mracad
from mracad.spec.recipe import pipeline
from mracad.spec.schema import page
assert main(["crown", {str(panel)!r}, "--faces", "#1", "--height", "0.5mm", "-o", "crowned.step"]) == 0
assert '## crown' in page() and pipeline("crown --height 1mm ! check").steps("a.step")[0].options.height == "1mm"
made = mracad.crown({str(panel)!r}, height=0.5, faces=0)
assert "height : length" in mracad.crown.__doc__ and mracad.report_of(made).deviations[0].largest > 0.4
"""
    done = run("-c", script)
    assert done.returncode == 0 and "1 crowned by 0.5mm" in done.stdout, done.stderr
    before, after = (mracad.snapshot(path).surfaces for path in (panel, run.place / "crowned.step"))
    off = [np.abs(b.net.poles - a.net.poles).max() for a, b in zip(before, after, strict=True)]
    assert off[0] == pytest.approx(0.5, rel=0.1) and max(off[1:]) == 0


def test_a_broken_plug_in_is_a_warning(run):
    points = run.place / "mracad_crown-1.0.dist-info" / "entry_points.txt"
    points.write_text("[mracad.edits]\nnowhere = mracad_nowhere:Nowhere\ncrown = mracad_crown.options:Fitting\n")
    done = run("-c", "import mracad; assert callable(mracad.smooth)")
    assert done.returncode == 0 and done.stderr.count("of another package cannot be used") == 2
