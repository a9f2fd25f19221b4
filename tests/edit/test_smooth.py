"""Smoothing on kernel-free models: covariance, the meaning of a scale, what must not move, bounds, levels."""

import dataclasses

import numpy as np
import pytest

from mracad.bspline.knots import KnotVector
from mracad.bspline.net import Net
from mracad.edit.smooth import smooth
from mracad.errors import UsageError
from mracad.options import Smooth
from mracad.select import Scope
from tests.edit.models import fitted, rotation, sheet


def rough(seed=0, degree=3, spans=(30, 22), noise=0.05, weights=False):
    rng = np.random.default_rng(seed)
    u, v = (KnotVector.clamped(np.r_[0, np.cumsum(rng.uniform(0.5, 1.5, n))], degree) for n in spans)
    x, y = np.meshgrid(u.greville(), v.greville(), indexing="ij")
    poles = np.stack([x, y, 2 * np.sin(x / 9) * np.cos(y / 7)], axis=-1) + noise * rng.standard_normal((*x.shape, 3))
    return Net(u, v, poles, rng.uniform(0.7, 1.4, x.shape) if weights else None)


def moved(net, matrix=None, shift=0.0, factor=1.0):
    matrix = np.eye(3) if matrix is None else matrix
    return Net(net.u, net.v, factor * net.poles @ matrix.T + shift, net.weights)


def smoothed(net, **options):
    model = sheet(net, diagonal=options.pop("diagonal", None))
    edit = smooth(model, Smooth(**options))
    return edit.displacement.applied(model).surfaces[0].net, edit


@pytest.mark.parametrize("degree", [2, 3, 5, 8])
@pytest.mark.parametrize("weights", [False, True])
def test_translation_rotation_and_scaling_commute(degree, weights):
    net = rough(degree=degree, weights=weights)
    plain, edit = smoothed(net, scale="4mm")
    assert edit.outcomes[0].status == "edited"
    size = np.ptp(net.poles)
    shift = np.array([1e3, -400.0, 250.0])
    assert np.abs(smoothed(moved(net, shift=shift), scale="4mm")[0].poles - plain.poles - shift).max() < 1e-9 * size
    turn = rotation([1, 2, -0.5], 0.7)
    assert np.abs(smoothed(moved(net, turn), scale="4mm")[0].poles - plain.poles @ turn.T).max() < 1e-9 * size
    large = smoothed(moved(net, factor=25.4), scale=f"{4 * 25.4}mm")[0].poles
    assert np.abs(large / 25.4 - plain.poles).max() < 1e-9 * size


def parameterisations(height):
    """One height field over 100 mm × 100 mm on five parameterisations; degrees, knots and speed differ."""
    rng = np.random.default_rng(5)
    uneven = np.r_[0, np.cumsum(rng.uniform(0.5, 1.5, 140))]
    uneven /= uneven[-1]
    dense = np.unique(np.r_[np.linspace(0, 0.5, 61), np.linspace(0.5, 1, 151)])
    even = KnotVector.clamped(np.linspace(0, 1, 141), 3)
    yield fitted(even, even, height)
    yield fitted(KnotVector.clamped(uneven, 3), KnotVector.clamped(uneven[::-1] * -1 + 1, 3), height)
    yield fitted(KnotVector.clamped(np.linspace(0, 1, 121), 5), even, height)
    yield fitted(KnotVector.clamped(dense, 3), KnotVector.clamped(np.linspace(0, 1, 201), 2), height)
    speed = lambda t: 100 * (0.6 * t + 0.4 * t**2)  # noqa: E731
    fast = KnotVector.clamped(np.linspace(0, 1, 181), 3)
    yield fitted(fast, fast, height, u_of=speed, v_of=speed)


