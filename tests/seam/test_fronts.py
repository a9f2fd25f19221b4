import numpy as np
import pytest
from scipy.sparse import csr_array, eye_array, kron

from mracad.bspline.gram import gram
from mracad.bspline.knots import KnotVector
from mracad.seam.factor import BROAD, Definite
from mracad.seam.fronts import Fronts


def form(nu, nv, degree):
    """M + K of a flat net, and the places of its control points."""
    u, v = (KnotVector.clamped(np.arange(n - degree + 1.0), degree) for n in (nu, nv))
    (mu, ku), (mv, kv) = ([gram(k, order).tocsr() for order in (0, 2)] for k in (u, v))
    matrix = kron(mu, mv) + 5 * (kron(ku, mv) + kron(mu, kv)) + 1e-9 * eye_array(nu * nv)
    return csr_array(matrix), np.indices((nu, nv)).reshape(2, -1).T


@pytest.mark.parametrize(("nu", "nv", "degree"), [(61, 47, 3), (9, 160, 3), (30, 33, 5), (8, 8, 3)])
def test_fronts_solve_what_they_factor(nu, nv, degree):
    matrix, places = form(nu, nv, degree)
    some = np.random.default_rng(1).uniform(size=nu * nv) < 0.9
    matrix, places = matrix[some][:, some], places[some]
    x = np.random.default_rng(2).standard_normal((len(places), 3))
    np.testing.assert_allclose(Fronts(matrix, places)(matrix @ x), x, atol=1e-8)


def test_fronts_take_far_fewer_numbers_than_a_band():
    matrix, places = form(130, 130, 3)
    found = Fronts(matrix, places)
    kept = sum(each.square.size + each.below.size for each in found._fronts)
    assert kept < 0.7 * len(places) * 3 * 130


def test_wide_nets_are_solved_by_fronts_and_narrow_ones_by_a_band():
    for nu, nv, wide in ((BROAD // 3 + 8, BROAD // 3 + 8, True), (12, 200, False)):
        matrix, places = form(nu, nv, 3)
        solve, plain = Definite(matrix, places), Definite(matrix)
        assert isinstance(solve._solve, Fronts) == wide
        right = np.random.default_rng(3).standard_normal((len(places), 3))
        expected = plain(right)
        np.testing.assert_allclose(solve(right), expected, atol=1e-9 * np.abs(expected).max())


def test_matrices_that_are_not_definite_are_refused():
    matrix, places = form(20, 20, 3)
    with pytest.raises(np.linalg.LinAlgError, match="not positive definite"):
        Fronts(csr_array(matrix - eye_array(len(places))), places)
