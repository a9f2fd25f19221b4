"""The laws of joints between the patches of a ball, against their closed form."""

import numpy as np

from mracad.occ.view import view
from mracad.seam.natural import seams
from mracad.seam.wishes import Wishes
from tests.edit.feature import grounds


def test_the_patches_of_a_ball_are_joined_by_a_cosine():
    """Along a side of a cube's patch on a sphere, u from −π/4 to π/4, T_v = ±S_v ± sin(2u) S_u by its metric."""
    ball = view(grounds.sewn(grounds.ball(20.0, 12)))
    plain, found = (seams(ball, range(6), Wishes(pieces=most)).found for most in (0, 64))
    assert len(found) == 12 and {seam.joint.order for seam in plain} == {0} and all(seam.loose for seam in plain)
    share = np.linspace(0, 1, 200)
    for seam in found:
        joint = seam.joint
        assert joint.order == 1 and not seam.loose and joint.missed <= 5e-4 and joint.pieces <= 64
        assert abs(abs(joint.across.values[0]) - 1) < 1e-4 and joint.across.degree == 0
        law = joint.along.at(share, share)
        start = np.sign(law[0])
        assert np.abs(law - start * 2 / np.pi * np.cos(np.pi * share)).max() < 1e-3


def test_laws_take_no_more_pieces_than_are_asked_for():
    ball = view(grounds.sewn(grounds.ball(20.0, 12)))
    assert {seam.joint.order for seam in seams(ball, range(6), Wishes(pieces=8)).found} == {0}
