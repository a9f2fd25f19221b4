"""The sample plug-in adds an edit everywhere: command, recipe, schema, Python."""

import subprocess
import sys
import tomllib
from pathlib import Path

import numpy as np
import pytest

import mracad as library
from mracad.spec.recipe import pipeline
from mracad.spec.schema import page
from mracad.spec.steps import STEPS
from mracad.spec.steps.plugged import plugged

PLUGIN = Path(__file__).parents[2] / "samples" / "plugin"


@pytest.fixture
def installed(tmp_path, monkeypatch):
    """Where a package is installed whose entry points are those of the plug-in."""
    points = tomllib.loads((PLUGIN / "pyproject.toml").read_text())["project"]["entry-points"]["mracad.edits"]
    info = tmp_path / "mracad_crown-1.0.dist-info"
    info.mkdir()
    (info / "METADATA").write_text("Metadata-Version: 2.1\nName: mracad-crown\nVersion: 1.0\n")
    lines = "\n".join(f"{name} = {value}" for name, value in points.items())
    (info / "entry_points.txt").write_text(f"[mracad.edits]\n{lines}\n")
    for place in (PLUGIN, tmp_path):
        monkeypatch.syspath_prepend(place)
    return info


def test_its_edit_is_a_command_a_step_and_a_function(installed, mracad, samples, tmp_path, monkeypatch):
    asked = f"import sys; sys.path[:0] = {sys.path[:2]!r}; from mracad.spec.steps import STEPS; print(*STEPS)"
    steps = subprocess.run([sys.executable, "-c", asked], capture_output=True, text=True, check=True).stdout.split()
    assert {"crown", "smooth"} <= {*steps}
    monkeypatch.setitem(STEPS, "crown", plugged()["crown"])
    before, out = samples / "assembly.step", tmp_path / "out.step"
    done = mracad("crown", before, "--height", "0.5mm", "-o", out)
    assert done.code == 0 and "1 crowned by 0.5mm" in done.out
    was, now = (library.snapshot(path).surfaces[0].net for path in (before, out))
    top = np.abs(now.poles - was.poles).max()
    assert top == pytest.approx(0.5, rel=0.1) and np.array_equal(now.poles[0], was.poles[0])
    assert "## crown" in page() and pipeline("crown --height 1mm ! check").steps("a.step")[0].options.height == "1mm"
    made = library.crown(before, height=0.5)
    assert np.allclose(library.snapshot(made).surfaces[0].net.poles, now.poles, rtol=0, atol=1e-9)
    assert "height : length" in library.crown.__doc__
    monkeypatch.delattr(library, "crown")


def test_a_broken_one_is_a_warning(installed):
    points = "[mracad.edits]\nnowhere = mracad_nowhere:Nowhere\ncrown = mracad_crown.options:Fitting\n"
    (installed / "entry_points.txt").write_text(points)
    with pytest.warns(UserWarning, match="of another package cannot be used") as told:
        assert plugged() == {}
    assert len(told) == 2
