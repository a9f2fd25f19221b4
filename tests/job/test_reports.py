"""What is reported is plain data: any reader of JSON takes it, and no name can play tricks on a terminal."""

import json

import msgspec
import pytest
from mracad_cli.render import json as render
from OCP.BRepPrimAPI import BRepPrimAPI_MakeBox

from mracad.edit.smooth import smooth
from mracad.job import check, compare
from mracad.job.document import run
from mracad.job.words import of_finding
from mracad.occ.files import read, write
from mracad.occ.step import write_step
from mracad.occ.view import view
from mracad.spec.steps import Check, Compare, Smooth
from tests.occ import shapes

PLAIN = (str, int, float, bool, type(None))


def odd(value, path=""):
    """The places of whatever is not a value of JSON itself: a number of numpy is not."""
    if isinstance(value, dict):
        return [x for key, item in value.items() for x in odd(item, f"{path}.{key}")] + [
            path for key in value if type(key) is not str
        ]
    if isinstance(value, list | tuple):
        return [x for item in value for x in odd(item, f"{path}[]")]
    return [] if type(value) in PLAIN else [f"{path}: {type(value).__name__}"]


def raw(verdict):
    """Everything that a verdict holds, dataclasses taken apart."""
    return [
        [msgspec.to_builtins(layer.figures), *((f.rule, f.faces, f.edge, f.where, dict(f.figures)) for f in found)]
        for layer in verdict.layers
        for found in (layer.findings, layer.notes)
    ]


@pytest.fixture
def panels(samples):
    return [read(samples / f"{name}.step") for name in ("panel_clean", "panel")]


def test_a_comparison_is_plain_data(panels, samples, tmp_path):
    strict = Compare(max_gap_growth="1e-12mm", max_angle_growth=0.0, max_volume_change=0.0)
    other = tmp_path / "other.igs"
    write(read(samples / "assembly.step"), other)
    pairs = [tuple(panels), (read(samples / "assembly.step"), read(other)), (panels[0], read(other))]
    for ref, new in pairs:
        judged = compare.compare(new, strict, lambda ref=ref: ref)
        assert odd(raw(judged.verdict)) == []
        body = render.verdict(judged.verdict, judged.failed)
        assert odd(body) == [] and json.loads(json.dumps(body, allow_nan=True))
        assert all(
            of_finding(finding) for layer in judged.verdict.layers for finding in (*layer.findings, *layer.notes)
        )


def test_a_check_is_plain_data(panels, samples):
    text = (samples / "panel.step").read_bytes()
    strict = Check(max_gap="1e-12mm", max_angle=1e-12, max_tolerance="1e-12mm", expect="99", min_wall="1m")
    judged = check.check(panels[1], strict, text=text)
    assert {"shells", "seams", "tolerances"} <= {layer.name for layer in judged.verdict.layers if layer.findings}
    assert odd(raw(judged.verdict)) == [] and odd(render.verdict(judged.verdict, judged.failed)) == []


def test_an_edit_is_plain_data(panels):
    assert odd(render.report(run(panels[1], smooth, Smooth(scale="25mm")))) == []


def test_files_that_differ_are_told_as_json(mracad, samples, tmp_path):
    result = mracad("compare", samples / "panel_clean.step", samples / "panel.step", "--json")
    assert result.code == 1 and "seams" in json.loads(result.out)["layers"][2]["name"]
    steps = "smooth --scale 25mm ! compare --max-angle-growth 0"
    result = mracad("pipeline", steps, samples / "panel.step", "-o", tmp_path / "out.step", "--json")
    assert result.code == 1 and json.loads(result.out)["steps"][1]["failed"]
    assert not (tmp_path / "out.step").exists()


def test_a_name_like_a_face_is_a_name(mracad, tmp_path):
    path = tmp_path / "pins.step"
    boxes = [BRepPrimAPI_MakeBox(size, 2, 3).Shape() for size in (1, 5)]
    colours = {0: "#ff0000", 1: "#00ff00"}
    write_step(shapes.document(*boxes, names={0: "pin #99", 1: "pin #1"}, colours=colours), path)
    assert mracad("compare", path, path).code == 0
    other = tmp_path / "other.step"
    write_step(shapes.document(*boxes, names={0: "pin #99", 1: "pin #1"}, colours=colours | {0: "#0000ff"}), other)
    body = json.loads(mracad("compare", path, other, "--json").out)
    assert body["failed"] == ["colours"]
    found = next(x for x in body["layers"] if x["name"] == "colours")["findings"]
    lost = next(f for f in found if f["rule"] == "colours" and f["figures"]["change"] == "lost")
    assert lost["figures"]["product"] == "pin #99" and lost["figures"]["face"] is None
    assert lost["text"] == "lost: pin #99 surface #ff0000"


def test_control_characters_of_names_never_reach_the_terminal(mracad, tmp_path):
    name, path = "evil\x1b[2J\x9b31m\nname", tmp_path / "evil.step"
    document = shapes.document(BRepPrimAPI_MakeBox(1, 2, 3).Shape(), names={0: name})
    other = shapes.document(BRepPrimAPI_MakeBox(1, 2, 3).Shape(), names={0: "good"})
    write_step(document, path)
    write_step(other, tmp_path / "good.step")
    named = view(read(path)).products[0]
    assert "\x1b" in named and "\x9b" in named
    for line in (("info", path), ("compare", path, tmp_path / "good.step")):
        result = mracad(*line)
        assert not any(c in result.out + result.err for c in "\x1b\x9b"), line
        assert "evil\\u001b[2J\\u009b31m" in result.out
    result = mracad("info", path, "--json")
    assert json.loads(result.out)["products"] == [named] and "\x1b" not in result.out and "\x9b" not in result.out
    result = mracad("info", tmp_path / "no\x1b[2J.step")
    assert result.code == 3 and "no\\u001b[2J.step" in result.err and "\x1b" not in result.err
