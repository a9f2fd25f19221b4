"""Boxes of faces themselves: a share of the diagonal is one of the model, not of its control points."""

import json

import numpy as np
import pytest
from OCP.BRepPrimAPI import BRepPrimAPI_MakeTorus
from OCP.gp import gp_Ax1, gp_Dir, gp_Pnt, gp_Trsf
from OCP.TopLoc import TopLoc_Location

from mracad.occ.boxes import face_boxes
from mracad.occ.step import write_step
from mracad.occ.view import view
from tests.occ import shapes

HIGH = 40.0


def hill(*bounds):
    """A bicubic Bézier face over [0, 3]² of height 4 · HIGH · b(u) b(v) with b = 3 u (1 − u), u, v in the bounds."""
    x, y = np.meshgrid(np.arange(4.0), np.arange(4.0), indexing="ij")
    z = np.zeros((4, 4))
    z[1:3, 1:3] = HIGH  # z = HIGH (3 u (1 − u)) (3 v (1 − v))
    return shapes.face_on(shapes.bspline(np.stack([x, y, z], axis=-1)), *bounds)


def boxes(document):
    model = view(document)
    return model, face_boxes(document, model)


@pytest.mark.parametrize(
    ("bounds", "top"),
    [((), HIGH * (3 / 4) ** 2), ((0.1, 0.3, 0.2, 0.9), HIGH * (3 * 0.3 * 0.7) * 3 / 4)],
)
def test_the_top_of_a_hill_inside_and_on_the_edge(bounds, top):
    model, (box,) = boxes(shapes.document(hill(*bounds)))
    u0, u1, v0, v1 = bounds or (0, 1, 0, 1)
    low = 0.0 if not bounds else HIGH * (3 * 0.1 * 0.9) * (3 * 0.9 * 0.1)
    right = np.array([[3 * u0, 3 * v0, low], [3 * u1, 3 * v1, top]])
    assert box == pytest.approx(right, abs=2e-4 * np.linalg.norm(right[1] - right[0]))
    assert model.diagonal == pytest.approx(np.linalg.norm(right[1] - right[0]), rel=2e-4)
    assert (model.faces[0].box[1] - model.faces[0].box[0])[2] >= top - low


def test_every_instance_counts_where_it_stands():
    turn = gp_Trsf()
    turn.SetRotation(gp_Ax1(gp_Pnt(0, 0, 0), gp_Dir(1, 0, 0)), np.pi / 2)
    model = view(shapes.assembly(hill(), TopLoc_Location(), TopLoc_Location(turn)))
    top = HIGH * (3 / 4) ** 2
    assert model.diagonal == pytest.approx(np.linalg.norm([3.0, top + 3.0, top]), rel=2e-4)


def test_a_torus_is_as_large_as_it_is():
    document = shapes.document(BRepPrimAPI_MakeTorus(10.0, 2.0).Shape())
    assert view(document).diagonal == pytest.approx(np.linalg.norm([24.0, 24.0, 4.0]), rel=1e-3)


def test_two_percent_and_info_mean_the_face_itself(mracad, tmp_path):
    path = tmp_path / "hill.step"
    write_step(shapes.document(hill(), names={0: "hill"}), path)
    found = json.loads(mracad("info", path, "--json").out)
    size = np.linalg.norm([3.0, 3.0, HIGH * (3 / 4) ** 2])
    assert found["diagonal"] == pytest.approx(size, rel=2e-4) and found["scale"] == pytest.approx(size / 50, rel=2e-4)
    assert found["faces"][0]["box"][1][2] == pytest.approx(HIGH * (3 / 4) ** 2, rel=2e-4)