def kept(net, wave, scale):
    """Share of a ripple's amplitude left in the middle of the sheet, fitted to the ripple and its quadrature."""
    result, _ = smoothed(net, scale=f"{scale}mm", diagonal=150.0)
    grid = np.linspace(0.25, 0.75, 160)
    points = result.grid(grid, grid).reshape(-1, 3)
    k = 2 * np.pi / wave
    basis = np.stack([np.sin(k * points[:, 0]), np.cos(k * points[:, 0]), np.ones(len(points))], axis=1)
    coefficients = np.linalg.lstsq(basis, points[:, 2], rcond=None)[0]
    return float(np.hypot(*coefficients[:2]) / 0.05)


SCALE = 10.0


@pytest.mark.parametrize(
    ("wave", "low", "high"), [(3.5, 0, 0.1), (5.0, 0, 0.1), (30.0, 0.95, 1.01), (45.0, 0.95, 1.01)]
)
def test_scale_is_a_wavelength_on_every_parameterisation(wave, low, high):
    shares = [kept(net, wave, SCALE) for net in parameterisations(lambda x, y: 0.05 * np.sin(2 * np.pi * x / wave))]
    print(f"ripple of {wave} mm at scale {SCALE} mm: kept", np.round(shares, 4))
    assert low <= min(shares) and max(shares) <= high
    assert max(shares) - min(shares) <= 0.1


def test_nothing_frozen_moves_by_a_bit():
    net = rough()
    result, _ = smoothed(net, scale="4mm")
    border = np.ones(net.poles.shape[:2], bool)
    border[2:-2, 2:-2] = False
    assert np.array_equal(result.poles[border], net.poles[border])
    assert (result.poles[~border] != net.poles[~border]).mean() > 0.99
    for keep, rows in (("g0", 1), ("g2", 3)):
        result, _ = smoothed(net, scale="4mm", keep=keep)
        assert np.array_equal(result.poles[:rows], net.poles[:rows])
        assert (result.poles[rows, rows:-rows] != net.poles[rows, rows:-rows]).any()


def test_amount_scales_the_edit_and_zero_is_the_identity():
    net = rough()
    full, _ = smoothed(net, scale="4mm")
    half, _ = smoothed(net, scale="4mm", amount=0.5)
    assert np.abs(half.poles - (net.poles + full.poles) / 2).max() < 1e-12
    _, none = smoothed(net, scale="4mm", amount=0.0)
    assert not none.displacement.offsets and none.outcomes[0].reason == "amount 0"


def test_a_bound_on_the_deviation_holds_and_blends():
    net = rough(noise=0.2)
    free, _ = smoothed(net, scale="4mm")
    change = np.linalg.norm(free.poles - net.poles, axis=-1)
    bound = 0.4 * change.max()
    result, edit = smoothed(net, scale="4mm", max_deviation=f"{bound}mm")
    limited = np.linalg.norm(result.poles - net.poles, axis=-1)
    assert 0.5 * bound < limited.max() <= bound
    assert edit.outcomes[0].moved <= bound
    loose, _ = smoothed(net, scale="4mm", max_deviation="50mm")
    assert np.array_equal(loose.poles, free.poles)


def test_levels_are_rungs_and_fractions_lie_between_them():
    net = rough(noise=0.2)
    levels = {level: smoothed(net, level=level)[1] for level in (1.0, 2.0, 1.5)}
    from mracad.edit.smooth import _SurfaceSmoothing

    model = sheet(net)
    target = {
        level: _SurfaceSmoothing(model, model.surfaces[0], {0}, Smooth(level=level))._target(None).poles
        for level in (1.0, 2.0, 1.5)
    }
    assert np.abs(target[1.5] - (target[1.0] + target[2.0]) / 2).max() < 1e-12
    assert all(edit.outcomes[0].status == "edited" for edit in levels.values())
    assert np.ptp(target[2.0] - net.poles) > np.ptp(target[1.0] - net.poles)


def test_a_coarse_face_is_left_alone_and_says_why():
    _, edit = smoothed(rough(), scale="0.5mm")
    assert edit.outcomes[0].status == "unchanged" and "no span finer" in edit.outcomes[0].reason
    flat = rough(noise=0.0)
    plane = Net(flat.u, flat.v, np.concatenate([flat.poles[..., :2], 0 * flat.poles[..., :1]], axis=-1))
    _, edit = smoothed(plane, scale="4mm")
    assert edit.outcomes[0].status == "unchanged" and edit.outcomes[0].reason == "no detail"
    assert not edit.displacement.offsets


