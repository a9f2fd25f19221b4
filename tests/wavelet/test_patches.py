"""Patches joined along sides, whichever way they run: seams stay closed on all levels."""

from itertools import product

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mracad.bspline.curve import Curve
from mracad.bspline.gram import gram
from mracad.bspline.knots import KnotVector
from mracad.bspline.refine import refinement
from mracad.bspline.surface import Net
from mracad.errors import UsageError
from mracad.wavelet import wavedec, wavedec_patches, waverec_patches
from mracad.wavelet.ladder import rungs_by_level
from mracad.wavelet.step import Chain, step
from tests.bspline.spaces import random_knots
from tests.bspline.test_surface import circle


def knots(seed, degree=3, most=2):
    return random_knots(degree, "clamped", 9, seed, most)


def noisy(u, v, seed):
    return Net(u, v, np.random.default_rng(seed).standard_normal((u.count, v.count, 3)))


def turned(kv):
    return KnotVector.from_multiplicities(7.0 - 2 * kv.breaks[::-1], kv.multiplicities[::-1], kv.degree)


def changed(net, swap, back_u, back_v):
    """The same surface with its directions swapped or turned, over other domains."""
    u, v, poles = net.u, net.v, net.poles
    if back_u:
        u, poles = turned(u), poles[::-1]
    if back_v:
        v, poles = turned(v), poles[:, ::-1]
    return Net(v, u, poles.swapaxes(0, 1)) if swap else Net(u, v, poles)


def unchanged(net, swap, back_u, back_v, x, y):
    """Points of a changed surface at shares of the first and second direction of the original."""
    if swap:
        net = Net(net.v, net.u, net.poles.swapaxes(0, 1))
    share = [(1 - s if back else s) for s, back in ((x, back_u), (y, back_v))]
    at = [k.domain[0] + k.period * s for s, k in zip(share, (net.u, net.v), strict=True)]
    return net.grid(*at)


def alike(pyramids):
    """The same changes to all pyramids: nothing, a fractional level, gains, thresholds."""
    yield [p.scaled([0.0, 1.7, -0.5, *[1.0] * 9][: len(p.levels)]) for p in pyramids], 0.0
    yield [p.thresholded(0.7) for p in pyramids], 0.0
    yield [p.thresholded(0.4, soft=True) for p in pyramids], 1.3


@given(st.integers(0, 10**6), st.booleans(), st.booleans(), st.booleans(), st.sampled_from([2, 3, 4]))
@settings(deadline=None, max_examples=15)
def test_seams_stay_closed_whichever_way_patches_run(seed, swap, back_u, back_v, degree):
    v = knots(seed, degree, 3)
    left, right = noisy(knots(seed + 1), v, 1), noisy(knots(seed + 2, 2), v, 2)
    right.poles[0] = left.poles[-1]
    way = swap, back_u, back_v
    pyramids = wavedec_patches([left, changed(right, *way)])
    share = np.linspace(0, 1, 23)
    one, two = waverec_patches(pyramids)
    np.testing.assert_allclose(one.poles, left.poles, atol=1e-11)
    np.testing.assert_allclose(two.poles, changed(right, *way).poles, atol=1e-11)
    for those, level in alike(pyramids):
        one, two = waverec_patches(those, level)
        assert np.abs(one.poles - left.poles).max() > 1e-2
        ends = [unchanged(one, False, False, False, share[-1:], share), unchanged(two, *way, share[:1], share)]
        np.testing.assert_allclose(ends[0], ends[1], atol=1e-11)


def test_the_six_sides_of_a_box_stay_together():
    k = [knots(s, most=1) for s in (1, 2, 3)]
    count = [each.count for each in k]
    grid = np.stack(np.meshgrid(*(np.linspace(-1, 1, n) for n in count), indexing="ij"), axis=-1)
    grid = grid + 0.3 * np.random.default_rng(0).standard_normal(grid.shape)
    nets, places = [], []
    for axis, end in product(range(3), (0, -1)):
        others = [a for a in range(3) if a != axis]
        nets.append(Net(k[others[0]], k[others[1]], grid.take(end, axis)))
        places.append((axis, end, others))
    pyramids = wavedec_patches(nets)
    for those, level in alike(pyramids):
        found = waverec_patches(those, level)
        for i, (axis, end, others) in enumerate(places):
            for j, (other, side, theirs) in enumerate(places):
                if axis < other:
                    one = found[i].poles.take(side, others.index(other))
                    two = found[j].poles.take(end, theirs.index(axis))
                    np.testing.assert_allclose(one, two, atol=1e-12)


