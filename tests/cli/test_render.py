"""Pictures on the command line: what is said and written, next to models too, and what is refused."""

import io
import json

import numpy as np
import pytest
from PIL import Image

from tests.cli.test_errors import one_line
from tests.mesh.readers import arrays
from tests.occ import shapes


def test_a_picture_of_a_model(mracad, samples, tmp_path):
    out = tmp_path / "a.png"
    result = mracad("render", samples / "trimmed.step", "-o", out, "--size", "200x100", "--show", "curvature")
    assert result.code == 0 and "largest curvature 0 to " in result.out and "200 × 100" in result.out
    assert Image.open(out).size == (200, 100)


def test_deviation_from_another_file_is_told_with_its_range(mracad, samples, tmp_path):
    show = f"deviation:{samples / 'panel_clean.step'}"
    words = ("-o", tmp_path / "a.png", "--size", "100x60", "--show", show, "--json")
    told = json.loads(mracad("render", samples / "panel.step", *words).out)
    assert -0.1 < told["map"]["lowest"] < 0 < told["map"]["highest"] < 0.1
    assert told["map"]["unit"] == "mm" and told["size"] == [100, 60]


def test_an_edit_writes_pictures_as_it_writes_models(mracad, samples, tmp_path):
    out = tmp_path / "after.png", tmp_path / "after.step"
    words = ("--scale", "25mm", "-o", out[0], "-o", out[1], "--show", "deviation", "--view", "top,front")
    result = mracad("smooth", samples / "panel.step", *words, "--picture-size", "360x240")
    assert result.code == 0 and "valid: yes, as read back" in result.out and "after.png" in result.out
    show = f"deviation:{samples / 'panel.step'}"
    again = ("--show", show, "--view", "top", "--view", "front", "--size", "360x240")
    direct = mracad("render", out[1], "-o", tmp_path / "b.png", *again)
    assert direct.code == 0
    one, two = (np.asarray(Image.open(path)).astype(int) for path in (out[0], tmp_path / "b.png"))
    assert (np.abs(one - two).max(axis=2) > 8).mean() < 2e-3, "the picture is of the result"


def test_what_a_picture_is_measured_from_is_a_need_of_it(mracad, samples, tmp_path):
    show = f"deviation:{samples / 'panel_clean.step'}"
    words = ("-o", tmp_path / "a.png", "--show", show, "--depfile", tmp_path / "a.d", "--picture-size", "90x60")
    assert mracad("offset", samples / "panel.step", "--distance", "1mm", *words).code == 0
    assert "panel_clean.step" in (tmp_path / "a.d").read_text()


def test_convert_draws_too(mracad, samples, tmp_path):
    assert mracad("convert", samples / "blade.step", "-o", tmp_path / "a.png", "--show", "faces").code == 0
    assert Image.open(io.BytesIO((tmp_path / "a.png").read_bytes())).size == (1200, 800)


def test_what_an_edit_did_is_drawn_as_its_report_says(mracad, samples, tmp_path):
    from mracad.view.colours import rgb
    from mracad.view.treatment import EDGES, FACES

    out, report = tmp_path / "a.png", tmp_path / "a.json"
    words = ("--faces", "#1", "--hold", "#4", "--scale", "25mm", "--show", "treatment", "--view", "top")
    edit = mracad("smooth", samples / "panel.step", *words, "-o", out, "--picture-size", "500x300", "--report", report)
    assert edit.code == 0
    told, picture = json.loads(report.read_text()), np.asarray(Image.open(out).convert("RGB")).astype(int)

    def area(colour):
        return (np.abs(picture - 255 * rgb(colour)).max(axis=2) <= 12).sum()

    assert {each["status"] for each in told["faces"]} == {"edited", "held", "unselected"}
    assert {name for name, colour in FACES.items() if area(colour) > 2000} == {"edited", "held", "unselected"}
    assert {each["how"] for each in told["edges"]} == {"frozen"} and area(EDGES["stayed 1"]) > 100
    assert not area(EDGES["coupled"])


