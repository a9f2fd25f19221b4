from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from mracad.bspline.basis import basis, gauss
from mracad.bspline.knots import KnotVector
from mracad.bspline.refine import is_nested
from mracad.bspline.surface import Net
from mracad.errors import UsageError
from mracad.wavelet.ladder import arc_lengths, ladder_for_scale, rungs_by_level
from mracad.wavelet.project import projection
from tests.bspline.spaces import KINDS, random_knots
from tests.bspline.test_surface import circle, sphere
from tests.wavelet.pairs import uniform


def reversed_knots(kv):
    return KnotVector.from_multiplicities(-kv.breaks[::-1], kv.multiplicities[::-1], kv.degree, kv.periodic)


def test_dyadic_knots_give_the_dyadic_ladder():
    assert rungs_by_level(uniform(3, 5)) == [uniform(3, j) for j in (5, 4, 3, 2, 1, 0)]


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("most", [1, 3])
def test_rungs_are_nested_and_never_lose_neighbours(kind, most):
    for seed in range(8):
        kv = random_knots(3, kind, 23 + seed, seed, most)
        rungs = rungs_by_level(kv)
        assert rungs[0] is kv
        for fine, coarse in pairwise(rungs):
            assert is_nested(coarse, fine)
            here = np.isin(fine.breaks, coarse.breaks)
            assert not (~here[1:] & ~here[:-1]).any()
        multiple = kv.multiplicities[slice(None) if kv.periodic else slice(1, -1)].max() > 1
        if multiple:
            assert rungs[1].breaks.tolist() == kv.breaks.tolist()
        inner = rungs[-1].multiplicities[1:-1]
        assert (inner == 1).all()
        assert rungs[-1].spans <= (9 if kind == "periodic" else 1)
        if kind == "periodic":
            assert rungs[-1].spans >= 4


def test_kept_lines_survive_on_every_rung():
    kv = random_knots(3, "clamped", 20, 1)
    lines = [kv.breaks[5], kv.breaks[6], kv.breaks[13]]
    lengths = np.diff(kv.breaks)
    mask = np.isin(kv.breaks, lines)
    rungs = rungs_by_level(kv, frozenset(lines))
    assert rungs == rungs_by_level(kv, mask)
    for rung in [*rungs, ladder_for_scale(kv, lengths, 100.0, set(lines))]:
        assert (rung.multiplicities[np.isin(rung.breaks, lines)] == kv.multiplicities[mask]).all()
        assert np.isin(lines, rung.breaks).all()
    assert rungs[-1].breaks[1:-1].tolist() == lines


def test_near_duplicates_count_as_one_knot():
    breaks = np.sort(np.concatenate([np.arange(9.0), np.arange(1, 8) + 1e-6, [1e-6, 8 - 1e-6]]))
    kv = KnotVector.clamped(breaks, 3)
    rungs = rungs_by_level(kv, lengths=np.diff(breaks))
    assert [rung.spans for rung in rungs] == [17, 8, 4, 2, 1]
    assert np.round(rungs[1].breaks, 3).tolist() == list(range(9))


def test_a_scale_below_every_span_changes_nothing():
    for kind in KINDS:
        kv = random_knots(3, kind, 12, 2)
        assert ladder_for_scale(kv, np.ones(12), 1.0) is kv


def test_a_scale_above_everything_leaves_the_ends():
    kv = random_knots(3, "clamped", 12, 2)
    assert ladder_for_scale(kv, np.ones(12), 1e3).spans == 1
    loop = random_knots(3, "periodic", 12, 2)
    assert 4 <= ladder_for_scale(loop, np.ones(12), 1e3).spans <= 8


