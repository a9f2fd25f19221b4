"""An edit that spoils a face is taken back, bit for bit, and the others are done."""

import dataclasses
import sys

import numpy as np
import pytest

from mracad.edit.smooth import smooth
from mracad.errors import EditError
from mracad.job.document import run
from mracad.model.displacement import Displacement, Offset
from mracad.model.facts import Failure
from mracad.occ.apply import apply, restore
from mracad.occ.check import check
from mracad.occ.step import read_step
from mracad.occ.view import view
from mracad.spec.steps import Smooth
from tests.conftest import SAMPLES


def test_restore_undoes_moved_and_refined_surfaces():
    for name in ("panel", "blade", "bottle"):
        document = read_step(SAMPLES / f"{name}.step")
        model = view(document)
        rng = np.random.default_rng(0)
        offsets = {}
        for surface in model.surfaces:
            extra = np.array([np.mean(surface.net.u.breaks[:2])]) if surface.index % 2 else np.empty(0)
            shape = surface.net.refined(extra, np.empty(0)).poles.shape
            inner = np.zeros(shape[:2], bool)
            inner[4:-4, 4:-4] = True
            offsets[surface.index] = Offset(np.where(inner[..., None], rng.standard_normal(shape), 0.0), extra)
        apply(document, model, Displacement(offsets))
        assert any(
            not np.array_equal(a.net.poles, b.net.poles)
            for a, b in zip(view(document).surfaces, model.surfaces, strict=True)
        )
        restore(document, model, Displacement(offsets))
        for a, b in zip(view(document).surfaces, model.surfaces, strict=True):
            assert a.net.u == b.net.u and a.net.v == b.net.v and np.array_equal(a.net.poles, b.net.poles)
        assert check(document).valid


def test_a_spoiled_face_is_left_and_named(monkeypatch):
    """The kernel is made to object to face #2 whenever it moves."""
    real = sys.modules["mracad.occ.check"].check

    def picky(document, faces=None, distances=False):
        verdict = real(document, faces, distances)
        if faces is not None and 1 in set(faces):
            return dataclasses.replace(verdict, valid=False, failures=(Failure("face", "UnorientableShape", 1),))
        return verdict

    monkeypatch.setattr(sys.modules["mracad.occ.check"], "check", picky)
    document = read_step(SAMPLES / "panel.step")
    report = run(document, smooth, Smooth(scale="16mm"))
    states = [(o.status, o.words) for o in report.edit.outcomes]
    assert states[1] == ("left", "would come out worse: its result would not be valid")
    assert all(status == "edited" for i, (status, _) in enumerate(states) if i != 1)
    before, after = view(read_step(SAMPLES / "panel.step")).surfaces, view(document).surfaces
    assert np.array_equal(before[1].net.poles, after[1].net.poles)
    assert not np.array_equal(before[0].net.poles, after[0].net.poles)
    assert report.valid_after.valid
    with pytest.raises(EditError, match="#2: would come out worse: its result would not be valid"):
        run(read_step(SAMPLES / "panel.step"), smooth, Smooth(scale="16mm", faces=("#2",)))
