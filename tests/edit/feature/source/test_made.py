"""Features from sources, put on models from the command line and from Python."""

import json

import numpy as np
import pytest
from mracad_cli.__main__ import main
from PIL import Image

from mracad.edit.feature.edits import repeat
from mracad.edit.feature.extract import feature_of
from mracad.occ.step import write_step
from mracad.spec.steps import Repeat, Single
from tests.edit.feature import grounds
from tests.edit.models import sheet

FORMULA = "formula:'0.3*exp(-(x*x+y*y)/8)',radius:9mm"


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A sheet on a sphere, three rhombi, and a logo with soft edges, white on black."""
    place = tmp_path_factory.mktemp("made")
    grounds.save(place / "ball.step", grounds.above("sphere 60", lambda a, b: 0 * a, 25.0, 16))
    write_step(grounds.rhombi(25.0, 6, 0.01), place / "three.step")
    x, y = np.meshgrid(*2 * [np.linspace(-1, 1, 256)])
    levels = 0.5 - 0.5 * np.tanh((np.maximum(np.abs(x), np.abs(y) * 1.5) - 0.55) / 0.06)
    Image.fromarray(np.round(65535 * levels).astype(np.uint16)).save(place / "logo.png")
    return place


def run(*words, code=0):
    assert main([str(word) for word in words]) == code


def test_a_formula_stands_as_high_as_it_says_on_a_sphere(folder):
    net = grounds.above("sphere 60", lambda a, b: 0 * a, 25.0, 16)
    edit = repeat(sheet(net), Repeat(feature=FORMULA, at=("0,0,60",)))
    after = edit.displacement.applied(sheet(net)).surfaces[0].net
    points = np.asarray(after.grid(*(np.linspace(*k.domain, 150) for k in (after.u, after.v)))).reshape(-1, 3)
    radius = np.linalg.norm(points, axis=1)
    s = 60 * np.arccos(points[:, 2] / radius)
    assert np.abs(radius - 60 - 0.3 * np.exp(-(s**2) / 8)).max() < 3e-3 * 0.3
    assert edit.copies[0].deviation < 2e-3 * 0.3


def test_sharp_edges_are_held_all_along_them_and_ring_nowhere(folder):
    x, y = np.meshgrid(*2 * [np.linspace(-7, 7, 400)])
    levels = ((np.hypot(x, y) < 5) & (np.hypot(x - 1, y) > 2)).astype(np.uint8)
    Image.fromarray(255 * levels).save(folder / "sharp.png")
    source = f"{folder / 'sharp.png'},width:14mm,height:0.3mm,spacing:0.1mm"
    model = sheet(grounds.above("sphere 60", lambda a, b: 0 * a, 25.0, 16))
    edit = repeat(model, Repeat(feature=source, at=("0,0,60",)))
    after = edit.displacement.applied(model).surfaces[0].net
    at = [np.random.default_rng(axis).uniform(-6.5, 6.5, 700) for axis in (0, 1)]
    points = np.asarray(after.grid(*(np.sort(x) for x in at))).reshape(-1, 3)
    radius = np.linalg.norm(points, axis=1)
    away = 60 * np.arccos(points[:, 2] / radius) / np.hypot(*points[:, :2].T)
    ideal = feature_of(model, Single(feature=source), {0}, source).lookup(away[:, None] * points[:, :2])[:, 2]
    error = (radius - 60 - ideal) / 0.3
    assert np.abs(error).max() < 0.045 and np.sqrt(np.mean(error**2)) < 0.005
    assert (radius - 60).min() / 0.3 > -0.01 and (radius - 60).max() < 1.01 * 0.3


def test_a_logo_goes_over_the_seams_of_three_patches_with_points_under_it_alone(folder, tmp_path):
    source = f"{folder / 'logo.png'},width:14mm,height:0.3mm"
    run("repeat", folder / "three.step", "--feature", source, "--at", "0,0,0", "-o", tmp_path / "a.step",
        "--report", tmp_path / "a.json")  # fmt: skip
    body = json.loads((tmp_path / "a.json").read_text())
    copy = body["copies"][0]
    assert len(copy["faces"]) == 3 and copy["deviation"] < 0.01 * 0.3 and copy["rms"] < 0.002 * 0.3
    assert body["valid"]["after"]["valid"] and sum(edge["how"] != "frozen" for edge in body["edges"]) == 3
    from mracad.occ.step import read_step
    from mracad.occ.view import view

    for surface in view(read_step(tmp_path / "a.step")).surfaces:
        points = surface.net.poles[..., :2]
        far = np.abs(points).max(axis=2) > 18.0
        assert 0 < far.sum() < 0.25 * far.size


def test_a_feature_file_is_the_same_as_its_source(folder, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    run("feature", "make", FORMULA, "-o", "f.feature")
    for name, feature in (("a", FORMULA), ("b", "f.feature")):
        run("repeat", folder / "ball.step", "--feature", feature, "--at", "0,0,60", "-o", f"{name}.brep")
    one, two = ((tmp_path / f"{name}.brep").stat().st_size for name in "ab")
    assert abs(one - two) < 0.01 * one


def test_images_are_told_by_their_sides_and_discs_by_their_diameter(folder, tmp_path, capfd, monkeypatch):
    monkeypatch.chdir(tmp_path)
    np.save("wide.npy", np.add.outer(np.hanning(20), np.hanning(40)))
    run("feature", "make", "wide.npy,width:40mm,height:1mm", "-o", "a.feature")
    run("feature", "make", "formula:0.2*cos(x)*cos(y),radius:3mm", "-o", "b.feature")
    image, *_, disc = [line for line in capfd.readouterr().out.splitlines() if "across" in line]
    assert ", 40 × 20 mm across, " in image and ", 7.5 mm across, " in disc


def test_recipes_and_transfers_take_sources_and_find_files_beside_them(folder, tmp_path, monkeypatch):
    recipe = folder / "logo.toml"
    recipe.write_text('[[step]]\nuse = "repeat"\nfeature = "logo.png,width:14mm,height:0.3mm"\nat = ["0,0,60"]\n')
    monkeypatch.chdir(folder)
    run("run", recipe, "ball.step", "-o", tmp_path / "a.brep")
    run("transfer", "ball.step", "ball.step", "--from", "logo.png,width:14mm,height:0.3mm", "--to", "0,0,60",
        "-o", tmp_path / "b.brep")  # fmt: skip
    assert (tmp_path / "a.brep").read_bytes() == (tmp_path / "b.brep").read_bytes()


@pytest.mark.parametrize(
    ("source", "code"),
    [
        ("none.png,width:3mm,height:1mm", 3),
        ("none.svg,height:1mm", 3),
        ("ball.png,width:3mm", 2),
        ("texture:snow,width:3,height:1", 2),
        ("formula:q,radius:3mm", 2),
        ("formula:0*x,radius:3mm", 4),
        ("formula:x,radius:500mm", 4),
    ],
)
def test_a_bad_source_writes_nothing_and_says_why_in_one_line(folder, tmp_path, source, code, capfd, monkeypatch):
    monkeypatch.chdir(tmp_path)
    run("repeat", folder / "ball.step", "--feature", source, "--at", "0,0,60", "-o", "a.step", code=code)
    if "500mm" not in source:
        run("feature", "make", source, "-o", "a.feature", code=code)
    said = capfd.readouterr()
    assert not said.out and all(line.startswith("mracad: ") for line in said.err.splitlines())
    assert not list(tmp_path.iterdir())
