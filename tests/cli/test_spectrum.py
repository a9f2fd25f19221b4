"""``mracad spectrum``: what it prints and writes agrees, and nothing is written where it cannot be."""

import csv
import json

import pytest

from tests.conftest import SAMPLES

PANEL = SAMPLES / "panel.step"


def read(path):
    with open(path, newline="") as file:
        return list(csv.DictReader(file))


def test_print_json_and_csv_agree(mracad, tmp_path):
    words = "--faces", "#1", "--faces", "#2"
    table = mracad("spectrum", PANEL, *words)
    assert table.code == 0 and "10 to 20" in table.out and "█" in table.out and "try --scale" in table.out
    body = json.loads(mracad("spectrum", PANEL, *words, "--json", "-o", tmp_path / "a.csv").out)
    assert mracad("spectrum", PANEL, *words, "-o", tmp_path / "a.json").code == 0
    assert json.loads((tmp_path / "a.json").read_text()) == body
    rows = read(tmp_path / "a.csv")
    assert {row["face"] for row in rows} == {"", "1", "2"} and [face["face"] for face in body["faces"]] == [1, 2]
    for place, name in ((body["model"], ""), (body["faces"][0], "1")):
        for way in "uv":
            bands = place[way]["bands"]
            found = [row for row in rows if (row["face"], row["direction"]) == (name, way)]
            assert [float(row["rms_mm"]) for row in found] == pytest.approx([band["rms"] for band in bands])
            assert sum(float(row["share"]) for row in found) == pytest.approx(1.0)
            assert all(2 * band["from"] == band["to"] for band in bands)
    assert body["model"]["noise"] == pytest.approx(0.05 / 3**0.5, rel=0.1)
    assert body["model"]["scale"] == min(body["model"][way]["shape"] for way in "uv") / 2


@pytest.mark.parametrize("name", ["a.pdf", "a", "none/a.csv", "none/a.png"])
def test_what_cannot_be_written_is_refused(name, mracad, tmp_path):
    result = mracad("spectrum", PANEL, "-o", tmp_path / name)
    assert result.code in (2, 3) and result.err.count("mracad: ") == 1 and not list(tmp_path.iterdir())


def test_a_file_is_replaced_only_if_asked(mracad, tmp_path):
    (tmp_path / "a.csv").write_text("precious")
    assert mracad("spectrum", PANEL, "--faces", "#1", "-o", tmp_path / "a.csv").code == 2
    assert (tmp_path / "a.csv").read_text() == "precious"
    assert mracad("spectrum", PANEL, "--faces", "#1", "-o", tmp_path / "a.csv", "--overwrite").code == 0
    assert len(read(tmp_path / "a.csv")) > 20


def test_several_files_are_written_and_named(mracad, tmp_path):
    result = mracad("spectrum", PANEL, "--faces", "#1", "-o", tmp_path / "a.csv", "-o", tmp_path / "a.json")
    assert result.out.splitlines()[-1] == "wrote a.csv, a.json"
    assert json.loads((tmp_path / "a.json").read_text())["faces"] and len(read(tmp_path / "a.csv")) > 20


def test_a_plane_has_no_spectrum(mracad, samples):
    result = mracad("spectrum", samples / "trimmed.step", "--faces", "#2")
    assert (result.code, result.out) == (0, "trimmed.step: no NURBS face\n")


def test_a_model_without_nurbs_faces_says_so(mracad, tmp_path):
    from OCP.BRepPrimAPI import BRepPrimAPI_MakeBox

    from tests.occ import shapes

    shapes.save(BRepPrimAPI_MakeBox(1.0, 2.0, 3.0).Shape(), tmp_path / "box.step")
    result = mracad("spectrum", tmp_path / "box.step")
    assert (result.code, result.out) == (0, "box.step: no NURBS face\n")
    assert json.loads(mracad("spectrum", tmp_path / "box.step", "--json").out) == {"file": "box.step", "faces": []}


def test_a_picture_shows_the_bands_of_the_model(mracad, tmp_path):
    from matplotlib.image import imread

    two = "--faces", "#1", "--faces", "#2"
    for name, faces in (("a.png", two), ("b.png", two), ("c.png", ("--faces", "#2"))):
        assert mracad("spectrum", PANEL, *faces, "-o", tmp_path / name).code == 0
    one, same, scalograms = (imread(tmp_path / name) for name in ("a.png", "b.png", "c.png"))
    assert one.shape[:2] == (400, 1000) and (one == same).all()
    assert scalograms.shape[:2] == (700, 1000)
    assert (tmp_path / "c.png").stat().st_size < 1e5


def test_drawings_state_the_noise_and_the_scale(mracad, tmp_path):
    for name in ("a.svg", "b.svg"):
        assert mracad("spectrum", PANEL, "--faces", "#1", "-o", tmp_path / name).code == 0
    text = (tmp_path / "a.svg").read_text()
    scale = json.loads(mracad("spectrum", PANEL, "--faces", "#1", "--json").out)["model"]["scale"]
    assert text == (tmp_path / "b.svg").read_text() and all(
        f">{x}<" in text for x in ("noise", f"--scale {scale:.3g}mm")
    )
