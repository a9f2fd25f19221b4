"""What --close-gaps and --fit-g1 leave is said, and how far off it is."""

import json

import pytest

from mracad.edit.smooth import smooth
from mracad.inspect.seams import seams
from mracad.job import words
from mracad.job.document import run
from mracad.occ.step import write_step
from mracad.occ.view import view
from mracad.spec.steps import Smooth
from tests.edit import panels
from tests.edit.test_seams import torn


@pytest.fixture(scope="module")
def patches():
    _, noisy = panels.whole(8, 0.05, patches=(2, 2))
    return panels.cut(noisy, (2, 2))


def notes(document, **options):
    return words.notes(run(document, smooth, Smooth(level=1, **options), apply=False))


def test_what_is_not_mended_is_named_with_how_far_off_it_stayed(patches):
    before = seams(view(torn(patches, False)))
    widest, steepest = max(before, key=lambda m: m.gap), max(before, key=lambda m: m.angle)
    (gaps,) = notes(torn(patches, False), close_gaps=True, edges="frozen")
    assert "closed 0 of" in gaps and f"edge#{widest.edge + 1} keeps a gap of {widest.gap:.3g} mm" in gaps
    (angles,) = notes(torn(patches, False), fit_g1=5.0, edges="frozen")
    assert "made tangent 0 of" in angles
    assert f"edge#{steepest.edge + 1} keeps an angle of {steepest.angle:.3g}°" in angles


def test_what_is_mended_needs_no_note_and_what_needs_none_is_said(patches):
    assert notes(torn(patches, False), close_gaps=True) == []
    sound = panels.document(patches, sewn=True)
    (none,) = notes(sound, close_gaps=True)
    assert "no gap between edited faces" in none
    least = min(m.angle for m in seams(view(torn(patches, False))) if m.angle > 0.02)
    (above,) = notes(torn(patches, False), fit_g1=least / 2)
    assert f"the smallest above that: {least:.3g}°" in above
    assert notes(sound) == []


def test_notes_are_printed_and_reported(mracad, patches, tmp_path):
    path = tmp_path / "in.step"
    write_step(torn(patches, False), path)
    words = ("smooth", path, "--level", "1", "--close-gaps", "--edges", "frozen", "-o", tmp_path / "out.step")
    result = mracad(*words, "--report", tmp_path / "r.json")
    assert result.code == 0 and "note: close-gaps: closed 0 of" in result.out
    assert "keeps a gap of" in json.loads((tmp_path / "r.json").read_text())["notes"][0]
