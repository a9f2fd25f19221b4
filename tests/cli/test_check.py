"""Checking: every oracle fails in the right layer, at the right face or edge, and nowhere else."""

import json
import re
import time

import numpy as np
import pytest
from OCP.BRep import BRep_Builder
from OCP.BRepBuilderAPI import BRepBuilderAPI_MakeFace, BRepBuilderAPI_MakePolygon
from OCP.BRepPrimAPI import BRepPrimAPI_MakeBox
from OCP.gp import gp_Pnt
from OCP.TopAbs import TopAbs_FACE
from OCP.TopExp import TopExp_Explorer
from OCP.TopoDS import TopoDS, TopoDS_Shell

from mracad.errors import LimitError
from mracad.inspect.verdict import Layer
from mracad.job import check as checks
from mracad.job import guard
from mracad.occ.files import read
from mracad.occ.view import view
from tests.occ import shapes


def checked(mracad, path, *words):
    """Exit code, the body, and the layers by name."""
    result = mracad("check", path, "--json", *words)
    body = json.loads(result.out)
    return result.code, body, {layer["name"]: layer for layer in body["layers"]}


def failing(layers):
    """The layers that found something."""
    return {name for name, layer in layers.items() if layer["status"] in ("fail", "noted")}


@pytest.fixture
def box(tmp_path):
    return shapes.save(BRepPrimAPI_MakeBox(10, 20, 30).Shape(), tmp_path / "box.step")


def faces_of(text):
    (members,) = re.findall(rb"CLOSED_SHELL\('',\(([^)]*)\)", text)
    return members, [face.strip() for face in members.split(b",")]


def flat(*corners):
    polygon = BRepBuilderAPI_MakePolygon()
    for corner in corners:
        polygon.Add(gp_Pnt(*corner))
    polygon.Close()
    return BRepBuilderAPI_MakeFace(polygon.Wire()).Face()


def test_a_box_passes_every_layer(mracad, box):
    code, body, layers = checked(mracad, box, "--min-wall", "1mm", "--fail-on", "mesh", "--fail-on", "free-edges")
    assert code == 0 and body["valid"] is True and not failing(layers)
    assert list(layers) == [
        "file", "load", "brep", "shells", "seams", "self-intersection", "tolerances", "walls", "mesh",
    ]  # fmt: skip
    assert layers["walls"]["figures"]["least"] == pytest.approx(10, abs=1e-6)
    assert checked(mracad, box, "--min-wall", "11mm")[0] == 1


def test_a_missing_face_leaves_four_free_edges(mracad, box):
    text = box.read_bytes()
    members, faces = faces_of(text)
    box.write_bytes(text.replace(members, b",".join(faces[1:])))
    _, _, layers = checked(mracad, box)
    assert failing(layers) == {"shells"}
    free = [finding for finding in layers["shells"]["findings"] if finding["rule"] == "free-edge"]
    assert len(free) == 4 and all(abs(finding["where"][0]) < 1e-9 for finding in free)  # the face x = 0
    assert mracad("check", box, "--fail-on", "free-edges").code == 1


def test_a_flipped_face_is_named(mracad, box):
    text = box.read_bytes()
    _, faces = faces_of(text)
    (face,) = re.findall(rb"%s = ADVANCED_FACE[^;]*;" % faces[2], text)
    (bound,) = re.findall(rb"%s = FACE_BOUND[^;]*;" % re.search(rb"\((#\d+)\)", face)[1], text)
    for entity in (face, bound):
        (sense,) = re.findall(rb"\.([TF])\.\);$", entity)
        text = text.replace(entity, entity[:-4] + (b"F" if sense == b"T" else b"T") + entity[-3:])
    box.write_bytes(text)
    code, body, layers = checked(mracad, box)
    assert code == 1 and body["valid"] is False and failing(layers) == {"shells"}
    (finding,) = layers["shells"]["findings"]
    assert finding["rule"] == "flipped-face"
    # the kernel puts the faces in another order; the third of the file is y = 0
    (face,) = finding["faces"]
    assert view(read(box)).faces[face - 1].box[:, 1] == pytest.approx(0, abs=1e-6)


