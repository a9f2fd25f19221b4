"""The command on real models: no face gets rougher, and outputs are as good as the kernel's own copy of the input."""

import json
from collections import Counter
from functools import cache

import pytest

from tests.judge import allowed, assert_as_good, judge, kernel_copy
from tests.roughness import compared, removed


def pairs(body, ways):
    """Pairs of faces, counted from 0, with a seam that was treated so."""
    edges = {edge["edge"] for edge in body["edges"] if edge["how"] in ways}
    every = body["seams"]["each"]
    return {tuple(sorted(face - 1 for face in seam["faces"])) for seam in every if seam["edge"] in edges}


@pytest.fixture(scope="module")
def copied(tmp_path_factory):
    """What is said of the kernel's own copy of a file; once for each."""
    folder = tmp_path_factory.mktemp("kernel")
    return cache(lambda source: judge(kernel_copy(source, folder / source.name)))


@pytest.mark.parametrize("percent", [2, 0.5, 10])
def test_smoothing_makes_no_face_rougher(corpus_file, refined_file, percent, mracad, copied, tmp_path, pytestconfig):
    if percent != 2 and not pytestconfig.getoption("--long"):
        pytest.skip(f"pytest --long smooths at {percent} %")
    out, report = tmp_path / "out.step", tmp_path / "report.json"
    result = mracad("smooth", corpus_file, "--scale", f"{percent}%", "-o", out, "--report", report)
    assert result.code == 0 and "Traceback" not in result.err, result.err
    lines = result.out.splitlines()
    assert len(lines) == 4 and lines[0].startswith(corpus_file.name) and lines[3].startswith("valid: ")
    body = json.loads(report.read_text())
    edited = {face["face"]: face for face in body["faces"] if face["status"] == "edited"}
    assert ("nothing changed" in lines[0]) == (not edited)
    for face in body["faces"]:
        assert (face["reason"] is None) == (face["status"] == "edited")

    faces = compared(corpus_file, out, percent / 100 * body["diagonal"])
    moved = {face.index + 1 for face in faces if face.moved}
    edges = Counter((edge["how"], edge["reason"]) for edge in body["edges"])
    print(
        f"\n{corpus_file.stem} at {percent} %: {len(moved)} of {len(faces)} faces moved, removed {removed(faces):.3f}"
    )
    for (how, reason), count in sorted(edges.items()):
        print(f"{count:6d} {how}{reason and ': '}{reason}")
    assert moved <= edited.keys()
    assert {face.index + 1: face.grew for face in faces if face.grew} == {}

    coupled, loose = pairs(body, {"coupled"}), pairs(body, {"to tolerance"})
    held = {pair for pair in pairs(body, {"frozen"}) if any(face + 1 in edited for face in pair)}
    refined = {number - 1 for number, face in edited.items() if face["inserted"]}
    widest = allowed(judge(corpus_file), loose, held)
    assert_as_good(judge(out), copied(corpus_file), refined, coupled, widest)


@pytest.mark.parametrize("ending", ["step", "igs", "brep"])
def test_converted_files_are_as_good_as_the_kernels_own(refined_file, mracad, copied, tmp_path, ending):
    out = tmp_path / f"out.{ending}"
    result = mracad("convert", refined_file, "-o", out, "--json")
    assert result.code == 0, result.err
    found = json.loads(result.out)["read_back"][out.name]
    assert found["valid"] and found["faults"] == []
    if ending == "step":
        assert_as_good(judge(out), copied(refined_file))