def test_neighbours_share_knots_and_degrees_exactly():
    v, w = knots(1, 3, 1), KnotVector.clamped([0, 0.37, 1], 2)
    side = Curve(w, np.random.default_rng(0).standard_normal((w.count, 3)))
    finer = side.over(w.elevated(3)).refined([0.2, 0.6])
    left, right = noisy(v, w, 1), noisy(v, finer.knots, 2)
    left.poles[-1], right.poles[0] = side.poles, finer.poles
    one, two = waverec_patches(wavedec_patches([left, right]))
    assert one.v == two.v and one.v.degree == 3 and {0.2, 0.37, 0.6} <= set(one.v.breaks)
    uv = np.random.default_rng(0).uniform(0, 1, (30, 2)) * [v.period, 1.0]
    np.testing.assert_allclose(one.evaluate(uv), left.evaluate(uv), atol=1e-12)


@pytest.mark.parametrize("order", [1, 2])
def test_derivatives_across_stay_in_proportion(order):
    """Rows of control points that mirror each other give derivatives in the proportion (−1)^r on all levels."""
    u, v = knots(4, 5, 1), knots(5, 3, 1)
    left, right = noisy(u, v, 1), noisy(turned(u), v, 2)
    for i in range(order + 1):
        right.poles[-1 - i] = left.poles[i] * [-1, 1, 1]
        left.poles[0, :, 0] = right.poles[-1, :, 0] = 0.0
    share, domain = np.linspace(0, 1, 17), u.domain
    for those, level in alike(wavedec_patches([left, right], order=order)):
        one, two = waverec_patches(those, level)
        at = v.domain[0] + v.period * share
        start = one.evaluate(np.stack([0 * at + domain[0], at], axis=1), 2)
        end = two.evaluate(np.stack([0 * at + two.u.domain[1], at], axis=1), 2, side=("left", "right"))
        for r, where in ((0, 0), (1, 1), (2, 3))[: order + 1]:
            np.testing.assert_allclose(start[where] * [-1, 1, 1], end[where] * (-2.0) ** r, atol=1e-8)


@pytest.mark.parametrize("pinned", [1, 2])
@pytest.mark.parametrize("degree", [3, 5, 9])
def test_pinned_wavelets_are_orthogonal_to_coarse_splines_that_vanish(pinned, degree):
    fine = knots(degree, degree, degree)
    coarse = rungs_by_level(fine)[1]
    each = step(coarse, fine, pinned)
    c = np.random.default_rng(0).standard_normal((fine.count, 2))
    low, high = each.analyse(c)
    np.testing.assert_allclose(each.synthesise(low, high), c, atol=1e-11)
    wave = each.synthesise(np.zeros_like(low), high)
    np.testing.assert_array_equal(wave[[*range(pinned), *range(-pinned, 0)]], 0)
    moments = refinement(coarse, fine).apply_transposed(gram(fine).apply(wave))[pinned:-pinned]
    np.testing.assert_allclose(moments, 0, atol=1e-11)
    if not isinstance(each, Chain):
        alone = np.array([each.synthesise(np.zeros(len(low)), row) for row in np.eye(len(high))])
        np.testing.assert_allclose(np.abs(alone).max(axis=1), each.heights)


def test_curves_keep_their_ends():
    a, b = (
        Curve(k, np.random.default_rng(i).standard_normal((k.count, 3))) for i, k in enumerate((knots(1), knots(2)))
    )
    one, two = waverec_patches(wavedec_patches([a, b]), 2.5)
    for new, old in ((one, a), (two, b)):
        np.testing.assert_allclose(new.poles[[0, -1]], old.poles[[0, -1]], atol=1e-12)


