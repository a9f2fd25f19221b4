"""Conditions solved in advance."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.sparse import block_diag, csr_array

from mracad.seam import constrained
from mracad.seam.constrained import Constrained
from mracad.seam.eliminate import Eliminated

CORNER = np.array([[1.0, -1, 0, 0], [0, 1, -1, 0], [0, 0, 1, -1], [-1, 0, 0, 1]])
"""All round a corner, the last condition follows from the others."""

TANGENT = np.array([[1.0, -2, 1, 0], [0, 1, -1, 0]])


def rows() -> csr_array:
    """Two corners, a tangent, and an unknown that is not tied, with the unknowns mixed up."""
    whole = block_diag([CORNER, TANGENT, CORNER, np.zeros((0, 1))], format="csr")
    return whole[:, np.random.default_rng(2).permutation(whole.shape[1])]


def test_the_basis_spans_all_displacements_that_meet_the_conditions():
    given = rows()
    found = Eliminated.of(given)
    assert found is not None
    basis = found.basis.toarray()
    assert basis.shape == (13, 13 - (3 + 2 + 3))
    assert np.allclose(basis.T @ basis, np.eye(5), atol=1e-14)
    assert np.abs(given @ basis).max() < 1e-14
    assert np.allclose(found.least.toarray(), np.linalg.pinv(given.toarray()), atol=1e-13)


def test_conditions_are_left_that_tie_many_unknowns_or_nearly_follow_from_each_other():
    chain = csr_array(np.eye(150, 151) - np.eye(150, 151, 1))
    assert Eliminated.of(chain) is None
    assert Eliminated.of(csr_array([[1.0, 1.0], [1.0, 1.0 + 1e-6]])) is None


@pytest.mark.parametrize("goal", [False, True])
def test_minima_are_those_with_multipliers(goal, monkeypatch):
    given, rng = rows(), np.random.default_rng(5)
    count = given.shape[1]
    square = rng.standard_normal((count, count))
    form, free = csr_array(square @ square.T + np.eye(count)), np.ones(count, bool)
    free[3] = False
    right, start = rng.standard_normal((2, count, 3))
    start[3] = 0.0
    wanted = given @ np.where(free[:, None], rng.standard_normal((count, 3)), 0.0) if goal else None
    found = []
    for many in (0, count):
        monkeypatch.setattr(constrained, "MANY", many)
        solve = Constrained(form, given, free)
        found += [solve(right, start, wanted), solve(right), solve.settled(start)]
        assert np.abs(given @ (start + found[-3]) - (0.0 if wanted is None else wanted)).max() < 1e-12
    assert all(np.allclose(one, other, atol=1e-10) for one, other in zip(found[:3], found[3:], strict=True))
