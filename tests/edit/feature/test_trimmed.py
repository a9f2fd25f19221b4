"""Copies over a seam along a trim curve, whose two sides have no spline space in common."""

import io
from dataclasses import replace

import numpy as np
import pytest

from mracad.bspline.fit import curve_through
from mracad.edit.feature.edits import move, repeat
from mracad.errors import EditError
from mracad.inspect.seams import seams
from mracad.job.document import run
from mracad.model.displacement import Displacement, Offset
from mracad.occ.step import read_step, write_step
from mracad.occ.view import view
from mracad.seam.cause import Cause, Still
from mracad.seam.interface import joints
from mracad.seam.wishes import Wishes
from mracad.spec.steps import Move, Repeat
from samples.models import documents, geometry
from tests.edit import halves, panels
from tests.edit.feature.grounds import HEIGHT, bump
from tests.occ import shapes


def document(sewn=True):
    """Two halves of one smooth surface that meet along a wavy trim curve, the nets askew to each other."""
    return halves.document(*halves.quiet(0.0, (9, 17)), sewn)


def height(x, y):
    p, q = x / halves.SIZE, y / halves.SIZE
    return 40 * (p**3 - 2 * p * q * q + q * q - p * p)


def on_seam(y, beside=0.0):
    x = float(halves.waist(y)) + beside
    return np.array([x, y, height(x, y)])


def word(point):
    return ",".join(repr(float(x)) for x in point)


def read_back(document):
    stream = io.BytesIO()
    write_step(document, stream)
    return view(read_step(io.BytesIO(stream.getvalue())))


def how(report):
    return next((t.how, t.reason) for t in report.edit.edges if len(t.faces) == 2)


def visible(count=400):
    """Parameters of points of each half, up to the seam."""
    x, y = (z.ravel() for z in np.meshgrid(np.linspace(60, 150, count), np.linspace(20, 180, count)))
    left = x < halves.waist(y)
    return np.stack([x, y], axis=1)[left], np.stack([x - halves.SHEAR * y, y], axis=1)[~left]


@pytest.mark.parametrize(
    "place", [on_seam(100.0), on_seam(60.0, -8.0), on_seam(120.0, 5.0)], ids=["on", "left", "right"]
)
def test_a_copy_lies_over_a_trimmed_seam(feature, place):
    paper = document()
    before = view(paper)
    report = run(paper, repeat, Repeat(feature=feature, at=(word(place),)))
    after = read_back(paper)
    assert report.valid_after.valid and how(report) == ("to tolerance", None)
    (copy,) = report.edit.copies
    (old,), (new,) = seams(before), seams(after)
    print(f"gap {new.gap:.1e} mm, angle {new.angle:.1e}°, off by {copy.deviation:.1e} mm, lost {copy.lost:.1e} mm")
    assert new.gap <= 1e-4 and new.angle <= old.angle + 0.008
    assert len(copy.faces) == 2 and copy.deviation <= 1e-3 * HEIGHT
    for one, two, uv in zip(before.surfaces, after.surfaces, visible(), strict=True):
        points, su, sv = one.net.evaluate(uv, 1)
        normal = np.cross(su, sv)
        normal /= np.linalg.norm(normal, axis=1, keepdims=True)
        # chords for geodesics: the ground's radius is above 500 mm
        wanted = bump(np.linalg.norm(points - place, axis=1))[:, None] * normal
        assert np.abs(two.net.evaluate(uv) - points - wanted).max() <= 2e-3 * HEIGHT


def test_a_feature_is_moved_off_a_trimmed_seam(feature):
    """What it leaves is the ground that was there before it."""
    paper = document()
    before = view(paper)
    run(paper, repeat, Repeat(feature=feature, at=(word(on_seam(100.0)),)))
    top = on_seam(100.0) + np.array([0, 0, HEIGHT])
    report = run(paper, move, Move(feature=f"near:{word(top)},radius:20", to=word(on_seam(100.0, -45.0))))
    after = read_back(paper)
    (new,) = seams(after)
    assert how(report) == ("to tolerance", None) and new.gap <= 1e-4 and new.angle <= 0.012
    for one, two, uv in zip(before.surfaces, after.surfaces, visible(), strict=True):
        points = one.net.evaluate(uv)
        near = np.linalg.norm(points - on_seam(100.0), axis=1) < 16
        left = np.abs(two.net.evaluate(uv) - points)[near].max()
        print(f"left {left:.1e} mm of {HEIGHT} mm")
        assert left <= 5e-3 * HEIGHT


