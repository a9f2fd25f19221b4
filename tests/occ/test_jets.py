"""Faces that do not move: what is computed of them at once is what the kernel says of each point."""

import sys

import numpy as np
import pytest
from OCP.BRepAdaptor import BRepAdaptor_Surface
from OCP.BRepBuilderAPI import BRepBuilderAPI_MakeFace
from OCP.gp import gp_Ax3, gp_Cone, gp_Cylinder, gp_Dir, gp_Pnt, gp_Sphere, gp_Torus, gp_Trsf, gp_Vec
from OCP.TopLoc import TopLoc_Location
from OCP.TopoDS import TopoDS

from mracad.occ.view import view

module = sys.modules[view.__module__]
BOUNDS = 0.3, 5.9, -0.7, 1.1


def frame(left):
    axes = gp_Ax3(gp_Pnt(12, -70, 31), gp_Dir(1, 2, -3), gp_Dir(2, -1, 0.2))
    if left:
        axes.YReverse()
    return axes


KINDS = {
    "cylinder": lambda axes: gp_Cylinder(axes, 7.3),
    "cone": lambda axes: gp_Cone(axes, 0.4, 6.1),
    "narrowing": lambda axes: gp_Cone(axes, -0.3, 5.0),
    "sphere": lambda axes: gp_Sphere(axes, 11.0),
    "torus": lambda axes: gp_Torus(axes, 20.0, 3.5),
}


@pytest.mark.parametrize("left", [False, True])
@pytest.mark.parametrize("kind", KINDS)
def test_closed_forms_are_those_of_the_kernel(kind, left, monkeypatch):
    turn = gp_Trsf()
    turn.SetRotation(frame(False).Axis(), 0.8)
    turn.SetTranslationPart(gp_Vec(3, 4, 5))
    face = BRepBuilderAPI_MakeFace(KINDS[kind](frame(left)), *BOUNDS).Face().Moved(TopLoc_Location(turn))
    surface = BRepAdaptor_Surface(TopoDS.Face_s(face), False)
    rng = np.random.default_rng(5)
    uv = np.stack([rng.uniform(*BOUNDS[:2], 40), rng.uniform(*BOUNDS[2:], 40)], axis=1)
    wanted = []
    for u, v in uv.tolist():
        point, du, dv, duu, dvv, duv = gp_Pnt(), *(gp_Vec() for _ in range(5))
        surface.D2(u, v, point, du, dv, duu, dvv, duv)
        wanted.append([each.Coord() for each in (point, du, dv, duu, duv, dvv)])
    monkeypatch.setattr(module, "gp_Pnt", None)  # the kernel is not asked point by point
    found = module._jets(surface, uv)
    assert np.abs(found - np.array(wanted)).max() <= 1e-12 * np.abs(wanted).max()
