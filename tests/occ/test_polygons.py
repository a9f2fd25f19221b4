"""Triangles of the kernel as arrays, against its own methods."""

import numpy as np
from OCP.BRep import BRep_Builder, BRep_Tool
from OCP.BRepMesh import BRepMesh_IncrementalMesh
from OCP.BRepPrimAPI import BRepPrimAPI_MakeBox, BRepPrimAPI_MakeCylinder
from OCP.gp import gp_Pnt, gp_Trsf, gp_Vec
from OCP.Poly import Poly_Triangle, Poly_Triangulation
from OCP.TopAbs import TopAbs_FACE
from OCP.TopLoc import TopLoc_Location
from OCP.TopoDS import TopoDS, TopoDS_Face

from mracad.occ.polygons import polygons
from mracad.occ.topology import inside


def test_triangles_are_those_that_the_kernel_tells_one_by_one():
    shape = BRepPrimAPI_MakeCylinder(2, 3).Shape()
    BRepMesh_IncrementalMesh(shape, 0.1)
    faces = [TopoDS.Face_s(face) for face in inside(shape, TopAbs_FACE)]
    bare = next(inside(BRepPrimAPI_MakeBox(1, 1, 1).Shape(), TopAbs_FACE))
    there = gp_Trsf()
    there.SetTranslation(gp_Vec(5, 0, 0))
    moved = TopoDS.Face_s(faces[0].Moved(TopLoc_Location(there)))
    found = polygons({0: faces[0], 1: moved, 2: TopoDS.Face_s(bare), **dict(enumerate(faces[1:], 3))})
    assert found.keys() == {0, 1, 3, 4}
    for index, face in ((0, faces[0]), *enumerate(faces[1:], 3)):
        mesh = BRep_Tool.Triangulation_s(face, TopLoc_Location())
        points, uv, corners = found[index]
        assert points.tolist() == [list(mesh.Node(i).Coord()) for i in range(1, mesh.NbNodes() + 1)]
        assert uv.tolist() == [list(mesh.UVNode(i).Coord()) for i in range(1, mesh.NbNodes() + 1)]
        assert (corners + 1).tolist() == [list(mesh.Triangle(i).Get()) for i in range(1, mesh.NbTriangles() + 1)]
    np.testing.assert_allclose(found[1][0], found[0][0] + [5, 0, 0])


def test_triangles_without_parameters_are_told_with_others():
    mesh, face = Poly_Triangulation(3, 1, False), TopoDS_Face()
    corners = [[0, 0, 0], [1, 0, 0], [0, 1, 0]]
    for i, place in enumerate(corners, 1):
        mesh.SetNode(i, gp_Pnt(*place))
    mesh.SetTriangle(1, Poly_Triangle(1, 2, 3))
    BRep_Builder().MakeFace(face, mesh)
    shape = BRepPrimAPI_MakeBox(1, 1, 1).Shape()
    BRepMesh_IncrementalMesh(shape, 0.1)
    other = TopoDS.Face_s(next(inside(shape, TopAbs_FACE)))
    found = polygons({0: face, 1: other})
    assert [part.tolist() for part in found[0]] == [corners, [[0, 0]] * 3, [[0, 1, 2]]]
    for one, alone in zip(found[1], polygons({1: other})[1], strict=True):
        assert one.tolist() == alone.tolist()
