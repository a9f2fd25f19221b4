"""Rounds too small for a scale keep their shape: the wavelength follows their radius."""

import numpy as np
import pytest

from mracad.bspline.fit import interpolated
from mracad.bspline.knots import KnotVector
from mracad.bspline.surface import Net
from mracad.edit.fair import Filter
from mracad.edit.smooth import smooth
from mracad.edit.target import sheets
from mracad.edit.tolerances import GROWTH
from mracad.edit.watch import Tried, Watch
from mracad.model.cells import quadrature
from mracad.seam.energy import forms
from mracad.seam.interface import Joints
from mracad.seam.solve import Problem, Space
from mracad.spec.steps import Smooth
from tests.edit.models import sheet


def rounded(radius=6.0, noise=0.0, wave=0.0):
    """Two planes with a round between them; noise, and waves of 20 mm along the round."""
    u, v = KnotVector.clamped(np.linspace(-40, 40, 81), 3), KnotVector.clamped(np.linspace(0, 80, 41), 3)
    us, vs = np.meshgrid(u.greville(), v.greville(), indexing="ij")
    half = radius * np.pi / 4
    turn = np.clip(us, -half, half) / radius
    away = us - np.clip(us, -half, half)
    normals = np.stack([np.sin(turn), 0 * turn, np.cos(turn)], axis=-1)
    middle = np.stack([away * np.cos(turn), vs, -radius - away * np.sin(turn)], axis=-1)
    high = radius + wave * np.sin(2 * np.pi * vs / 20)
    net = Net(u, v, interpolated(u, v, middle + high[..., None] * normals))
    return net.with_poles(net.poles + noise * np.random.default_rng(1).standard_normal(net.poles.shape))


def target(net, limited):
    """What smoothing at 60 mm would do to a surface if nothing were held and nobody judged it."""
    wish, model = Filter(60.0, limited=limited), sheet(net)
    (one,) = sheets(model, [0], wish).values()
    form = forms(one.net, one.metric, quadrature(one.net, one.faces), one.creases, one.stretch)
    every = np.ones(net.poles.shape[:2], bool)
    problem = Problem({0: Space(one.net, form, every, every, one.trend.poles)})
    return net.with_poles(net.poles + wish.target(problem, {0: one}, Joints()).reshape(net.poles.shape))


def off(net, truth, band=(-4.0, 4.0)):
    """Distances along the normals from the truth, about the round, without the ends."""
    us, vs = np.linspace(*band, 101), np.linspace(15, 65, 201)
    normals = truth.normals(np.stack(np.meshgrid(us, vs, indexing="ij"), axis=-1).reshape(-1, 2))
    return ((net.grid(us, vs) - truth.grid(us, vs)).reshape(-1, 3) * normals).sum(axis=1).reshape(101, 201)


def test_a_round_stays_and_waves_along_it_go():
    clean, wavy = rounded(), rounded(wave=0.05)
    free, limited = (off(target(wavy, limited), clean) for limited in (False, True))
    phase = np.exp(2j * np.pi * np.linspace(15, 65, 201)[:160] / 20)
    wave = float(2 * np.abs(limited[:, :160] @ phase / 160).max())
    shape = [float(np.abs(each[:, :160].mean(axis=1)).max()) for each in (free, limited)]
    print(f"profile changed by {shape[0]:.3f} mm without, {shape[1]:.4f} with; {wave / 0.05:.3f} of the waves left")
    assert 7 * shape[1] < shape[0] and wave < 0.1 * 0.05


def test_new_waves_on_a_round_do_not_hide_in_its_bend():
    """Next to a curvature of 1 / 6 mm, waves of 0.02 mm add little; the judge knows that the round is no wave."""
    clean, wavy = rounded(), rounded(wave=0.02)
    spread = []
    for limited in (False, True):
        (one,) = sheets(sheet(clean), [0], Filter(20.0, limited=limited)).values()
        watch = Watch([(clean, one.base, one.faces)], one.wavelength, [one.reach])
        (change,) = Tried(watch, [clean], [wavy.poles - clean.poles]).changes({0: 1.0})[0].values()
        spread.append(change.spread)
    print(f"excess over what was there: {spread[0]:.3f} if the round counts as a wave, {spread[1]:.2f} if not")
    assert spread[0] < GROWTH.spread < spread[1]


@pytest.mark.parametrize("scale", ["20mm", "60mm"])
def test_noise_goes_and_the_round_stays(scale):
    """Without the limit the judge lets the round be flattened: that is smoother."""
    clean, noisy = rounded(), rounded(noise=0.02)
    model, left = sheet(noisy), []
    before = float(np.sqrt((off(noisy, clean, (-30.0, 30.0)) ** 2).mean()))
    for limited in (True, False):
        options = Smooth(scale=scale, limit_by_curvature=limited, free_edges="smooth", corners="move")
        after = smooth(model, options).displacement.applied(model).surfaces[0].net
        left.append(float(np.sqrt((off(after, clean, (-30.0, 30.0)) ** 2).mean())) / before)
    print(f"{scale}: error {left[0]:.2f} of the noise with the limit, {left[1]:.1f} without")
    assert 6 * left[0] < left[1]


def profile(turn, knots, stretch=None):
    """A sheet of 80 mm by the turn of its profile at arc lengths; ``stretch`` gives arc lengths at parameters."""
    v = KnotVector.clamped(np.linspace(0, 80, 21), 3)
    s = np.linspace(*knots.domain, 30_001) if stretch is None else stretch(np.linspace(*knots.domain, 30_001))
    angle = turn(s)
    steps = np.stack([np.cos(angle), np.sin(angle)], axis=-1)
    walked = np.cumsum((steps[1:] + steps[:-1]) / 2 * np.diff(s)[:, None], axis=0)
    walked = np.concatenate([np.zeros((1, 2)), walked])
    at = knots.greville() if stretch is None else stretch(knots.greville())
    x, z = (np.interp(at, s, each)[:, None] + np.zeros(v.count) for each in walked.T)
    return Net(knots, v, interpolated(knots, v, np.stack([x, v.greville() + 0 * x, z], axis=-1)))


def test_shape_beside_rims_does_not_go_for_the_sake_of_a_round():
    """Bent with a radius of 400 mm outside the round, the sheet has nothing shorter than the scale there.  Bending less
    towards its free rims, as it would without a trend, it would move by 0.16 mm there."""
    knots = KnotVector.clamped(np.linspace(-150, 150, 151), 3)
    net = profile(lambda s: np.clip(s, -4.5, 4.5) / 6 + (s - np.clip(s, -4.5, 4.5)) / 400, knots)
    moved = np.abs(off(target(net, True), net, (110.0, 150.0))).max()
    print(f"{moved:.4f} mm beside the rim")
    assert moved < 0.02


def test_a_trend_that_cannot_follow_the_surface_is_none():
    """The parameter changes its speed by a factor of 3 within an even bend: no coarse spline comes near."""
    knots = KnotVector.from_multiplicities(np.linspace(-150, 150, 151), [4, *[1] * 74, 3, *[1] * 74, 4], 3)
    net = profile(lambda s: s / 400, knots, lambda u: np.where(u < 0, 3 * u, u))
    moved = np.abs(off(target(net, True), net, (-60.0, 60.0))).max()
    print(f"{moved:.4f} mm about the line")
    assert moved < 0.01