@pytest.mark.parametrize("options", [{"edges": "frozen"}, {"hold": ("edge#2",)}], ids=["frozen", "held"])
def test_a_seam_that_may_not_move_takes_its_part(feature, options):
    place = word(on_seam(100.0, 10.0))
    with pytest.raises(EditError, match="stay in place cut off"):
        run(document(), repeat, Repeat(feature=feature, at=(place,), **options))
    paper = document()
    line = next(edge for edge in view(paper).edges if len(edge.sides) == 2)
    assert line.index == 1
    report = run(paper, repeat, Repeat(feature=feature, at=(place,), clip=True, **options))
    again = next(edge for edge in read_back(paper).edges if len(edge.sides) == 2)
    assert report.edit.copies[0].lost > 0.1 * HEIGHT
    assert np.abs(again.points - line.points).max() < 1e-9


def test_a_copy_lies_over_a_trimmed_seam_that_is_not_sewn(feature):
    """Both edges move, which run opposite ways at different paces; they still coincide in the file."""
    paper = document(sewn=False)
    (old,) = seams(view(paper))
    report = run(paper, repeat, Repeat(feature=feature, at=(word(on_seam(100.0, 3.0)),)))
    (new,) = seams(read_back(paper))
    assert [t.how for t in report.edit.edges if t.how != "frozen"] == ["to tolerance"] * 2
    (copy,) = report.edit.copies
    print(f"gap {old.gap:.1e} -> {new.gap:.1e} mm, angle {new.angle:.1e}°, off by {copy.deviation:.1e} mm")
    assert new.gap <= old.gap + 1e-5 and new.angle <= old.angle + 0.008
    assert copy.deviation <= 1e-3 * HEIGHT and copy.lost <= 1e-3 * HEIGHT


@pytest.mark.parametrize("place", [(102.0, 98.0), (97.0, 60.0)], ids=["corner", "beside"])
def test_a_copy_lies_over_a_junction_of_one_edge_with_two_that_are_not_sewn(feature, place):
    clean, _ = panels.whole(16, 0.0, patches=(2, 2))
    nets = panels.thirds(clean).values()
    faces = [shapes.face_on(geometry.surface(net.poles, net.u.knots, net.v.knots, (3, 3))) for net in nets]
    paper = documents.single(shapes.compound(*faces), "junction")
    at = word(clean.evaluate(np.array([place]))[0])
    report = run(paper, repeat, Repeat(feature=feature, at=(at,)))
    (copy,), new = report.edit.copies, seams(read_back(paper))
    assert [t.how for t in report.edit.edges].count("to tolerance") == (3 if len(copy.faces) == 3 else 2)
    assert copy.deviation <= 3e-3 * HEIGHT
    print(f"gap {max(m.gap for m in new):.1e} mm, off by {copy.deviation:.1e} mm")
    assert len(new) >= 3 and max(m.gap for m in new) <= 1e-4 and max(m.angle for m in new) <= 0.01


def test_points_that_correspond_are_nearest_not_at_equal_fractions(feature):
    """The curve of one face runs up to 0.05 mm ahead of the other's along the seam, which a copy tilts by half."""
    paper = document()
    model = view(paper)
    (edge,) = (e for e in model.edges if len(e.sides) == 2)
    ahead = edge.sides[1].face
    trim = model.faces[ahead].trim(edge.index)
    share = trim.curve.knots.greville() / halves.SIZE
    poles = trim.curve.evaluate(halves.SIZE * (share + 1e-3 * share * (1 - share)))[0]
    hurried = replace(trim, curve=curve_through(trim.curve.knots, poles))
    faces = [
        replace(f, trims=tuple(hurried if t is trim else t for t in f.trims)) if f.index == ahead else f
        for f in model.faces
    ]
    skewed = replace(model, faces=tuple(faces))
    edit = repeat(skewed, Repeat(feature=feature, at=(word(on_seam(100.0, 3.0)),)))
    assert [t.how for t in edit.edges if len(t.faces) == 2] == ["to tolerance"]
    assert edit.copies[0].deviation <= 1e-3 * HEIGHT


def test_a_seam_is_no_worse_than_itself_on_finer_nets():
    """It is looked at in more places there, where the input may be wider open than where it was measured."""
    _, *nets = halves.surfaces(0.2, (8, 16))
    before = view(halves.document(*nets))
    (seam,) = joints(before, {0, 1}, Wishes("g1")).loose
    still = {}
    for surface in before.surfaces:
        u, v = surface.net.u, surface.net.v
        finer = (np.linspace(*k.domain, 152)[1:-1] for k in (u, v))
        still[surface.index] = Offset(np.zeros((u.count + 150, v.count + 150, 3)), *finer)
    after = Displacement(still).applied(before)
    assert seam.excess(before, after, (1e-9, 0.0, 0.0), (1e-9, 1e-9, 1e-9))[1].max() <= 1.0


def test_edges_beyond_which_no_copy_lies_are_told_as_such(feature):
    report = run(document(), repeat, Repeat(feature=feature, at=(word(on_seam(100.0, -45.0)),)))
    assert how(report) == ("frozen", Cause(Still.BARE))
