"""Shrinkage in wavelet space: what noise makes of details is known, and what has no details stays as it is."""

import numpy as np
import pytest

from mracad.bspline.knots import KnotVector
from mracad.bspline.surface import Net
from mracad.wavelet.shrink import shrunk, spins, thresholded
from mracad.wavelet.transform import decompose
from tests.edit.models import rotation

NOISE = 0.05


def net(size=(24, 17), degree=3, seed=0):
    """A flat net over uneven knots, one of them double."""
    rng = np.random.default_rng(seed)
    u, v = (KnotVector.clamped(np.cumsum(rng.uniform(0.5, 1.5, n + 1)), degree) for n in size)
    u = u.refined(u.breaks[5:6])
    x, y = np.meshgrid(u.greville(), v.greville(), indexing="ij")
    return Net(u, v, np.stack([x, y, 0 * x], axis=-1))


def white(one, seed):
    return NOISE * np.random.default_rng(seed).standard_normal(one.poles.shape)


def error(poles, one):
    return float(np.sqrt(((poles - one.poles) ** 2).mean()))


@pytest.mark.parametrize("degree", [1, 3, 4])
def test_deviations_of_details_are_those_of_many_noisy_nets(degree):
    one = net(degree=degree)
    spin = spins(one)[3]
    total, count = None, 200
    for seed in range(count):
        levels = decompose(white(one, seed) / NOISE, spin.u, spin.v).levels
        squares = [{name: (band**2).sum(axis=2) for name, band in each.bands.items()} for each in levels]
        total = squares if total is None else [{k: a[k] + b[k] for k in a} for a, b in zip(total, squares, strict=True)]
    assert len(spin.deviations) == len(total)
    for known, found in zip(spin.deviations, total, strict=True):
        assert known.keys() == found.keys()
        for name, deviation in known.items():
            ratio = np.sqrt(found[name] / (3 * count)) / deviation
            assert abs(ratio.mean() - 1) < 0.06 and np.abs(ratio - 1).max() < 5 / np.sqrt(6 * count)


def test_ladders_drop_different_knots_and_are_always_the_same():
    one = net()
    first, again = spins(one), spins(one)
    assert [each.u for each in first] == [each.u for each in again]
    assert len({each.u[2] for each in first}) > 1 and all(each.u[-1].spans < 4 for each in first)


def test_knots_that_are_kept_stay_on_every_rung():
    one = net()
    crease = float(one.u.breaks[9])
    assert all(crease in rung.breaks for each in spins(one, (frozenset({crease}), frozenset())) for rung in each.u)


@pytest.mark.parametrize("degree", [2, 3])
def test_a_polynomial_stays_as_it_is(degree):
    """It has no details, whatever the pilot says."""
    one = net(degree=degree)
    x, y = one.poles[..., 0], one.poles[..., 1]
    flat = Net(one.u, one.v, np.stack([x, y, 0.3 * x - 0.2 * y], axis=-1))
    for kept in (thresholded(flat.poles, NOISE, spins(flat)), shrunk(flat.poles, NOISE, spins(flat), one.poles)):
        assert np.abs(kept - flat.poles).max() < 1e-10


def test_noise_on_a_plane_all_but_vanishes():
    one = net()
    noisy, every = one.poles + white(one, 1), spins(one)
    left = thresholded(noisy, NOISE, every)
    assert error(left, one) < 0.4 * NOISE
    assert error(shrunk(noisy, NOISE, every, one.poles), one) <= error(left, one)


def test_detail_far_above_the_noise_stays():
    one = net((40, 40))
    bump = np.exp(-((one.poles[..., 0] - 20) ** 2 + (one.poles[..., 1] - 20) ** 2) / 18.0)
    shape = Net(one.u, one.v, one.poles + 40 * NOISE * bump[..., None] * [0, 0, 1])
    noisy = shape.poles + white(one, 2)
    kept = shrunk(noisy, NOISE, spins(one), shape.poles)
    assert error(kept, shape) < 0.5 * NOISE
    assert abs(kept[..., 2].max() / shape.poles[..., 2].max() - 1) < 0.05


def test_rotation_and_scaling_commute():
    one = net()
    turn, noisy = rotation([1, 2, 3], 0.7), one.poles + white(one, 3)
    every, pilot = spins(one), thresholded(one.poles + white(one, 3), NOISE, spins(one))
    kept = shrunk(noisy, NOISE, every, pilot)
    other = shrunk(7 * noisy @ turn.T, 7 * NOISE, every, 7 * pilot @ turn.T)
    assert np.abs(other - 7 * kept @ turn.T).max() < 1e-10
