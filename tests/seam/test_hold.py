"""Separation: whatever moves on the free points, every edge keeps its continuity."""

import numpy as np
import pytest

from mracad.bspline.knots import KnotVector
from mracad.bspline.surface import Net
from mracad.model.brep import Face, Trim
from mracad.model.region import face_region
from mracad.seam.hold import CONTINUITY, frozen_along, jet_support, separate
from tests.model.test_region import circle, segment, square

TRIMS = {
    "natural": (segment((0, 0), (0, 1)), [1, 2, 3]),
    "part of a side": (segment((0.2, 1), (0.6, 1)), [1, 2, 3]),
    "isoparametric inside": (segment((0.33, 0.1), (0.33, 0.8)), [1, 2, 3]),
    "isoparametric on a knot": (segment((0.1, 0.5), (0.7, 0.5)), [1, 2, 3]),
    "slanted": (segment((0.1, 0.2), (0.8, 0.9)), None),
    "circle": (circle([0.5, 0.5], 0.3), None),
    "nearly natural": (segment((1e-5, 0), (0, 1)), None),
}


def along(net, curve, keep="g1"):
    """Points frozen by one curve."""
    return frozen_along(net, [curve], face_region(net, face(0, [curve])), [CONTINUITY[keep]])


def random_net(degrees, seed=0):
    rng = np.random.default_rng(seed)
    u = KnotVector.clamped(np.r_[0, np.sort(rng.uniform(0, 1, 18)), 1], degrees[0])
    v = KnotVector.clamped(np.linspace(0, 1, 21), degrees[1])
    return Net(u, v, rng.standard_normal((u.count, v.count, 3)))


@pytest.mark.parametrize("degrees", [(3, 3), (2, 5), (1, 4)])
@pytest.mark.parametrize("keep", ["g0", "g1", "g2"])
@pytest.mark.parametrize("name", TRIMS)
def test_a_displacement_of_the_free_points_leaves_the_jet_along_the_edge(degrees, keep, name):
    curve, _ = TRIMS[name]
    net = random_net(degrees)
    frozen = along(net, curve, keep)
    assert frozen.any() and not frozen.all()
    delta = Net(net.u, net.v, np.where(frozen[..., None], 0.0, net.poles))
    uv = curve.evaluate(np.linspace(0, 1, 300))[0]
    orders = {"g0": 1, "g1": 3, "g2": 6}[keep]
    for side in (("left", "left"), ("right", "right")):
        inner = (uv > 0).all(axis=1) if side[0] == "left" else (uv < 1).all(axis=1)
        jets = delta.evaluate(uv[inner], 2, side)[:orders]
        if keep == "g2" and name.startswith(("natural", "part", "iso")) and min(degrees) < 2:
            jets = jets[:3]
        for jet in jets:
            assert np.abs(jet).max(initial=0.0) <= 1e-9


def test_rows_of_a_natural_edge():
    net = random_net((3, 3))
    for keep, rows in (("g0", 1), ("g1", 2), ("g2", 3)):
        frozen = along(net, segment((0, 0), (0, 1)), keep)
        assert frozen[:rows].all() and not frozen[rows:].any()
        frozen = along(net, segment((0, 1), (1, 1)), keep)
        assert frozen[:, -rows:].all() and not frozen[:, :-rows].any()


def test_the_closing_edge_of_a_periodic_direction_freezes_the_functions_around_it():
    knots = KnotVector.from_multiplicities(np.arange(13.0), [1] * 13, 3, periodic=True)
    touched = jet_support(knots, 0.0, 1)
    assert touched.sum() == 3
    assert np.array_equal(touched, jet_support(knots, 12.0, 1))
    rng = np.random.default_rng(1)
    v = KnotVector.clamped(np.linspace(0, 1, 6), 3)
    frozen = along(Net(knots, v, np.zeros((12, 8, 3))), segment((12, 0), (12, 1)), "g1")
    delta = Net(knots, v, np.where(frozen[..., None], 0, rng.standard_normal((12, 8, 3))))
    at = np.stack([np.zeros(9), np.linspace(0, 1, 9)], axis=1)
    assert max(np.abs(x).max() for x in delta.evaluate(at, 1)) < 1e-14


def face(index, curves):
    trims = tuple(Trim(i, c) for i, c in enumerate(curves))
    return Face(index, "bspline", 0, trims, False, np.eye(4), np.zeros((2, 3)))


def test_a_face_that_is_not_edited_freezes_its_whole_region():
    net = random_net((3, 3))
    left = face(
        0, [segment((0, 0), (0.5, 0)), segment((0.5, 0), (0.5, 1)), segment((0.5, 1), (0, 1)), segment((0, 1), (0, 0))]
    )
    right = face(
        1, [segment((0.5, 0), (1, 0)), segment((1, 0), (1, 1)), segment((1, 1), (0.5, 1)), segment((0.5, 1), (0.5, 0))]
    )
    both = separate(net, [left, right], {0, 1})
    one = separate(net, [left, right], {0})
    delta = Net(net.u, net.v, np.where(one.free[..., None], net.poles, 0.0))
    x, y = np.meshgrid(np.linspace(0.5, 1, 30), np.linspace(0, 1, 30))
    assert np.abs(delta.evaluate(np.stack([x.ravel(), y.ravel()], 1))).max() == 0
    assert one.free.sum() < both.free.sum()
    assert both.visible.all()


def test_points_outside_the_face_are_invisible():
    net = random_net((3, 3))
    separation = separate(net, [face(0, [circle([0.5, 0.5], 0.2)])], {0})
    assert not separation.visible[0].any() and not separation.free[-1].any()
    assert separation.visible.sum() < net.poles.shape[0] * net.poles.shape[1] / 2
    outer = separate(net, [face(0, [*square(0, 1), circle([0.5, 0.5], 0.35)])], {0})
    hidden = ~outer.visible
    assert hidden.any()
    delta = Net(net.u, net.v, np.where(hidden[..., None], net.poles, 0.0))
    angle = np.linspace(0, 2 * np.pi, 100)
    ring = 0.5 + 0.36 * np.stack([np.cos(angle), np.sin(angle)], axis=1)
    assert np.abs(delta.evaluate(ring)).max() == 0