def test_tubes_are_joined_along_closed_sides():
    ring, v = random_knots(3, "periodic", 12, 1, 1), knots(2)
    a, b = noisy(ring, v, 1), noisy(ring, v, 2)
    b.poles[:, 0] = a.poles[:, -1]
    for those, level in alike(wavedec_patches([a, b])):
        one, two = waverec_patches(those, level)
        np.testing.assert_allclose(one.poles[:, -1], two.poles[:, 0], atol=1e-12)


def test_rational_patches_stay_closed():
    arc = Curve(circle().knots, np.random.default_rng(0).standard_normal((8, 2)), circle().weights)
    v = knots(1)
    nets = []
    for seed in (1, 2):
        poles = np.random.default_rng(seed).standard_normal((8, v.count, 3))
        poles[:, 0, :2], poles[:, 0, 2] = arc.poles, 1.0
        weights = np.random.default_rng(seed).uniform(1, 2, poles.shape[:2])
        weights[:, 0] = arc.weights * seed
        nets.append(Net(arc.knots, v, poles, weights))
    turn = np.linspace(*arc.knots.domain, 30)
    one, two = (net.grid(turn, v.breaks[:1]) for net in waverec_patches(wavedec_patches(nets), 1.5))
    assert np.abs(one - nets[0].grid(turn, v.breaks[:1])).max() > 1e-2
    np.testing.assert_allclose(one, two, atol=1e-12)


def test_places_of_patches_are_over_their_own_parameters():
    net = noisy(knots(1), knots(2), 1)
    other = noisy(knots(3), knots(2), 2)
    other.poles[0] = net.poles[-1]
    plain, back = wavedec_patches([net, other])[1], wavedec_patches([net, changed(other, False, False, True)])[1]
    own = other.v.domain[0] + other.v.period * (
        1 - (back.places(0)["HH"][1] - turned(other.v).domain[0]) / (2 * other.v.period)
    )
    np.testing.assert_allclose(own, plain.places(0)["HH"][1], atol=1e-12)
    assert back.plot().axes[0].get_ylim() == turned(other.v).domain


def test_sides_that_are_points_stay_points():
    u, v = knots(1), knots(2)
    nets = [noisy(u, v, seed) for seed in (1, 2, 3)]
    for net, after in zip(nets, [*nets[1:], nets[0]], strict=True):
        net.poles[:, 0], net.poles[:, -1] = 0.0, 5.0
        after.poles[0] = net.poles[-1]
    for net in nets:
        net.poles[:, 0], net.poles[:, -1] = 0.0, 5.0
    for those, level in alike(wavedec_patches(nets)):
        found = waverec_patches(those, level)
        for net, after in zip(found, [*found[1:], found[0]], strict=True):
            np.testing.assert_allclose(net.poles[-1], after.poles[0], atol=1e-12)
            np.testing.assert_allclose(net.poles[:, 0], 0.0, atol=1e-12)
            np.testing.assert_allclose(net.poles[:, -1], 5.0, atol=1e-12)


def test_a_half_twist_and_a_mixture_are_refused():
    u, v = knots(1), KnotVector.clamped([0, 1, 2, 3, 4.0], 3)
    band = noisy(u, v, 1)
    band.poles[-1] = band.poles[0, ::-1]
    with pytest.raises(UsageError, match="half twist"):
        wavedec_patches([band])
    with pytest.raises(UsageError, match="all be curves or all be surfaces"):
        wavedec_patches([band, Curve(v, band.poles[0])])
    with pytest.raises(UsageError, match="outside"):
        waverec_patches(wavedec_patches([noisy(u, v, 1)]), 50)
    for order in (-1, 4):
        with pytest.raises(UsageError, match="order"):
            wavedec_patches([noisy(u, v, 1)], order=order)
    assert wavedec_patches([]) == [] == waverec_patches([])


def test_alone_a_patch_is_not_pinned():
    net = noisy(knots(1), knots(2), 1)
    assert np.abs(waverec_patches([wavedec(net)], 2)[0].poles[0, 0] - net.poles[0, 0]).max() > 1e-3
