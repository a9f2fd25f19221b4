"""Faces that do not move: what is computed of them at once is what the kernel says of each point."""

import numpy as np
import pytest
from OCP.BRep import BRep_Tool
from OCP.BRepAdaptor import BRepAdaptor_Surface
from OCP.BRepBuilderAPI import BRepBuilderAPI_MakeFace
from OCP.gp import gp_Ax3, gp_Cone, gp_Cylinder, gp_Dir, gp_Pnt, gp_Sphere, gp_Torus, gp_Trsf, gp_Vec
from OCP.TopLoc import TopLoc_Location

from mracad.bspline.surface import curvature
from mracad.model.sampling import SAMPLES, shares
from mracad.occ.topology import edge_uses
from mracad.occ.view import view
from tests.occ import shapes

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
def test_closed_forms_are_those_of_the_kernel(kind, left):
    turn = gp_Trsf()
    turn.SetRotation(frame(False).Axis(), 0.8)
    turn.SetTranslationPart(gp_Vec(3, 4, 5))
    made = BRepBuilderAPI_MakeFace(KINDS[kind](frame(left)), *BOUNDS).Face().Moved(TopLoc_Location(turn))
    document = shapes.document(shapes.compound(made))
    (face,), (part,), model = document.faces, document.parts, view(document)
    surface = BRepAdaptor_Surface(face, False)
    seen = 0
    for use in edge_uses(face):
        edge = model.edges[part.edge_number(use)]
        if edge.degenerate:
            continue
        seen += 1
        curve, (first, last) = BRep_Tool.CurveOnSurface_s(use, face, 0.0, 0.0), BRep_Tool.Range_s(use, face)
        rows = []
        for t in (first + (last - first) * shares(SAMPLES)).tolist():
            point, du, dv, duu, dvv, duv = gp_Pnt(), *(gp_Vec() for _ in range(5))
            surface.D2(*curve.Value(t).Coord(), point, du, dv, duu, dvv, duv)
            rows.append([each.Coord() for each in (point, du, dv, duu, duv, dvv)])
        points, *derivatives = np.array(rows).swapaxes(0, 1)
        normals = np.cross(derivatives[0], derivatives[1])
        normals *= model.faces[0].outward / np.linalg.norm(normals, axis=1, keepdims=True)
        bends = model.faces[0].outward * curvature(tuple(derivatives), np.cross(normals, edge.tangents))
        (side,) = edge.sides
        assert np.abs(side.points - points).max() <= 1e-11
        assert np.abs(side.normals - normals).max() <= 1e-12
        assert np.abs(side.curvatures - bends).max() <= 1e-12
    assert seen >= 3
