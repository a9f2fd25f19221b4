"""The ways in and out beside STEP: exact formats keep every bit, meshes are closed, units are right."""

import io
import os
import subprocess
import sys

import numpy as np
import pytest

from mracad.errors import FileError
from mracad.formats import FORMATS
from mracad.occ.check import check
from mracad.occ.files import read, write
from mracad.occ.load import Text
from mracad.occ.sizes import mass
from mracad.occ.view import view
from tests.mesh.readers import scene

EXACT = [name for name, format in FORMATS.items() if format.kind == "exact"]
MESHES = [name for name, format in FORMATS.items() if format.kind == "mesh"]


def written(document, format, **options):
    stream = io.BytesIO()
    assert write(document, stream, format, **options).lost == ()
    return stream.getvalue()


def again(document, format, input_unit=None):
    return read(Text(written(document, format), "again"), input_unit)


@pytest.mark.parametrize("format", EXACT)
@pytest.mark.parametrize("name", ["blade", "trimmed"])
def test_exact_formats_keep_every_pole_knot_and_weight(samples, name, format):
    document = read(samples / f"{name}.step")
    found = again(document, format)
    old, new = view(document), view(found)
    assert found.unit == "mm" and check(found).valid and check(found).solids == 1
    assert [face.kind for face in new.faces] == [face.kind for face in old.faces]
    assert len(new.surfaces) == len(old.surfaces)
    for a, b in zip(old.surfaces, new.surfaces, strict=True):
        assert np.array_equal(a.net.poles, b.net.poles)
        assert np.array_equal(a.net.u.knots, b.net.u.knots) and np.array_equal(a.net.v.knots, b.net.v.knots)
        assert (a.net.weights is None) == (b.net.weights is None)
        assert a.net.weights is None or b.net.weights == pytest.approx(a.net.weights, rel=1e-15)


@pytest.mark.parametrize("format", EXACT)
def test_an_assembly_in_inches(samples, format):
    document = read(samples / "assembly.step")
    found = again(document, format)
    old, new = mass(document), mass(found)
    assert found.unit == ("in" if format in ("step", "iges") else "mm")
    assert (new.volume, new.area) == pytest.approx((old.volume, old.area), rel=1e-9)
    assert new.centre == pytest.approx(old.centre, abs=1e-9)
    assert check(found).solids == (6 if format == "iges" else 3) and check(found).valid
    if format == "iges":  # which knows no instances
        assert {face.colour for face in view(found).faces} == {face.colour for face in view(document).faces}
    else:
        assert [len(part.placements) for part in found.parts] == [len(part.placements) for part in document.parts]


@pytest.mark.parametrize("format", EXACT)
def test_the_unit_of_the_input_can_be_corrected(samples, format):
    document = read(samples / "blade.step")
    found = again(document, format, "in")
    assert found.unit == "in"
    assert view(found).surfaces[0].net.poles == pytest.approx(25.4 * view(document).surfaces[0].net.poles)
    assert again(found, "iges").unit == "in"


@pytest.mark.parametrize("name", ["assembly", "trimmed", "bottle"])
def test_meshes_are_closed_and_fill_the_volume(samples, name):
    document = read(samples / f"{name}.step")
    model, whole = view(document), mass(document)
    for format in MESHES:
        scale = 1e-3 if format in ("gltf", "glb") else 1.0
        data = written(document, format, chord=1e-3 * model.diagonal, angle=20.0)
        bodies = scene(data, format).dump()
        for body in bodies:
            body.merge_vertices()
        assert all((np.unique(np.sort(b.edges, axis=1), axis=0, return_counts=True)[1] == 2).all() for b in bodies), (
            format
        )
        assert sum(b.volume for b in bodies) == pytest.approx(whole.volume * scale**3, rel=5e-3), format


