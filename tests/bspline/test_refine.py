import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mracad.bspline.curve import Curve
from mracad.bspline.gram import gram
from mracad.bspline.knots import KnotVector
from mracad.bspline.refine import refinement
from mracad.bspline.rows import LARGE, Rows
from mracad.bspline.solve import BandSolver, folded
from mracad.errors import MracadError, UsageError
from tests.bspline.spaces import KINDS, knot_vectors, random_knots


@given(knot_vectors(25), st.integers(0, 1000))
@settings(deadline=None, max_examples=80)
def test_refinement_is_exact(kv, seed):
    rng = np.random.default_rng(seed)
    fine = kv.refined(rng.uniform(*kv.domain, rng.integers(0, 9)))
    p = refinement(kv, fine)
    assert p.shape == (fine.count, kv.count)
    assert p.values.min() >= 0
    np.testing.assert_allclose(p.values.sum(axis=1), 1, atol=1e-14)
    c = rng.standard_normal((kv.count, 2))
    t = rng.uniform(*kv.domain, 40)
    np.testing.assert_allclose(Curve(kv, c).evaluate(t), Curve(fine, p.apply(c)).evaluate(t), atol=1e-13)


@pytest.mark.parametrize("kind", KINDS)
def test_coarse_gram_matrix_follows(kind):
    kv = random_knots(4, kind, 6, 0)
    fine = kv.refined([0.31, 0.77, 0.78])
    p = refinement(kv, fine).toarray()
    np.testing.assert_allclose(p.T @ gram(fine).toarray() @ p, gram(kv).toarray(), atol=1e-14)


@pytest.mark.parametrize(
    ("degree", "scale", "head", "inner"),
    [
        (3, 16, [[16, 8], [8, 12, 3], [4, 11, 8, 2], [2, 8, 12, 8, 2]], 3),
        (2, 4, [[4, 2], [2, 3, 1], [1, 3, 3, 1]], 2),
        (1, 2, [[2, 1], [1, 2, 1]], 1),
    ],
)
def test_golden_columns(degree, scale, head, inner):
    j = 4
    coarse, fine = (KnotVector.clamped(np.arange(2**k + 1) / 2**k, degree) for k in (j - 1, j))
    p = refinement(coarse, fine).toarray() * scale
    for column in range(6):
        start = (0, *range(1, inner + 1))[column] if column <= inner else inner + 2 * (column - inner)
        entries = head[min(column, inner)]
        expected = np.zeros(len(p))
        expected[start : start + len(entries)] = entries
        np.testing.assert_allclose(p[:, column], expected, atol=1e-14)


def test_untouched_functions_stay_themselves():
    for kind in KINDS:
        kv = random_knots(3, kind, 6, 5, most=1)
        np.testing.assert_array_equal(refinement(kv, kv).toarray(), np.eye(kv.count))


def test_a_clamped_vector_refines_an_unclamped_one():
    kv = random_knots(4, "unclamped", 5, 7)
    fine = KnotVector(np.repeat(kv.breaks, 5), 4)
    c = np.random.default_rng(0).standard_normal((kv.count, 3))
    t = np.linspace(*kv.domain, 37)[:-1]
    np.testing.assert_allclose(
        Curve(kv, c).evaluate(t), Curve(fine, refinement(kv, fine).apply(c)).evaluate(t), atol=1e-12
    )


def test_knots_that_are_not_nested_are_refused():
    a, b = KnotVector.clamped([0, 1, 2], 3), KnotVector.clamped([0, 1.5, 2], 3)
    for coarse, fine in ((a, b), (a, KnotVector.clamped([0, 1, 2], 2)), (a, KnotVector.clamped([0, 1, 3], 3)),
                         (KnotVector.from_multiplicities([0, 1, 2], [4, 2, 4], 3), a)):  # fmt: skip
        with pytest.raises(UsageError, match="nested"):
            refinement(coarse, fine)


@given(knot_vectors(4), st.integers(0, 1000))
@settings(deadline=None, max_examples=40)
def test_banded_products_are_those_of_the_dense_matrix(kv, seed):
    rng = np.random.default_rng(seed)
    fine = kv.refined(rng.uniform(*kv.domain, 5))
    p, g = refinement(kv, fine), gram(fine).rows
    dense = p.toarray()
    c, e = rng.standard_normal((2, kv.count, 3)), rng.standard_normal((2, fine.count, 3))
    np.testing.assert_allclose(p.apply(c, 1), np.einsum("ij,ajk->aik", dense, c), atol=1e-13)
    np.testing.assert_allclose(p.apply_transposed(e, -2), np.einsum("ij,aik->ajk", dense, e), atol=1e-13)
    np.testing.assert_allclose(p.tocsr().toarray(), dense)
    np.testing.assert_allclose(g.dot(p).toarray(), g.toarray() @ dense, atol=1e-14)


