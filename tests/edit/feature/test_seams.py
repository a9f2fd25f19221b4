"""Copies over seams: what takes part, where knots go, and what is left as it was."""

import io

import numpy as np
import pytest
from OCP.BRepPrimAPI import BRepPrimAPI_MakeBox

from mracad.bspline.fit import interpolated
from mracad.bspline.knots import KnotVector
from mracad.bspline.surface import Net
from mracad.edit.feature import taken
from mracad.edit.feature.edits import repeat
from mracad.edit.feature.seams import crossing
from mracad.errors import EditError
from mracad.inspect.seams import seams
from mracad.job.document import run
from mracad.occ.step import read_step, write_step
from mracad.occ.view import view
from mracad.seam.border import Border
from mracad.seam.joint import Joint
from mracad.seam.law import NONE, constant
from mracad.seam.natural import Seam
from mracad.spec.steps import Repeat
from tests import zoo
from tests.edit import panels
from tests.edit.feature import grounds
from tests.edit.feature.grounds import HEIGHT, SIGMA, bump
from tests.edit.models import sheet
from tests.occ import shapes


def panel(more=()):
    """Two sewn patches of 1 mm spans, the second with more knots along their seam x = 100."""
    clean, _ = panels.whole(100, 0.0, patches=(2, 1))
    patches = panels.cut(clean, (2, 1))
    patches[1, 0] = panels.refined(patches[1, 0], v_knots=more)
    return view(panels.document(patches))


def at(*places):
    return tuple(f"{x},{y},{float(panels.truth(x, y))!r}" for x, y in places)


def test_only_control_points_beside_the_seam_differ_from_the_ideal(feature):
    """Those of a copy beyond them are the same as if it lay there alone, bit for bit."""
    model = panel()
    coupled, frozen = (
        repeat(model, Repeat(feature=feature, at=at((95, 40.3)), edges=edges, clip=True))
        for edges in ("coupled", "frozen")
    )
    assert [t.how for t in coupled.edges if len(t.faces) == 2] == ["coupled"]
    for index, rows in ((0, slice(-8, None)), (1, slice(0, 8))):
        one, two = (each.displacement.offsets[index].poles for each in (coupled, frozen))
        assert one.shape == two.shape == model.surfaces[index].net.poles.shape
        differ = np.flatnonzero((one != two).any(axis=(1, 2)))
        assert len(differ) and set(differ) <= set(np.arange(len(one))[rows])
        assert (one != 0).any(axis=(1, 2)).sum() > 12


def test_knots_are_matched_only_under_copies(feature):
    """One side has twice the knots along the seam; the other gets them under each of two copies, not between them."""
    twice = np.arange(100) + 0.5
    model = panel(twice)
    edit = repeat(model, Repeat(feature=feature, at=at((100, 22), (100, 79)), size=0.4))
    matched = np.intersect1d(edit.displacement.offsets[0].v_knots, twice)
    # ten spans and a half of a copy, seven of functions that reach beyond it
    assert set(twice[(np.abs(twice[:, None] - [22, 79]) < 10).any(axis=1)]) <= set(matched)
    assert (np.abs(matched[:, None] - [22, 79]).min(axis=1) < 18).all()
    assert max(copy.deviation for copy in edit.copies) <= 1e-3 * HEIGHT


def test_stretches_hold_the_supports_of_what_moves():
    k = KnotVector.clamped(np.linspace(0, 1, 31), 3)
    x, y = np.meshgrid(k.greville(), k.greville(), indexing="ij")
    nets = {i: Net(k, k, np.stack([x + i, y, 0 * x], axis=-1)) for i in (0, 1)}
    sides = Border(0, 0, 0, 1.0, "left", 0.0, 1.0), Border(1, 1, 0, 0.0, "right", 1.0, 0.0)
    seam = Seam(0, 0, *sides, Joint(1, constant(1.0), NONE), 0.0, 0.0)
    moved = {i: np.zeros((33, 33), bool) for i in (0, 1)}
    moved[0][-1, 16] = True
    found = crossing(seam, nets, moved)
    # its support is between knots 13 and 17, that of the functions up to three away between 10 and 20
    assert np.allclose(found.stretches, [(10 / 30, 20 / 30)])
    assert np.allclose(list(found.rests()), [(0, 10 / 30), (20 / 30, 1)])
    moved[1][0, 0] = True
    assert np.allclose(crossing(seam, nets, moved).stretches, [(10 / 30, 20 / 30), (26 / 30, 1)])
    moved[0][:, 16] = False
    moved[0][3, 16] = True
    assert np.allclose(crossing(seam, nets, moved).stretches, [(26 / 30, 1)])


