"""One model in two formats: what a format cannot hold, and how it writes things down, is noted; the rest fails."""

import json
import math

import pytest
from OCP.BRepAlgoAPI import BRepAlgoAPI_Cut
from OCP.BRepBuilderAPI import BRepBuilderAPI_NurbsConvert, BRepBuilderAPI_Transform
from OCP.BRepFilletAPI import BRepFilletAPI_MakeFillet
from OCP.BRepPrimAPI import BRepPrimAPI_MakeBox, BRepPrimAPI_MakeCylinder
from OCP.gp import gp_Ax2, gp_Dir, gp_Pnt, gp_Trsf, gp_Vec
from OCP.ShapeUpgrade import ShapeUpgrade_ShapeDivideClosed
from OCP.TopAbs import TopAbs_EDGE, TopAbs_FACE, TopAbs_SOLID
from OCP.TopExp import TopExp_Explorer
from OCP.TopLoc import TopLoc_Location
from OCP.TopoDS import TopoDS

from mracad.formats import unheld
from mracad.occ.files import read, write
from mracad.occ.step import write_step
from mracad.occ.topology import compound, inside
from tests.cli.test_check import flat
from tests.occ import shapes
from tests.occ.test_colours import colour

SMALL = 300_000
"""Real models of more bytes than this are converted only where ``--long`` asks for it."""


def saved(shape, path, colour=None):
    """A file with one part."""
    document = shapes.document(shape, names={0: "part"}, colours={0: colour} if colour else None)
    write(document, path)
    return path


def converted(mracad, source, target):
    assert mracad("convert", source, "-o", target).code == 0
    return target


def compared(mracad, ref, new, *words):
    """The body and the layers by name; the exit code fits."""
    result = mracad("compare", ref, new, "--json", *words)
    body = json.loads(result.out)
    assert result.code == (0 if body["passed"] else 1)
    return body, {layer["name"]: layer for layer in body["layers"]}


def notes(layers):
    return {(name, note["rule"]) for name, layer in layers.items() for note in layer["notes"]}


def rounded():
    """A block with a rounded edge."""
    block = BRepPrimAPI_MakeBox(10, 20, 30).Shape()
    fillet = BRepFilletAPI_MakeFillet(block)
    fillet.Add(2.0, TopoDS.Edge_s(TopExp_Explorer(block, TopAbs_EDGE).Current()))
    return fillet.Shape()


def pierced(x):
    """A block with a hole."""
    hole = BRepPrimAPI_MakeCylinder(gp_Ax2(gp_Pnt(x, 10, -1), gp_Dir(0, 0, 1)), 2, 40).Shape()
    return BRepAlgoAPI_Cut(rounded(), hole).Shape()


def moved(shape, *by):
    shift = gp_Trsf()
    shift.SetTranslation(gp_Vec(*by))
    return BRepBuilderAPI_Transform(shape, shift, True).Shape()


@pytest.mark.parametrize(
    ("name", "ending"),
    [("assembly", "igs"), ("assembly", "brep"), ("trimmed", "igs"), ("blade", "igs"), ("bottle", "bbrep")],
)
def test_a_sample_in_another_format_is_the_same_both_ways(mracad, samples, tmp_path, name, ending):
    source = samples / f"{name}.step"
    other = converted(mracad, source, tmp_path / f"other.{ending}")
    for pair in ((source, other), (other, source)):
        body, layers = compared(mracad, *pair)
        assert body["passed"], {n: layers[n]["findings"][:3] for n in body["failed"]}
        assert all(layer["status"] == "pass" for layer in layers.values())
    lacks = unheld("AP214", read(other).schema)
    assert {layer for layer, rule in notes(layers) if rule == "not-held"} <= lacks.keys()
    if name == "assembly":
        assert {"assembly", "names", "layers"} <= {layer for layer, rule in notes(layers) if rule == "not-held"}
        (note,) = layers["layers"]["notes"]
        assert note["text"] == f"not held by {'IGES' if ending == 'igs' else 'BREP'}: layers"


def test_a_real_model_is_the_same_in_every_format(mracad, corpus_file, tmp_path, pytestconfig):
    if corpus_file.stat().st_size > SMALL and not pytestconfig.getoption("--long"):
        pytest.skip("more than 300 kB: pytest --long converts it")
    for ending in ("step", "igs", "brep"):
        pair = corpus_file, converted(mracad, corpus_file, tmp_path / f"other.{ending}")
        body, layers = compared(mracad, *(reversed(pair) if ending == "brep" else pair))
        assert body["passed"], (ending, {n: layers[n]["findings"][:3] for n in body["failed"]})


