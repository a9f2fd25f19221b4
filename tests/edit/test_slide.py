"""Sharp edges that slide along a neighbour that stays."""

import dataclasses
import io
import json
import sys

import cadquery
import numpy as np
import pytest
from OCP.BRepGProp import BRepGProp
from OCP.GProp import GProp_GProps
from scipy.spatial import KDTree

import mracad as library
from mracad.bspline.closest import distances
from mracad.edit.denoise import denoise
from mracad.edit.fair import Filter, faired
from mracad.edit.pose import Scene
from mracad.edit.slid import settled
from mracad.edit.smooth import smooth
from mracad.edit.tolerances import Tolerances
from mracad.edit.trial import Trial
from mracad.edit.whole import wished
from mracad.inspect.seams import seams
from mracad.job.document import run
from mracad.job.look import looked_at
from mracad.model.cells import inside_grid
from mracad.model.facts import Failure
from mracad.occ.apply import apply, restore
from mracad.occ.check import check
from mracad.occ.files import read, write
from mracad.occ.rails import railed
from mracad.occ.view import view
from mracad.seam.interface import joints
from mracad.seam.wishes import Wishes
from mracad.spec.select import scope
from mracad.spec.steps.smooth import Denoise, Smooth
from samples.models import documents
from tests.edit import blocks
from tests.edit.models import sheet

SLIDE = Smooth(scale=blocks.SCALE, edges="slide")
CLEAN, NOISY = blocks.nets()
BAND = 8.0  # mm
NAMES = list(blocks.SHAPES)


@pytest.fixture(scope="module")
def made():
    """Each shape's document as it was, made once."""
    data = {}

    def make(name):
        if name not in data:
            stream = io.BytesIO()
            write(blocks.document(name, NOISY), stream, "brep")
            data[name] = stream.getvalue()
        stream = io.BytesIO(data[name])
        stream.name = f"{name}.brep"
        return read(stream)

    return make


def looked(document, options=SLIDE):
    return looked_at(document, options)[0]


def sculpted(model):
    """The NURBS face and its net."""
    face = next(face for face in model.faces if face.surface is not None)
    return face, model.surfaces[face.surface].net


def along(trim, count):
    """Parameters evenly along an edge."""
    return trim.curve.evaluate(np.linspace(*trim.curve.knots.domain, count))[0]


def volume(document):
    found = GProp_GProps()
    BRepGProp.VolumePropertiesGK_s(document.shape, found, 1e-5)
    return found.Mass()


def errors(model):
    """Root mean square of the height over the top without noise, in a band along the edges and inside."""
    face, net = sculpted(model)
    us, vs = (np.linspace(*knots.domain, 201) for knots in (net.u, net.v))
    points = net.grid(us, vs)[inside_grid(face, net, us, vs)]
    rim = net.evaluate(np.concatenate([along(trim, 400) for trim in face.trims]))
    beside = KDTree(rim).query(points)[0] < BAND
    off = points[:, 2] - CLEAN.evaluate(points[:, :2])[:, 2]
    return [float(np.sqrt((off[where] ** 2).mean())) for where in (beside, ~beside)]


def test_a_rim_in_planes_keeps_every_control_point_on_them(made):
    model = looked(made("block"))
    edit = smooth(model, SLIDE)
    (index,) = edit.displacement.offsets
    poles = edit.displacement.offsets[index].poles
    for axis in (0, 1):
        sides = np.take(poles, (0, -1), axis=axis)
        assert np.abs(sides[..., axis]).max() < 1e-12
        assert np.abs(sides).max() > 0.02
    corners = poles[:: len(poles) - 1, :: poles.shape[1] - 1]
    assert np.abs(corners[..., :2]).max() < 1e-12 and np.abs(corners[..., 2]).min() > 1e-4
    assert [each.how for each in edit.edges] == ["slid"] * 4 and not any(each.reason for each in edit.edges)


def off(model, net):
    """Largest distance of a top from its neighbours along their edges."""
    face, _ = sculpted(model)
    found = []
    for trim in face.trims:
        (beside,) = {side.face for side in model.edges[trim.edge].sides} - {face.index}
        found.append(np.abs(model.rails.grounds[beside].off(net.evaluate(along(trim, 333)))[0]).max())
    return max(found)


