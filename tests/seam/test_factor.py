"""Solutions of definite systems against dense linear algebra."""

import tracemalloc

import numpy as np
import pytest
from scipy.sparse import csr_array

from mracad.seam.factor import Definite


def laplacian(nu, nv, ring=False):
    """Points of a grid tied to their neighbours, round the grid along v where asked."""
    n = nu * nv
    at = np.arange(n).reshape(nu, nv)
    pairs = [(at[:-1], at[1:]), (at[:, :-1], at[:, 1:])] + ([(at[:, -1], at[:, 0])] if ring else [])
    dense = 0.1 * np.eye(n)
    for a, b in pairs:
        for i, j in zip(a.ravel(), b.ravel(), strict=True):
            dense[[i, j], [i, j]] += 1.0
            dense[i, j] -= 1.0
            dense[j, i] -= 1.0
    return dense


MIXED = np.random.default_rng(1).permutation(60)
DENSE = np.random.default_rng(2).standard_normal((400, 400))


@pytest.mark.parametrize(
    "dense",
    [
        laplacian(12, 5),
        laplacian(5, 12, ring=True),
        laplacian(12, 5)[MIXED][:, MIXED],
        DENSE.T @ DENSE + np.eye(400),
        np.diag([2.0, 1.0, -3.0]),
        np.zeros((0, 0)),
    ],
    ids=["grid", "ring", "any order", "no band", "indefinite", "nothing"],
)
def test_solutions_are_those_of_dense_algebra(dense):
    right = np.random.default_rng(0).standard_normal((len(dense), 3))
    kept = right.copy()
    found = Definite(csr_array(dense))(right)
    assert np.abs(dense @ found - right).max(initial=0.0) < 1e-9 and (right == kept).all()


def room(matrix):
    """Bytes that a factor keeps."""
    tracemalloc.start()
    factor = Definite(matrix)
    kept, _ = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    del factor
    return kept


def test_the_band_is_taken_along_the_short_side():
    wide, narrow = (csr_array(laplacian(*shape)) for shape in ((4, 100), (100, 4)))
    Definite(wide)  # what is imported on the way is no part of it
    assert room(wide) <= 2 * room(narrow) <= 14 * 8 * 400
