"""One face of a document is edited: everything that the document says beside that stays, read back by the kernel."""

import json

import numpy as np
import pytest

from mracad.model.displacement import Displacement, Offset
from mracad.model.region import face_region, supported
from mracad.occ.apply import apply
from mracad.occ.contents import contents
from mracad.occ.files import read
from mracad.occ.step import read_step, write_step
from mracad.occ.view import view
from tests.conftest import CORPUS

EXPECTED = {  # usages, products, colours, layers, annotations
    "as1_assembly_colours_occ": (13, 9, 5, 1, 0),
    "nist_ctc02_pmi_ap242": (2, 3, 2, 0, 162),
    "bracket_featuretype_inch_sw": (0, 1, 1, 0, 0),
    "impeller_shapr3d": (2, 3, 11, 0, 0),
}
MOVED = 1e-3


def inner(model, surface):
    """An offset of the control points that no edge depends on, in a refinement where there are such."""
    knots = [np.linspace(*k.domain, 14)[1:-1] for k in (surface.net.u, surface.net.v)]
    net = surface.net.refined(*knots)
    free = np.ones(net.poles.shape[:2], bool)
    for face in surface.faces:
        for crossed in face_region(net, model.faces[face]).crossed:
            free &= ~supported(net, crossed)
    return Offset(np.repeat(np.where(free, MOVED, 0.0)[..., None], 3, axis=2), *knots) if free.any() else None


def round_trip(source, target):
    """Edit one face, write, read back, compare; what the document says beside geometry."""
    document = read_step(source)
    model, before = view(document), contents(document)
    surface, offset = next((s, o) for s in model.surfaces for o in [inner(model, s)] if o is not None)
    apply(document, model, Displacement({surface.index: offset}))
    write_step(document, target)
    again = read_step(target)
    seen, after = view(again), contents(again)
    assert after == before
    for old, new in zip(model.faces, seen.faces, strict=True):
        for word in ("name", "product", "colour", "instances"):
            assert getattr(old, word) == getattr(new, word)
        # the kernel writes a torus that meets itself as a surface of revolution
        assert old.kind == new.kind or (old.kind, new.kind) == ("torus", "revolution")
    for old, new in zip(model.surfaces, seen.surfaces, strict=True):
        if old.index == surface.index:
            refined = offset.over(old.net)
            assert np.abs(new.net.poles - refined.poles).max() == pytest.approx(MOVED, rel=1e-6)
        else:
            assert np.abs(old.net.poles - new.net.poles).max() <= 1e-12 * model.diagonal
    return before


@pytest.mark.parametrize("name", ["assembly", "trimmed"])
def test_samples(samples, tmp_path, name):
    found = round_trip(samples / f"{name}.step", tmp_path / "out.step")
    assert (found.unit, found.usages, len(found.colours)) == (("in", 6, 4) if name == "assembly" else ("mm", 0, 0))


@pytest.mark.skipif(CORPUS is None, reason="MRACAD_CORPUS does not name a folder of STEP models")
@pytest.mark.parametrize("name", EXPECTED)
def test_real_models(tmp_path, name):
    found = round_trip(CORPUS / f"{name}.step", tmp_path / "out.step")
    layers = {layer for _, layer in found.layers}
    annotations = sum(found.annotations.values())
    assert (found.usages, len(found.products), len(found.colours), len(layers), annotations) == EXPECTED[name]


def test_one_edit_changes_every_instance(mracad, samples, tmp_path):
    out = tmp_path / "out.step"
    assert mracad("smooth", samples / "assembly.step", "--scale", "8mm", "-o", out).code == 0
    body = json.loads(mracad("compare", samples / "assembly.step", out, "--json").out)
    assert body["failed"] == ["deviation"]
    assert {face for finding in body["layers"][1]["findings"] for face in finding["faces"]} == {7}
    assert next(p for p in view(read_step(out)).faces if p.index == 6).instances == 4


def smoothed(mracad, samples, out, *words):
    return mracad("smooth", samples / "assembly.step", "--scale", "8mm", "-o", out, *words)


def test_one_instance_is_edited_alone(mracad, samples, tmp_path):
    out = tmp_path / "out.step"
    assert smoothed(mracad, samples, out, "--instance", "front pair/pad left").code == 0
    old, new = read(samples / "assembly.step"), read(out)
    before, after = contents(old), contents(new)
    assert after.tree == before.tree and after.layers == before.layers
    assert {(what, colour) for _, what, colour in after.colours} == {
        (what, colour) for _, what, colour in before.colours
    }
    pads = [part for part in new.parts if part.product == "pad"]
    assert sorted(len(part.placements) for part in pads) == [1, 3]
    nets = {len(part.placements): view(new).surfaces[i].net for i, part in enumerate(pads)}
    assert np.array_equal(nets[3].poles, view(old).surfaces[0].net.poles)
    assert np.abs(nets[1].poles - nets[3].over(nets[1].u, nets[1].v).poles).max() > 1e-3
    assert all(set(part.face_colours.values()) == {"#ff0000"} for part in pads)


def test_faces_of_an_instance_have_the_numbers_of_its_part(mracad, samples, tmp_path):
    words = ("--instance", "front pair/pad left", "--dry-run", "--json", "--faces")
    out = tmp_path / "out.step"
    edited = json.loads(smoothed(mracad, samples, out, *words, "#7").out)
    assert edited["counts"]["edited"] == 1 and edited["counts"].get("unselected", 0) == 1
    for other in ("!#7", "#1"):
        none = smoothed(mracad, samples, out, *words[:3], "--faces", other)
        assert none.code == 2 and "no selected face" in none.err
    steps = "smooth --scale 8mm --instance 'front pair/pad left' ! smooth --scale 9mm --faces #7 --instance"
    again = mracad("pipeline", f"{steps} 'front pair/pad left'", samples / "assembly.step", "-o", out)
    assert again.code == 0 and len([p for p in read(out).parts if p.product == "pad"]) == 2


@pytest.mark.parametrize(
    ("path", "says"), [("pad left", "2 instances"), ("nothing", "no instance"), ("front pair", "no instance")]
)
def test_an_instance_that_is_not_one(mracad, samples, tmp_path, path, says):
    result = smoothed(mracad, samples, tmp_path / "out.step", "--instance", path)
    assert result.code == 2 and says in result.err and "front pair/pad left" in result.err
    assert "  fixture/front pair/pad left" in mracad("info", samples / "assembly.step", "--all").out
