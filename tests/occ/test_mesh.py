"""Meshes of documents, and CadQuery selectors."""

import io
from collections import Counter
from dataclasses import replace

import numpy as np
import pytest
from OCP.BRepPrimAPI import BRepPrimAPI_MakeBox, BRepPrimAPI_MakeSphere
from OCP.IMeshTools import IMeshTools_MeshAlgoType_Delabella, IMeshTools_MeshAlgoType_Watson

from mracad.bspline.knots import KnotVector
from mracad.bspline.surface import Net
from mracad.errors import FileError, UsageError
from mracad.inspect import accept
from mracad.occ import scene as scenes
from mracad.occ import triangles as triangulation
from mracad.occ.files import Lost, write
from mracad.occ.select import select_cq
from mracad.occ.step import read_step
from mracad.occ.view import view
from tests.edit.feature import grounds
from tests.occ import shapes


def corners(path):
    data = path.read_bytes()
    layout = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])
    triangles = np.frombuffer(data[84:], layout)
    assert len(triangles) == int.from_bytes(data[80:84], "little")
    return triangles["corners"]


def is_watertight(triangles):
    edges = Counter()
    for triangle in triangles.tolist():
        a, b, c = map(tuple, triangle)
        for edge in ((a, b), (b, c), (c, a)):
            edges[edge] += 1
    return all(count == 1 and edges[(b, a)] == 1 for (a, b), count in edges.items())


@pytest.mark.parametrize("unit", ["MM", "M"])
def test_a_box_is_watertight_and_in_millimetres(tmp_path, unit):
    document = read_step(shapes.save(BRepPrimAPI_MakeBox(1, 2, 3).Shape(), tmp_path / "in.step", unit))
    assert write(document, tmp_path / "out.stl").lost == ()
    triangles = corners(tmp_path / "out.stl")
    assert is_watertight(triangles) and len(triangles) == 12
    assert triangles.reshape(-1, 3).max(axis=0) == pytest.approx([1, 2, 3], rel=1e-6)


def test_finer_settings_give_more_triangles_and_text_says_the_same(tmp_path):
    document = shapes.document(BRepPrimAPI_MakeSphere(5).Shape())
    sizes = []
    for chord, angle in ((0.5, 40), (0.05, 40), (0.05, 5), (None, None)):
        write(document, tmp_path / "out.stl", chord=chord, angle=angle)
        sizes.append(len(corners(tmp_path / "out.stl")))
        assert is_watertight(corners(tmp_path / "out.stl"))
    assert sizes[0] < sizes[1] < sizes[2]
    first = (tmp_path / "out.stl").read_bytes()
    write(document, tmp_path / "out.stl")
    assert (tmp_path / "out.stl").read_bytes() == first
    write(document, tmp_path / "text.stl", ascii=True)
    text = (tmp_path / "text.stl").read_text()
    assert text.startswith("solid mracad\n") and text.count("facet normal") == sizes[3]


def test_faces_of_many_knots_are_meshed_by_the_algorithm_that_suits_them(monkeypatch):
    """The kernel's default takes the square of their number."""
    used = []
    mesh = triangulation.BRepMesh_IncrementalMesh
    monkeypatch.setattr(
        triangulation, "BRepMesh_IncrementalMesh", lambda shape, how: (used.append(how.MeshAlgo), mesh(shape, how))
    )
    for spans in (10, 80):
        k = KnotVector.clamped(np.linspace(0.0, 1.0, spans + 1), 3)
        x, y = np.meshgrid(k.greville(), k.greville(), indexing="ij")
        found = triangulation.triangles(grounds.sewn([Net(k, k, np.stack([x, y, x * y], axis=-1))]))
        area = np.linalg.norm(np.cross(*np.diff(found.points[found.corners], axis=1).swapaxes(0, 1)), axis=1).sum() / 2
        assert area == pytest.approx(1.281, abs=2e-3)
    assert used == [IMeshTools_MeshAlgoType_Watson, IMeshTools_MeshAlgoType_Delabella]


def test_a_face_that_cannot_be_meshed_is_named(tmp_path):
    box = BRepPrimAPI_MakeBox(1, 2, 3).Shape()
    bare = shapes.document(box).faces[2].EmptyCopied()  # no boundary at all
    assert write(shapes.document(shapes.compound(box, bare)), tmp_path / "out.stl").lost == (
        Lost("faces", 7, 6, ("#7",)),
    )


def test_a_closed_body_whose_mesh_is_open_is_told(monkeypatch):
    """The face without triangles, and those around it; not those of a shell that is open anyway."""
    box = BRepPrimAPI_MakeBox(1, 2, 3).Shape()
    whole = scenes.triangles

    def torn(document, chord, angle):
        mesh = whole(document, chord, angle)
        keep = mesh.faces != 2
        some = {name: getattr(mesh, name)[keep] for name in ("corners", "own", "faces", "parts")}
        return replace(mesh, **some, missing=(2,))

    assert scenes.scene(shapes.document(box))[2] == ()
    monkeypatch.setattr(scenes, "triangles", torn)
    assert scenes.scene(shapes.document(box))[2] == (0, 1, 2, 4, 5)
    faces = shapes.document(box).faces
    assert scenes.scene(shapes.document(shapes.compound(*faces)))[2] == ()
    stream = io.BytesIO()
    found = accept.meshed(write(shapes.document(box), stream, "stl").open, before=(2, 4))
    assert (
        not found.valid
        and [f.faces for f in found.faults] == [(0, 1, 5)]
        and [f.faces for f in found.forgiven] == [(2, 4)]
    )


def test_bad_settings_and_targets(tmp_path):
    document = shapes.document(BRepPrimAPI_MakeSphere(5).Shape())
    for wrong in ({"chord": 0.0}, {"angle": -1.0}, {"chord": float("nan")}):
        with pytest.raises(UsageError, match="positive"):
            write(document, tmp_path / "out.stl", **wrong)
    with pytest.raises(FileError, match="cannot write"):
        write(document, tmp_path / "nowhere" / "out.stl")
    assert not list(tmp_path.iterdir())


def test_cadquery_selectors():
    document = shapes.document(BRepPrimAPI_MakeBox(1, 2, 3).Shape())
    boxes = [face.box for face in view(document).faces]
    (top,) = select_cq(document, ">Z")
    assert boxes[top][0, 2] == pytest.approx(3, abs=1e-6)
    assert len(select_cq(document, "|Z")) == 2
    with pytest.raises(UsageError, match="selector"):
        select_cq(document, ">>nonsense<<")