@pytest.mark.parametrize("axis", [0, 1])
def test_a_copy_on_a_ruled_face_is_smooth(feature, axis):
    """Of degree 1 in one direction; the closed form, and no kinks."""
    line, curve = KnotVector.clamped([0.0, 1.0], 1), KnotVector.clamped(np.linspace(0, 1, 5), 3)
    u, v = (line, curve)[:: 1 - 2 * axis]
    x, y = np.meshgrid(120 * u.greville(), 120 * v.greville(), indexing="ij")
    flat = sheet(Net(u, v, np.stack([x, y, 0 * x], axis=-1)))
    edit = repeat(flat, Repeat(feature=feature, at=("61.3,58.8,0",)))
    assert edit.copies[0].deviation <= 1e-3 * HEIGHT
    net = edit.displacement.applied(flat).surfaces[0].net
    places = np.stack(np.meshgrid(np.linspace(0.2, 0.8, 400), np.linspace(0.2, 0.8, 400), indexing="ij"), -1)
    points, su, sv = net.evaluate(places.reshape(-1, 2), 1)
    wanted = bump(np.hypot(points[:, 0] - 61.3, points[:, 1] - 58.8))
    assert np.abs(points[:, 2] - wanted).max() <= 1e-3 * HEIGHT
    slopes = np.stack([points[:, 0] - 61.3, points[:, 1] - 58.8], axis=1) * (-wanted / SIGMA**2)[:, None]
    found = np.stack([su[:, 2] / su[:, 0], sv[:, 2] / sv[:, 1]], axis=1)
    print(f"slopes off by {np.abs(found - slopes).max():.1e} of {np.abs(slopes).max():.2f}")
    assert np.abs(found - slopes).max() <= 5e-3 * np.abs(slopes).max()


@pytest.mark.parametrize("degrees", [(2, 2), (1, 2)])
def test_low_degrees_are_raised_exactly_where_copies_need_knots(feature, degrees):
    """A bump on a face of degree 2 has no jumps of curvature at its knots, and the face below it is what it was."""
    u, v = (KnotVector.clamped([0.0, 0.3, 1.0] if d > 1 else [0.0, 1.0], d) for d in degrees)
    x, y = np.meshgrid(120 * u.greville(), 120 * v.greville(), indexing="ij")
    bent = sheet(Net(u, v, np.stack([x, y, 3e-3 * y**2 - 2e-3 * x], axis=-1)))
    edit = repeat(bent, Repeat(feature=feature, at=("61.3,58.8,10",)))
    own, offset = bent.surfaces[0].net, edit.displacement.offsets[0]
    assert offset.degrees == (3, 3) and edit.copies[0].deviation <= 1e-3 * HEIGHT
    uv = np.random.default_rng(0).random((500, 2))
    assert np.abs(offset.over(own).evaluate(uv) - own.evaluate(uv)).max() <= 1e-12
    for axis, knots in enumerate((offset.over(own).u, offset.over(own).v)):
        assert (knots.multiplicities[1:-1] == np.where(np.isin(knots.breaks[1:-1], (u, v)[axis].breaks), 2, 1)).all()


def test_degrees_are_raised_across_closing_edges_and_not_where_nothing_lies(feature):
    """A cylinder of the kernel, rational, of degree 2 round its axis, where it closes, and 1 along it."""
    model = view(shapes.document(zoo.nurbs(zoo.cylinder().val().wrapped)))
    (wall,) = (f for f in model.faces if len({t.edge for t in f.trims}) == 3)
    edit = repeat(model, Repeat(feature=feature, at=("15,0,15",), size=0.3))
    (offset,) = edit.displacement.offsets.values()
    net = model.surfaces[wall.surface].net
    assert list(edit.displacement.offsets) == [wall.surface] and offset.degrees == (3, 3)
    fine = offset.over(net)
    assert [k.periodic for k in (fine.u, fine.v)] == [k.periodic for k in (net.u, net.v)] == [True, False]
    assert edit.copies[0].deviation <= 1e-3 * HEIGHT and edit.copies[0].taken == 0.0