def test_copies_of_an_edit_are_drawn_with_their_rings(mracad, small, tmp_path):
    from mracad.view.rings import COLOUR

    out, report = tmp_path / "a.png", tmp_path / "a.json"
    words = ("--feature", "near:5,5,0,radius:1.5", "--at", "14,5,0", "--size", "1.5", "--report", report)
    shown = ("-o", out, "--show", "features", "--view", "top", "--picture-size", "400x220")
    assert mracad("repeat", small[0], *words, *shown).code == 0
    (copy,) = json.loads(report.read_text())["copies"]
    assert copy["radius"] == pytest.approx(1.5 * 1.5)
    y, x = np.nonzero(np.abs(np.asarray(Image.open(out).convert("RGB")) - 255 * COLOUR).sum(axis=2) < 90)
    pixel = 20 / (0.9 * 400)
    assert [np.ptp(x) * pixel, np.ptp(y) * pixel] == pytest.approx([4.5, 4.5], abs=4 * pixel)
    assert [x.mean() * pixel, y.mean() * pixel] == pytest.approx([200 * pixel + 4, 110 * pixel], abs=3 * pixel)


@pytest.mark.parametrize(
    ("words", "code", "says"),
    [
        (["--show", "zebras"], 2, "did you mean 'zebra'"),
        (["--show", "curvature:least"], 2, "curvature:max"),
        (["--show", "zebra:3"], 2, "after a colon"),
        (["--show", "deviation"], 2, "deviation:REF.step"),
        (["--show", "deviation:"], 2, "names no file"),
        (["--show", "deviation:none.step"], 3, "none.step"),
        (["--before", "none.step"], 3, "none.step"),
        (["--view", "aside"], 2, "not a view"),
        (["--view", "1,2"], 2, "not a view"),
        (["--view", "0,0,0"], 2, "no direction"),
        (["--view", ",".join(["iso"] * 17)], 2, "17 views"),
        (["--size", "12"], 2, "1200x800"),
        (["--size", "8x8"], 2, "out of bounds"),
        (["--size", "9000x9000"], 2, "out of bounds"),
        (["--size", "8000x8000"], 2, "out of bounds"),
        (["--stripes", "0"], 2, "between 1 and 2000"),
        (["--fit", "#99"], 2, "#1 to #"),
        (["--fit", "edge#1"], 2, "no face is selected"),
        (["-o", "a.jpg"], 3, "unknown extension"),
        (["-o", "a.step"], 2, "pictures are .png, .gif or .mp4"),
        (["--show", "treatment"], 2, "give it to an edit"),
        (["--wipe"], 2, "add --before"),
        (["--comb"], 2, "add --section"),
        (["--section", "z=9m"], 2, "the model is between z="),
        (["--section", "z"], 2, "write z=120mm"),
        (["-o", "nowhere/a.png"], 3, "no folder"),
        (["-o", "a.png", "-o", "b.png"], 2, "give -o once"),
        (["--show", "zebra", "--show=faces"], 2, "give --show once"),
        (["-o", "a.gif", "--view", "iso,top"], 2, "give one view"),
    ],
)
def test_what_cannot_be_drawn(mracad, samples, tmp_path, monkeypatch, words, code, says):
    monkeypatch.chdir(tmp_path)
    result = mracad("render", samples / "trimmed.step", *([] if "-o" in words else ["-o", "a.png"]), *words)
    one_line(result, code)
    assert says in result.err
    assert not list(tmp_path.iterdir())


def test_pictures_of_edits_take_what_those_of_models_take(mracad, samples, tmp_path):
    words = ("--show", "zebra", "--stripes", "12", "--view", "top", "--fit", "#2", "--before", samples / "blade.step")
    edit = ("--distance", "0.1mm", "-o", tmp_path / "a.png", "-o", tmp_path / "a.step", "--picture-size", "200x90")
    assert mracad("offset", samples / "blade.step", *edit, *words).code == 0
    assert mracad("render", tmp_path / "a.step", "-o", tmp_path / "b.png", "--size", "200x90", *words).code == 0
    one, two = (np.asarray(Image.open(tmp_path / name)).astype(int) for name in ("a.png", "b.png"))
    assert one.shape == (90, 200, 3)
    assert (np.abs(one - two)[32:].max(axis=2) > 8).mean() < 2e-2, "below the names"


@pytest.mark.parametrize(
    ("words", "says"),
    [
        (["--show", "zebra", "-o", "a.step"], "show: no picture is written; add -o OUT.png"),
        (["--picture-size", "90x60", "-o", "a.stl"], "picture-size: no picture"),
        (["--view", "top", "--dry-run"], "view: no picture"),
        (["--stripes", "9", "-o", "a.png"], "stripes: shaded has none"),
        (["--chord", "1mm", "-o", "a.png"], "chord: no mesh is written; add -o OUT.stl"),
        (["--ascii", "-o", "a.3mf"], "ascii: no STL file"),
        (["--schema", "AP203", "-o", "a.brep"], "schema: no STEP file"),
        (["--format", "stl", "-o", "a.stl"], "add -o -"),
        (["-o", "a.step", "--scale", "9mm"], "give --scale once"),
        (["-o", "a.gif", "--view", "iso", "--view", "top"], "give one view"),
    ],
)
def test_options_without_an_output_for_them_are_refused(mracad, samples, tmp_path, monkeypatch, words, says):
    monkeypatch.chdir(tmp_path)
    result = mracad("smooth", samples / "panel.step", "--scale", "25mm", *words)
    one_line(result, 2)
    assert says in result.err and not list(tmp_path.iterdir())


