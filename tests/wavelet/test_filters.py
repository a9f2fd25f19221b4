import numpy as np
import pytest
from hypothesis import given, settings

from mracad.bspline.basis import basis
from mracad.bspline.gram import gram
from mracad.bspline.knots import KnotVector
from mracad.bspline.refine import refinement
from mracad.errors import UsageError
from mracad.wavelet.filters import wavelets
from tests.bspline.spaces import KINDS, random_knots
from tests.wavelet.pairs import pairs, random_pair, uniform

# degree, coarse level from which it holds (None: that level alone), start, integers, (level, squared norm)
GOLDEN = [
    (3, (1,), 0, [1, -2, 3, -2, 1], (1, 1 / 7)),
    (3, (2,), 0, [1368, -2064, 1793, -1053, 691, -240], (2, 31196288 / 315)),
    (3, (3, 4, 5), 0, [1136914560, -1655323200, 1321223960, -633094403, 229000092, -46819570, 3456748, -27877],
     (4, 1703554701101069632 / 105)),
    (3, (4, 5), 1, [113407810560, -310334449720, 409599117799, -442436404716, 314778993806, -131665074668,
                    27809640281, -2055920496, 16580004], (4, 280961917610911715308132 / 105)),
    (3, (4, 5), 2, [1228360, -6643465, 26584020, -59678354, 77343956, -58651607, 25047312, -5312796, 392832, -3168],
     (4, 1283456577116476 / 15)),
    *((3, (4, 5), start, [1, -124, 1677, -7904, 18482, -24264, 18482, -7904, 1677, -124, 1], (4, 42201354 / 5))
      for start in (3, 5)),
    (2, (1,), 0, [2, -3, 3, -2], (1, 4 / 5)),
    (2, (2,), 0, [144, -177, 109, -53, 21], (2, 4936 / 3)),
    (2, (3, 4, 5), 0, [6864, -8346, 4967, -2083, 406, -14], (3, 9160006 / 5)),
    (2, (3, 4, 5), 1, [780, -1949, 3481, -3362, 1618, -319, 11], (3, 713568)),
    *((2, (4, 5), start, [1, -29, 147, -303, 303, -147, 29, -1], (4, 17011 / 6)) for start in (2, 4, 6)),
    (1, (1,), 0, [1, -1, 1], (1, 1 / 3)),
    (1, (2, 3, 4), 0, [12, -11, 6, -1], (3, 32 / 3)),
    *((1, (3, 4), start, [1, -6, 10, -6, 1], (3, 9)) for start in (1, 3)),
]  # fmt: skip


@pytest.mark.parametrize(("degree", "levels", "start", "integers", "norm"), GOLDEN)
def test_exact_wavelets_on_uniform_knots(degree, levels, start, integers, norm):
    # The tables count the level of the fine knots i / 2^j.
    for j in levels:
        fine = uniform(degree, j)
        q = wavelets(uniform(degree, j - 1), fine).toarray()
        column = q[:, np.flatnonzero((q != 0).argmax(axis=0) == start)]
        assert column.shape[1] == 1
        found = column[:, 0] / column[start, 0] * integers[0]
        expected = np.zeros(fine.count)
        expected[start : start + len(integers)] = integers
        np.testing.assert_allclose(found, expected, rtol=1e-9, atol=1e-13 * np.abs(expected).max())
        if j == norm[0]:
            squared = expected @ gram(fine).toarray() @ expected
            assert squared == pytest.approx(norm[1], rel=1e-10)


@pytest.mark.parametrize("degree", [1, 2, 3, 4, 5])
def test_uniform_wavelets_mirror_each_other(degree):
    q = wavelets(uniform(degree, 4), uniform(degree, 5)).toarray()
    mirrored = q[::-1, ::-1]
    signs = np.sign((q * mirrored).sum(axis=0))
    np.testing.assert_allclose(mirrored * signs, q, atol=1e-11 * np.abs(q).max())


def relative_products(coarse: KnotVector, fine: KnotVector, q: np.ndarray) -> float:
    """Largest inner product of a wavelet and a coarse function, both of unit length."""
    g, p = gram(fine).toarray(), refinement(coarse, fine).toarray()
    return float(np.abs((p.T @ g @ q) / np.sqrt(np.diag(p.T @ g @ p))[:, None]).max())


@given(pairs())
@settings(deadline=None, max_examples=150)
def test_count_independence_and_orthogonality(pair):
    coarse, fine = pair
    if fine.closed()[1] != (0, 0):  # functions that are all but zero within the domain say nothing there
        fine, coarse = fine.closed()[0], coarse.closed()[0]
    q = wavelets(coarse, fine).toarray()
    assert q.shape == (fine.count, fine.count - coarse.count)
    both = np.concatenate([refinement(coarse, fine).toarray(), q / np.abs(q).max(axis=0)], axis=1)
    assert np.linalg.matrix_rank(both, tol=1e-14) == fine.count
    assert relative_products(coarse, fine, q) < 1e-13 * 10 ** max(0, fine.degree - 5)


