import numpy as np
import pytest
from hypothesis import given, settings

from mracad.bspline import boor
from mracad.bspline.basis import basis, gauss, jet
from mracad.bspline.gram import gram
from mracad.bspline.knots import KnotVector
from mracad.errors import UsageError
from tests.bspline.spaces import KINDS, knot_vectors, random_knots


def dense(kv, x, derivative=0, side="right"):
    first, values = basis(kv, x, derivative, side)
    out = np.zeros((len(x), kv.count))
    np.add.at(out, (np.arange(len(x))[:, None], (first[:, None] + np.arange(kv.degree + 1)) % kv.count), values)
    return out


@given(knot_vectors())
@settings(deadline=None, max_examples=60)
def test_partition_of_unity(kv):
    x = np.concatenate([np.linspace(*kv.domain, 41), kv.breaks])
    for side in ("left", "right"):
        _, values = basis(kv, x, side=side)
        assert values.min() >= 0
        np.testing.assert_allclose(values.sum(axis=1), 1, atol=1e-14)
        np.testing.assert_allclose(basis(kv, x, 1, side)[1].sum(axis=1), 0, atol=1e-9)


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("degree", [1, 3, 22])
@pytest.mark.parametrize("side", ["left", "right"])
def test_compiled_code_and_arrays_give_the_same_bits(kind, degree, side, monkeypatch):
    kv = random_knots(degree, kind, 6, seed=degree)
    low, high = kv.domain
    x = np.concatenate([np.linspace(low - 0.3, high + 0.3, 100), kv.breaks])
    found = []
    for used in (True, False):
        monkeypatch.setattr(boor.EVALUATE, "pays", lambda work, used=used: used)
        found.append(jet(kv, x, (2, 0, 1, degree, degree + 1), side))
    for compiled, arrays in zip(*found, strict=True):
        np.testing.assert_array_equal(compiled, arrays)
        assert compiled.strides == arrays.strides  # sums of products depend on them


@pytest.mark.parametrize("degree", [1, 3, 9, 25])
def test_bernstein_polynomials_are_the_basis_of_one_span(degree):
    from math import comb

    x = np.linspace(0, 1, 33)
    exact = np.array([comb(degree, i) * x**i * (1 - x) ** (degree - i) for i in range(degree + 1)]).T
    np.testing.assert_allclose(basis(KnotVector.clamped([0, 1], degree), x)[1], exact, rtol=1e-12, atol=1e-300)


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("degree", [1, 2, 3, 5, 8])
def test_derivatives_against_differences(kind, degree):
    kv = random_knots(degree, kind, 6, degree)
    x = 0.5 * (kv.breaks[1:] + kv.breaks[:-1])
    h = 1e-5
    for k in (1, 2, 3):
        slope = (dense(kv, x + h, k - 1) - dense(kv, x - h, k - 1)) / (2 * h)
        np.testing.assert_allclose(dense(kv, x, k), slope, atol=1e-6 * max(1, np.abs(slope).max()) * 10**k)


def test_sides_differ_only_where_the_spline_breaks():
    kv = KnotVector.from_multiplicities([0, 1, 2], [4, 3, 4], 3)
    at = np.array([1.0])
    np.testing.assert_allclose(dense(kv, at, 0, "left"), dense(kv, at, 0, "right"), atol=1e-15)
    assert np.abs(dense(kv, at, 1, "left") - dense(kv, at, 1, "right")).max() > 1
    simple = KnotVector.clamped([0, 1, 2], 3)
    for k in range(3):
        np.testing.assert_allclose(dense(simple, at, k, "left"), dense(simple, at, k, "right"), atol=1e-13)


def test_end_polynomials_serve_beyond_the_domain():
    kv = KnotVector.clamped([0, 1, 2.5], 3)
    x = np.array([-0.5, 3.0])
    factorial = enumerate((1, 1, 2, 6))
    ends = [(dense(kv, np.array([0.0]), k), dense(kv, np.array([2.5]), k, "left"), f) for k, f in factorial]
    taylor = [sum(low * (-0.5) ** k / f for k, (low, _, f) in enumerate(ends)),
              sum(high * 0.5**k / f for k, (_, high, f) in enumerate(ends))]  # fmt: skip
    np.testing.assert_allclose(dense(kv, x), np.concatenate(taylor), atol=1e-12)


def test_derivatives_above_the_degree_vanish():
    kv = KnotVector.clamped([0, 1, 2], 2)
    assert not basis(kv, np.array([0.3]), 3)[1].any()


@given(knot_vectors())
@settings(deadline=None, max_examples=40)
def test_gauss_points_integrate_polynomials(kv):
    span, offset, weight = gauss(kv, kv.degree + 1)
    x = kv.knots[span][:, None] + offset
    low, high = kv.domain
    for k in (0, 1, 2 * kv.degree + 1):
        exact = (high ** (k + 1) - low ** (k + 1)) / (k + 1)
        assert abs((x**k * weight).sum() - exact) <= 1e-12 * max(1, abs(exact))


GOLDEN = {
    3: (10080, [[1440, 882, 186, 12], [882, 2232, 1575, 348, 3], [186, 1575, 3294, 2264, 239, 2],
                [12, 348, 2264, 4832, 2382, 240, 2]], [2, 240, 2382, 4832, 2382, 240, 2]),
    2: (120, [[24, 14, 2], [14, 40, 25, 1], [2, 25, 66, 26, 1]], [1, 26, 66, 26, 1]),
    1: (6, [[2, 1], [1, 4, 1]], [1, 4, 1]),
}  # fmt: skip


@pytest.mark.parametrize("degree", GOLDEN)
@pytest.mark.parametrize("level", [3, 4])
def test_gram_golden_numbers(degree, level):
    divisor, corner, inner = GOLDEN[degree]
    g = gram(KnotVector.clamped(np.arange(2**level + 1) / 2**level, degree)).toarray() * 2**level * divisor
    for i, row in enumerate(corner):
        np.testing.assert_allclose(g[i, : len(row)], row, rtol=1e-12)
        assert np.abs(g[i, len(row) :]).max() < 1e-9
    middle = len(g) // 2
    np.testing.assert_allclose(g[middle, middle - degree : middle + degree + 1], inner, rtol=1e-12)
    np.testing.assert_allclose(g, g[::-1, ::-1], atol=1e-9)


@given(knot_vectors())
@settings(deadline=None, max_examples=40)
def test_gram_is_the_integral(kv):
    span, offset, weight = gauss(kv, kv.degree + 2)
    x = (kv.knots[span][:, None] + offset).ravel()
    w = np.random.default_rng(0).uniform(0.5, 2, kv.spans)
    for k in range(min(kv.degree, 2) + 1):
        values = dense(kv, x, k)
        exact = values.T @ ((weight * w[:, None]).ravel()[:, None] * values)
        g = gram(kv, k, w)
        size = np.abs(exact).max()
        np.testing.assert_allclose(g.toarray(), exact, atol=1e-11 * size)
        np.testing.assert_allclose(g.tocsr().toarray(), exact, atol=1e-11 * size)
        np.testing.assert_allclose(g.diagonal(), np.diag(exact), atol=1e-11 * size)
        c = np.random.default_rng(1).standard_normal((2, kv.count, 3))
        np.testing.assert_allclose(g.apply(c, 1), np.einsum("ij,ajk->aik", exact, c), atol=1e-11 * size * kv.count)


def test_gram_refuses_bad_weights():
    kv = KnotVector.clamped([0, 1, 2], 2)
    for weights in ([1.0], [1.0, 0.0], [1.0, np.nan]):
        with pytest.raises(UsageError):
            gram(kv, weights=weights)
