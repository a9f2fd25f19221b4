"""The detail of whole faces: lengths along them and frames."""

import numpy as np

from mracad.edit.character import Character
from mracad.edit.feature.patch import Patch
from tests.edit.feature import grounds
from tests.edit.models import sheet


def test_places_correspond_by_arc_length_and_are_mirrored_beyond_the_face():
    own = Character.of(Patch.of(sheet(grounds.uneven()), 0, {0}), [(0.0, 1.0, 1.0)])
    uv = np.random.default_rng(0).uniform(0, 1, (100, 2))
    lengths = own.lengths(uv)
    assert np.abs(lengths - 200.0 * uv).max() < 0.05  # x = 200 u on the plane
    assert np.abs(own.parameters(lengths) - uv).max() < 1e-9
    for turned in (-lengths, 400.0 - lengths, 400.0 + lengths):
        assert np.abs(own.parameters(turned) - uv).max() < 1e-6


def test_detail_in_frames_of_the_coarse_surface():
    """A band between two scales: what the coarse surface and the detail sum up to; along the normal of a plane."""
    flat = Patch.of(sheet(grounds.plane(60.0, (30.0, 30.0))), 0, {0})
    own = Character.of(flat, [(0.0, 200.0, 1.0)])
    assert np.abs(own.coarse.net.poles + own.detail.poles - flat.net.poles).max() < 1e-12
    uv = np.random.default_rng(0).uniform(10, 50, (100, 2))
    frames = own.frames(uv)
    assert np.abs(frames @ frames.swapaxes(1, 2) - np.eye(3)).max() < 1e-12
    local = own.local(uv)
    assert np.abs(np.einsum("qij,qi->qj", frames, local) - own.detail.evaluate(uv)).max() < 1e-12
