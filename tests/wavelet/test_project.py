import numpy as np
import pytest
from hypothesis import given, settings
from scipy.spatial.transform import Rotation

from mracad.bspline.basis import basis, gauss
from mracad.bspline.gram import gram
from mracad.bspline.knots import KnotVector
from mracad.bspline.refine import refinement
from mracad.bspline.rows import LARGE
from mracad.bspline.surface import Net
from mracad.errors import UsageError
from mracad.wavelet.ladder import rungs_by_level
from mracad.wavelet.project import at_scale, band, projection
from tests.bspline.spaces import random_knots
from tests.wavelet.pairs import pairs


@given(pairs())
@settings(deadline=None, max_examples=100)
def test_a_projection(pair):
    coarse, fine = pair
    s = projection(coarse, fine)
    rng = np.random.default_rng(0)
    c, y = rng.standard_normal((fine.count, 3)), rng.standard_normal((coarse.count, 3))
    np.testing.assert_allclose(s.coarse(refinement(coarse, fine).apply(y)), y, atol=1e-11)
    smooth = s.apply(c)
    np.testing.assert_allclose(s.apply(smooth), smooth, atol=1e-10 * max(1, np.abs(smooth).max()))
    np.testing.assert_allclose(s.apply(np.ones(fine.count)), 1, atol=1e-14)
    if fine.closed()[1] == (0, 0):
        inner = refinement(coarse, fine).apply_transposed(gram(fine).apply(smooth - c))
        np.testing.assert_allclose(inner, 0, atol=1e-11)


@pytest.mark.parametrize("kind", ["clamped", "periodic"])
@pytest.mark.parametrize("degree", [3, 7])
def test_weighted_projection_is_orthogonal_in_its_own_product(kind, degree):
    fine = random_knots(degree, kind, 14, 2)
    coarse = rungs_by_level(fine)[-1]
    weights = np.random.default_rng(1).uniform(0.01, 10, fine.spans)
    c = np.random.default_rng(0).standard_normal((2, fine.count))
    rest = c - projection(coarse, fine, weights).apply(c, 1)
    inner = refinement(coarse, fine).apply_transposed(gram(fine, weights=weights).apply(rest, 1), 1)
    np.testing.assert_allclose(inner, 0, atol=1e-11)
    assert projection(coarse, fine, weights) is projection(coarse, fine, weights.copy())


@pytest.mark.parametrize("degree", [3, 7])
def test_weights_of_an_unclamped_space(degree):
    fine = random_knots(degree, "unclamped", 14, 2)
    coarse = rungs_by_level(fine)[-2]
    weights = np.random.default_rng(1).uniform(0.1, 10, fine.spans)
    y = np.random.default_rng(0).standard_normal((coarse.count, 3))
    found = projection(coarse, fine, weights).coarse(refinement(coarse, fine).apply(y))
    np.testing.assert_allclose(found, y, atol=1e-11)
    c = np.random.default_rng(0).standard_normal(fine.count)
    plain = projection(coarse, fine).apply(c)
    np.testing.assert_allclose(projection(coarse, fine, np.full(fine.spans, 5.0)).apply(c), plain, atol=1e-11)
    assert np.abs(projection(coarse, fine, weights).apply(c) - plain).max() > 1e-3


@pytest.mark.parametrize("degree", [1, 2, 3, 5, 9, 15, 22])
@pytest.mark.parametrize("kind", ["clamped", "periodic", "unclamped"])
def test_smoothing_commutes_with_motions(degree, kind):
    fine = random_knots(degree, kind, 14, degree)
    s = projection(rungs_by_level(fine)[-1], fine)
    c = np.random.default_rng(0).standard_normal((fine.count, 3))
    smooth = s.apply(c)
    size = np.abs(smooth).max()
    turn, far = Rotation.from_rotvec([1, 0.2, -0.4]).as_matrix(), np.array([1.0, -2.0, 3.0])
    np.testing.assert_allclose(s.apply(c + far) - far, smooth, atol=1e-9 * size)
    np.testing.assert_allclose(s.apply(c @ turn.T), smooth @ turn.T, atol=1e-9 * size)
    np.testing.assert_allclose(s.apply(25.4 * c), 25.4 * smooth, atol=25.4e-9 * size)