def test_a_file_that_was_iges_is_the_same_as_step(mracad, tmp_path):
    source = saved(rounded(), tmp_path / "a.igs", "#3366cc")
    other = converted(mracad, source, tmp_path / "b.step")
    assert compared(mracad, source, other)[0]["passed"] and compared(mracad, other, source)[0]["passed"]


@pytest.mark.parametrize("ending", ["step", "igs", "brep"])
def test_real_differences_fail_in_every_format(mracad, tmp_path, ending):
    ref = saved(pierced(5), tmp_path / "ref.step")
    shape = {
        "deviation": moved(pierced(5), 0, 0, 1e-3),
        "faces": shapes.compound(*list(inside(pierced(5), TopAbs_FACE))[1:]),
        "outline": pierced(5.001),
    }
    for what, other in shape.items():
        new = saved(other, tmp_path / f"{what}.{ending}")
        for pair in ((ref, new), (new, ref)):
            body, _ = compared(mracad, *pair)
            assert ("deviation" if what == "outline" else what) in body["failed"], what
    new = saved(rounded(), tmp_path / f"whole.{ending}")
    for pair in ((ref, new), (new, ref)):
        body, layers = compared(mracad, *pair)
        assert {"faces", "deviation"} <= set(body["failed"])
        assert any(f["rule"] == "outline" for f in layers["deviation"]["findings"])


def test_another_colour_fails_where_both_formats_hold_colours(mracad, tmp_path):
    ref = saved(rounded(), tmp_path / "ref.step", "#3366cc")
    same, other = (saved(rounded(), tmp_path / f"{c}.igs", f"#{c}") for c in ("3366cc", "cc6633"))
    assert compared(mracad, ref, same)[0]["passed"]
    body, layers = compared(mracad, ref, other)
    assert body["failed"] == ["colours"]
    assert layers["colours"]["findings"][0]["text"] == "#1 is #cc6633, was #3366cc"
    body, layers = compared(mracad, ref, saved(rounded(), tmp_path / "none.brep"))
    assert body["passed"] and ("colours", "not-held") in notes(layers)


@pytest.mark.parametrize("ending", ["step", "igs", "brep"])
def test_an_analytic_surface_written_as_a_b_spline_is_noted(mracad, tmp_path, ending):
    ref = saved(pierced(5), tmp_path / "ref.step")
    new = saved(BRepBuilderAPI_NurbsConvert(pierced(5), True).Shape(), tmp_path / f"new.{ending}")
    for pair in ((ref, new), (new, ref)):
        body, layers = compared(mracad, *pair)
        assert body["passed"], {n: layers[n]["findings"][:3] for n in body["failed"]}
        assert ("faces", "face-kind") in notes(layers)


def test_faces_without_a_shell_are_noted_in_iges_alone(mracad, tmp_path):
    ref = saved(pierced(5), tmp_path / "ref.step")
    bare = shapes.compound(*inside(pierced(5), TopAbs_FACE))
    body, layers = compared(mracad, ref, saved(bare, tmp_path / "bare.igs"))
    assert body["passed"] and ("topology", "shells") in notes(layers)
    body, layers = compared(mracad, ref, saved(bare, tmp_path / "bare.brep"))
    assert body["failed"] == ["topology"]


def test_a_face_alone_in_a_shell_is_noted(mracad, tmp_path):
    """STEP has no face without a shell."""
    apart = [flat((0, 0, z), (10, 0, z), (10, 10, z), (0, 10, z)) for z in (0, 5)]
    ref = saved(shapes.compound(*apart), tmp_path / "ref.brep")
    new = converted(mracad, ref, tmp_path / "new.step")
    for pair in ((ref, new), (new, ref)):
        body, layers = compared(mracad, *pair)
        assert body["passed"] and ("topology", "open-shells") in notes(layers)
    joined = [flat((0, 0, 0), (10, 0, 0), (10, 10, z), (0, 10, z)) for z in (0, 5)]
    bare, shell = (
        saved(shapes.compound(*joined), tmp_path / "bare.brep"),
        saved(shapes.sewn(*joined), tmp_path / "s.step"),
    )
    assert compared(mracad, bare, shell)[0]["failed"] == ["topology"]


