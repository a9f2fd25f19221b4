"""Places all over grounds of known geometry: their distances, borders, seams."""

import re

import numpy as np
import pytest

from mracad.bspline.fit import interpolated as at_greville
from mracad.bspline.knots import KnotVector
from mracad.bspline.surface import Net
from mracad.edit.feature import edits
from mracad.edit.feature.clear import parts
from mracad.edit.feature.detail import Feature
from mracad.edit.feature.fill import Room, random
from mracad.edit.feature.fill import filled as all_over
from mracad.edit.feature.ground import Ground
from mracad.edit.feature.pattern import places
from mracad.edit.feature.spread import NOWHERE, Spots, arcs
from mracad.errors import Code, EditError, MracadError
from mracad.occ.view import view
from mracad.seam.interface import joints
from mracad.seam.wishes import Wishes
from mracad.spec.steps import Repeat
from tests.edit.feature import grounds
from tests.edit.models import sheet

ANYWHERE = lambda spots: np.ones(len(spots), bool)  # noqa: E731


def room(model, seed=0):
    return Room.of(Ground.of(model, [f.index for f in model.faces]), Wishes(), True, seed)


@pytest.fixture(scope="module")
def ball():
    """A sphere of radius 20 of six sewn patches."""
    return view(grounds.sewn(grounds.ball(20.0, 6)))


def angles(points):
    """Distances along a sphere between points, over its radius; infinite to themselves."""
    unit = points / np.linalg.norm(points, axis=1, keepdims=True)
    return np.arccos(np.clip(unit @ unit.T - 3 * np.eye(len(unit)), -1, 1))


def test_random_places_fill_a_sphere_of_six_patches_evenly_and_leave_no_room(ball):
    found = random(room(ball), 3.0, ANYWHERE, NOWHERE)
    assert set(found.face) == set(range(6)) and set(found.part) == {0}
    far = 20.0 * angles(found.points).min(axis=1)
    assert far.min() > 3.0 * (1 - 1e-6)
    rng = np.random.default_rng(5)
    anywhere = rng.normal(size=(4000, 3))
    anywhere *= 20.0 / np.linalg.norm(anywhere, axis=1, keepdims=True)
    hole = 20.0 * np.arccos(np.clip((anywhere @ found.points.T).max(axis=1) / 400.0, -1, 1))
    assert hole.max() < 3.0 * 1.1
    # as many across the seams, at |x| = |y|, as anywhere else
    x = np.sort(np.abs(found.points), axis=1)
    strip = x[:, 1] > 0.9 * x[:, 2]
    seams = np.sort(np.abs(anywhere), axis=1)
    share = (seams[:, 1] > 0.9 * seams[:, 2]).mean()
    assert strip.mean() == pytest.approx(share, abs=4 * np.sqrt(share / len(found)))


def test_seeds_tell_random_places_apart_and_the_order_of_faces_does_not(ball):
    found = random(room(ball), 4.0, ANYWHERE, NOWHERE)
    other = random(room(ball, 1), 4.0, ANYWHERE, NOWHERE)
    assert len(found) != len(other) or np.abs(found.points - other.points).max() > 1.0
    turned = view(grounds.sewn(grounds.ball(20.0, 6)[::-1]))
    again = random(room(turned), 4.0, ANYWHERE, NOWHERE)
    assert np.array_equal(np.sort(again.points, axis=0), np.sort(found.points, axis=0))


def test_borders_are_kept_clear_and_smooth_seams_are_none():
    halves = view(grounds.sewn([grounds.uneven(100.0), grounds.uneven(100.0, origin=(100.0, 0.0, 0.0))]))
    given = room(halves)
    found = random(given, 6.0, lambda spots: given.clear(spots, np.full(len(spots), 9.0)), NOWHERE).points
    low, high = found.min(axis=0), found.max(axis=0)
    assert (low[:2] >= 9.0 - 1e-3).all() and (high[:2] <= [191.0 + 1e-3, 91.0 + 1e-3]).all()
    assert (low[:2] < 10.5).all() and (high[:2] > [189.5, 89.5]).all()
    assert (np.abs(found[:, 0] - 100.0) < 3.0).sum() > 5


def test_creases_part_the_ground():
    """Two planes that meet at right angles."""
    flat, upright = grounds.uneven(100.0), grounds.uneven(100.0)
    upright = upright.with_poles(upright.poles[..., [2, 1, 0]] * [1, 1, -1])
    model = view(grounds.sewn([flat, upright]))
    joined = joints(model, {0, 1}, Wishes())
    assert set(parts(Ground.of(model, {0, 1}), joined)) == {0, 1}
    given = room(model)
    found = random(given, 6.0, lambda spots: given.clear(spots, np.full(len(spots), 9.0)), NOWHERE)
    assert np.hypot(found.points[:, 0], found.points[:, 2]).min() >= 9.0 - 1e-3