def test_smoothing_is_that_of_the_reversed_spline():
    fine = random_knots(3, "clamped", 20, 7, most=1)
    coarse = rungs_by_level(fine)[1]

    def back(kv):
        return KnotVector(-kv.knots[::-1], kv.degree)

    c = np.random.default_rng(0).standard_normal((fine.count, 3))
    mirrored = projection(back(coarse), back(fine)).apply(c[::-1])[::-1]
    np.testing.assert_allclose(mirrored, projection(coarse, fine).apply(c), atol=1e-12)


@pytest.mark.parametrize("degree", [3, 8])
@pytest.mark.parametrize("gap", [1e-4, 1e-8])
def test_near_duplicate_knots(degree, gap):
    breaks = np.sort(np.concatenate([np.arange(13.0), np.arange(1, 12) + gap]))
    fine = KnotVector.clamped(breaks, degree)
    coarse = fine.without(breaks[1:-1:2])
    y = np.random.default_rng(0).standard_normal((coarse.count, 3))
    found = projection(coarse, fine).coarse(refinement(coarse, fine).apply(y))
    np.testing.assert_allclose(found, y, atol=1e-10)


def test_equal_spaces_return_what_they_are_given():
    kv = random_knots(3, "clamped", 5, 0)
    c = np.random.default_rng(0).standard_normal((kv.count, 3))
    assert projection(kv, kv).apply(c) is c
    assert projection(kv, kv).coarse(c) is c


def test_the_best_approximation():
    fine = random_knots(3, "clamped", 15, 1, most=1)
    coarse = rungs_by_level(fine)[1]
    span, offset, weight = gauss(fine, 5)
    x = (fine.knots[span][:, None] + offset).ravel()

    def matrix(kv):
        first, values = basis(kv, x)
        dense = np.zeros((len(x), kv.count))
        np.put_along_axis(dense, first[:, None] + np.arange(4), values, axis=1)
        return np.sqrt(weight.ravel())[:, None] * dense

    c = np.random.default_rng(0).standard_normal(fine.count)
    best = np.linalg.lstsq(matrix(coarse), matrix(fine) @ c, rcond=None)[0]
    np.testing.assert_allclose(projection(coarse, fine).coarse(c), best, atol=1e-12)


def test_what_does_not_fit_is_refused():
    fine = random_knots(3, "clamped", 8, 1)
    coarse = rungs_by_level(fine)[-1]
    with pytest.raises(UsageError, match="nested"):
        projection(fine, coarse)
    with pytest.raises(UsageError):
        projection(coarse, fine, np.ones(3))
    with pytest.raises(UsageError):
        projection(coarse, fine).apply(np.ones(3))


def test_large_arrays():
    for kind in ("clamped", "periodic", "unclamped"):
        fine = random_knots(3, kind, 30, 3)
        s = projection(rungs_by_level(fine)[-1], fine)
        c = np.random.default_rng(0).standard_normal((LARGE // 10, fine.count, 3))
        parts = [s.apply(part, 1) for part in np.array_split(c, 20)]
        np.testing.assert_allclose(s.apply(c, 1), np.concatenate(parts), atol=1e-12)


def test_a_net_at_a_scale_and_the_band_between_two():
    """A coarse wave stays, a fine one goes; bands add up to what was taken away."""
    k = KnotVector.clamped(np.linspace(0.0, 100.0, 101), 3)
    x, y = np.meshgrid(k.greville(), k.greville(), indexing="ij")
    net = Net(k, k, np.stack([x, y, np.sin(2 * np.pi * x / 60) + np.sin(2 * np.pi * y / 4)], axis=-1))
    uv = np.random.default_rng(0).uniform(15, 85, (400, 2))
    left = at_scale(net, 20.0).evaluate(uv)[:, 2] - np.sin(2 * np.pi * uv[:, 0] / 60)
    assert np.abs(left).max() < 0.05
    coarse, middle = band(net, 8.0, 20.0)
    _, fine = band(net, 0.0, 8.0)
    assert np.abs(coarse.poles + middle.poles + fine.poles - net.poles).max() < 1e-10
    kept = at_scale(net, 20.0, (frozenset(k.breaks.tolist()), frozenset()))
    assert kept.u == k and np.abs(kept.poles[..., 2].mean(axis=1) - net.poles[..., 2].mean(axis=1)).max() < 0.05
