"""Displacements of models, frames of faces and the law of samples, by closed forms."""

import numpy as np
import pytest

from mracad.bspline.knots import KnotVector
from mracad.bspline.surface import Net
from mracad.model.brep import Face, Model, Surface
from mracad.model.displacement import Displacement, Offset, lifted
from mracad.model.sampling import between, hermite, shares

QUARTER = np.array([[0.0, -1, 0, 5], [1, 0, 0, 6], [0, 0, 1, 7], [0, 0, 0, 1]])


def sheet():
    rng = np.random.default_rng(1)
    u, v = KnotVector.clamped([0, 1, 2, 4], 3), KnotVector.clamped([0, 3], 2)
    return Net(u, v, rng.standard_normal((6, 3, 3)), rng.uniform(0.5, 2, (6, 3)))


def face(reversed=False):
    return Face(0, "bspline", 0, (), reversed, QUARTER, np.zeros((2, 3)))


@pytest.mark.parametrize("degrees", [(3, 2), (4, 3)])
def test_an_offset_of_a_finer_net_moves_the_surface_by_what_it_is(degrees):
    net = sheet()
    fine = net.over(net.u.elevated(degrees[0]).refined([0.5, 2, 2]), net.v.elevated(degrees[1]).refined([1.0]))
    poles = np.random.default_rng(2).standard_normal(fine.poles.shape)
    offset = Offset.of(net, fine, poles)
    model = Model("sheet", (Surface(0, net, (0,)),), (face(),), (), 1.0)
    moved = Displacement({0: offset}).applied(model).surfaces[0].net
    uv = np.random.default_rng(3).uniform(0, 3, (40, 2))
    np.testing.assert_allclose(
        moved.evaluate(uv) - net.evaluate(uv), offset.motion(net).evaluate(uv), rtol=0, atol=1e-12
    )
    twice = Displacement({0: offset}).scaled(2.0).applied(model).surfaces[0].net
    np.testing.assert_allclose(twice.poles - moved.poles, poles, rtol=0, atol=1e-12)


def test_what_does_not_move_keeps_its_surfaces():
    model = Model("sheet", (Surface(0, sheet(), (0,)),), (face(),), (), 1.0)
    assert Displacement().applied(model).surfaces[0] is model.surfaces[0]


def test_points_and_vectors_go_from_the_surface_to_the_part_and_back():
    points = np.array([[[1.0, 2, 3], [0, 0, 0]]])
    np.testing.assert_allclose(face().placed(points), [[[3, 7, 10], [5, 6, 7]]])
    np.testing.assert_allclose(face().turned(points[0]), [[-2, 1, 3], [0, 0, 0]])
    np.testing.assert_allclose(face().local(face().placed(points)), points)
    assert (face().outward, face(reversed=True).outward) == (1, -1)


def test_samples_are_the_zeros_of_a_chebyshev_polynomial():
    for count in (3, 25, 33):
        share = shares(count)
        assert share[0] > 0 and share[-1] < 1 and (np.diff(share) > 0).all()
        np.testing.assert_allclose(np.polynomial.Chebyshev.basis(count)(2 * share - 1), 0, atol=1e-12)


def test_cubics_are_interpolated_exactly():
    t = np.arange(5.0)
    values = np.stack([t**3, 1 - t, t**2], axis=1)
    rates = np.stack([3 * t**2, -np.ones(5), 2 * t], axis=1)
    segment, s = between(5)
    at = segment[:, None] + s
    wanted = np.concatenate([at**3, 1 - at, at**2], axis=1)
    np.testing.assert_allclose(hermite(values, rates, segment, s), wanted, atol=1e-12)
    np.testing.assert_allclose(hermite(values[None], rates[None], segment, s)[0], wanted, atol=1e-12)


def test_offsets_over_finer_knots_and_higher_degrees_are_the_same_surface():
    rng = np.random.default_rng(3)
    k = KnotVector.clamped(np.linspace(0, 1, 4), 2)
    own = Net(k, k, rng.normal(size=(5, 5, 3)), 1 + rng.random((5, 5)))
    fine = own.over(k.elevated(3).refined([0.1, 0.1]), k.refined([0.7]))
    poles = rng.normal(size=own.poles.shape)
    uv = rng.random((50, 2))
    moved = lifted(own, fine, poles)
    wanted = Net(k, k, poles, own.weights).evaluate(uv)
    assert np.abs(Net(fine.u, fine.v, moved, fine.weights).evaluate(uv) - wanted).max() < 1e-12
    assert lifted(own, own, poles) is poles
    offset = Offset.of(own, fine, moved)
    assert offset.degrees == (3, 2) and offset.u_knots.tolist() == [0.1, 0.1] and offset.v_knots.tolist() == [0.7]
    again = offset.over(own)
    assert (again.u, again.v) == (fine.u, fine.v)
