"""Offsets: closed forms on planes, cylinders, spheres and tori; seams that stay closed; edges that stay."""

import json

import numpy as np
import pytest
from mracad_cli.__main__ import main
from OCP.BRepPrimAPI import BRepPrimAPI_MakeBox, BRepPrimAPI_MakeSphere, BRepPrimAPI_MakeTorus

from mracad.bspline.surface import pairs
from mracad.edit.offset import offset
from mracad.errors import UsageError
from mracad.inspect.seams import seams
from mracad.occ.step import read_step
from mracad.occ.view import view
from mracad.seam.cause import Still
from mracad.spec.steps.smooth import OffsetFaces
from tests import zoo
from tests.edit import halves
from tests.edit.feature import grounds
from tests.edit.models import sheet
from tests.occ import shapes

DISTANCE = 2.0


def moved(model, **options):
    """The model offset by two millimetres."""
    return offset(model, OffsetFaces(distance="2mm", **options)).displacement.applied(model)


def points(model, count=50):
    net = model.surfaces[0].net
    return net.evaluate(pairs(*(np.linspace(*k.domain, count) for k in (net.u, net.v))))


def body(shape):
    return view(shapes.document(zoo.nurbs(shape)))


def test_a_plane_moves_as_a_whole():
    found = points(moved(sheet(grounds.uneven())))
    assert np.abs(found[:, 2] - DISTANCE).max() < 1e-12


@pytest.mark.parametrize("inward", [False, True])
def test_a_cylinder_gets_another_radius(inward):
    found = points(moved(sheet(grounds.cylinder(40.0, 120.0)), inward=inward))
    wanted = 40.0 - DISTANCE if inward else 40.0 + DISTANCE
    assert np.abs(np.hypot(found[:, 0], found[:, 2]) - wanted).max() < 1e-10


def test_a_sphere_gets_another_radius_poles_and_all():
    """By the seam along its meridian, too."""
    found = points(moved(body(BRepPrimAPI_MakeSphere(40.0).Shape())))
    assert np.abs(np.linalg.norm(found, axis=1) - 42.0).max() < 1e-10


def test_outward_is_where_the_face_looks():
    """The tube of a torus gets thicker outward and thinner inward."""
    torus = body(BRepPrimAPI_MakeTorus(40.0, 10.0).Shape())
    for inward, radius in ((False, 12.0), (True, 8.0)):
        x, y, z = points(moved(torus, inward=inward)).T
        assert np.abs(np.hypot(np.hypot(x, y) - 40.0, z) - radius).max() < 1e-10


def test_smooth_seams_stay_closed_and_smooth():
    """Three patches at a corner on a paraboloid: along parameter lines; knots are set where d n needs them."""
    before = view(grounds.rhombi(bend=0.004, spans=6))
    after = moved(before)
    for old, new in zip(seams(before), seams(after), strict=True):
        assert new.gap <= old.gap + 1e-9 and new.angle <= old.angle + 1e-6
    for one, two in zip(before.surfaces, after.surfaces, strict=True):
        uv = pairs(*[np.linspace(0.0, 1.0, 60)] * 2)
        wanted = one.net.evaluate(uv) + DISTANCE * one.net.normals(uv) * (-1 if before.faces[two.index].reversed else 1)
        assert np.abs(two.net.evaluate(uv) - wanted).max() < 1e-4 * DISTANCE


def test_a_trimmed_seam_stays_closed():
    after = moved(before := view(halves.document(*halves.quiet(0.0, (9, 17)), True)))
    (old,), (new,) = seams(before), seams(after)
    assert new.gap <= 1e-4 and new.angle <= old.angle + 0.01


def test_sharp_edges_stay_and_faces_fade_there():
    box = body(BRepPrimAPI_MakeBox(80.0, 90.0, 100.0).Shape())
    edit = offset(box, OffsetFaces(distance="1mm"))
    assert {t.reason.still for t in edit.edges} == {Still.SHARP}
    assert all(outcome.status == "edited" and 0.9 < outcome.moved < 1.1 for outcome in edit.outcomes)
    after = edit.displacement.applied(box)
    assert max(seam.gap for seam in seams(after)) < 1e-5


def test_what_is_held_stays():
    flat = sheet(grounds.uneven())
    edit = offset(flat, OffsetFaces(distance="2mm", edges="frozen"))
    net = edit.displacement.applied(flat).surfaces[0].net
    rim = net.evaluate(np.stack([np.linspace(*net.u.domain, 50), np.full(50, net.v.domain[0])], axis=1))
    assert np.abs(rim[:, 2]).max() < 1e-9
    assert abs(points(edit.displacement.applied(flat))[:, 2].max() - DISTANCE) < 1e-2


def test_what_is_too_narrow_to_reach_the_distance_is_left():
    """Sides of a box 50 mm wide would fade over 8 × 10 mm from each of their edges."""
    box = body(BRepPrimAPI_MakeBox(50.0, 50.0, 50.0).Shape())
    outcomes = offset(box, OffsetFaces(distance="10mm")).outcomes
    assert {each.words for each in outcomes} == {"can hardly move with its edges held"}


def test_what_would_fold_is_left():
    """A cylinder has no offset beyond its axis; less than was asked for is not done instead."""
    edit = offset(sheet(grounds.cylinder(40.0, 120.0)), OffsetFaces(distance="60mm", inward=True))
    (outcome,) = edit.outcomes
    assert outcome.status == "left" and not edit.displacement.offsets and "fold" in outcome.words


def test_what_bends_more_tightly_than_the_distance_is_left():
    """Rounded edges have no offset inward by more than their radius, whatever their seams allow; outward they have."""
    box = body(zoo.rounded_box().val().wrapped)
    edit = offset(box, OffsetFaces(distance="4.1mm", inward=True))
    folded = [outcome for outcome in edit.outcomes if outcome.words == "would fold: bends with radii down to 4 mm"]
    assert len(folded) == 20 and all(outcome.status == "left" for outcome in folded)
    assert len(offset(box, OffsetFaces(distance="4.1mm")).faces("edited")) == 26


def test_the_command_writes_what_is_asked_for(tmp_path):
    source, target, report = grounds.save(tmp_path / "in.step", grounds.uneven()), tmp_path / "out.step", tmp_path / "r"
    assert main(["offset", str(source), "-o", str(target), "--distance", "0.2cm", "--report", str(report)]) == 0
    found = points(view(read_step(target)))
    assert np.abs(found[:, 2] - DISTANCE).max() < 1e-9
    assert json.loads(report.read_text())["valid"]["after"]["valid"]


@pytest.mark.parametrize("distance", [None, "0mm", "-2mm", "nan", "two"])
def test_bad_distances_are_refused(distance):
    with pytest.raises(UsageError, match="distance"):
        OffsetFaces(distance=distance)


def test_a_distance_must_be_given(tmp_path, capsys):
    source = grounds.save(tmp_path / "in.step", grounds.uneven())
    assert main(["offset", str(source), "-o", str(tmp_path / "out.step")]) == 2
    assert "--distance" in capsys.readouterr().err and not (tmp_path / "out.step").exists()
