"""The noise of a control net: found where it is, none where there is none."""

import numpy as np
import pytest

from mracad.bspline.knots import KnotVector
from mracad.bspline.surface import Net
from mracad.inspect.noise import FEWEST, noise
from tests.edit.models import rotation


def net(sigma, size=(40, 30), degree=3, seed=0):
    """A wavy net over uneven knots."""
    rng = np.random.default_rng(seed)
    u, v = (KnotVector.clamped(np.cumsum(rng.uniform(0.7, 1.3, n + 1)), degree) for n in size)
    x, y = np.meshgrid(u.greville(), v.greville(), indexing="ij")
    poles = np.stack([x, y, 3 * np.sin(x / 12) * np.cos(y / 15)], axis=-1)
    return Net(u, v, poles + sigma * rng.standard_normal(poles.shape))


def size(found, points=None, seen=None):
    """The noise of a net, told by some of its control points; 0 for none."""
    every = np.ones(found.poles.shape[:2], bool)
    told = noise(found, every if points is None else points, every if seen is None else seen)
    return told.size if told else 0.0


def inside(found, by=4):
    return np.pad(np.ones(np.subtract(found.poles.shape[:2], 2 * by), bool), by)


@pytest.mark.parametrize("degree", [2, 3, 5])
def test_white_noise_is_found_whatever_the_shape_degree_and_knots(degree):
    found = [size(net(0.05, degree=degree, seed=seed)) for seed in range(4)]
    assert max(abs(each / 0.05 - 1) for each in found) < 0.1 and abs(np.mean(found) / 0.05 - 1) < 0.04


@pytest.mark.parametrize("turn", [0.0, 0.7])
def test_noise_along_normals_counts_in_full_and_along_the_surface_hardly(turn):
    """A scanner's noise, upwards; and noise of the parametrisation, which does not show."""
    clean, turned = net(0.0), rotation([1, 2, 3], turn)
    shake = 0.05 * np.random.default_rng(3).standard_normal(clean.poles.shape)
    up, along = (Net(clean.u, clean.v, (clean.poles + shake * each) @ turned.T) for each in ([0, 0, 1], [1, 1, 0]))
    assert size(up) == pytest.approx(0.05, rel=0.1) and size(along) < 0.02


def test_a_smooth_net_has_next_to_none():
    assert size(net(0.0)) < 1e-3


def test_noise_turns_and_grows_with_the_net():
    one = net(0.05)
    other = Net(one.u, one.v, 7.0 * one.poles @ rotation([1, 2, 3], 0.7).T)
    assert size(other) == pytest.approx(7.0 * size(one), rel=1e-9)


def test_what_does_not_follow_the_surface_does_not_count():
    one = net(0.05)
    far = np.where(inside(one, 2)[..., None], one.poles, net(3.0, seed=1).poles)
    assert size(Net(one.u, one.v, far), inside(one), inside(one, 2)) == pytest.approx(0.05, rel=0.1)


def test_clean_rows_beside_noisy_ones_are_found_and_dilute_nothing():
    """Two clean rows all around, as beside seams that were kept tangent."""
    one = net(0.05)
    noisy = inside(one, 2)
    mixed = Net(one.u, one.v, np.where(noisy[..., None], one.poles, net(0.0).poles))
    told = noise(mixed, inside(one, 1), np.ones_like(noisy))
    assert (told.where == noisy).mean() > 0.97 and told.where[noisy].mean() > 0.97
    assert told.size == pytest.approx(0.05, rel=0.08)


def test_noise_everywhere_is_everywhere():
    one = net(0.05, seed=2)
    assert noise(one, inside(one, 1), np.ones(one.poles.shape[:2], bool)).where.all()


def test_ripple_is_no_noise():
    """A ripple of six control points has the same size in neighbouring differences only if it is white."""
    one = net(0.0)
    waves = 0.05 * np.sin(np.arange(one.poles.shape[0]) * 2 * np.pi / 6)[:, None] * np.ones(one.poles.shape[1])
    rippled = Net(one.u, one.v, one.poles + waves[..., None] * [0, 0, 1])
    assert size(rippled) < 0.01


def test_few_points_tell_nothing():
    one = net(0.05, (2, 40))
    assert size(one, np.zeros(one.poles.shape[:2], bool)) == 0.0
    few = np.zeros(one.poles.shape[:2], bool)
    few[2, 10 : 10 + FEWEST - 1] = True
    assert size(one, few) == 0.0
    more = np.zeros(net(0.05).poles.shape[:2], bool)
    more[10:16, 10:16] = True
    assert size(net(0.05), more) > 0.0


@pytest.mark.parametrize("seed", range(3))
def test_what_a_few_control_points_have_most_of_is_no_noise(seed):
    """Surfaces fitted in high degree have kinks of any size here and there, and smooth pieces between them."""
    clean, rng = net(0.0), np.random.default_rng(seed)
    sizes = rng.exponential(0.6, clean.poles.shape[:2]) ** 3
    assert size(clean.with_poles(clean.poles + sizes[..., None] * rng.standard_normal(clean.poles.shape))) == 0.0
