"""Numbers at the points of meshes, read back from the files: as on the surfaces, face by face."""

import io
import zipfile

import numpy as np
import pytest
from lxml import etree
from OCP.BRepBuilderAPI import BRepBuilderAPI_MakeFace
from OCP.BRepPrimAPI import BRepPrimAPI_MakeCylinder, BRepPrimAPI_MakeSphere
from OCP.Geom import Geom_OffsetSurface
from vtkmodules.util.numpy_support import vtk_to_numpy

from mracad.errors import UsageError
from mracad.occ.files import read, write
from mracad.occ.scene import scene
from mracad.view.colours import diverging
from mracad.view.scalars import scalars
from tests.mesh import readers
from tests.occ import shapes

FORMATS = ["ply", "glb", "vtp", "vtu"]


def written(document, format, *what, reference=None, chord=0.5):
    stream = io.BytesIO()
    paint = scalars(document, what, reference=reference)
    told = write(document, stream, format, chord=chord, angle=30.0, paint=paint)
    return stream.getvalue(), told.legends


@pytest.mark.parametrize("format", FORMATS)
def test_the_curvature_of_a_sphere_is_1_over_its_radius(format):
    ball = shapes.document(BRepPrimAPI_MakeSphere(10.0).Shape())
    data, legends = written(ball, format, "curvature:mean", "curvature", "curvature:gauss", "roughness")
    found = readers.arrays(data, format)
    assert len(found["curvature_mean"]) > 50
    assert found["curvature_mean"] == pytest.approx(0.1, rel=1e-2)
    assert found["curvature_max"] == pytest.approx(0.1, rel=1e-2)
    assert found["curvature_gauss"] == pytest.approx(0.01, rel=1e-2)
    assert not found["roughness"].any()
    assert [(legend.unit, legend.low < 0) for legend in legends[:2]] == [("1/mm", True), ("1/mm", False)]
    if format == "vtp":
        assert np.abs(10 * found["normals"] - readers.points(readers.vtk(data, format))).max() < 5e-3


def offset():
    x, y = np.meshgrid(np.linspace(0, 60, 8), np.linspace(0, 40, 7), indexing="ij")
    ground = shapes.bspline(np.stack([x, y, 4 * np.sin(x / 20) * np.cos(y / 15)], axis=-1))
    moved = BRepBuilderAPI_MakeFace(Geom_OffsetSurface(ground, 0.3), 1e-7).Face()
    return shapes.document(moved), shapes.document(shapes.face_on(ground))


@pytest.mark.parametrize("format", [*FORMATS, "3mf"])
def test_the_deviation_of_an_offset_face_is_the_offset(format):
    moved, ground = offset()
    data, (legend,) = written(moved, format, "deviation", reference=ground)
    assert (legend.lowest, legend.highest) == pytest.approx((0.3, 0.3), rel=1e-4)
    if format != "3mf":
        assert readers.arrays(data, format)["deviation"] == pytest.approx(0.3, rel=1e-4)
        return
    root = etree.fromstring(zipfile.ZipFile(io.BytesIO(data)).read("3D/3dmodel.model"))
    (colour,) = {each.get("color") for each in root.iter(f"{{{root.nsmap['m']}}}color")}
    expected = 255 * diverging(np.array(0.3 / legend.high))
    assert np.abs(np.array([*bytes.fromhex(colour[1:])]) - expected).max() <= 1, "the colour in pictures"


def test_faces_that_meet_at_an_edge_keep_their_own_numbers():
    rod = shapes.document(BRepPrimAPI_MakeCylinder(5.0, 20.0).Shape())
    data, _ = written(rod, "vtu", "curvature:max")
    output = readers.vtk(data, "vtu")
    values, face = readers.arrays(data, "vtu")["curvature_max"], vtk_to_numpy(output.GetCellData().GetArray("face"))
    by_corner = values[readers.corners(output)]
    for number, expected in ((1, 0.2), (2, 0.0), (3, 0.0)):
        assert by_corner[face == number] == pytest.approx(expected, abs=1e-9)


def test_instances_have_their_own_deviation_but_one_curvature(samples):
    fixture = read(samples / "assembly.step")
    plain = scene(fixture, 5.0, 60.0)[0]
    placed = list(plain.placed())
    assert len(scalars(fixture, ["curvature"])(plain).bodies) == len(plain.bodies) < len(placed)
    ball = shapes.document(BRepPrimAPI_MakeSphere(1.0).Shape())
    found = scalars(fixture, ["deviation"], reference=ball)(plain)
    assert len(found.bodies) == len(placed)
    for body in found.placed():
        assert body.places.values["deviation"] == pytest.approx(np.linalg.norm(body.points, axis=1) - 1, abs=1e-5)


def test_what_has_no_numbers(samples):
    ball = shapes.document(BRepPrimAPI_MakeSphere(10.0).Shape())
    for what in ("zebra", "deviation", "curvature:least"):
        with pytest.raises(UsageError):
            scalars(ball, [what])
    with pytest.raises(UsageError, match="stl holds no numbers"):
        write(ball, io.BytesIO(), "stl", paint=scalars(ball, ["curvature"]))
