"""Features that a model proposes."""

import numpy as np

from mracad.edit.feature.edits import move
from mracad.edit.feature.find import found
from mracad.occ.step import read_step
from mracad.occ.view import view
from mracad.spec.steps import Move
from tests.edit.feature import grounds
from tests.edit.feature.grounds import HEIGHT, SIGMA
from tests.edit.models import sheet


def test_a_bump_is_found_where_it_is_and_nothing_else():
    (one,) = found(sheet(grounds.plane(100.0, (40.0, 62.0))), {0})
    assert np.abs(np.array(one.place)[:2] - [40, 62]).max() < 1.0
    assert HEIGHT / 2 < one.height < 1.1 * HEIGHT and 2 * SIGMA < one.size < 8 * SIGMA
    assert one.text.startswith("near:40,62,")


def test_what_is_proposed_can_be_moved(samples):
    """The emboss of the shell, among marks of milling, over a seam: with its size and height."""
    shell = view(read_step(samples / "shell.step"))
    faces = {face.index for face in shell.faces}
    (one,) = found(shell, faces)
    print(one)
    assert np.abs(np.array(one.place)[:2] - [90, -2]).max() < 2.0 and one.face == 4
    assert abs(one.height - 1.5) < 0.25 and 26 < one.size < 36
    edit = move(shell, Move(feature=one.text, to="150,-2,44"))
    assert abs(edit.copies[0].deviation) < 0.02 * one.height


def test_noise_and_shape_at_rims_do_not_stand_out(samples):
    for name in ("panel", "blade"):
        model = view(read_step(samples / f"{name}.step"))
        assert found(model, {face.index for face in model.faces if face.surface is not None}) == []


def test_nothing_stands_out_of_a_bare_face():
    assert found(sheet(grounds.uneven()), {0}) == []
