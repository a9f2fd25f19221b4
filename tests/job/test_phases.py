"""The message of a time limit names the phase that was running."""

import time
from functools import reduce
from importlib import import_module

import pytest

from mracad import note
from mracad.edit.feature.edits import repeat
from mracad.job.document import run
from mracad.occ.files import read
from mracad.occ.step import write_step
from mracad.spec.steps import Repeat
from tests.edit import panels


@pytest.fixture
def panel(tmp_path):
    _, noisy = panels.whole(6, 0.1, patches=(2, 2))
    write_step(panels.document(panels.cut(noisy, (2, 2))), tmp_path / "panel.step")
    return tmp_path / "panel.step"


@pytest.mark.parametrize(
    ("place", "phase"),
    [
        ("mracad.job.look:view", "looking at faces"),
        ("mracad.edit.fair:drive", "editing"),
    ],
)
def test_a_time_limit_names_the_phase(place, phase, mracad, panel, tmp_path, monkeypatch):
    module, _, name = place.partition(":")
    *within, name = name.split(".")
    monkeypatch.setattr(reduce(getattr, within, import_module(module)), name, lambda *args, **kwargs: time.sleep(60))
    result = mracad("smooth", panel, "--scale", "60mm", "-o", tmp_path / "out.step", "--time-limit", "3")
    assert result.code == 5 and f"time limit of 3 s exceeded while {phase} 'panel.step'" in result.err
    assert not (tmp_path / "out.step").exists()


def test_every_phase_of_an_edit_is_noted_in_its_turn(mracad, panel, tmp_path, monkeypatch):
    noted = []
    monkeypatch.setattr(note, "doing", lambda stage="", subject="": stage in noted or noted.append(stage))
    assert mracad("smooth", panel, "--scale", "60mm", "-o", tmp_path / "out.step").code == 0
    phases = [
        "reading",
        "looking at faces",
        "editing",
        "measuring seams",
        "checking the input",
        "changing the model",
        "checking the result",
        "measuring the deviation",
        "writing",
    ]
    assert [stage for stage in noted if stage in phases] == phases


def test_every_phase_of_info_is_noted_in_its_turn(mracad, panel, monkeypatch):
    noted = []
    monkeypatch.setattr(note, "doing", lambda stage="", subject="": stage in noted or noted.append(stage))
    assert mracad("info", panel).code == 0
    assert noted == ["reading", "looking at faces", "looking at scales", "measuring seams", "checking"]


def test_copies_of_features_note_their_phases_also_for_a_bar(mracad, panel, tmp_path):
    noted = []

    def watcher(stage, _):
        noted.append(stage)

    note.watch(watcher)
    try:
        options = Repeat(feature="formula:0.5*cos(x/9)**2,radius:12mm", fill="hexagons,spacing:90mm")
        run(read(panel), repeat, options)
    finally:
        note.unwatch(watcher)
    phases = ["finding places", "laying copies", "fitting seams under copies", "comparing copies with the feature",
              "measuring what edges take of copies"]  # fmt: skip
    assert [stage for stage in noted if stage in phases] == phases
