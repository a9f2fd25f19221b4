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


def every(found):
    return np.ones(found.poles.shape[:2], bool)


@pytest.mark.parametrize("degree", [2, 3, 5])
def test_white_noise_is_found_whatever_the_shape_degree_and_knots(degree):
    found = [noise(each, every(each)) for each in (net(0.05, degree=degree, seed=seed) for seed in range(4))]
    assert max(abs(each / 0.05 - 1) for each in found) < 0.1 and abs(np.mean(found) / 0.05 - 1) < 0.04


def test_a_smooth_net_has_next_to_none():
    assert noise(net(0.0), every(net(0.0))) < 1e-3


def test_noise_turns_and_grows_with_the_net():
    one = net(0.05)
    other = Net(one.u, one.v, 7.0 * one.poles @ rotation([1, 2, 3], 0.7).T)
    assert noise(other, every(one)) == pytest.approx(7.0 * noise(one, every(one)), rel=1e-9)


def test_only_points_that_may_have_noise_count():
    one = net(0.05)
    inside = np.pad(np.ones(np.subtract(one.poles.shape[:2], 8), bool), 4)
    poles = np.where(inside[..., None], one.poles, net(0.0).poles)
    assert noise(Net(one.u, one.v, poles), inside) == pytest.approx(0.05, rel=0.1)


def test_few_points_tell_nothing():
    one = net(0.05, (2, 40))
    assert noise(one, every(one)) is None
    some = np.zeros_like(every(net(0.05)))
    some[:10, :10] = True
    assert FEWEST < (10 - 3) ** 2 and noise(net(0.05), some) is not None
    some[::3] = False
    assert noise(net(0.05), some) is None
