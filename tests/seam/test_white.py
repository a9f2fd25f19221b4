"""The metric of control points: differences, and inserted knots that change nothing."""

import numpy as np
import pytest

from mracad.bspline.knots import KnotVector
from mracad.bspline.surface import Net
from mracad.seam.white import bends, white

NONE = (frozenset(), frozenset())


def uneven(spans=20, degree=3, seed=0, by=0.5):
    return KnotVector.clamped(np.cumsum(np.random.default_rng(seed).uniform(1 - by, 1 + by, spans + 1)), degree)


def net(u, v):
    x, y = np.meshgrid(u.greville(), v.greville(), indexing="ij")
    return Net(u, v, np.stack([x, y, np.sin(x / 3) * y], axis=-1))


def test_on_even_points_they_are_plain_differences():
    knots = KnotVector(np.arange(30.0), 3)
    assert np.allclose(bends(knots, knots), np.diff(np.eye(knots.count), 3, axis=0))


def test_none_crosses_a_crease():
    knots = uneven()
    g = knots.greville()
    crease = float(g[8] + 1e-3 * (g[9] - g[8]))
    rows = np.abs(bends(knots, knots, frozenset({crease}))) > 0
    assert len(rows) == len(bends(knots, knots)) - 3 and not (rows[:, 8] & rows[:, 9]).any()


def test_a_periodic_direction_has_no_end():
    knots = KnotVector(np.arange(13.0), 3, periodic=True)
    matrix = bends(knots, knots)
    assert len(matrix) == knots.count and np.abs(matrix.sum(axis=1)).max() < 1e-12


def test_a_raised_degree_is_bent_across_its_knots():
    """Between the knots of a parabola of degree 3 the third derivative is 0, whatever happens across them."""
    own = uneven(degree=2)
    raised = own.elevated(3)
    kinked = np.maximum(raised.greville() - raised.greville()[20], 0.0)
    assert np.abs(bends(raised, own) @ kinked).max() > 0.1


def test_inserted_knots_change_no_energy_of_a_smooth_change_and_no_weight():
    own = net(uneven(60, by=0.1), uneven(seed=1))
    fine = own.refined((own.u.breaks[:-1] + own.u.breaks[1:]) / 2, [])
    every = [white(each, own, np.ones(each.poles.shape[:2], bool), NONE) for each in (own, fine)]
    energies, masses = [], []
    for each, form in zip((own, fine), every, strict=True):
        z = each.poles[..., 2].ravel()
        energies.append(z @ (form.along[0] @ z))
        masses.append(form.mass.sum())
    assert energies[1] == pytest.approx(energies[0], rel=0.15)
    assert masses[1] == pytest.approx(masses[0], rel=0.02)
    assert np.allclose(every[0].mass, 1.0)


def test_only_points_that_count_take_part():
    own = net(uneven(), uneven(seed=1))
    points = np.ones(own.poles.shape[:2], bool)
    points[:5] = False
    form = white(own, own, points, NONE)
    far = np.where(points, 0.0, 1.0).ravel()
    assert not form.mass[far > 0].any()
    assert all(not (along @ far).any() for along in form.along)