def test_nothing_comes_near_the_own_place_of_a_feature():
    given = room(sheet(grounds.uneven(100.0)))
    own = Spots.on(given.ground, given.parts, np.array([0]), np.array([[0.5, 0.5]]))
    found = random(given, 6.0, ANYWHERE, own)
    assert np.linalg.norm(found.points - own.points, axis=1).min() >= 6.0 - 1e-9


def test_distances_along_the_ground_are_exact_on_spheres_and_circles():
    t = np.linspace(0.1, 1.2, 9)
    normals = np.stack([np.cos(t), np.sin(t), 0 * t], axis=1)
    first = np.broadcast_to([1.0, 0.0, 0.0], normals.shape)
    assert arcs(5.0 * (normals - first), first, normals) == pytest.approx(5.0 * t, rel=1e-9)
    assert np.isinf(arcs(np.array([[0.0, 0.0, 1.0]]), first[:1], -first[:1]))[0]


def filled(model, **options):
    """Places from options, for a small feature."""
    ground = Ground.of(model, [f.index for f in model.faces])
    feature = Feature(1.0, 1.0, 0.5, np.zeros((5, 5, 4)))
    return all_over(ground, feature, Repeat(feature="bump.feature", **options), Wishes())


def points(places):
    return np.array([p.point for p in places])


def steps(at, count):
    """Distances of each place from its nearest ones."""
    return np.sort(np.linalg.norm(at[:, None] - at, axis=2), axis=1)[:, 1 : count + 1]


@pytest.mark.parametrize(("kind", "count"), [("hexagons", 6), ("grid", 4)])
def test_rows_are_exact_on_two_planes_and_go_on_over_their_seam(kind, count):
    halves = view(grounds.sewn([grounds.uneven(60.0), grounds.uneven(60.0, origin=(60.0, 0.0, 0.0))]))
    at = points(filled(halves, fill=f"{kind},spacing:6mm"))
    assert ((at[:, :2] >= 1.0 - 1e-3) & (at[:, :2] <= [119.0 + 1e-3, 59.0 + 1e-3])).all()
    inner = ((at[:, :2] > 8.0) & (at[:, :2] < [112.0, 52.0])).all(axis=1)
    assert inner.sum() > (1.0 if count == 4 else 1.15) * 104 * 44 / 36 * 0.9
    assert np.abs(steps(at, count)[inner] - 6.0).max() < 0.02


def test_rows_close_round_a_cylinder_that_they_do_not_fit():
    """Unrolled, with a circumference of 15.7 spacings."""
    nets = []
    for quarter in range(4):
        k = KnotVector.clamped(np.linspace(0.0, np.pi / 2, 9), 3)
        h = KnotVector.clamped(np.linspace(0.0, 60.0, 5), 3)
        t, z = np.meshgrid(k.greville() + quarter * np.pi / 2, h.greville(), indexing="ij")
        nets.append(Net(k, h, at_greville(k, h, np.stack([10 * np.cos(t), 10 * np.sin(t), z], axis=-1))))
    at = points(filled(view(grounds.sewn(nets)), fill="hexagons,spacing:4mm", align="Z"))
    turn, z = np.arctan2(at[:, 1], at[:, 0]), at[:, 2]
    apart = np.angle(np.exp(1j * (turn[:, None] - turn)))
    far = np.sort(np.hypot(10 * apart, z[:, None] - z), axis=1)[:, 1:7]
    inner = (z > 6) & (z < 54)
    assert np.abs(far[inner] / 4.0 - 1.0).max() < 0.06


@pytest.mark.parametrize(("kind", "count", "spread"), [("hexagons", 5, 0.07), ("grid", 4, 0.12)])
def test_rows_are_as_even_as_a_sphere_permits(ball, kind, count, spread):
    """Of hexagons, twelve places have only five neighbours."""
    at = points(filled(ball, fill=f"{kind},spacing:4mm"))
    far = 20.0 * np.sort(angles(at), axis=1)[:, :count] / 4.0
    assert far[:, 0].min() > 0.65 and far.mean() == pytest.approx(1.0, abs=0.06) and far.std() < spread
    share = len(at) * 16.0 * (1.0 if count == 4 else 0.75**0.5) / (1600 * np.pi)
    assert share == pytest.approx(1.0, abs=0.07)


