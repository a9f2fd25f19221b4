"""Noise of few control points: how much likelier they are with it than without."""

import numpy as np
import pytest

from mracad.bspline.knots import KnotVector
from mracad.bspline.surface import Net
from mracad.inspect.evidence import evidence, pooled
from mracad.inspect.noise import Noise

NONE = (frozenset(), frozenset())
NOISE = 0.02


def shape(counts=(9, 8), degree=5):
    """A smooth bent surface, its control points at Greville abscissae of uneven knots."""
    rng = np.random.default_rng(3)
    u, v = (KnotVector.clamped(np.cumsum(rng.uniform(0.6, 1.4, n - degree + 1)), degree) for n in counts)
    x, y = np.meshgrid(u.greville(), v.greville(), indexing="ij")
    return Net(u, v, np.stack([3 * x, 3 * y, np.sin(x / 2) * np.cos(y / 3)], axis=-1))


def inner(net, rim):
    return np.pad(np.ones(np.subtract(net.poles.shape[:2], 2 * rim), bool), rim)


def spoiled(net, where, seed=0, size=NOISE):
    return net.with_poles(
        net.poles + np.where(where[..., None], np.random.default_rng(seed).normal(0, size, net.poles.shape), 0.0)
    )


def told(net, *roles, **options):
    return evidence(net, roles, np.ones(net.poles.shape[:2], bool), NONE, **options)


def test_two_points_among_clean_ones_are_enough():
    net = shape((8, 7))
    few = np.zeros(net.poles.shape[:2], bool)
    few[3:5, 3] = True
    sizes = []
    for seed in range(40):
        found = told(spoiled(net, few, seed), few, inner(net, 2), np.ones_like(few))
        assert found is not None and np.array_equal(found.where, few)
        sizes.append(found.size)
    print(f"{np.sqrt(np.mean(np.square(sizes))) / NOISE:.3f} of the noise")
    assert np.sqrt(np.mean(np.square(sizes))) == pytest.approx(NOISE, rel=0.15)


def test_a_clean_net_has_none():
    net = shape()
    assert told(net, inner(net, 3), inner(net, 1), np.ones(net.poles.shape[:2], bool)) is None


def test_of_several_sets_of_points_the_right_one_is_found():
    net = shape((14, 13))
    roles = [inner(net, rim) for rim in (4, 2, 0)]
    for noisy in roles:
        found = told(spoiled(net, noisy), *roles)
        assert found is not None and np.array_equal(found.where, noisy)
        assert found.size == pytest.approx(NOISE, rel=0.2)


def test_stated_noise_is_taken_as_it_is():
    net = shape()
    where = inner(net, 3)
    found = told(spoiled(net, where), where, stated=3 * NOISE)
    assert found is not None and found.size == pytest.approx(3 * NOISE)


def test_the_smoother_the_shape_the_surer_its_differences():
    net = shape()
    where = inner(net, 3)
    wavy = net.with_poles(net.poles + [0, 0, 0.05] * np.sin(2 * net.poles[..., :1]))
    calm, rough = (told(spoiled(each, where), where, stated=NOISE) for each in (net, wavy))
    assert calm is not None and rough is not None and np.prod(calm.precision) > 10 * np.prod(rough.precision)


def test_what_may_be_one_noise_counts_as_one():
    where = np.ones((2, 1), bool)
    each = [Noise(size, where, (np.zeros(2), np.zeros(1)), 3, (1.0, 1.0)) for size in (0.7, 1.0, 1.3, 100.0)]
    alike = pooled(dict(enumerate(each[:3])))
    assert [noise.size for noise in alike.values()] == pytest.approx([np.sqrt((0.49 + 1 + 1.69) / 3)] * 3)
    apart = pooled(dict(enumerate(each)))
    assert [noise.size for noise in apart.values()] == [0.7, 1.0, 1.3, 100.0]