def test_an_edit_refuses_a_picture_before_it_starts(mracad, samples, tmp_path):
    words = ("--scale", "25mm", "-o", tmp_path / "a.png", "--show", "zebras")
    one_line(mracad("smooth", samples / "panel.step", *words), 2)


@pytest.mark.parametrize(
    ("command", "words", "says"),
    [
        ("smooth", ["-o", "a.step", "--scalar", "deviation"], "no mesh is written; add an output in .3mf, .ply"),
        ("smooth", ["-o", "a.ply", "-o", "a.stl", "--scalar", "deviation"], "STL holds no numbers at points; write"),
        ("convert", ["-o", "a.obj", "--scalar", "curvature"], "OBJ holds no numbers at points; write .3mf, .ply"),
        ("convert", ["-o", "a.ply", "--scalar", "deviation"], "write deviation:REF.step"),
        ("convert", ["-o", "a.ply", "--scalar", "zebra"], "'zebra' has no numbers"),
        ("convert", ["-o", "a.ply", "--scalar", "roughness:wide"], "scalar"),
        ("convert", ["-o", "a.ply", "--scalar", "roughness", "--scalar", "roughness:2mm"], "asked for twice"),
    ],
)
def test_numbers_at_points_without_a_mesh_for_them_are_refused(
    mracad, samples, tmp_path, monkeypatch, command, words, says
):
    monkeypatch.chdir(tmp_path)
    result = mracad(command, samples / "panel.step", *(["--scale", "25mm"] if command == "smooth" else []), *words)
    one_line(result, 2)
    assert says in result.err and not list(tmp_path.iterdir())


@pytest.mark.parametrize(
    ("words", "says"),
    [
        (["--chord", "1mm"], "chord: no mesh is written; add --format stl"),
        (["--scalar", "curvature"], "no mesh is written; write .3mf, .ply"),
        (["--scalar", "curvature", "--format", "stl"], "STL holds no numbers at points"),
    ],
)
def test_a_batch_refuses_options_of_meshes_without_them(mracad, samples, tmp_path, monkeypatch, words, says):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "a.toml").write_text('[[step]]\nuse = "check"\n')
    result = mracad("batch", "a.toml", samples / "panel.step", "-O", "out", *words)
    one_line(result, 2)
    assert says in result.err and not (tmp_path / "out").exists()


def test_deviation_at_the_points_of_an_edit_is_from_the_input(mracad, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    x, y = np.meshgrid(np.linspace(0, 30, 8), np.linspace(0, 20, 8), indexing="ij")
    shapes.save(shapes.face_on(shapes.bspline(np.stack([x, y, 0.01 * x * y], axis=-1))), tmp_path / "in.step")
    words = ("offset", "in.step", "--distance", "0.1mm", "-o", "a.ply", "-o", "a.step", "--json", "--overwrite")
    told = json.loads(mracad(*words, "--scalar", "deviation").out)
    (legend,) = told["scalars"]["a.ply"]
    values = arrays((tmp_path / "a.ply").read_bytes(), "ply")["deviation"]
    assert (values.min(), values.max()) == pytest.approx((legend["lowest"], legend["highest"]), rel=1e-6)
    assert np.median(values) == pytest.approx(0.1, abs=1e-3) and not told["scalars"]["a.step"]
    said = mracad("convert", "a.step", "-o", "b.ply", "--scalar", "deviation:in.step").out
    assert "deviation 0.1 to 0.1 mm" in said
    assert arrays((tmp_path / "b.ply").read_bytes(), "ply")["deviation"] == pytest.approx(values, abs=1e-6)
    assert mracad(*words, "--scalar", "deviation:b.step", "--depfile", "a.d").code == 3, "there is no such file"
    assert mracad(*words, "--scalar", "deviation:in.step", "--depfile", "a.d").code == 0
    assert (tmp_path / "a.d").read_text().startswith("a.ply a.step: in.step in.step\n")
