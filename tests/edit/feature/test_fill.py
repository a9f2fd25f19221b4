"""Places all over grounds of known geometry: their distances, borders, seams."""

import numpy as np
import pytest

from mracad.edit.feature.clear import parts
from mracad.edit.feature.fill import Room, random
from mracad.edit.feature.ground import Ground
from mracad.edit.feature.spread import NOWHERE, Spots, arcs
from mracad.occ.view import view
from mracad.seam.interface import joints
from mracad.seam.wishes import Wishes
from tests.edit.feature import grounds
from tests.edit.models import sheet


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
    found = random(room(ball), 3.0, 0.0, NOWHERE)
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
    found = random(room(ball), 4.0, 0.0, NOWHERE)
    other = random(room(ball, 1), 4.0, 0.0, NOWHERE)
    assert len(found) != len(other) or np.abs(found.points - other.points).max() > 1.0
    turned = view(grounds.sewn(grounds.ball(20.0, 6)[::-1]))
    again = random(room(turned), 4.0, 0.0, NOWHERE)
    assert np.array_equal(np.sort(again.points, axis=0), np.sort(found.points, axis=0))


def test_borders_are_kept_clear_and_smooth_seams_are_none():
    halves = view(grounds.sewn([grounds.uneven(100.0), grounds.uneven(100.0, origin=(100.0, 0.0, 0.0))]))
    found = random(room(halves), 6.0, 9.0, NOWHERE).points
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
    found = random(room(model), 6.0, 9.0, NOWHERE)
    assert np.hypot(found.points[:, 0], found.points[:, 2]).min() >= 9.0 - 1e-3


def test_nothing_comes_near_the_own_place_of_a_feature():
    given = room(sheet(grounds.uneven(100.0)))
    own = Spots.on(given.ground, given.parts, np.array([0]), np.array([[0.5, 0.5]]))
    found = random(given, 6.0, 0.0, own)
    assert np.linalg.norm(found.points - own.points, axis=1).min() >= 6.0 - 1e-9


def test_distances_along_the_ground_are_exact_on_spheres_and_circles():
    t = np.linspace(0.1, 1.2, 9)
    normals = np.stack([np.cos(t), np.sin(t), 0 * t], axis=1)
    first = np.broadcast_to([1.0, 0.0, 0.0], normals.shape)
    assert arcs(5.0 * (normals - first), first, normals) == pytest.approx(5.0 * t, rel=1e-9)
    assert np.isinf(arcs(np.array([[0.0, 0.0, 1.0]]), first[:1], -first[:1]))[0]