@pytest.mark.parametrize("name", NAMES)
def test_edges_stay_on_their_neighbours(made, name):
    model = looked(made(name))
    edit = smooth(model, SLIDE)
    assert {each.how for each in edit.edges} == {"slid"}
    after = edit.displacement.applied(model)
    assert off(model, sculpted(after)[1]) <= Tolerances().gap / 2
    for each in seams(after):
        assert each.gap <= Tolerances().gap / 2


@pytest.mark.parametrize("name", ["sphere", "cone"])
def test_newton_steps_bring_edges_back_onto_curved_neighbours(made, name):
    model, wish = looked(made(name)), Filter(float(blocks.SCALE.removesuffix("mm")))
    chosen = scope(model, SLIDE)
    every = chosen.movable(model)
    result = faired(model, every, wish, wished(model, SLIDE, chosen), Tolerances())
    onto, failed = settled(Scene(model, result.sheets, result.joints, Tolerances()), result)
    before, after = (off(model, sculpted(each.displacement().applied(model))[1]) for each in (result, onto))
    assert after < 0.3 * before and not failed


@pytest.mark.parametrize("name", ["block", "boss", "cone", "rounded"])
def test_rims_get_as_smooth_as_the_inside(made, name):
    model = looked(made(name))
    rim, inside = errors(smooth(model, SLIDE).displacement.applied(model))
    held, _ = errors(smooth(model, Smooth(scale=blocks.SCALE)).displacement.applied(model))
    print(f"{name}: rim {rim:.4f}, held {held:.4f}, inside {inside:.4f}")
    assert rim <= 1.3 * inside and rim < 0.93 * held


def test_denoised_rims_get_as_smooth_as_the_inside():
    """What is left of noise is noise: single rims are 1.1 to 1.5 times as far off as the inside."""
    found = []
    for name in ("block", "boss", "cone"):
        for seed in range(1, 4):
            model = looked(blocks.document(name, blocks.nets(seed=seed)[1]), Denoise())
            edit = denoise(model, Denoise())
            assert {each.how for each in edit.edges} == {"slid"}
            found.append(errors(edit.displacement.applied(model)))
            print(f"{name}, seed {seed}: rim {found[-1][0]:.4f}, inside {found[-1][1]:.4f}")
    rim, inside = np.sqrt(np.mean(np.square(found), axis=0))
    assert rim <= 1.3 * inside


@pytest.mark.parametrize(
    ("name", "words"),
    [(name, ("smooth", "--scale", blocks.SCALE, "--edges", "slide")) for name in NAMES]
    + [(name, ("denoise",)) for name in ("block", "boss", "cone")],
)
def test_solids_stay_valid_as_read_back(made, tmp_path, mracad, name, words):
    document = made(name)
    source, target = tmp_path / "in.step", tmp_path / "out.step"
    documents.write(document, source)
    found = mracad(words[0], source, "-o", target, *words[1:], "--json")
    assert found.code == 0, found.err
    report = json.loads(found.out)
    assert {each["how"] for each in report["edges"]} == {"slid"}
    before, after = read(source), read(target)
    verdict = check(after)
    assert verdict.valid and verdict.solids == 1 and verdict.edge_tolerance <= Tolerances().gap / 2
    kinds = [[face.kind for face in view(each).faces] for each in (before, after)]
    assert kinds[0] == kinds[1]
    if name in ("block", "boss", "cone"):
        assert abs(volume(after) / volume(before) - 1) < 1e-4
    for old, new in zip(*(railed(each, view(each)).rails.grounds.values() for each in (before, after)), strict=True):
        assert np.array_equal(old.frame, new.frame)
        assert (old.radius, old.minor, old.slope) == (new.radius, new.minor, new.slope)


