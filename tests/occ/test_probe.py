"""Places on faces whose geometry is known."""

import numpy as np
import pytest
from OCP.BRepAlgoAPI import BRepAlgoAPI_Cut
from OCP.BRepPrimAPI import BRepPrimAPI_MakeBox, BRepPrimAPI_MakeCylinder, BRepPrimAPI_MakeSphere
from OCP.gp import gp_Ax2, gp_Dir, gp_Pnt

from mracad.occ.probe import middles, nearest
from mracad.occ.step import read_step
from mracad.occ.view import view
from tests.occ import shapes


@pytest.fixture
def opened(tmp_path):
    def of(shape):
        document = read_step(shapes.save(shape, tmp_path / "model.step"))
        return document, view(document)

    return of


@pytest.fixture
def drilled(opened):
    """A block of 40 × 40 × 10 mm with a hole of radius 5 mm in its middle."""
    block = BRepPrimAPI_MakeBox(gp_Pnt(-20, -20, 0), 40, 40, 10).Shape()
    hole = BRepPrimAPI_MakeCylinder(gp_Ax2(gp_Pnt(0, 0, -1), gp_Dir(0, 0, 1)), 5, 12).Shape()
    return opened(BRepAlgoAPI_Cut(block, hole).Shape())


def test_a_hole_is_concave_and_its_normal_points_inward(drilled):
    document, model = drilled
    found = nearest(document, model, np.array([3.0, 0.0, 4.0]))
    assert model.faces[found.face].kind == "cylinder"
    assert np.abs(found.point - [5, 0, 4]).max() < 1e-6 and abs(found.distance - 2) < 1e-6
    assert np.abs(found.normal - [-1, 0, 0]).max() < 1e-6
    curvatures = sorted((k, np.abs(way)) for k, way in found.bends)
    assert curvatures[0][0] == pytest.approx(-0.2) and curvatures[1][0] == pytest.approx(0, abs=1e-12)
    assert np.abs(curvatures[0][1] - [0, 1, 0]).max() < 1e-6


def test_a_hole_is_no_part_of_the_face_around_it(drilled):
    """Above the middle of the hole the rim is nearest; beside it the plane."""
    document, model = drilled
    assert nearest(document, model, np.array([0.0, 0.0, 11.0])).distance == pytest.approx(np.hypot(5, 1))
    beside = nearest(document, model, np.array([9.0, 2.0, 12.0]))
    assert model.faces[beside.face].kind == "plane" and beside.distance == pytest.approx(2.0)
    assert np.abs(beside.normal - [0, 0, 1]).max() < 1e-12 and [k for k, _ in beside.bends] == [0.0, 0.0]


def test_a_sphere_is_convex(opened):
    document, model = opened(BRepPrimAPI_MakeSphere(8.0).Shape())
    found = nearest(document, model, np.array([9.0, 9.0, 0.0]))
    assert found.distance == pytest.approx(9 * np.sqrt(2) - 8)
    assert [k for k, _ in found.bends] == pytest.approx([1 / 8, 1 / 8])
    assert np.abs(found.normal - np.array([1, 1, 0]) / np.sqrt(2)).max() < 1e-9
    assert np.abs(np.abs(found.along @ np.array([1, -1, 0]) / np.sqrt(2)) - 1) < 1e-9


def test_a_pole_has_no_direction_of_u(opened):
    document, model = opened(BRepPrimAPI_MakeSphere(8.0).Shape())
    found = nearest(document, model, np.array([0.0, 0.0, 9.0]))
    assert found.along is None and found.distance == pytest.approx(1.0)


def test_the_middle_of_every_face(drilled):
    document, model = drilled
    assert [each.face for each in middles(document)] == list(range(len(model.faces)))
