"""Denoising: noise goes, shape stays, and nobody says at what scale."""

from itertools import pairwise

import cadquery
import numpy as np
import pytest

from mracad.bspline.surface import Net
from mracad.edit.denoise import Quiet, denoise
from mracad.edit.estimate import SHARES, Asked, Risk
from mracad.edit.result import Reason
from mracad.inspect.noise import Noise
from mracad.inspect.seams import seams
from mracad.inspect.spectrum import spectra
from mracad.occ.view import view
from mracad.seam.ladders import Creases
from mracad.spec.steps.smooth import Denoise
from samples.models import documents
from tests.edit import panels
from tests.edit.models import rotation, sheet
from tests.inspect.test_evidence import NOISE as SIZE
from tests.inspect.test_evidence import inner, shape, spoiled

NOISE = 0.3
NONE: Creases = (frozenset(), frozenset())


@pytest.fixture(scope="module")
def panel():
    """The clean panel, its noisy patches, their model, the noise; what either method leaves of the unsplit panel."""
    clean, noisy = panels.whole(32, NOISE)
    patches = panels.cut(noisy, (2, 3))
    one = sheet(noisy)
    unsplit = []
    for method in ("wiener", "spline"):
        after = denoise(one, Denoise(method=method)).displacement.applied(one).surfaces[0].net
        nets = {key: each.net for key, each in panels.cut(after, (2, 3)).items()}
        unsplit.append(panels.rms(nets, patches, clean))
    before = panels.rms({key: each.net for key, each in patches.items()}, patches, clean)
    return clean, patches, view(panels.document(patches)), before, *unsplit


@pytest.fixture(scope="module")
def quiet(panel):
    """What denoising the patches does."""
    _, _, model, *_ = panel
    return denoise(model, Denoise())


def test_noise_goes_and_shape_stays(panel):
    *_, before, unsplit, spline = panel
    print(f"{unsplit / before:.3f} of the noise is left, {spline / before:.3f} by the spline")
    assert unsplit < 0.2 * before
    assert unsplit < 0.8 * spline < 0.24 * before


def test_patches_come_close_to_the_unsplit_surface_and_stay_joined(panel, quiet):
    clean, patches, model, before, _, spline = panel
    after = quiet.displacement.applied(model)
    nets = {key: after.surfaces[i].net for i, key in enumerate(sorted(patches))}
    error = panels.rms(nets, patches, clean)
    print(
        f"{error / before:.3f} of the noise is left, {error / spline:.3f} of what the spline of the unsplit one leaves"
    )
    assert error < 1.15 * spline
    measured = seams(after)
    assert max(seam.gap for seam in measured) < 1e-9 and max(seam.angle for seam in measured) < 1e-5


def test_the_report_says_how_much_noise_there_is(quiet):
    assert [outcome.status for outcome in quiet.outcomes] == ["edited"] * 6
    assert np.abs(np.array([outcome.noise for outcome in quiet.outcomes]) / NOISE - 1).max() < 0.08


def test_a_clean_face_stays_as_it_is():
    clean, _ = panels.whole(32, NOISE)
    edit = denoise(sheet(clean), Denoise())
    (outcome,) = edit.outcomes
    size = np.linalg.norm(np.ptp(clean.poles, axis=(0, 1)))
    moved = max((np.abs(each.poles).max() for each in edit.displacement.offsets.values()), default=0.0)
    assert moved < 1e-6 * size
    if not moved:
        assert (outcome.status, outcome.reason) == ("unchanged", Reason.CLEAN)


def test_a_clean_patch_filled_by_the_kernel_stays_as_it_is():
    """Its control points, of degree 8 over three spans each way, jump about, but not everywhere alike."""
    corners = [
        (30 * np.cos(angle), 30 * np.sin(angle), 4 * (-1) ** k) for k, angle in enumerate(np.arange(6) * np.pi / 3)
    ]
    sides = [
        cadquery.Edge.makeLine(cadquery.Vector(*a), cadquery.Vector(*b)) for a, b in pairwise([*corners, corners[0]])
    ]
    filled = cadquery.Face.makeNSidedSurface(sides, [cadquery.Vector(0, 0, 10)])
    model = view(documents.single(filled.wrapped, "filled"))
    (outcome,) = denoise(model, Denoise()).outcomes
    assert (outcome.status, outcome.noise) == ("unchanged", 0.0)
    assert spectra(model, [0])[0].noise == 0.0


def test_few_control_points_full_of_noise_tell_nothing():
    (outcome,) = denoise(sheet(panels.whole(2, NOISE)[1]), Denoise()).outcomes
    assert (outcome.status, outcome.noise) == ("unchanged", 0.0)


def test_few_noisy_control_points_among_clean_ones_tell_enough():
    """Rims are held with their tangents' rows clean: what is inside is compared with how smooth these are."""
    clean = shape()
    noisy = spoiled(clean, inner(clean, 2))
    edit = denoise(sheet(noisy), Denoise())
    after = edit.displacement.applied(sheet(noisy)).surfaces[0].net
    before, now = (np.sqrt(((net.poles - clean.poles) ** 2).mean()) for net in (noisy, after))
    (outcome,) = edit.outcomes
    print(f"{now / before:.3f} of the noise is left, {outcome.noise / SIZE:.2f} of it found")
    assert now < 0.5 * before and outcome.noise == pytest.approx(SIZE, rel=0.3)
    assert outcome.taken == pytest.approx(1 - outcome.roughness[1].bending / outcome.roughness[0].bending)
    assert not (after.poles - clean.poles)[~inner(clean, 2)].any()
    assert spectra(sheet(noisy), [0])[0].noise == outcome.noise


