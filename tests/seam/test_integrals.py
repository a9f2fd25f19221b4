"""Integrals taken one direction after the other against sums over all products of functions."""

import numpy as np
import pytest

from mracad.bspline.gram import gram
from mracad.bspline.knots import KnotVector
from mracad.compiled import Compiled
from mracad.seam.integrals import integrals, sites

ORDERS = ((0, 0), (1, 0), (0, 1), (2, 0), (1, 1), (0, 2))
BREAKS = np.array([0.0, 0.3, 0.45, 1.0])
KNOTS = {
    "cubic": KnotVector.clamped(BREAKS, 3),
    "double": KnotVector.from_multiplicities(BREAKS, [6, 2, 5, 6], 5),
    "line": KnotVector.clamped(BREAKS, 1),
    "ring": KnotVector.from_multiplicities(BREAKS, [1, 1, 1, 1], 2, periodic=True),
}


def gauss(knots, cuts=()):
    """Gauss points of all spans, some of them cut."""
    breaks = np.union1d(knots.breaks, cuts)
    nodes, weights = np.polynomial.legendre.leggauss(knots.degree + 1)
    half = np.diff(breaks)[:, None] / 2
    return sites(knots, breaks[:-1, None] + half * (nodes + 1), half * weights)


def along(side):
    """All functions and derivatives of a direction at its points, ``(3, points, functions)``."""
    table = np.zeros((3, side.at.size, side.knots.count))
    for piece, first in enumerate(side.first):
        for g in range(side.at.shape[1]):
            for k in range(side.knots.degree + 1):
                table[:, piece * side.at.shape[1] + g, (first + k) % side.knots.count] += side.table[piece, g, :, k]
    return table


def whole(stencil):
    """A stencil as a dense matrix."""
    nu, nv, wu, wv = stencil.shape
    dense = np.zeros((nu, nv, nu, nv))
    for i, j, k, m in np.ndindex(*stencil.shape):
        dense[i, j, (i + k - wu // 2) % nu, (j + m - wv // 2) % nv] += stencil[i, j, k, m]
    return dense.reshape(nu * nv, -1)


@pytest.mark.parametrize(("u", "v"), [("cubic", "double"), ("double", "line"), ("ring", "cubic"), ("line", "ring")])
def test_integrals_are_sums_over_products_of_functions(u, v):
    sides = gauss(KNOTS[u], [0.1, 0.2]), gauss(KNOTS[v], [0.7])
    rng, size = np.random.default_rng(0), (sides[0].at.size, sides[1].at.size)
    coefficients = {(a, b): rng.standard_normal(size) for i, a in enumerate(ORDERS) for b in ORDERS[: i + 1]}
    in_u, in_v = map(along, sides)
    wanted = 0.0
    for (a, b), c in coefficients.items():
        left, right = (np.einsum("xi,yj->xyij", in_u[r], in_v[s]).reshape(c.size, -1) for r, s in (a, b))
        part = left.T @ (c.reshape(-1, 1) * right)
        wanted = wanted + (part if a == b else part + part.T)
    found = whole(integrals(sides, tuple(coefficients), np.array([c.T for c in coefficients.values()])))
    assert np.abs(found - wanted).max() <= 1e-12 * np.abs(wanted).max()


@pytest.mark.parametrize(("u", "v"), [("cubic", "double"), ("ring", "line")])
def test_compiled_code_and_arrays_give_the_same_bits(u, v, monkeypatch):
    sides = gauss(KNOTS[u], [0.1, 0.2]), gauss(KNOTS[v], [0.7])
    pairs = tuple((a, b) for i, a in enumerate(ORDERS) for b in ORDERS[: i + 1])
    values = np.random.default_rng(0).standard_normal((len(pairs), sides[1].at.size, sides[0].at.size))
    found = []
    for used in (True, False):
        monkeypatch.setattr(Compiled, "pays", lambda self, work, used=used: used)
        found.append(integrals(sides, pairs, values))
    np.testing.assert_array_equal(*found)


def test_large_nets_are_products_of_their_directions():
    """They are integrated in blocks."""
    u, v = KnotVector.clamped(np.arange(701.0), 2), KnotVector.clamped(np.arange(301.0), 3)
    sides = gauss(u), gauss(v)
    weights = np.multiply.outer(*(side.weight.ravel() for side in sides[::-1]))
    found = integrals(sides, (((0, 0), (0, 0)),), weights[None])
    bands = []
    for kv in (u, v):
        dense, place = gram(kv).toarray(), np.arange(kv.count)[:, None] + np.arange(-kv.degree, kv.degree + 1)
        inside = (place >= 0) & (place < kv.count)
        bands.append(np.where(inside, dense[np.arange(kv.count)[:, None], np.clip(place, 0, kv.count - 1)], 0.0))
    rows = np.array([0, 1, 350, 699, 701])
    wanted = np.einsum("ik,jm->ijkm", bands[0][rows], bands[1])
    np.testing.assert_allclose(found[rows], wanted, rtol=0, atol=1e-12)  # parameters of 700 have but 13 digits left
