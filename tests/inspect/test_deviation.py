"""How far a displacement moves faces, where it is known."""

import numpy as np
import pytest

from mracad.inspect.deviation import deviations
from mracad.model.brep import Model, Surface
from mracad.model.displacement import Displacement, Offset
from tests.model.shapes import face, plane, rectangle


def sheet(curves=()):
    net = plane(spans=8, size=10.0, height=10.0)
    return Model("sheet", (Surface(0, net, (0,)),), (face(curves),), (), 1.0), net


def test_a_translation_is_the_same_everywhere():
    model, net = sheet()
    (found,) = deviations(model, Displacement({0: Offset(np.full(net.poles.shape, [1.0, 2.0, 2.0]))}))
    assert (found.largest, found.mean, found.bound) == pytest.approx((3.0, 3.0, 3.0))
    assert found.normal == pytest.approx(2.0)


def test_only_what_the_face_has_counts():
    poles = np.zeros((11, 11, 3))
    poles[0, 0, 2] = 5.0
    model, _ = sheet()
    assert deviations(model, Displacement({0: Offset(poles)}))[0].largest == pytest.approx(5.0)
    model, _ = sheet(rectangle(6.0, 6.0, 9.0, 9.0))
    (found,) = deviations(model, Displacement({0: Offset(poles)}))
    assert found.largest == found.bound == 0.0


def test_the_bound_holds_and_the_place_is_where_it_is_largest():
    model, net = sheet()
    poles = np.random.default_rng(3).standard_normal(net.poles.shape)
    (found,) = deviations(model, Displacement({0: Offset(poles)}))
    uv = np.array([found.where[:2]])
    assert found.mean < found.largest <= found.bound
    assert found.largest == pytest.approx(np.linalg.norm(Offset(poles).motion(net).evaluate(uv)))