def test_spans_end_up_between_half_the_scale_and_the_scale():
    rng = np.random.default_rng(0)
    for spans in (np.full(400, 0.3), rng.uniform(0.1, 1.0, 400), np.geomspace(0.01, 0.9, 400)):
        kv = KnotVector.clamped(np.concatenate([[0], np.cumsum(spans)]), 3)
        left = np.diff(ladder_for_scale(kv, spans, 4.0).breaks)
        assert left.max() <= 4.0 + 1e-5
        assert (left[1:] + left[:-1]).min() >= 4.0 - 1e-5


def test_multiple_knots_are_as_fine_as_their_number():
    def copies(degree, multiplicity, span, scale):
        mults = [degree + 1, *[multiplicity] * 9, degree + 1]
        kv = KnotVector.from_multiplicities(np.arange(11.0), mults, degree)
        return set(ladder_for_scale(kv, np.full(10, span), scale).multiplicities[1:-1].tolist())

    assert copies(3, 3, 6.0, 10.0) == {1}
    assert copies(3, 2, 9.9, 10.0) == {1}
    assert copies(3, 3, 10.0, 10.0) == {3}
    assert copies(5, 5, 10.0, 10.0) == {3}
    assert copies(5, 5, 17.0, 10.0) == {5}


@given(st.integers(0, 10**6), st.sampled_from(KINDS), st.floats(0.3, 8))
@settings(deadline=None, max_examples=60)
def test_ladders_do_not_depend_on_rounding_units_or_direction(seed, kind, scale):
    rng = np.random.default_rng(seed)
    kv = random_knots(3, kind, int(rng.integers(5, 60)), seed)
    lengths = rng.choice([rng.uniform(0.05, 1, kv.spans), np.full(kv.spans, 0.5)])
    coarse = ladder_for_scale(kv, lengths, scale)
    noisy = lengths * (1 + 1e-14 * rng.standard_normal(kv.spans))
    assert ladder_for_scale(kv, noisy, scale) == coarse
    assert ladder_for_scale(kv, 25.4 * lengths, 25.4 * scale, tolerance=25.4e-4) == coarse
    if kind != "unclamped":
        back = ladder_for_scale(reversed_knots(kv), lengths[::-1], scale)
        if not (lengths == lengths[::-1]).all():  # a mirror image of itself leaves one tie open
            assert back == reversed_knots(coarse)
        else:
            assert back.count == coarse.count


@given(st.integers(0, 10**6))
@settings(deadline=None, max_examples=30)
def test_rungs_do_not_depend_on_direction(seed):
    kv = random_knots(3, "clamped", int(np.random.default_rng(seed).integers(5, 60)), seed)
    lengths = np.diff(kv.breaks)
    back = rungs_by_level(reversed_knots(kv), lengths=lengths[::-1])
    assert back == [reversed_knots(rung) for rung in rungs_by_level(kv, lengths=lengths)]


LENGTH, SCALE = 300.0, 10.0


def parameterisations():
    """(name, arc length at each break, multiplicity, degree)."""
    rng = np.random.default_rng(0)
    yield "uniform", np.full(1000, 0.3), 1, 3
    yield "uneven", rng.uniform(0.1, 1.5, 400), 1, 3
    yield "wild", 10 ** rng.uniform(-4, 0.3, 900), 1, 3
    yield "dense region", np.concatenate([np.full(80, 1.0), np.full(1500, 0.05), np.full(110, 1.0)]), 1, 3
    yield "graded", np.geomspace(0.05, 1.5, 500), 1, 3
    yield "double knots", np.full(220, 1.4), 2, 3
    yield "triple knots", np.full(350, 0.9), 3, 3
    yield "quadratic", rng.uniform(0.1, 1.2, 450), 1, 2
    yield "quintic", np.full(310, 0.97), 1, 5


