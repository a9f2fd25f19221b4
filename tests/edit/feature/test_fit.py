"""Control points and knots that hold copies."""

import numpy as np

from mracad.bspline.knots import KnotVector
from mracad.edit.feature.fit import holding, over_knots
from mracad.edit.feature.locate import Place
from mracad.model.region import grown
from tests.edit.feature.test_ideal import HEIGHT, bump, laid


def test_rows_grow_by_one_and_round_periodic_directions():
    k = KnotVector.clamped(np.arange(9.0), 3)
    around = KnotVector.from_multiplicities(np.arange(9.0), np.ones(9, int), 3, periodic=True)
    near = np.zeros((k.count, around.count), bool)
    near[5, 0] = True
    found = grown(near, (k, around))
    assert found.sum() == 9 and found[4:7, [-1, 0, 1]].all()
    assert grown(near, (k, around), 2)[3:8, [-2, -1, 0, 1, 2]].all()


def test_knots_are_set_until_the_copy_is_held_and_only_under_it():
    patch, every = laid("add", Place("here", np.array([80.0, 90.0, 0.0])))
    knots, poles = holding(every, patch)
    assert np.array_equal(poles, over_knots(every, patch, knots))
    fine = patch.net.over(*knots)
    from mracad.bspline.surface import Net

    uv = np.random.default_rng(0).uniform(0, 1, (5000, 2))
    found = np.asarray(Net(fine.u, fine.v, poles).evaluate(uv))
    points = np.asarray(patch.net.evaluate(uv))
    wanted = bump(np.hypot(points[:, 0] - 80, points[:, 1] - 90)) * (np.hypot(*(points[:, :2] - [80, 90]).T) < 15)
    assert np.abs(found[:, 2] - wanted).max() < 2e-3 * HEIGHT
    for kv, own, middle in zip(knots, patch.knots, (80.0, 90.0), strict=True):
        new = 200.0 * kv.beyond(own.elevated(kv.degree))
        assert len(new) and (np.abs(new - middle) < 60.0).all()