def test_a_copy_over_a_sharp_edge_is_refused(feature):
    """What lies beyond it is another side of the body, on which there is nothing of the copy."""
    document = shapes.document(zoo.nurbs(BRepPrimAPI_MakeBox(100.0, 100.0, 100.0).Shape()))
    with pytest.raises(EditError, match="stay in place cut off"):
        repeat(view(document), Repeat(feature=feature, at=("95,50,100",)))


BALL = 20.0


def on_ball(way):
    """The point of the ball in a direction."""
    return BALL * np.array(way) / np.linalg.norm(way)


@pytest.mark.parametrize(("way", "faces"), [((1, 1, 0.1), 2), ((1, 0.95, 0.85), 3)], ids=["seam", "corner"])
def test_copies_cross_the_seams_and_corners_of_a_ball(feature, way, faces):
    """Whose patches meet at an angle to their parameter lines: the closed form, and seams as they were, in the file."""
    paper = grounds.sewn(grounds.ball(BALL, 24))
    before = view(paper)
    place = on_ball(way)
    report = run(
        paper, repeat, Repeat(feature=feature, at=(",".join(map(repr, place.tolist())),), size=0.25, height=0.2)
    )
    stream = io.BytesIO()
    write_step(paper, stream)
    after = view(read_step(io.BytesIO(stream.getvalue())))
    (copy,) = report.edit.copies
    old, new = ([max(getattr(s, name) for s in seams(model)) for name in ("gap", "angle")] for model in (before, after))
    print(f"gap {new[0]:.1e} mm, angle {new[1] - old[1]:+.1e}°, off by {copy.deviation:.1e} mm")
    assert report.valid_after.valid and len(copy.faces) == faces and copy.taken < 1e-3
    assert [t.how for t in report.edit.edges if t.how != "frozen"] == ["to tolerance"] * (1 if faces == 2 else 3)
    assert new[0] <= 1e-4 and new[1] <= old[1] + 0.01 and copy.deviation <= 5e-3 * 0.2 * HEIGHT
    uv = np.random.default_rng(0).uniform(-np.pi / 4, np.pi / 4, (4000, 2))
    for one, two in zip(before.surfaces, after.surfaces, strict=True):
        points = one.net.evaluate(uv)
        far = BALL * np.arccos(np.clip(points @ place / BALL**2, -1, 1))
        wanted = bump(far, 0.2 * HEIGHT, 0.25 * SIGMA)
        moved = np.linalg.norm(two.net.evaluate(uv), axis=1) - np.linalg.norm(points, axis=1)
        assert np.abs(moved - wanted).max() <= 5e-3 * 0.2 * HEIGHT


def test_a_copy_tilts_a_corner_at_which_the_laws_of_three_seams_all_but_agree(feature, monkeypatch):
    """Splines through a warped ball, a micron off it: what three seams asked of a corner would hold it as it was.

    What seams that move change of a copy, no edge takes.
    """
    monkeypatch.setattr(taken, "SLIGHT", 1e-6)

    def warped(p):
        x, y, z = np.moveaxis(np.asarray(p), -1, 0) / BALL
        return BALL * np.stack([x + 0.15 * x * z + 0.1 * y * y, 1.1 * y + 0.1 * x * x, 0.9 * z + 0.12 * x * y], axis=-1)

    nets = grounds.ball(BALL, 24)
    k = nets[0].u
    points = [warped(net.grid(k.greville(), k.greville())) for net in nets]
    model = view(grounds.sewn([Net(k, k, interpolated(k, k, each)) for each in points]))
    place = warped(on_ball((1, -0.95, 0.85)))
    edit = repeat(model, Repeat(feature=feature, at=(",".join(map(repr, place.tolist())),), size=0.25, height=0.2))
    (copy,) = edit.copies
    assert [t.how for t in edit.edges if t.how != "frozen"] == ["to tolerance"] * 3 and len(copy.faces) == 3
    assert copy.deviation <= 2e-3 * 0.2 * HEIGHT and copy.lost > 0 and copy.taken == 0.0