@pytest.mark.parametrize("kind", ["clamped", "periodic"])
@pytest.mark.parametrize("degree", range(1, 26))
def test_orthogonality_when_every_second_knot_goes(degree, kind):
    fine = random_knots(degree, kind, 3 * degree + 8 if kind == "periodic" else 20, degree, most=1)
    coarse = fine.without(fine.breaks[1:-1:2])
    q = wavelets(coarse, fine)
    assert relative_products(coarse, fine, q.toarray()) < (1e-13 if degree <= 10 else 1e-9)
    norms = np.einsum("ij,ij->j", q.toarray(), gram(fine).apply(q.toarray()))
    np.testing.assert_allclose(norms, 1, atol=1e-13 * 4.0**degree)
    first = q.toarray()[(q.toarray() != 0).argmax(axis=0), np.arange(q.shape[1])]
    assert (first > 0).all()


@pytest.mark.parametrize("degree", [1, 2, 3, 5])
def test_supports_are_short(degree):
    fine = random_knots(degree, "clamped", 60, 0, most=1)
    q = wavelets(fine.without(fine.breaks[1:-1:2]), fine).toarray()
    assert (np.count_nonzero(q, axis=0) <= 3 * degree + 2).all()


@pytest.mark.parametrize("degree", [2, 3, 4])
@pytest.mark.parametrize("vanish", [(1, 1), (2, 2), (0, 2), (2, 1)])
def test_wavelets_that_leave_the_ends_alone(degree, vanish):
    fine = random_knots(degree, "clamped", 16, 3, most=2)
    coarse = fine.without(fine.breaks[1:-1:2])
    start, end = vanish
    q = wavelets(coarse, fine, vanish).toarray()
    n, m = fine.count - start - end, coarse.count - start - end
    assert q.shape == (n, n - m)
    g = gram(fine).toarray()[start : start + n, start : start + n]
    p = refinement(coarse, fine).toarray()
    assert np.abs(p[:start, start:]).max(initial=0) == 0  # the spaces are nested
    p = p[start : start + n, start : start + m]
    np.testing.assert_allclose(p.T @ g @ q, 0, atol=1e-13 * np.sqrt(np.abs(g).max()))
    assert np.linalg.matrix_rank(np.concatenate([p, q / np.abs(q).max(axis=0)], axis=1)) == n
    full = np.pad(q, ((start, end), (0, 0)))
    for x, orders in zip(fine.domain, vanish, strict=True):
        for k in range(orders):
            first, values = basis(fine, [x], k, "right" if x == fine.domain[0] else "left")
            np.testing.assert_array_equal(values @ full[first[0] : first[0] + degree + 1], 0)


def test_a_short_loop_has_its_wavelets_too():
    fine = KnotVector.from_multiplicities(np.arange(7.0), [1] * 7, 5, periodic=True)
    coarse = fine.without([1.0, 3.0, 5.0])
    q = wavelets(coarse, fine).toarray()
    assert np.linalg.matrix_rank(np.concatenate([refinement(coarse, fine).toarray(), q], axis=1)) == 6
    assert relative_products(coarse, fine, q) < 1e-13


def test_equal_spaces_have_no_wavelets():
    kv = uniform(3, 2)
    assert wavelets(kv, kv).shape == (kv.count, 0)


def test_columns_act_as_their_matrix():
    for kind in KINDS:
        coarse, fine = random_pair(3, kind, 12, 4, most=1)
        q = wavelets(coarse, fine)
        rng = np.random.default_rng(0)
        d, c = rng.standard_normal((2, q.shape[1])), rng.standard_normal((2, q.shape[0]))
        np.testing.assert_allclose(q.apply(d, 1), d @ q.toarray().T, atol=1e-11)
        np.testing.assert_allclose(q.apply_transposed(c, 1), c @ q.toarray(), atol=1e-11)
        row, column, value = q.coo()
        dense = np.zeros(q.shape)
        dense[row, column] = value
        np.testing.assert_array_equal(dense, q.toarray())


def test_bad_requests_are_refused():
    coarse, fine = uniform(3, 1), uniform(3, 2)
    with pytest.raises(UsageError, match="nested"):
        wavelets(fine, coarse)
    with pytest.raises(UsageError, match="vanish"):
        wavelets(coarse, fine, (3, 2))
    loop = KnotVector.from_multiplicities(np.arange(9.0), [1] * 9, 3, periodic=True)
    with pytest.raises(UsageError, match="vanish"):
        wavelets(loop.without([1.0]), loop, (1, 0))
