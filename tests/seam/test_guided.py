"""Minima under conditions that join the coordinates."""

import numpy as np
import pytest
from scipy.sparse import csr_array

from mracad.seam.constrained import Constrained
from mracad.seam.guided import Guided, Guides


def setting(seed, slack):
    """A random form of 30 points, conditions of each coordinate and joining ones, some of which depend on others."""
    rng = np.random.default_rng(seed)
    n, m = 30, 8
    root = rng.standard_normal((n, n)) * (rng.random((n, n)) < 0.3) + np.diag(rng.uniform(0.5, 2, n))
    rows = rng.standard_normal((3, n))
    table = rng.standard_normal((m, n)) * (rng.random((m, n)) < 0.4)
    ways = rng.standard_normal((m, 3))
    ways /= np.linalg.norm(ways, axis=1, keepdims=True)
    table, ways = np.concatenate([table, table[:2]]), np.concatenate([ways, ways[:2]])
    free = rng.random(n) < 0.85
    there = rng.standard_normal((n, 3)) * free[:, None]
    goal = ((table @ there) * ways).sum(axis=1) if not slack else rng.standard_normal(len(table))
    guides = Guides(csr_array(table), ways, np.full(len(table), slack), goal)
    return root.T @ root, rows, free, guides, rng.standard_normal((n, 3)), there, rows @ there


def dense(form, rows, free, guides, right, start, owed):
    """The same minimum of all coordinates together, by dense linear algebra."""
    n, kept = len(form), np.tile(free, 3)
    join = np.concatenate([guides.matrix.toarray() * guides.ways[:, k : k + 1] for k in range(3)], axis=1)[:, kept]
    a, b = np.kron(np.eye(3), form)[np.ix_(kept, kept)], np.kron(np.eye(3), rows)[:, kept]
    left = guides.goal - guides.of(start)
    lower = np.concatenate([(owed - rows @ start).T.ravel(), left])
    slack = np.diag(np.concatenate([np.zeros(len(b)), -guides.slack]))
    every = np.concatenate([b, join])
    kkt = np.block([[a, every.T], [every, slack]])
    found = np.linalg.lstsq(kkt, np.concatenate([right.T.ravel()[kept], lower]), rcond=1e-12)[0][: kept.sum()]
    whole = np.zeros(3 * n)
    whole[kept] = found
    return whole.reshape(3, n).T


@pytest.mark.parametrize("slack", [0.0, 0.3])
@pytest.mark.parametrize("seed", range(4))
def test_the_minimum_is_that_of_all_coordinates_together(seed, slack):
    form, rows, free, guides, right, _, owed = setting(seed, slack)
    solver = Guided(Constrained(csr_array(form), csr_array(rows), free), guides)
    start = np.random.default_rng(seed + 9).standard_normal(right.shape) * free[:, None]
    for begun in (np.zeros_like(right), start):
        found = solver(right, start=begun, goal=owed)
        wanted = dense(form, rows, free, guides, right, begun, owed)
        assert np.abs(found - wanted).max() < 1e-6 * np.abs(wanted).max()
        assert np.abs(rows @ (begun + found) - owed).max() < 1e-9
        if not slack:
            assert np.abs(guides.of(begun + found) - guides.goal).max() < 1e-9


def test_settled_meets_the_conditions_and_aimed_ones_aim_elsewhere():
    form, rows, free, guides, right, there, owed = setting(0, 0.0)
    still = Guides(guides.matrix, guides.ways, guides.slack, np.zeros(len(guides.ways)))
    solver = Guided(Constrained(csr_array(form), csr_array(rows), free), still)
    near = solver.settled(there)
    assert np.abs(still.of(near)).max() < 1e-9 and np.abs(rows @ near).max() < 1e-9
    again = solver.aimed(guides.ways, guides.goal)(np.zeros_like(right), start=near, goal=owed)
    assert np.abs(guides.of(near + again) - guides.goal).max() < 1e-9
