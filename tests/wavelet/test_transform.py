import numpy as np
import pytest
from hypothesis import given, settings

from mracad.bspline.gram import gram
from mracad.bspline.knots import KnotVector
from mracad.bspline.refine import refinement
from mracad.bspline.rows import LARGE
from mracad.errors import UsageError
from mracad.wavelet.ladder import ladder_for_scale, rungs_by_level
from mracad.wavelet.project import projection
from mracad.wavelet.step import Chain, step
from mracad.wavelet.transform import decompose, reconstruct
from tests.bspline.spaces import KINDS, random_knots
from tests.wavelet.pairs import pairs, uniform


def relative(a, b):
    return np.abs(a - b).max() / np.abs(b).max()


@pytest.mark.parametrize("degree", range(1, 26))
@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("most", [1, None])
def test_perfect_reconstruction(degree, kind, most):
    u = random_knots(degree, kind, 12, degree, most)
    rungs = rungs_by_level(u)
    c = np.random.default_rng(degree).standard_normal((u.count, 3))
    assert len(rungs) > 1 or kind == "periodic"
    assert relative(reconstruct(decompose(c, rungs)), c) < 1e-12


@pytest.mark.parametrize("degree", [1, 3, 5, 10, 22])
@pytest.mark.parametrize("gap", [1e-3, 1e-6, 1e-9])
def test_perfect_reconstruction_with_near_duplicate_knots(degree, gap):
    breaks = np.sort(np.concatenate([np.arange(13.0), np.arange(1, 12) + gap, [4 + 2 * gap, 7 - gap]]))
    kv = KnotVector.clamped(breaks, degree)
    c = np.random.default_rng(0).standard_normal((kv.count, 3))
    for lengths in (None, np.diff(breaks)):
        assert relative(reconstruct(decompose(c, rungs_by_level(kv, lengths=lengths))), c) < 1e-12


@pytest.mark.parametrize("degree", [3, 9, 15, 22])
def test_spans_of_all_sizes(degree):
    # Wavelets are all but dependent here at high degree: reconstruction and the coarse surface must not suffer.
    spans = 10 ** np.random.default_rng(0).uniform(-4, 0.3, 150)
    fine = KnotVector.clamped(np.concatenate([[0], np.cumsum(spans)]), degree)
    coarse = ladder_for_scale(fine, spans, 20.0)
    c = np.random.default_rng(0).standard_normal((fine.count, 3))
    pyramid = decompose(c, [fine, coarse])
    assert relative(reconstruct(pyramid), c) < 1e-12
    assert relative(reconstruct(pyramid, 1), projection(coarse, fine).apply(c)) < 1e-3


@given(pairs())
@settings(deadline=None, max_examples=100)
def test_any_pair_is_inverted(pair):
    coarse, fine = pair
    c = np.random.default_rng(0).standard_normal((fine.count, 2))
    assert relative(reconstruct(decompose(c, [fine, coarse])), c) < 1e-12


@pytest.mark.parametrize("kind", KINDS)
def test_nets_of_two_ladders(kind):
    u, v = random_knots(3, kind, 20, 1), random_knots(2, "clamped", 5, 2)
    ladder_u, ladder_v = rungs_by_level(u), rungs_by_level(v)
    assert len(ladder_u) != len(ladder_v)
    c = np.random.default_rng(0).standard_normal((u.count, v.count, 3))
    pyramid = decompose(c, ladder_u, ladder_v)
    assert relative(reconstruct(pyramid), c) < 1e-13
    assert pyramid.coarse.shape == (ladder_u[-1].count, ladder_v[-1].count, 3)
    for i, level in enumerate(pyramid.levels):
        here, there = (ladder_u[min(j, len(ladder_u) - 1)].count for j in (i, i + 1))
        assert ("HL" in level.bands) == (here != there)
        if "HL" in level.bands:
            assert len(level.bands["HL"]) == here - there
    size = pyramid.coarse.size + sum(b.size for level in pyramid.levels for b in level.bands.values())
    assert size == c.size


@pytest.mark.parametrize("kind", ["clamped", "periodic"])
@pytest.mark.parametrize("most", [1, None])
def test_coarse_poles_are_the_projection(kind, most):
    fine = random_knots(3, kind, 16, 5, most)
    coarse = rungs_by_level(fine)[-1]
    c = np.random.default_rng(0).standard_normal((4, fine.count))
    low, high = step(coarse, fine).analyse(c, 1)
    np.testing.assert_allclose(low, projection(coarse, fine).coarse(c, 1), atol=1e-11)
    assert high.shape == (4, fine.count - coarse.count)
    detail = c - refinement(coarse, fine).apply(low, 1)
    np.testing.assert_allclose(step(coarse, fine).synthesise(np.zeros_like(low), high, 1), detail, atol=1e-11)
    inner = refinement(coarse, fine).apply_transposed(gram(fine).apply(detail, 1), 1)
    np.testing.assert_allclose(inner, 0, atol=1e-12)