def test_rows_and_copies_are_aligned_along_a_direction_and_an_edge():
    model = view(grounds.sewn([grounds.uneven(60.0)]))
    for align, way in (("1,2,0", (1, 2, 0)), ("edge#1", None), ("Y", (0, 1, 0))):
        places = filled(model, fill="grid,spacing:6mm", align=align)
        if way is None:
            way = model.edges[0].tangents[0]
        way = np.array(way) / np.linalg.norm(way)
        assert np.abs([p.direction @ way - 1 for p in places]).max() < 1e-6
        at = points(places)
        step = at[:, None] - at
        near = np.abs(np.linalg.norm(step, axis=2) - 6.0) < 0.1
        along = np.abs(step[near] @ way) / 6.0
        assert np.minimum(along, np.abs(along - 1)).max() < 0.01


def test_parts_of_which_no_direction_is_asked_get_the_smoothest_one(ball):
    cloud = room(ball).cloud(6.0)
    ways, weight = np.ones((len(cloud.spots), 3)), np.zeros(len(cloud.spots))
    assert np.array_equal(cloud.field(4, ways, weight).z, cloud.field(4).z)
    assert not np.allclose(cloud.field(4, ways, weight + 1.0).z, cloud.field(4).z)


def test_copies_fade_with_the_distance_from_an_edge():
    model = view(grounds.sewn([grounds.uneven(60.0)]))
    edge = next(e for e in model.edges if np.ptp(e.points[:, 0]) < 1e-9 and e.points[0, 0] < 1)
    fade = f"distance-to:edge#{edge.index + 1},from:5mm=0.5,to:40mm=1.5"
    places = filled(model, fill="poisson,spacing:5mm", size_by=fade, height_by=fade)
    x = points(places)[:, 0]
    wanted = np.interp(x, [5, 40], [0.5, 1.5])
    assert np.abs(np.array([p.size for p in places]) - wanted).max() < 0.06
    assert [p.size for p in places] == [p.height for p in places]
    assert all(p.point[0] >= p.size - 1e-3 for p in places)


def test_copies_that_overlap_are_told():
    model = view(grounds.sewn([grounds.uneven(60.0)]))
    feature = Feature(4.0, 4.0, 0.5, np.zeros((5, 5, 4)))
    for spacing, told in ((9, ()), (7, ("copies are up to 8 mm wide and 7 mm apart: they overlap",))):
        options = Repeat(feature="bump.feature", fill=f"poisson,spacing:{spacing}mm")
        assert places(Ground.of(model, {0}), feature, options, Wishes())[1] == told


def test_no_place_is_left_by_a_margin():
    with pytest.raises(EditError, match="no place"):
        filled(view(grounds.sewn([grounds.uneven(60.0)])), fill="hexagons,spacing:6mm", margin="40mm")


def test_too_many_places_are_refused_before_they_are_made():
    with pytest.raises(MracadError, match="more than") as caught:
        filled(view(grounds.sewn([grounds.uneven(60.0)])), fill="poisson,spacing:0.01mm")
    assert caught.value.code == Code.LIMIT


def test_places_that_cannot_take_a_copy_are_left_out_and_told(monkeypatch):
    """Two planes that meet in the ridge x = 15 of one surface: nothing smooth bends over it."""
    k, h = KnotVector.clamped([0, 5, 10, 15, 15, 15, 20, 25, 30], 3), KnotVector.clamped(np.linspace(0, 20, 5), 3)
    x, y = np.meshgrid(k.greville(), h.greville(), indexing="ij")
    model = view(grounds.sewn([Net(k, h, np.stack([x, y, -1.5 * np.abs(x - 15)], axis=-1))]))
    options = Repeat(feature="formula:0.2*exp(-(x*x+y*y)/1),radius:2mm", fill="hexagons,spacing:5mm")
    monkeypatch.setattr(edits, "LARGE", 1000)
    edit = edits.repeat(model, options)
    assert len(edit.copies) > 20 and max(copy.short for copy in edit.copies) < 0.05 * 0.2
    left, large = edit.notes
    assert re.match(
        r"1 of \d+ places left out, because the faces there cannot hold a copy: place \d+ of \d+ \(15\.", left
    )
    (face,) = edit.outcomes
    assert large.startswith(f"#1 grows from {face.points - face.added} to {face.points} control points, by about ")
    monkeypatch.setattr(edits, "ROUNDS", 1)
    with pytest.raises(EditError, match=r"cannot hold the copy: .*select other faces"):
        edits.repeat(model, options)