def kept(kv, coarse, at, wavelength):
    """Share of a ripple that smoothing leaves, away from the ends; ``at`` maps parameters to arc length."""
    from scipy.sparse.linalg import spsolve

    from mracad.bspline.rows import Rows

    span, offset, weight = gauss(kv, kv.degree + 2)
    x = (kv.knots[span][:, None] + offset).ravel()
    w, s = weight.ravel(), at(x)
    ripple = np.sin(2 * np.pi * s / wavelength + 0.3)
    first, values = basis(kv, x)
    b = Rows(first, np.ascontiguousarray(values), kv.count).tocsr()
    c = spsolve((b.T @ (b * w[:, None])).tocsc(), b.T @ (w * ripple))
    before, after = b @ c, b @ projection(coarse, kv).apply(c)
    middle = (s > 3 * SCALE) & (s < LENGTH - 3 * SCALE)
    return (w * before * after)[middle].sum() / (w * before * before)[middle].sum()


@pytest.mark.parametrize(("name", "spans", "multiplicity", "degree"), list(parameterisations()))
@pytest.mark.parametrize("warp", [0.0, 40.0])
def test_scale_is_a_wavelength(name, spans, multiplicity, degree, warp):
    arc = np.concatenate([[0.0], np.cumsum(spans)])
    arc *= LENGTH / arc[-1]
    dense = np.linspace(0, LENGTH, 20001)

    def parameter(s):
        return s + warp * np.sin(2 * np.pi * s / LENGTH)

    mults = np.full(len(arc), multiplicity)
    mults[[0, -1]] = degree + 1
    kv = KnotVector.from_multiplicities(parameter(arc), mults, degree)
    coarse = ladder_for_scale(kv, np.diff(arc), SCALE)

    def at(x):
        return np.interp(x, parameter(dense), dense)

    shares = [kept(kv, coarse, at, k * SCALE) for k in (0.3, 0.4, 0.5, 1.0, 1.5, 2.0, 3.0, 4.0)]
    assert max(shares[:3]) <= 0.1
    assert min(shares[-2:]) >= 0.95
    assert (np.diff(shares) > -0.05).all()


def test_arc_lengths_of_a_sphere():
    ball = sphere()
    np.testing.assert_allclose(arc_lengths(ball, 1), [np.pi / 2] * 2, rtol=1e-3)
    places = 2 * (np.arange(16) + 0.5) / 16
    radius = np.linalg.norm(ball.evaluate(np.stack([0 * places, places], axis=1))[:, :2], axis=1)
    np.testing.assert_allclose(arc_lengths(ball, 0), np.pi / 2 * radius.mean(), rtol=1e-3)


def test_the_same_knots_however_the_model_lies():
    rng = np.random.default_rng(0)
    ring, v = circle(), random_knots(3, "clamped", 40, 1)
    fine = ring.refined(rng.uniform(0, 4, 50))
    poles = np.empty((fine.knots.count, v.count, 3))
    poles[..., :2], poles[..., 2] = fine.poles[:, None], v.greville()
    net = Net(fine.knots, v, poles, np.repeat(fine.weights[:, None], v.count, axis=1))
    turn = Rotation.from_rotvec([0.4, 1, -2]).as_matrix()
    moved = Net(net.u, net.v, 3.7 * (net.poles @ turn.T) + 100, net.weights)
    for direction, kv in ((0, net.u), (1, net.v)):
        for scale in (0.2, 0.5, 1.3):
            a = ladder_for_scale(kv, arc_lengths(net, direction), scale)
            b = ladder_for_scale(kv, arc_lengths(moved, direction), 3.7 * scale, tolerance=3.7e-4)
            assert a == b


def test_bad_requests_are_refused():
    kv = uniform(3, 2)
    bad = np.array([1.0, 1.0, -1.0, 1.0])
    for lengths, scale in ((np.ones(3), 1.0), (np.ones(4), 0.0), (np.ones(4), np.nan), (bad, 1.0)):
        with pytest.raises(UsageError):
            ladder_for_scale(kv, lengths, scale)
    with pytest.raises(UsageError):
        rungs_by_level(kv, np.ones(2, dtype=bool))
