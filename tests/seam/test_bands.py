"""Products, sums and factors of bands against dense linear algebra."""

import numpy as np
import pytest
from scipy.sparse import csr_array, eye_array, kron

from mracad.bspline.gram import gram
from mracad.bspline.knots import KnotVector
from mracad.seam.bands import Bands, Blocks, Cholesky
from mracad.seam.constrained import LEAST, Banded, Constrained

EVEN = {False: KnotVector.clamped(np.arange(20.0), 3), True: KnotVector.clamped(np.arange(4.0), 3)}
RING = KnotVector.from_multiplicities(np.arange(31.0), [1] * 31, 3, periodic=True)


def forms(u, v):
    """Mass and bending of a flat net over a part of which lies in a face, and places of control points."""
    (mu, ku), (mv, kv) = ([gram(k, order).tocsr() for order in (0, 2)] for k in (u, v))
    there = kron(np.ones((u.count, 1)), (np.arange(v.count) > 0)[:, None]).toarray().ravel()
    inside = csr_array(np.diag(there))
    found = [csr_array(inside @ each @ inside) for each in (kron(mu, mv), kron(ku, mv) + kron(mu, kv))]
    for each in found:
        each.eliminate_zeros()
        each.sort_indices()
    return found, np.indices((u.count, v.count)).reshape(2, -1).T


@pytest.mark.parametrize(
    ("u", "v", "widest"),
    [(EVEN[False], EVEN[True], 3 * 5 + 3), (EVEN[True], EVEN[False], 3 * 6 + 3), (EVEN[True], RING, 7 * 6)],
    ids=["along u", "along v", "ring"],
)
def test_products_and_minima_are_those_of_dense_algebra(u, v, widest):
    (mass, bending), places = forms(u, v)
    bands, n = Bands([mass, bending, csr_array(mass.shape)], places), len(places)
    assert bands.width <= widest and set(bands.points.tolist()) == set(np.flatnonzero(mass.diagonal()).tolist())
    x = np.random.default_rng(0).standard_normal((n, 3))
    for number in range(3):
        expected = bands.matrices[number] @ x
        np.testing.assert_allclose(Blocks([bands], number) @ x, expected, atol=1e-12 * np.abs(x).max())
    free = (np.random.default_rng(1).uniform(size=n) < 0.8) & (mass.diagonal() > 0)
    for weights in ((1.0, 0.0, 1.0), (1.0, 0.3, 1.0)):
        dense = (mass + weights[1] * bending).toarray()[np.ix_(free, free)]
        found = Banded(bands, weights, free)(x)
        assert not found[~free].any()
        np.testing.assert_allclose(found[free], np.linalg.solve(dense, x[free]), atol=1e-5 * np.abs(found).max())
        sparse = Constrained(mass + weights[1] * bending, csr_array((0, n)), free, places=places)(x)
        np.testing.assert_allclose(found, sparse, atol=1e-9 * np.abs(found).max())


def test_products_with_several_surfaces_keep_no_bands():
    (mass, _), places = forms(EVEN[False], EVEN[True])
    both, x = (
        [Bands([mass], places), Bands([2.0 * mass], places)],
        np.random.default_rng(0).standard_normal((len(places), 3)),
    )
    np.testing.assert_allclose(Blocks(both, 0) @ np.concatenate([x, x]), np.concatenate([mass @ x, 2.0 * mass @ x]))
    assert all(each.dense and "lower" not in vars(each) for each in both)


def test_a_control_point_without_mass_stays_where_the_form_hardly_holds_it():
    mass = csr_array(np.diag([1.0, 1e-30, 2.0]))
    solve = Banded(Bands([mass]), [1.0], np.ones(3, bool))
    np.testing.assert_allclose(solve(np.array([[1.0], [1e-30], [1.0]])).ravel(), [1.0, 0.0, 0.5], atol=1e-9)
    assert LEAST < 1e-9


def test_wide_bands_are_not_used_and_few_free_unknowns_are_solved_without_the_others():
    (mass, _), places = forms(*(KnotVector.clamped(np.arange(40.0), 3),) * 2)
    bands = Bands([mass], places)
    few, most = np.zeros(len(places), bool), np.ones(len(places), bool)
    few[:100] = True
    assert bands.holds(most) and not bands.holds(few)
    assert not Bands([csr_array(np.ones((900, 900)))]).holds(np.ones(900, bool))


def test_matrices_that_are_not_definite_are_refused():
    (mass, _), places = forms(EVEN[False], EVEN[True])
    matrix = csr_array(mass - eye_array(len(places)))
    bands = Bands([matrix], places)
    with pytest.raises(np.linalg.LinAlgError, match="not positive definite"):
        Cholesky(bands, bands.sum([1.0]))