def test_edges_slide_along_a_nurbs_face_that_stays(tmp_path, mracad):
    source, target = tmp_path / "in.step", tmp_path / "out.step"
    documents.write(blocks.walled(NOISY), source)
    model = looked(read(source))
    top, wall = (face.index for face in model.faces if face.surface is not None)
    found = mracad("smooth", source, "-o", target, "--scale", blocks.SCALE, "--edges", "slide", "--json")
    assert found.code == 0, found.err
    ways = {tuple(sorted(each["faces"])): each["how"] for each in json.loads(found.out)["edges"]}
    assert ways[top + 1, wall + 1] == "slid"
    after = view(read(target))
    nets = [each.surfaces[each.faces[wall].surface].net for each in (model, after)]
    assert np.array_equal(nets[0].poles, nets[1].poles)
    (edge,) = (each for each in after.edges if {side.face for side in each.sides} == {top, wall})
    (old,) = (each for each in model.edges if {side.face for side in each.sides} == {top, wall})
    assert np.abs(edge.points - old.points).max() > 0.02
    assert distances(nets[1], edge.points).max() < Tolerances().gap and edge.tolerance < Tolerances().gap
    assert check(read(target)).valid


def test_seams_that_move_end_where_their_edges_slid(tmp_path, mracad):
    document = documents.single(blocks.block(*blocks.halves(NOISY)).wrapped, "halves")
    source, target = tmp_path / "in.step", tmp_path / "out.step"
    documents.write(document, source)
    found = mracad("smooth", source, "-o", target, "--scale", blocks.SCALE, "--edges", "slide", "--json")
    assert found.code == 0, found.err
    ways = sorted(each["how"] for each in json.loads(found.out)["edges"])
    assert ways == ["coupled"] + ["slid"] * 6
    after = read(target)
    assert check(after).valid and check(after).edge_tolerance < 1e-6
    before, now = (next(e for e in view(read(f)).edges if len(e.sides) == 2 and e.sides[0].uv is not None
                        and e.sides[1].uv is not None) for f in (source, target))  # fmt: skip
    assert np.abs(before.points - now.points)[[0, -1]].max() > 1e-3


def test_edges_of_a_solid_that_was_moved_slide():
    place = cadquery.Location(cadquery.Vector(20, -30, 12), cadquery.Vector(1, 2, 3), 40)
    beside = cadquery.Solid.makeBox(5, 5, 5).moved(cadquery.Location(cadquery.Vector(300, 0, 0)))
    both = cadquery.Compound.makeCompound([blocks.block(NOISY).moved(place), beside])
    document = documents.single(both.wrapped, "moved")
    assert not np.allclose(sculpted(view(document))[0].frame, np.eye(4))
    report = run(document, smooth, SLIDE)
    assert {each.how for each in report.edit.edges} == {"slid"}
    assert max(each.gap for each in report.after) < 1e-9
    verdict = check(document)
    assert verdict.valid and verdict.edge_tolerance < 1e-6


def test_an_edge_stays_where_that_does_more(made, monkeypatch):
    """The judge is made to allow nothing that slides."""
    model = looked(made("block"))
    real = Trial.judged

    def strict(trial, *given, **more):
        verdict = real(trial, *given, **more)
        return trial.nothing() if trial.pose.led is not None else verdict

    monkeypatch.setattr(Trial, "judged", strict)
    edit = smooth(model, SLIDE)
    assert edit.outcomes[0].status == "edited"
    assert {(each.how, str(each.reason)) for each in edit.edges} == {("frozen", "plane neighbour")}
    held = smooth(model, Smooth(scale=blocks.SCALE)).displacement.offsets[0].poles
    assert np.array_equal(edit.displacement.offsets[0].poles, held)


def test_denoising_slides_as_if_the_rim_were_free(made):
    model = looked(made("block"), Denoise())
    rim, _ = errors(denoise(model, Denoise()).displacement.applied(model))
    free, _ = errors(denoise(sheet(NOISY), Denoise(free_edges="smooth")).displacement.applied(sheet(NOISY)))
    assert rim <= 1.05 * free


