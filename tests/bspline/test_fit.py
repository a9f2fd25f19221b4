"""Splines through values at the Greville points, and spans divided until they fit."""

import numpy as np
import pytest

from mracad.bspline.fit import divided, evenly, middles, missing, offsets_over, spans, split, through
from mracad.bspline.knots import KnotVector
from mracad.bspline.surface import Net, pairs


def net(spans=4, rational=False):
    """A square of 10 mm over x = 10 u, y = 10 v."""
    k = KnotVector.clamped(np.linspace(0, 1, spans + 1), 3)
    x, y = np.meshgrid(10 * k.greville(), 10 * k.greville(), indexing="ij")
    weights = 1 + 0.3 * np.random.default_rng(0).random(x.shape) if rational else None
    return Net(k, k, np.stack([x, y, 0 * x], axis=-1), weights)


@pytest.mark.parametrize("rational", [False, True])
def test_what_the_space_holds_is_reproduced(rational):
    space = net(rational=rational)
    poles = np.random.default_rng(1).normal(size=space.poles.shape)
    values = Net(space.u, space.v, poles, space.weights).grid(space.u.greville(), space.v.greville())
    assert np.abs(through(space, values) - poles).max() < 1e-12


def test_spans_are_divided_evenly_and_by_what_they_miss():
    k = KnotVector.clamped([0.0, 1.0, 3.0, 4.0], 3)
    assert evenly(k, np.array([1, 4, 2])).tolist() == [1.5, 2.0, 2.5, 3.5]
    assert spans(k, np.array([-1.0, 0.5, 1.0, 3.9, 9.0])).tolist() == [0, 0, 1, 2, 2]
    # a cubic misses 16 times less in halves; no span gets narrower than it need be
    where, missed, speed = np.array([0, 1, 2]), np.array([0.9, 16.0, 16.0]), np.ones(3)
    assert split(k, where, missed, speed, 0.1).tolist() == [2.0, 3.5]
    assert split(k, where, missed, speed, 0.9).tolist() == [2.0]


def test_knots_are_set_where_a_bump_is_missed_until_it_is_not():
    plane = net()

    def bump(uv):
        return np.exp(-((np.linalg.norm(uv - [0.3, 0.6], axis=1) / 0.05) ** 2))[:, None] * [0.0, 0.0, 1.0]

    def fitted(knots):
        values = bump(pairs(*(k.greville() for k in knots))).reshape(knots[0].count, knots[1].count, 3)
        return offsets_over(plane, knots, through(plane.over(*knots), values))

    def more(knots):
        uv = middles(*knots)
        sites = [(uv, spans(k, uv[:, axis])) for axis, k in enumerate(knots)]
        return missing(plane, fitted(knots), sites, bump, 1e-3, (0.05, 0.05))

    knots = divided((plane.u, plane.v), more)
    uv = np.random.default_rng(0).random((4000, 2))
    assert np.abs(fitted(knots).evaluate(uv) - bump(uv)).max() < 3e-3
    for k, middle in zip(knots, (0.3, 0.6), strict=True):
        widths = np.diff(k.breaks)
        assert widths[np.abs(k.breaks[:-1] - middle) < 0.02].max() < 0.05 < widths[k.breaks[:-1] > 0.79].max()