def test_a_hole_torn_open_by_a_hundredth(mracad, tmp_path):
    whole, path = BRepPrimAPI_MakeBox(10, 20, 30).Shape(), tmp_path / "torn.step"
    lid = flat((0, 0, 29.99), (10, 0, 29.99), (10, 20, 29.99), (0, 20, 29.99))
    shapes.save(_with_lid(whole, lid), path)
    _, _, layers = checked(mracad, path)
    assert failing(layers) == {"shells", "seams"}
    torn = [finding for finding in layers["seams"]["findings"] if finding["rule"] == "unsewn"]
    assert len(torn) == 4 and all("gap 0.01 mm" in finding["text"] for finding in torn)
    assert {face for finding in torn for face in finding["faces"]} >= {6}
    assert mracad("check", path, "--fail-on", "unsewn").code == 1


def _with_lid(whole, lid):
    shell, builder = TopoDS_Shell(), BRep_Builder()
    builder.MakeShell(shell)
    walk, number = TopExp_Explorer(whole, TopAbs_FACE), 0
    while walk.More():
        number += 1
        if number != 6:
            builder.Add(shell, TopoDS.Face_s(walk.Current()))
        walk.Next()
    builder.Add(shell, lid)
    return shell


def test_a_sheet_that_crosses_itself(mracad, tmp_path):
    poles, turn = np.zeros((12, 6, 3)), np.linspace(0, 1.9 * np.pi, 12)
    poles[..., 0], poles[..., 2] = (10 * np.sin(turn))[:, None], (10 * np.sin(2 * turn))[:, None]
    poles[..., 1] = np.linspace(0, 10, 6)
    path = shapes.save(shapes.face_on(shapes.bspline(poles)), tmp_path / "eight.step")
    code, _, layers = checked(mracad, path, "--fail-on", "self-intersection")
    assert code == 1 and failing(layers) == {"shells", "self-intersection"}
    (finding,) = layers["self-intersection"]["findings"]
    assert finding["faces"] == [1, 1]
    assert np.abs(np.array(finding["where"])[[0, 2]]).max() < 0.1  # the middle of the eight


@pytest.mark.parametrize("angle", [0.0, 30.0])
def test_the_angle_of_a_seam_is_known(mracad, tmp_path, angle):
    c, s = 10 * np.cos(np.radians(angle)), 10 * np.sin(np.radians(angle))
    left = flat((0, 0, 0), (10, 0, 0), (10, 10, 0), (0, 10, 0))
    right = flat((10, 0, 0), (10 + c, 0, s), (10 + c, 10, s), (10, 10, 0))
    path = shapes.save(shapes.sewn(left, right), tmp_path / "seam.step")
    _, _, layers = checked(mracad, path)
    (seam,) = layers["seams"]["figures"]["each"]
    assert seam["angle"] == pytest.approx(angle, abs=1e-9) and seam["gap"] < 1e-9
    code, _, layers = checked(mracad, path, "--kink", "90", "--max-angle", "15")
    assert (code, "seams" in failing(layers)) == ((1, True) if angle else (0, False))


def test_a_tangent_seam_is_smooth(mracad, tmp_path):
    from OCP.BRepFilletAPI import BRepFilletAPI_MakeFillet
    from OCP.TopAbs import TopAbs_EDGE

    whole = BRepPrimAPI_MakeBox(10, 20, 30).Shape()
    fillet = BRepFilletAPI_MakeFillet(whole)
    fillet.Add(2.0, TopoDS.Edge_s(TopExp_Explorer(whole, TopAbs_EDGE).Current()))
    path = shapes.save(fillet.Shape(), tmp_path / "round.step")
    _, _, layers = checked(mracad, path, "--max-angle", "1e-6")
    assert not failing(layers)
    angles = sorted(seam["angle"] for seam in layers["seams"]["figures"]["each"])
    assert angles[:2] == pytest.approx([0, 0], abs=1e-6) and angles[2:] == pytest.approx([90] * 13, abs=1e-6)


def test_a_layer_that_takes_too_long_says_nothing():
    slow = checks.limited("brep", lambda: time.sleep(60), checks.CheckLimits(layer_seconds=0.1))
    assert slow == Layer("brep", "time limit", "more than 0.1 s")


def test_a_layer_holds_no_more_memory_than_the_check():
    def hungry():
        held = b"x" * 600_000_000
        return Layer("brep", "pass", str(len(held)))

    def check():
        return checks.limited("brep", hungry, checks.CheckLimits(layer_seconds=60.0))

    assert guard.run(check, Layer).status == "pass"
    with pytest.raises(LimitError, match="memory limit of 500 MB"):
        guard.run(check, Layer, memory=500_000_000)