def test_large_arrays_are_what_small_ones_are():
    """They are swept by compiled code."""
    kv = random_knots(3, "clamped", 30, 0)
    fine = kv.refined(np.linspace(0.05, 4, 21))
    p = refinement(kv, fine)
    rng = np.random.default_rng(0)
    for axis in (0, 1, -1):
        for count, product in ((kv.count, p.apply), (fine.count, p.apply_transposed)):
            shape = [60, 2 * (LARGE // (60 * count) + 1)]
            shape.insert(axis % 3, count)
            c = rng.standard_normal(shape)
            other = 0 if axis % 3 else 1
            parts = [product(part, axis) for part in np.array_split(c, 20, other)]
            np.testing.assert_allclose(product(c, axis), np.concatenate(parts, other), atol=1e-13)


@pytest.mark.parametrize("n", [1, 2, 7, 8])
def test_folding_keeps_neighbours_close(n):
    order = folded(n)
    assert sorted(order) == list(range(n))
    place = np.argsort(order)
    assert np.abs(place - np.roll(place, 1)).max() <= 2


def test_solver_needs_pivots_and_says_when_there_are_none():
    row, column = np.array([0, 0, 1, 1]), np.array([0, 1, 0, 1])
    same = np.arange(2)
    solver = BandSolver(row, column, np.array([0.0, 1, 1, 1]), same, same)
    np.testing.assert_allclose(solver.solve(np.array([2.0, 3.0])), [1, 2])
    with pytest.raises(MracadError, match="singular"):
        BandSolver(row, column, np.ones(4), same, same)


@pytest.mark.parametrize("axis", [0, 1])
def test_compiled_triangles_agree_with_pivoting(axis):
    rng = np.random.default_rng(4)
    n = 60
    row, column = (x.ravel() for x in np.meshgrid(np.arange(n), np.arange(n), indexing="ij"))
    near = np.abs(row - column) <= 4
    row, column = row[near], column[near]
    solver = BandSolver(row, column, rng.standard_normal(len(row)), np.arange(n), np.arange(n))
    many = LARGE // (2 * n) + 1
    b = rng.standard_normal((n, many, 2) if axis == 0 else (many, n, 2))
    parts = [solver.solve(part, axis) for part in np.array_split(b, 20, 1 - axis)]
    np.testing.assert_allclose(solver.solve(b, axis), np.concatenate(parts, 1 - axis), rtol=1e-8, atol=1e-9)


def test_wrong_sizes_are_refused():
    rows = Rows(np.array([0, 1]), np.ones((2, 2)), 3)
    with pytest.raises(UsageError):
        rows.apply(np.ones(2))
    with pytest.raises(UsageError):
        rows.apply_transposed(np.ones(3))


@given(knot_vectors(7), st.integers(1, 4), st.integers(0, 1000))
@settings(deadline=None, max_examples=120)
def test_elevation_is_exact(kv, more, seed):
    rng = np.random.default_rng(seed)
    elevated = kv.elevated(kv.degree + more)
    assert (elevated.degree, elevated.domain, elevated.periodic) == (kv.degree + more, kv.domain, kv.periodic)
    inner = slice(0, -1) if kv.periodic else slice(1, -1)
    np.testing.assert_array_equal(elevated.multiplicities[inner], kv.multiplicities[inner] + more)
    c, t = rng.standard_normal((kv.count, 2)), np.concatenate([kv.breaks[:-1], rng.uniform(*kv.domain, 40)])
    before = Curve(kv, c).evaluate(t, 2)
    steepest = 2 * elevated.degree / np.diff(kv.breaks).min()  # of splines with control points up to 1
    for fine in (elevated, elevated.refined(rng.uniform(*kv.domain, 3))):
        p = refinement(kv, fine)
        assert p.shape == (fine.count, kv.count)
        assert p.values.min() > -1e-15
        np.testing.assert_allclose(p.values.sum(axis=1), 1, atol=1e-14)
        after = Curve(fine, p.apply(c)).evaluate(t, 2 if fine is elevated else 0)
        for order, (a, b) in enumerate(zip(before, after, strict=False)):
            np.testing.assert_allclose(b, a, rtol=0, atol=1e-12 * steepest**order)


@pytest.mark.parametrize("degree", [1, 2, 5])
def test_elevation_of_one_span(degree):
    coarse, fine = (KnotVector.clamped([0, 1], d) for d in (degree, degree + 1))
    share = np.arange(degree + 2)[:, None] / (degree + 1)
    expected = share * np.eye(degree + 2, degree + 1, -1) + (1 - share) * np.eye(degree + 2, degree + 1)
    np.testing.assert_allclose(refinement(coarse, fine).toarray(), expected, atol=1e-15)


def test_a_degree_is_never_lowered():
    kv = random_knots(4, "unclamped", 5, 7)
    assert kv.elevated(0) is kv and kv.elevated(4) is kv
    with pytest.raises(UsageError, match="nested"):
        refinement(kv.elevated(5), kv)
    smoother = KnotVector.clamped(kv.breaks, 5)
    with pytest.raises(UsageError, match="nested"):
        refinement(kv, smoother)
