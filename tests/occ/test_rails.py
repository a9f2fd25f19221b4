"""What edges slide along, against the kernel's own surfaces."""

import cadquery
import numpy as np
import pytest
from OCP.BRepAdaptor import BRepAdaptor_Surface
from OCP.BRepBuilderAPI import BRepBuilderAPI_Transform
from OCP.gp import gp_Ax2, gp_Dir, gp_Pnt, gp_Trsf, gp_Vec

from mracad.bspline.surface import curvature
from mracad.occ.rails import elementary, railed
from mracad.occ.view import view
from samples.models import documents

SOLIDS = {
    "plane": lambda: cadquery.Solid.makeBox(10, 12, 14),
    "cylinder": lambda: cadquery.Solid.makeCylinder(7, 20),
    "cone": lambda: cadquery.Solid.makeCone(9, 4, 12),
    "sphere": lambda: cadquery.Solid.makeSphere(8, angleDegrees1=-90),
    "torus": lambda: cadquery.Solid.makeTorus(11, 3),
}


def faces(kind, mirrored):
    """Faces of one kind, anywhere, outward and inward, also in left-handed frames."""
    placed = SOLIDS[kind]().rotate((0, 0, 0), (1, 2, 3), 40).translate((3, -5, 7))
    shape = placed.wrapped
    if mirrored:
        mirror = gp_Trsf()
        mirror.SetMirror(gp_Ax2(gp_Pnt(1, 2, 3), gp_Dir(1, 1, 0)))
        shape = BRepBuilderAPI_Transform(shape, mirror, True).Shape()
    body = cadquery.Shape.cast(shape)
    shell = cadquery.Workplane().box(60, 60, 60).val().cut(body)
    return [f.wrapped for s in (body, shell) for f in s.Faces() if f.geomType() == kind.upper()]


@pytest.mark.parametrize("mirrored", [False, True])
@pytest.mark.parametrize("kind", SOLIDS)
def test_distances_feet_parameters_and_curvatures(kind, mirrored):
    rng = np.random.default_rng(4)
    for face in faces(kind, mirrored):
        ground, surface = elementary(face), BRepAdaptor_Surface(face, True)
        assert ground.kind == kind
        for _ in range(6):
            u, v = (
                rng.uniform(max(low, -5.0), min(high, 5.0))
                for low, high in (
                    (surface.FirstUParameter(), surface.LastUParameter()),
                    (surface.FirstVParameter(), surface.LastVParameter()),
                )
            )
            point, vectors = gp_Pnt(), [gp_Vec() for _ in range(5)]
            surface.D2(u, v, point, *vectors)
            p, (su, sv, suu, svv, suv) = np.array(point.Coord()), [np.array(each.Coord()) for each in vectors]
            normal = np.cross(su, sv) / np.linalg.norm(np.cross(su, sv))
            outward = normal * (-1 if face.Orientation().name == "TopAbs_REVERSED" else 1)
            lifted = (p + 0.3 * normal)[None]
            distance, gradient = ground.off(lifted)
            assert abs(abs(distance[0]) - 0.3) < 1e-12
            steps = 1e-5 * np.eye(3)
            slope = [(ground.off(lifted + e)[0] - ground.off(lifted - e)[0])[0] / 2e-5 for e in steps]
            assert np.abs(slope - gradient[0]).max() < 1e-9
            foot, normals = ground.feet(lifted)
            assert np.abs(foot[0] - p).max() < 1e-12 and np.abs(normals[0] - outward).max() < 1e-12
            turns = np.array(ground.periods)
            off = ground.parameters(lifted)[0] - (u, v)
            off -= turns * np.round(off / np.where(turns > 0, turns, 1.0))
            assert np.abs(off).max() < 1e-12
            way = np.cross(normal, rng.standard_normal(3))
            way /= np.linalg.norm(way)
            bends = ground.bends(foot, way[None])
            known = curvature(tuple(each[None] for each in (su, sv, suu, suv, svv)), way[None])
            assert abs(bends[0] - known[0] * (outward @ normal)) < 1e-9


def test_lines_and_circles_between_elementary_faces_are_paths():
    solid = cadquery.Workplane().box(20, 20, 20).edges("|Z").fillet(3).val().wrapped
    document = documents.single(solid, "block")
    model = railed(document, view(document))
    assert len(model.rails.paths) == len(model.edges) == 24
    for index, path in model.rails.paths.items():
        edge = model.edges[index]
        _, ways = path.feet(edge.points)
        assert np.abs(path.feet(edge.points)[0] - edge.points).max() < 1e-12
        assert np.abs(np.abs((ways * edge.tangents).sum(axis=1)) - 1).max() < 1e-6
        assert path.radius in (0.0, 3.0) and 4 < path.length < 21
    assert {len(set(pair)) for pair in model.rails.ends.values()} == {2}
    met = np.bincount([vertex for pair in model.rails.ends.values() for vertex in pair])
    assert set(met[met > 0]) == {3} and (met > 0).sum() == 16
