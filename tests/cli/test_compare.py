"""Comparing: nothing differs from itself, what differs is found where it is, by as much as it is."""

import json
import re
from xml.etree import ElementTree

import numpy as np
import pytest
from OCP.BRepPrimAPI import BRepPrimAPI_MakeBox, BRepPrimAPI_MakeCylinder

from mracad.occ.step import write_step
from mracad.occ.units import UNITS, Units
from tests.occ import shapes

SAMPLES = ("assembly", "blade", "bottle", "trimmed")


def compared(mracad, *words):
    """Exit code, layers by name, and the deviation of each face by its number."""
    result = mracad("compare", *words, "--json")
    body = json.loads(result.out)
    layers = {layer["name"]: layer for layer in body["layers"]}
    assert result.code == (0 if body["passed"] else 1)
    assert body["failed"] == [name for name, layer in layers.items() if layer["status"] == "fail"]
    return body, layers, {d["new"]: d for d in layers["deviation"]["figures"]["each"]}


def saved(shape, path, unit="mm"):
    """A file with one part."""
    made = shapes.document(shape, names={0: "part"})
    made.units = Units(unit, UNITS[unit][0])
    write_step(made, path)
    return path


def flat(z):
    poles = np.stack([*np.meshgrid(np.arange(0.0, 8.0), np.arange(0.0, 6.0), indexing="ij"), np.full((8, 6), z)], -1)
    return shapes.face_on(shapes.bspline(poles))


def renumbered(text):
    """The same file with other entity numbers, its lines the other way round, its faces in another order."""
    head, body = text.split(b"DATA;\n")
    body, tail = body.split(b"ENDSEC;")[0], b"ENDSEC;\nEND-ISO-10303-21;\n"
    entities = re.findall(rb"#\d+ = (?:[^';]|'[^']*')*;\n", body)
    assert b"".join(entities) == body
    body = b"".join(reversed(entities))
    body = re.sub(rb"#(\d+)", lambda m: b"#%d" % (90001 - 7 * int(m[1])), body)

    def turned(match):
        return match[1] + b",".join(reversed(match[2].split(b","))) + b")"

    return head + b"DATA;\n" + re.sub(rb"(_SHELL\('',\()([^)]*)\)", turned, body) + tail


@pytest.mark.parametrize("name", SAMPLES)
def test_nothing_differs_from_itself(mracad, samples, name):
    body, layers, each = compared(mracad, samples / f"{name}.step", samples / f"{name}.step")
    assert body["passed"] and body["valid"] is True
    for deviation in each.values():
        assert deviation["there"]["largest"] < 1e-9 and deviation["back"]["largest"] < 1e-9
        assert deviation["outline"]["largest"] == 0
    assert layers["seams"]["figures"]["growth"] == {"gap": 0, "angle": 0}
    assert layers["size"]["figures"]["volume_change"] == 0


def test_a_face_offset_by_a_tenth_is_found_and_nothing_else(mracad, tmp_path):
    heights = (0.0, 5.0, 9.0)
    files = [
        saved(shapes.compound(*(flat(z + dz) for z, dz in zip(heights, shift, strict=True))), tmp_path / name)
        for name, shift in (("ref.step", (0, 0, 0)), ("new.step", (0, 0.1, 0)))
    ]
    body, layers, each = compared(mracad, *files)
    assert body["failed"] == ["deviation"]
    assert {finding["faces"][0] for finding in layers["deviation"]["findings"]} == {2}
    for number, deviation in each.items():
        for way in ("there", "back", "outline"):
            expected = 0.1 if number == 2 else 0.0
            for figure in ("largest", "mean", "p95"):
                assert deviation[way][figure] == pytest.approx(expected, abs=1e-6 if number == 2 else 1e-12)
        assert deviation["bound"] == pytest.approx(0.1 if number == 2 else 0.0, abs=1e-9)
    assert mracad("compare", *files, "--max-deviation", "0.1001mm").code == 0
    assert mracad("compare", *files, "--max-deviation", "0.0999mm").code == 1
    assert mracad("compare", *files, "--ignore", "deviation").code == 0


def test_a_box_that_grew_deviates_on_its_top_alone(mracad, tmp_path):
    files = [saved(BRepPrimAPI_MakeBox(10, 20, h).Shape(), tmp_path / f"{h}.step") for h in (30.0, 30.1)]
    _, _, each = compared(mracad, *files)
    worst = {n: max(d["there"]["largest"], d["back"]["largest"]) for n, d in each.items()}
    assert sorted(round(x, 6) for x in worst.values()) == [0, 0, 0, 0, 0, 0.1]
    (top,) = [n for n, x in worst.items() if x > 0.05]
    assert each[top]["outline"]["largest"] == pytest.approx(0.1, abs=1e-9)
    assert sum(d["outline"]["largest"] > 0.05 for d in each.values()) == 5
    assert mracad("compare", *files, "--max-deviation", "1mm", "--max-volume-change", "0.3").code == 1
    assert mracad("compare", *files, "--max-deviation", "1mm", "--max-volume-change", "0.4").code == 0