def test_colours_transparency_and_the_tree_reach_the_mesh(samples):
    from OCP.BRepPrimAPI import BRepPrimAPI_MakeBox
    from OCP.Quantity import Quantity_Color, Quantity_ColorRGBA, Quantity_TOC_sRGB
    from OCP.XCAFDoc import XCAFDoc_ColorType, XCAFDoc_DocumentTool

    from tests.occ import shapes

    document = read(samples / "assembly.step")
    assert {"fixture", "base"} <= set(scene(written(document, "glb"), "glb").graph.nodes)
    made = shapes.document(BRepPrimAPI_MakeBox(1, 2, 3).Shape())
    colour = Quantity_ColorRGBA(Quantity_Color(1.0, 0.5, 0.0, Quantity_TOC_sRGB), 0.25)
    tool = XCAFDoc_DocumentTool.ColorTool_s(made.xcaf.Main())
    tool.SetColor(made.parts[0].label, colour, XCAFDoc_ColorType.XCAFDoc_ColorSurf)
    made = again(made, "step")
    assert b'"#ff800040"' in written(made, "glb") and b"BLEND" in written(made, "glb")
    assert {face.colour for face in view(made).faces} == {"#ff800040"}


SCRIPT = """
import sys; from mracad.occ.files import read, write
from mracad.formats import FORMATS
document = read(sys.argv[1])
for format in FORMATS.values():
    if format.kind != "picture": write(document, sys.stdout.buffer, format.name)
"""


def test_the_same_bytes_in_every_process(samples):
    runs = [
        subprocess.run(
            [sys.executable, "-c", SCRIPT, samples / "assembly.step"],
            capture_output=True,
            check=True,
            env={**os.environ, "PYTHONHASHSEED": seed},
        ).stdout
        for seed in ("1", "2")
    ]
    assert runs[0] == runs[1] and runs[0].count(b"mracad") > 5


def test_the_header_of_iges(samples, monkeypatch):
    monkeypatch.setenv("SOURCE_DATE_EPOCH", "86400")
    data = written(read(samples / "bottle.step"), "iges", options_text="smooth --scale 5mm")
    assert data.startswith(b"smooth --scale 5mm ") and data.count(b"15H19700102.000000") == 2
    head = data.partition(b"D0000001")[0]
    assert b"Hmracad " in head and b"11Hbottle.step" in head and str(samples).encode() not in head


@pytest.mark.parametrize("format", EXACT)
@pytest.mark.parametrize("damage", ["empty", "cut", "other"])
def test_damaged_files(mracad, samples, tmp_path, format, damage):
    data = written(read(samples / "trimmed.step"), format)
    if damage == "cut":
        data = data[: len(data) // 3]
    elif damage == "empty":
        data = b"\n"
    else:
        data = b"no model\n" + bytes(range(256))
    source = tmp_path / "in.dat"
    source.write_bytes(data)
    result = mracad("convert", source, "-o", tmp_path / "out.step")
    assert result.code == 3 and result.err.count("\n") == 1 and "'in.dat'" in result.err
    assert not (tmp_path / "out.step").exists()


def test_meshes_in_a_brep_are_refused(tmp_path):
    from OCP.BRep import BRep_Builder
    from OCP.gp import gp_Pnt
    from OCP.Poly import Poly_Triangle, Poly_Triangulation
    from OCP.TopoDS import TopoDS_Face

    from tests.occ import shapes

    mesh = Poly_Triangulation(3, 1, False)
    for i, corner in enumerate([(0, 0, 0), (1, 0, 0), (0, 1, 0)], 1):
        mesh.SetNode(i, gp_Pnt(*map(float, corner)))
    mesh.SetTriangle(1, Poly_Triangle(1, 2, 3))
    face = TopoDS_Face()
    BRep_Builder().MakeFace(face, mesh)
    with pytest.raises(FileError, match="#1 is a mesh"):
        again(shapes.document(face), "binbrep")


def test_streams_are_known_by_their_content(samples, tmp_path):
    words = [sys.executable, "-m", "mracad_cli", "convert", "-", "-o", "-"]
    data = (samples / "blade.step").read_bytes()
    for format in ("brep", "3mf"):
        done = subprocess.run([*words, "--format", format], input=data, capture_output=True)
        assert done.returncode == 0, done.stderr
        data = done.stdout
    assert data.startswith(b"PK")


def test_commands_read_every_format(mracad, samples, tmp_path):
    model, out = tmp_path / "model.igs", tmp_path / "out.igs"
    assert mracad("convert", samples / "bottle.step", "-o", model).code == 0
    assert "model.igs: IGES" in mracad("info", model).out and "valid: yes" in mracad("check", model).out
    assert mracad("smooth", model, "--scale", "8mm", "-o", out, "-o", tmp_path / "out.ply").code == 0
    result = mracad("compare", model, out, "--json")
    assert result.code == 1 and '"failed": ["deviation"' in result.out