def test_outer_points_without_noise_stay():
    """Rows without noise all around, told by the differences among them, are not in the noise that is found."""
    clean, noisy = panels.whole(16, NOISE)
    inside = np.pad(np.ones(np.subtract(noisy.poles.shape[:2], 4), bool), 2)[..., None]
    mixed = noisy.with_poles(np.where(inside, noisy.poles, clean.poles))
    moved = denoise(sheet(mixed), Denoise()).displacement.offsets[0].poles
    assert not moved[~inside[..., 0]].any() and moved[inside[..., 0]].any()


def test_more_is_taken_where_the_noise_is_said_to_be_more():
    _, noisy = panels.whole(16, NOISE)
    faces = sheet(noisy).faces
    where = np.ones(noisy.poles.shape[:2], bool), (noisy.u.greville(), noisy.v.greville())
    stated = [Noise(each * NOISE, *where) for each in (0.1, 1.0, 10.0)]
    widths = [Quiet({0: each}, Asked()).wavelength(noisy, faces, NONE) for each in stated]
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


def test_nothing_moves_where_no_estimate_is_surely_better():
    """Clean, but said to be noisy: its own shape is far above such noise."""
    clean, _ = panels.whole(6, 0.0)
    edit = denoise(sheet(clean), Denoise(noise="1e-9mm"))
    moved = max((np.abs(each.poles).max() for each in edit.displacement.offsets.values()), default=0.0)
    assert moved < 1e-7 and edit.outcomes[0].noise == pytest.approx(1e-9)


def test_clean_rims_are_kept_in_the_solve_and_noisy_ones_are_not():
    """Two clean rows all around tell more than the noise beside them; noisy ones must not be carried inwards."""
    clean, noisy = panels.whole(16, NOISE)
    inside = np.pad(np.ones(np.subtract(noisy.poles.shape[:2], 4), bool), 2)[..., None]
    mixed = noisy.with_poles(np.where(inside, noisy.poles, clean.poles))
    cells = panels.cut(clean, (2, 3))
    errors = []
    for net in (mixed, noisy):
        after = denoise(sheet(net), Denoise()).displacement.applied(sheet(net)).surfaces[0].net
        both = [{key: each.net for key, each in panels.cut(x, (2, 3)).items()} for x in (net, after)]
        before, now = (panels.rms(each, cells, clean) for each in both)
        errors.append(now / before)
    print("of the noise is left: {:.3f} with clean rims, {:.3f} with noisy ones".format(*errors))
    assert max(errors) < 0.4 and errors[0] < errors[1]


@pytest.mark.parametrize("edges", ["smooth", "hold"])
def test_outliers_go_and_the_rest_is_as_without_them(edges):
    """Those on rims that are held stay, and only what depends on them is off."""
    _, noisy = panels.whole(24, NOISE)
    rng = np.random.default_rng(5)
    shape = noisy.poles.shape[:2]
    wrong = rng.choice(shape[0] * shape[1], shape[0] * shape[1] // 200, replace=False)
    far = rng.standard_normal((len(wrong), 3))
    poles = noisy.poles.reshape(-1, 3).copy()
    poles[wrong] += 20 * NOISE * far / np.linalg.norm(far, axis=1, keepdims=True)
    spoiled = noisy.with_poles(poles.reshape(noisy.poles.shape))
    rim = np.pad(np.zeros(np.subtract(shape, 2), bool), 1, constant_values=True)
    held = rim & np.isin(np.arange(rim.size), wrong).reshape(shape)
    us, vs = (np.linspace(*knots.domain, 301) for knots in (noisy.u, noisy.v))
    apart = ~noisy.with_poles(held[..., None] * np.ones(3)).grid(us, vs).any(axis=2) | (edges == "smooth")
    errors = []
    for net, share in ((noisy, 0.0), (spoiled, 0.5), (spoiled, 0.0)):
        after = denoise(sheet(net), Denoise(free_edges=edges, outliers=share)).displacement.applied(sheet(net))
        points = after.surfaces[0].net.grid(us, vs)
        off = points[..., 2] - panels.truth(points[..., 0], points[..., 1])
        errors.append(np.sqrt((off[apart] ** 2).mean()))
    print(
        f"{errors[1] / errors[0]:.3f} of the error without outliers; {errors[2] / errors[0]:.3f} if they are not named"
    )
    assert held.any() and errors[1] < 1.15 * errors[0] and errors[2] > 1.5 * errors[0]


@pytest.mark.parametrize("removed", [0.3, 1.0, 3.0])
def test_the_mean_of_two_estimates_with_the_least_risk(removed):
    rng = np.random.default_rng(2)
    one, other = rng.standard_normal((2, 2, 50))

    def risk(change, gone):
        return Risk((change**2).sum(axis=1), gone * np.array([60.0, 20.0]), 1.0)

    first, second = risk(one, 1.0), risk(other, removed)
    found, share = first.mixed(second, (one * other).sum(axis=1))
    every = {a: risk((1 - a) * one + a * other, 1 - a + a * removed).total for a in SHARES}
    assert share == min(every, key=every.get) and found.total == pytest.approx(every[share])