def stuck_net():
    """A ruled strip: both rows of its net lie on edges."""
    net = rough(spans=(30, 22))
    v = KnotVector.clamped([0, 6], 1)
    return Net(net.u, v, net.poles[:, [0, -1]])


def test_a_face_without_free_points_is_stuck_until_it_is_refined():
    net = stuck_net()
    result, edit = smoothed(net, scale="4mm")
    outcome = edit.outcomes[0]
    assert outcome.status == "stuck" and outcome.reason == "no free control points" and outcome.detail > 0.01
    assert np.array_equal(result.poles, net.poles)
    result, edit = smoothed(net, scale="4mm", refine=True)
    assert edit.outcomes[0].status == "edited" and edit.outcomes[0].inserted > 0
    uv = np.stack(np.meshgrid(np.linspace(*net.u.domain, 50), net.v.domain), axis=-1).reshape(-1, 2)
    assert np.abs(result.evaluate(uv) - net.evaluate(uv)).max() < 1e-12


def test_a_crease_line_stays_and_a_smooth_line_of_full_multiplicity_goes():
    breaks, mults = np.arange(41.0), np.ones(41, int)
    mults[[0, 20, -1]] = 4, 3, 4
    u = KnotVector.from_multiplicities(breaks, mults, 3)
    v = KnotVector.clamped(np.arange(31.0), 3)
    rng = np.random.default_rng(0)
    for slope, creases in ((1.0, 1), (0.0, 0)):
        x, y = np.meshgrid(u.greville(), v.greville(), indexing="ij")
        noise = 0.02 * rng.standard_normal(x.shape)
        noise[19:26] = 0.0
        net = Net(u, v, np.stack([x, y, slope * np.abs(x - 20) + noise], axis=-1))
        result, edit = smoothed(net, scale="5mm")
        assert edit.outcomes[0].creases == creases and edit.outcomes[0].status == "edited"
        line = np.stack([np.full(20, 20.0), np.linspace(5, 25, 20)], axis=1)
        turn = np.einsum("ij,ij->i", result.normals(line, ("left", "right")), result.normals(line))
        assert np.degrees(np.arccos(np.clip(turn, -1, 1))).max() == pytest.approx(90.0 * slope, abs=1.5)


def test_held_and_unselected_faces_stay():
    model = sheet(rough())
    for scope, status in (
        (Scope(frozenset({0}), held=frozenset({0})), "held"),
        (Scope(frozenset()), "unselected"),
    ):
        edit = smooth(model, Smooth(scale="4mm"), scope=scope)
        assert edit.outcomes[0].status == status and not edit.displacement.offsets


def test_faces_that_are_not_nurbs_are_named():
    model = sheet(rough())
    plane = dataclasses.replace(model.faces[0], index=1, kind="plane", surface=None, trims=())
    edit = smooth(dataclasses.replace(model, faces=(*model.faces, plane)), Smooth(scale="4mm"))
    assert [o.status for o in edit.outcomes] == ["edited", "analytic"]


@pytest.mark.parametrize("scale", ["0", "-3mm", "nan", "inf", "5 parsecs", "", "mm", "1e400mm"])
def test_a_scale_that_is_no_length_is_refused(scale):
    with pytest.raises(UsageError, match="scale"):
        smooth(sheet(rough()), Smooth(scale=scale))


@pytest.mark.parametrize(
    "options",
    [
        {},
        {"scale": "5", "level": 1.0},
        {"level": 0.0},
        {"level": float("nan")},
        {"scale": "5", "amount": 1.5},
        {"scale": "5", "amount": float("nan")},
    ],
)
def test_contradictory_options_are_refused(options):
    with pytest.raises(UsageError):
        Smooth(**options)