def test_what_is_not_known_is_not_called_valid(mracad, samples):
    code, body, layers = checked(mracad, samples / "bottle.step", "--layer-limit", "1e-6", "--fail-on", "unknown")
    assert code == 1 and body["valid"] is None and body["failed"] == ["brep"]
    assert layers["brep"]["status"] == layers["mesh"]["status"] == "time limit"
    assert mracad("check", samples / "bottle.step", "--layer-limit", "1e-6").code == 0


def test_reports(mracad, samples, tmp_path):
    junit, sarif = tmp_path / "x.xml", tmp_path / "x.sarif"
    words = ["--fail-on", "free-edges", "--junit", junit, "--sarif", sarif]
    assert mracad("check", samples / "panel.step", *words).code == 1
    assert 'name="shells"' in junit.read_text() and "<failure" in junit.read_text()
    (run,) = json.loads(sarif.read_text())["runs"]
    assert sum(result["ruleId"] == "shells/free-edge" for result in run["results"]) == 10
    assert mracad("check", samples / "panel.step", *words).code == 2


def test_what_was_found_without_being_asked_for_is_noted_everywhere(mracad, samples, tmp_path):
    """A panel has free edges; nothing was asked to fail for them."""
    sarif, junit = (tmp_path / "x.sarif", tmp_path / "x.xml")
    result = mracad("check", samples / "panel.step", "--json", "--sarif", sarif, "--junit", junit)
    shells = next(layer for layer in json.loads(result.out)["layers"] if layer["name"] == "shells")
    assert result.code == 0 and shells["status"] == "noted" and len(shells["findings"]) == 10
    (run,) = json.loads(sarif.read_text())["runs"]
    assert {found["level"] for found in run["results"]} == {"note"} and "<failure" not in junit.read_text()
    asked = mracad("check", samples / "panel.step", "--json", "--fail-on", "free-edges")
    assert '"name": "shells", "status": "fail"' in asked.out and asked.code == 1


def test_a_wrong_same_sense_is_named(mracad, box):
    text = box.read_bytes()
    number = re.search(rb"ADVANCED_FACE\('',\([^)]*\),#\d+,\.([TF])\.\)", text)
    other = b"F" if number[1] == b"T" else b"T"
    box.write_bytes(text[: number.start(1)] + other + text[number.end(1) :])
    code, body, layers = checked(mracad, box)
    assert code == 1 and body["valid"] is False and failing(layers) == {"brep"}
    (finding,) = layers["brep"]["findings"]
    assert finding["rule"] == "same-sense"
    # the kernel puts the faces in another order; the first of the file is x = 0
    (face,) = finding["faces"]
    assert view(read(box)).faces[face - 1].box[:, 0] == pytest.approx(0, abs=1e-6)


def test_a_face_that_cannot_be_loaded_is_named(mracad, samples, tmp_path):
    text = (samples / "panel.step").read_bytes()
    before, word, after = text.partition(b"B_SPLINE_SURFACE_WITH_KNOTS")
    spoiled = tmp_path / "spoiled.step"
    spoiled.write_bytes(
        before + word + re.sub(rb"\),\(0\.,[\d.]+,", b"),(0.,-1.,", after, count=1)
    )  # knots must increase
    _, body, layers = checked(mracad, spoiled)
    assert body["valid"] is False and layers["load"]["text"].startswith("5 faces of 6"), layers["load"]
    (finding,) = layers["load"]["findings"]
    number = re.fullmatch(r"face not loaded: #(\d+): Surface has not been created", finding["text"])[1]
    assert b"#%s = ADVANCED_FACE" % number.encode() in text


def test_seams_have_the_same_numbers_as_in_info(mracad, samples):
    info = json.loads(mracad("info", samples / "panel.step", "--json").out)
    layers = {x["name"]: x for x in json.loads(mracad("check", samples / "panel.step", "--json").out)["layers"]}
    found = layers["seams"]["figures"]["each"]
    assert [(s["edge"], s["faces"]) for s in found] == [(s["edge"], s["faces"]) for s in info["seams"]["each"]]
    assert all({"gap", "angle", "bend", "relative_bend", "where"} <= s.keys() for s in found)