@pytest.mark.parametrize("degree", [1, 3, 9, 22])
def test_coarse_splines_have_no_detail(degree):
    fine = random_knots(degree, "clamped", 14, 1)
    coarse = rungs_by_level(fine)[1]
    y = np.random.default_rng(0).standard_normal((coarse.count, 3))
    pyramid = decompose(refinement(coarse, fine).apply(y), [fine, coarse])
    # In poles a coarse spline comes back to rounding, whatever the condition of the wavelets.
    np.testing.assert_allclose(
        reconstruct(pyramid, 1), refinement(coarse, fine).apply(y), atol=1e-12 * 10 ** (degree / 4)
    )


def test_fractional_levels_blend_neighbours():
    rungs = rungs_by_level(random_knots(3, "clamped", 20, 1, most=2))
    c = np.random.default_rng(0).standard_normal((rungs[0].count, 3))
    pyramid = decompose(c, rungs)
    whole = [reconstruct(pyramid, j) for j in range(len(rungs))]
    np.testing.assert_allclose(whole[0], c, atol=1e-13)
    for j, t in ((0, 0.3), (1, 0.5), (2, 0.9)):
        np.testing.assert_allclose(reconstruct(pyramid, j + t), (1 - t) * whole[j] + t * whole[j + 1], atol=1e-13)
    for j, rung in enumerate(rungs):
        np.testing.assert_allclose(whole[j], projection(rung, rungs[0]).apply(c), atol=1e-10)
    with pytest.raises(UsageError):
        reconstruct(pyramid, len(rungs))


def test_gains_by_level():
    rungs = rungs_by_level(uniform(3, 4))
    c = np.random.default_rng(0).standard_normal((rungs[0].count, 2))
    pyramid = decompose(c, rungs)
    dull = pyramid.scaled([0.0] * 2 + [1.0] * (len(rungs) - 3))
    np.testing.assert_allclose(reconstruct(dull), reconstruct(pyramid, 2), atol=1e-14)
    with pytest.raises(UsageError):
        pyramid.scaled([1.0])


def test_translation_moves_the_coarse_poles_alone():
    rungs = rungs_by_level(random_knots(22, "clamped", 14, 1))
    c = np.random.default_rng(0).standard_normal((rungs[0].count, 3))
    far = np.array([1e3, -2e3, 5e2])
    a, b = decompose(c, rungs), decompose(c + far, rungs)
    np.testing.assert_allclose(reconstruct(b, 2) - far, reconstruct(a, 2), atol=1e-9 * 1e3)


def test_multiple_knots_go_one_copy_at_a_time():
    fine = random_knots(5, "clamped", 10, 3)
    assert isinstance(step(rungs_by_level(fine)[1], fine), Chain)
    assert step(fine.without(fine.breaks[1:2]), fine) is step(fine.without(fine.breaks[1:2]), fine)


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("degree", [1, 3, 9])
def test_large_nets_are_what_small_ones_are(kind, degree):
    """They are swept by compiled code."""
    u, v = random_knots(degree, kind, 24, 1), random_knots(3, "clamped", 21, 2)
    ladders = rungs_by_level(u), rungs_by_level(v)
    c = np.random.default_rng(0).standard_normal((u.count, v.count, 5 * LARGE // (u.count * v.count)))
    swept = decompose(c, *ladders)
    assert relative(reconstruct(swept), c) < 1e-12
    finer = reconstruct(swept, 1)
    for part in (slice(0, 4), slice(-4, None)):
        plain = decompose(c[..., part], *ladders)
        np.testing.assert_allclose(swept.coarse[..., part], plain.coarse, atol=1e-10)
        assert relative(finer[..., part], reconstruct(plain, 1)) < 1e-10


def test_what_does_not_fit_is_refused():
    rungs = rungs_by_level(uniform(3, 3))
    with pytest.raises(UsageError, match="do not fit"):
        decompose(np.zeros((5, 3)), rungs)
    with pytest.raises(UsageError, match="nested"):
        decompose(np.zeros((rungs[1].count, 3)), rungs[::-1][-2:])
    once = step(rungs[1], rungs[0])
    with pytest.raises(UsageError):
        once.analyse(np.zeros(3))
    with pytest.raises(UsageError):
        once.synthesise(np.zeros(3), np.zeros(3))


def test_a_ladder_of_one_rung_changes_nothing():
    kv = uniform(2, 0)
    c = np.random.default_rng(0).standard_normal((3, 3, 3))
    np.testing.assert_allclose(reconstruct(decompose(c, [kv], [kv])), c, atol=1e-15)


@pytest.mark.parametrize("shape", [(1,), (2,), (3,), (49, 3), (7, 4, 1)])
@pytest.mark.parametrize("axis", [0, 1])
@pytest.mark.parametrize("kind", KINDS)
def test_compiled_steps_are_the_same(shape, axis, kind):
    fine, coarse = rungs_by_level(random_knots(3, kind, 40, 1))[:2]
    other = (53,) if axis else ()
    c = np.random.default_rng(1).standard_normal((*other, fine.count, *shape))
    plain, compiled = (step(coarse, fine).analyse(c, axis, compiled=each) for each in (False, True))
    for one, two in zip(plain, compiled, strict=True):
        np.testing.assert_allclose(one, two, atol=1e-12)
    np.testing.assert_allclose(step(coarse, fine).synthesise(*compiled, axis, compiled=True), c, atol=1e-12)
