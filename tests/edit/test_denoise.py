"""Denoising: noise goes, shape stays, and nobody says at what scale."""

import numpy as np
import pytest

from mracad.bspline.surface import Net
from mracad.edit.denoise import Quiet, denoise
from mracad.edit.result import Reason
from mracad.inspect.seams import seams
from mracad.occ.view import view
from mracad.seam.ladders import Creases
from mracad.spec.steps.smooth import Denoise
from tests.edit import panels
from tests.edit.models import rotation, sheet

NOISE = 0.3
NONE: Creases = (frozenset(), frozenset())


def left(model, patches, clean, **options):
    """The denoised model, and the error that is left."""
    after = denoise(model, Denoise(**options)).displacement.applied(model)
    nets = {key: after.surfaces[i].net for i, key in enumerate(sorted(patches))}
    return after, panels.rms(nets, patches, clean)


@pytest.fixture(scope="module")
def panel():
    """The clean panel, its noisy patches and their model, and what is left of the noise of the unsplit one."""
    clean, noisy = panels.whole(32, NOISE)
    patches = panels.cut(noisy, (2, 3))
    one = sheet(noisy)
    after = denoise(one, Denoise()).displacement.applied(one).surfaces[0].net
    unsplit = panels.rms({key: each.net for key, each in panels.cut(after, (2, 3)).items()}, patches, clean)
    before = panels.rms({key: each.net for key, each in patches.items()}, patches, clean)
    return clean, patches, view(panels.document(patches)), before, unsplit


def test_noise_goes_and_shape_stays(panel):
    *_, before, unsplit = panel
    print(f"{unsplit / before:.3f} of the noise is left")
    assert unsplit < 0.4 * before


def test_patches_come_close_to_the_unsplit_surface_and_stay_joined(panel):
    clean, patches, model, before, unsplit = panel
    after, error = left(model, patches, clean)
    print(f"{error / before:.3f} of the noise is left, {error / unsplit:.3f} of what is left of the unsplit surface")
    assert error < 1.15 * unsplit
    measured = seams(after)
    assert max(seam.gap for seam in measured) < 1e-9 and max(seam.angle for seam in measured) < 1e-5


def test_the_report_says_how_much_noise_there_is(panel):
    _, _, model, *_ = panel
    edit = denoise(model, Denoise())
    assert [outcome.status for outcome in edit.outcomes] == ["edited"] * 6
    assert np.abs(np.array([outcome.noise for outcome in edit.outcomes]) / NOISE - 1).max() < 0.08


def test_a_clean_face_stays_as_it_is():
    clean, _ = panels.whole(32, NOISE)
    edit = denoise(sheet(clean), Denoise())
    (outcome,) = edit.outcomes
    size = np.linalg.norm(np.ptp(clean.poles, axis=(0, 1)))
    moved = max((np.abs(each.poles).max() for each in edit.displacement.offsets.values()), default=0.0)
    assert moved < 1e-6 * size
    if not moved:
        assert (outcome.status, outcome.reason) == ("unchanged", Reason.CLEAN)


def test_few_control_points_tell_nothing():
    (outcome,) = denoise(sheet(panels.whole(2, NOISE)[1]), Denoise()).outcomes
    assert (outcome.status, outcome.reason, outcome.noise) == ("unchanged", Reason.CLEAN, 0.0)


def test_more_is_taken_where_the_noise_is_said_to_be_more():
    _, noisy = panels.whole(32, NOISE)
    faces = sheet(noisy).faces
    widths = [Quiet({0: stated}).wavelength(noisy, faces, NONE) for stated in (0.1 * NOISE, NOISE, 10 * NOISE)]
    assert widths[0] < widths[1] < widths[2]
    one = sheet(noisy)
    little, more = (
        denoise(one, Denoise(noise=f"{stated}mm", strength=strength)).displacement.offsets[0].poles
        for stated, strength in ((NOISE, 1.0), (NOISE / 2, 2.0))
    )
    assert np.array_equal(little, more)


def test_rotation_and_scaling_commute():
    _, noisy = panels.whole(16, NOISE)
    turned = Net(noisy.u, noisy.v, 7.0 * noisy.poles @ rotation([1, 2, 3], 0.7).T)
    one, other = (
        denoise(sheet(net), Denoise()).displacement.applied(sheet(net)).surfaces[0].net.poles for net in (noisy, turned)
    )
    assert np.abs(other - 7.0 * one @ rotation([1, 2, 3], 0.7).T).max() < 1e-6