def test_a_closing_edge_elsewhere_is_noted(mracad, tmp_path):
    files = [tmp_path / "ref.brep", tmp_path / "new.step"]
    for path, start in zip(files, (0.0, 2.0), strict=True):
        turned = gp_Ax2(gp_Pnt(0, 0, 0), gp_Dir(0, 0, 1), gp_Dir(math.cos(start), math.sin(start), 0))
        hole = BRepPrimAPI_MakeCylinder(gp_Ax2(gp_Pnt(2, 0, 10), gp_Dir(1, 0, 0)), 1, 10).Shape()
        saved(BRepAlgoAPI_Cut(BRepPrimAPI_MakeCylinder(turned, 5, 20).Shape(), hole).Shape(), path)
    for pair in (files, files[::-1]):
        body, layers = compared(mracad, *pair)
        assert body["passed"] and {("seams", "seam-lost"), ("seams", "seam-added")} <= notes(layers)


def test_an_edge_in_two_pieces_is_noted(mracad, tmp_path):
    corners = (0, 0, 0), (5, 0, 0), (10, 0, 0), (10, 10, 0), (0, 10, 0)
    ref = saved(flat(*corners[:1], *corners[2:]), tmp_path / "ref.step")
    new = saved(flat(*corners), tmp_path / "new.step")
    body, layers = compared(mracad, ref, new)
    assert body["passed"] and {("topology", "edges"), ("topology", "free-edges")} <= notes(layers)


@pytest.mark.parametrize("ending", ["step", "igs"])
def test_a_face_in_two_parts_is_noted(mracad, tmp_path, ending):
    divided = ShapeUpgrade_ShapeDivideClosed(pierced(5))
    assert divided.Perform()
    ref, new = saved(pierced(5), tmp_path / "ref.step"), saved(divided.Result(), tmp_path / f"new.{ending}")
    body, layers = compared(mracad, ref, new)
    assert body["passed"], {n: layers[n]["findings"][:3] for n in body["failed"]}
    (note,) = (n for n in layers["faces"]["notes"] if n["rule"] == "face-split")
    assert len(note["faces"]) == 2 and "is now in 2 parts" in note["text"]
    body, layers = compared(mracad, new, ref)
    assert body["passed"] and ("faces", "face-merged") in notes(layers)
    elsewhere = ShapeUpgrade_ShapeDivideClosed(pierced(5.01))
    assert elsewhere.Perform()
    body, _ = compared(mracad, ref, saved(elsewhere.Result(), tmp_path / f"elsewhere.{ending}"))
    assert "deviation" in body["failed"]


def test_instances_are_compared_where_they_stand(mracad, tmp_path):
    def places(*xs):
        made = []
        for x in xs:
            shift = gp_Trsf()
            shift.SetTranslation(gp_Vec(x, 0, 0))
            made.append(TopLoc_Location(shift))
        return made

    block = BRepPrimAPI_MakeBox(10, 20, 30).Shape()
    ref = tmp_path / "ref.step"
    write_step(shapes.assembly(block, *places(0, 10, 40)), ref)  # the first two touch in a whole face
    assert compared(mracad, ref, converted(mracad, ref, tmp_path / "same.igs"))[0]["passed"]
    apart = tmp_path / "apart.step"
    write_step(shapes.assembly(block, *places(0, 10, 40.001)), apart)
    body, _ = compared(mracad, ref, converted(mracad, apart, tmp_path / "apart.igs"))
    assert "deviation" in body["failed"]


def test_the_colour_of_a_body_is_that_of_its_faces(mracad, tmp_path):
    """STEP colours one body of a part, IGES its faces."""
    boxes = [BRepPrimAPI_MakeBox(gp_Pnt(x, 0, 0), 1, 2, 3).Shape() for x in (0, 5)]
    document = shapes.document(compound(boxes), names={0: "part"})
    body = TopExp_Explorer(document.parts[0].shape, TopAbs_SOLID).Current()
    colour(document, document.shape_tool.AddSubShape(document.parts[0].label, body), "#0000ff")
    write(document, tmp_path / "ref.step")
    assert [face["colour"] for face in json.loads(mracad("info", tmp_path / "ref.step", "--json").out)["faces"]] == [
        *["#0000ff"] * 6,
        *[""] * 6,
    ]
    body, layers = compared(
        mracad, tmp_path / "ref.step", converted(mracad, tmp_path / "ref.step", tmp_path / "new.igs")
    )
    assert body["passed"], layers["colours"]
