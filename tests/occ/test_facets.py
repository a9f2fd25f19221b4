"""Triangles for pictures: corners and surfaces in the kernel's parameters, instances with their colours."""

import numpy as np
import pytest
from OCP.BRepAdaptor import BRepAdaptor_Surface
from OCP.BRepBuilderAPI import BRepBuilderAPI_MakeFace, BRepBuilderAPI_Transform
from OCP.BRepPrimAPI import BRepPrimAPI_MakeBox, BRepPrimAPI_MakeSphere
from OCP.Geom import (
    Geom_ConicalSurface,
    Geom_CylindricalSurface,
    Geom_OffsetSurface,
    Geom_Plane,
    Geom_SphericalSurface,
    Geom_SurfaceOfLinearExtrusion,
    Geom_SurfaceOfRevolution,
    Geom_ToroidalSurface,
)
from OCP.gp import gp_Ax1, gp_Ax2, gp_Ax3, gp_Dir, gp_Pnt, gp_Trsf, gp_Vec

from mracad.occ.facets import facets
from tests.occ import shapes

POLES = np.array([[0.0, 3.0, 0.0], [1.0, 3.5, 2.0], [0.5, 5.0, 4.0], [0.0, 4.0, 7.0], [1.0, 4.0, 9.0]])


def curve():
    from OCP.Geom import Geom_BSplineCurve
    from OCP.TColgp import TColgp_Array1OfPnt
    from OCP.TColStd import TColStd_Array1OfInteger, TColStd_Array1OfReal

    points, knots, mults = TColgp_Array1OfPnt(1, 5), TColStd_Array1OfReal(1, 3), TColStd_Array1OfInteger(1, 3)
    for i, pole in enumerate(POLES.tolist(), 1):
        points.SetValue(i, gp_Pnt(*pole))
    for i, (knot, mult) in enumerate(((0.0, 4), (0.4, 1), (1.0, 4)), 1):
        knots.SetValue(i, knot)
        mults.SetValue(i, mult)
    return Geom_BSplineCurve(points, knots, mults, 3)


def placement(right_handed):
    position = gp_Ax3(gp_Pnt(1, 2, 3), gp_Dir(1, 2, 3), gp_Dir(1, 0, 0))
    if not right_handed:
        position.YReverse()
    return position


def grounds():
    for hand in (True, False):
        position = placement(hand)
        yield Geom_Plane(position), (-2, 3, -1, 2)
        yield Geom_CylindricalSurface(position, 4.0), (0.2, 2.0, -1, 5)
        yield Geom_ConicalSurface(position, 0.4, 4.0), (0.2, 2.0, -1, 5)
        yield Geom_SphericalSurface(position, 4.0), (0.2, 2.0, -1, 1.2)
        yield Geom_ToroidalSurface(position, 6.0, 2.0), (0.2, 2.0, 1, 4)
    line = gp_Ax1(gp_Pnt(0, 0.5, 0), gp_Dir(0, 0.2, 1))
    steps = np.array([[0, 0, 0], [2, 0, 1], [4, 1, 0], [6, 0, 0]], float)
    spline = shapes.bspline(POLES[:, None] + steps)
    yield Geom_SurfaceOfLinearExtrusion(curve(), gp_Dir(1, 0.3, 0)), (0.1, 0.9, -2, 2)
    yield Geom_SurfaceOfRevolution(curve(), line), (0.2, 2.0, 0.1, 0.9)
    yield spline, (0.0, 1.0, 0.0, 1.0)
    yield Geom_OffsetSurface(spline, 0.1), (0.1, 0.9, 0.1, 0.9)


@pytest.mark.parametrize("kind", range(14))
def test_surfaces_are_those_of_the_kernel(kind):
    surface, bounds = list(grounds())[kind]
    face = BRepBuilderAPI_MakeFace(surface, *map(float, bounds), 1e-7).Face()
    move = gp_Trsf()
    move.SetRotation(gp_Ax1(gp_Pnt(1, 0, 0), gp_Dir(1, 1, 0)), 0.7)
    document = shapes.document(BRepBuilderAPI_Transform(face, move, False).Shape())
    body = facets(document, 1e-3, 20.0)
    (found,) = body.facets.values()
    kernel = BRepAdaptor_Surface(document.faces[0])
    rng = np.random.default_rng(kind)
    uv = rng.uniform(found.uv.min(axis=0), found.uv.max(axis=0), (20, 2))
    jets = np.array(found.ground.jets(uv, 2))
    point, *vectors = gp_Pnt(), *(gp_Vec() for _ in range(5))
    for k, (u, v) in enumerate(uv.tolist()):
        kernel.D2(u, v, point, *vectors)
        su, sv, suu, svv, suv = (each.Coord() for each in vectors)
        np.testing.assert_allclose(jets[:, k], [point.Coord(), su, sv, suu, suv, svv], atol=1e-9, rtol=1e-9)
    np.testing.assert_array_equal(jets[:3], found.ground.jets(uv, 1))
    np.testing.assert_allclose(found.ground.jets(found.uv, 1)[0], found.points, atol=1e-6)
    _, su, sv = found.ground.jets(found.uv[found.corners].mean(axis=1), 1)
    a, b, c = found.points[found.corners].swapaxes(0, 1)
    assert (found.outward * (np.cross(su, sv) * np.cross(b - a, c - a)).sum(axis=1) > 0).all()


def test_each_instance_is_placed_with_its_colours(samples):
    import mracad

    document = mracad.read(samples / "assembly.step")
    body = facets(document, 1e-3, 20.0)
    assert len(body.placed) == sum(len(part.placements) for part in document.parts)
    assert {colour for place in body.placed for colour in place.colours} >= {"#00ff00", "#ffff00"}
    every = [
        body.facets[face].points @ place.frame[:3, :3].T + place.frame[:3, 3]
        for place in body.placed
        for face in place.faces
    ]
    low, high = np.concatenate(every).min(axis=0), np.concatenate(every).max(axis=0)
    assert body.diagonal == pytest.approx(np.linalg.norm(high - low))


def test_edges_are_drawn_once_and_closing_ones_not_at_all():
    from OCP.BRepPrimAPI import BRepPrimAPI_MakeCylinder

    can = facets(shapes.document(BRepPrimAPI_MakeCylinder(gp_Ax2(), 3.0, 5.0).Shape()), 1e-3, 20.0)
    assert len({edge for face in can.facets.values() for edge in face.rims}) == 2
    box = facets(shapes.document(BRepPrimAPI_MakeBox(1, 2, 3).Shape()), 1e-3, 20.0)
    assert len({edge for face in box.facets.values() for edge in face.rims}) == 12


def test_faces_that_the_kernel_leaves_unfinished_are_meshed_again(monkeypatch):
    import mracad.occ.facets as module

    kernel = module.BRepMesh_IncrementalMesh

    def careless(shape, chord, relative, angle):
        return kernel(shape, chord, relative, angle) if angle < 0.3 else kernel(shape, 1e3 * chord, relative, 3.0)

    monkeypatch.setattr(module, "BRepMesh_IncrementalMesh", careless)
    (found,) = facets(shapes.document(BRepPrimAPI_MakeSphere(10.0).Shape()), 1e-4, 30.0).facets.values()
    gaps = 10.0 - np.linalg.norm(found.points[found.corners].mean(axis=1), axis=1)
    assert gaps.max() < 0.01
    assert found.off == pytest.approx(gaps.max(), rel=0.3)