def test_the_library_slides_like_the_command(tmp_path, mracad):
    source, target = tmp_path / "in.step", tmp_path / "out.step"
    documents.write(blocks.document("cone", blocks.nets(16)[1]), source)
    assert mracad("denoise", source, "--noise", "0.05mm", "-o", target).code == 0
    model = library.snapshot(library.read(source))
    edit = denoise(model, Denoise(noise="0.05mm"))
    assert {each.how for each in edit.edges} == {"slid"}
    poles = [sculpted(each)[1].poles for each in (edit.displacement.applied(model), view(read(target)))]
    assert np.array_equal(*poles)


def test_edges_and_faces_that_are_held_do_not_slide(made):
    for hold in ("edge#2", "#2"):
        options = Smooth(scale=blocks.SCALE, edges="slide", hold=(hold,))
        model = looked(made("block"), options)
        edit = smooth(model, options)
        still = [each for each in edit.edges if each.how == "frozen"]
        assert still and all(each.reason for each in still)
        face, net = sculpted(model)
        for each in still:
            trim = next(trim for trim in face.trims if trim.edge == each.edge)
            uv = along(trim, 50)
            assert np.abs(edit.displacement.offsets[0].motion(net).evaluate(uv)).max() < 1e-12
        assert sum(each.how == "slid" for each in edit.edges) == 4 - len(still)


def test_an_edge_that_cannot_slide_within_the_tolerance_stays_and_says_so(made):
    report = run(made("torus"), smooth, Smooth(scale=blocks.SCALE, edges="slide", gap_tolerance="1e-9mm"))
    assert {each.how for each in report.edit.edges} == {"frozen"}
    assert {str(each.reason) for each in report.edit.edges} == {"could not slide along its torus neighbour"}
    assert report.valid_after.valid


def test_an_edge_that_would_spoil_its_neighbour_stays(made, monkeypatch):
    """The kernel is made to object to one side whenever it is looked at alone with the top."""
    real = sys.modules["mracad.occ.check"].check

    def picky(document, faces=None, distances=False):
        verdict = real(document, faces, distances)
        if faces is not None and 3 in set(faces):
            return dataclasses.replace(verdict, valid=False, failures=(Failure("face", "UnorientableShape", 3),))
        return verdict

    monkeypatch.setattr(sys.modules["mracad.occ.check"], "check", picky)
    report = run(made("block"), smooth, SLIDE)
    beside = [each for each in report.edit.edges if 3 in each.faces]
    assert [str(each.reason) for each in beside] == ["could not slide along its plane neighbour"]
    assert report.edit.outcomes[0].status == "edited" and report.valid_after.valid


def test_smooth_edges_to_an_analytic_neighbour_stay():
    """Rounded corners of a block are tangent to its flat sides, and meet its top and bottom in sharp edges."""
    solid = cadquery.Workplane().box(60, 60, 60).edges("|Z").fillet(15).val().wrapped
    document = documents.single(solid, "rounded")
    model = looked(document, Smooth(scale="10mm", edges="slide", faces=("type:cylinder",)))
    movable = {face.index for face in model.faces if face.surface is not None}
    found = joints(model, movable, Wishes(slide=frozenset(range(len(model.edges)))))
    assert len(found.slides) == 8 and len(found.frozen) == 8
    for slide in found.slides:
        assert np.abs(model.edges[slide.edge].tangents[:, 2]).max() < 1e-9
    assert {str(why) for why in found.frozen.values()} == {"plane neighbour"}


def test_restore_undoes_edges_that_slid(made):
    for name in ("boss", "rounded"):
        document = made(name)
        before = io.BytesIO()
        write(document, before, "brep")
        model = looked(document)
        moved = smooth(model, SLIDE).displacement
        apply_and_back = apply(document, model, moved)
        changed = io.BytesIO()
        write(document, changed, "brep")
        restore(document, model, moved, apply_and_back)
        after = io.BytesIO()
        write(document, after, "brep")
        assert changed.getvalue() != before.getvalue()
        assert view(document).surfaces[0].net.poles.tobytes() == model.surfaces[0].net.poles.tobytes()
        for old, new in zip(model.edges, view(document).edges, strict=True):
            assert np.abs(old.points - new.points).max() < 1e-12
            assert old.tolerance == new.tolerance
        assert check(document).valid