@pytest.mark.parametrize("name", SAMPLES)
def test_renumbered_entities_and_reordered_faces_are_equal(mracad, samples, tmp_path, name):
    other = tmp_path / "other.step"
    other.write_bytes(renumbered((samples / f"{name}.step").read_bytes()))
    body, layers, each = compared(mracad, samples / f"{name}.step", other)
    assert body["passed"], body["failed"]
    assert layers["faces"]["figures"]["renumbered"] > 0
    assert max(d["there"]["largest"] for d in each.values()) < 1e-9


def test_millimetres_against_inches_of_the_same_part(mracad, tmp_path):
    part = BRepPrimAPI_MakeCylinder(5, 20).Shape()
    mm, inch = (saved(part, tmp_path / f"{unit}.step", unit) for unit in ("mm", "in"))
    body, layers, _ = compared(mracad, mm, inch)
    assert body["passed"] and layers["units"]["text"] == "in, was mm"
    assert layers["size"]["figures"]["new"]["volume"] == pytest.approx(500 * np.pi, rel=1e-6)


def test_attributes_that_were_lost_are_named(mracad, samples, tmp_path):
    text = (samples / "assembly.step").read_bytes()
    other = tmp_path / "other.step"
    for layer, old, new, says in (
        ("colours", b"COLOUR('yellow')", b"COLOUR('cyan')", "pin surface #ffff00"),
        ("layers", b"ASSIGNMENT('tooling'", b"ASSIGNMENT('scrap'", "tooling base plate"),
        ("names", b"PRODUCT('pin','pin'", b"PRODUCT('bolt','bolt'", "lost: pin"),
        ("assembly", b"'6','locating pin'", b"'6','stray pin'", "locating pin"),
    ):
        assert old in text
        other.write_bytes(text.replace(old, new))
        body, layers, _ = compared(mracad, samples / "assembly.step", other)
        assert layer in body["failed"]
        assert any(says in finding["text"] for finding in layers[layer]["findings"]), layers[layer]
        assert layers["deviation"]["status"] == "pass"


def test_lost_and_new_faces_are_named(mracad, tmp_path):
    whole, less = ([flat(0), flat(5), flat(9)], [flat(0), flat(9)])
    a, b = (saved(shapes.compound(*faces), tmp_path / f"{len(faces)}.step") for faces in (whole, less))
    body, layers, _ = compared(mracad, a, b)
    assert layers["faces"]["figures"] == {"matched": 2, "lost": 1, "added": 0, "renumbered": 1}
    assert [f["text"] for f in layers["faces"]["findings"]] == ["#2 (bspline) is gone"]
    assert {"faces", "topology"} <= set(body["failed"])


def test_reports(mracad, samples, tmp_path):
    junit, sarif = tmp_path / "out.xml", tmp_path / "out.sarif"
    words = [samples / "panel_clean.step", samples / "panel.step", "--junit", junit, "--sarif", sarif]
    result = mracad("compare", *words, "--max-gap-growth", "1mm", "--ignore", "names")
    assert result.code == 1 and "failed: deviation" in result.out and " at " in result.out
    suite = ElementTree.parse(junit).getroot()
    cases = {case.get("name"): case for case in suite}
    assert suite.get("tests") == str(len(cases)) == "13" and suite.get("failures") == "2"
    assert cases["deviation"].find("failure") is not None and cases["names"].find("skipped") is not None
    (run,) = json.loads(sarif.read_text())["runs"]
    assert any(r["ruleId"] == "deviation/deviates" and r["level"] == "error" for r in run["results"])
    assert mracad("compare", *words).code == 2  # they exist
    assert mracad("compare", *words, "--overwrite").code == 1
    assert mracad("compare", *words[:2], "--max-deviation", "nonsense").code == 2


def test_wrong_units_are_corrected_on_either_side(mracad, samples, tmp_path):
    good, wrong = samples / "bottle.step", tmp_path / "bottle.step"
    text = good.read_bytes()
    assert b"SI_UNIT(.MILLI.,.METRE.)" in text
    wrong.write_bytes(text.replace(b"SI_UNIT(.MILLI.,.METRE.)", b"SI_UNIT($,.METRE.)"))
    limit = ("--max-deviation", "1e-9mm")
    assert mracad("compare", good, wrong, *limit).code == 1
    assert mracad("compare", good, wrong, "--input-unit", "mm", *limit).code == 0
    assert mracad("compare", wrong, good, "--reference-unit", "mm", *limit).code == 0
    assert mracad("compare", wrong, good, "--reference-unit", "parsec").code == 2
