"""Patterns of places on grounds of known geometry."""

import numpy as np
import pytest

from mracad.edit.feature.ground import Ground
from mracad.edit.feature.pattern import along, grid, polar, scattered
from mracad.spec import places as spec
from tests.edit.feature import grounds
from tests.edit.models import sheet


def test_a_grid_follows_a_cylinder():
    """Distances round it are those along its circles, nearly: it is walked in chords."""
    ground = Ground.of(sheet(grounds.cylinder(40.0, 120.0)), {0})
    foot = ground.feet(np.array([[40.0 * np.sin(0.4), 30.0, 40.0 * np.cos(0.4)]]))
    x = np.array([np.cos(0.4), 0.0, -np.sin(0.4)])
    frame = np.stack([x, np.cross(foot.normals[0], x), foot.normals[0]])
    places = grid(ground, spec.grid("3x2,10,20", "grid"), foot.points[0], frame, True)
    assert len(places) == 5
    for p in places:
        i, j = (int(n) - 1 for n in p.label.split()[1].split(","))
        assert np.hypot(p.point[0], p.point[2]) == pytest.approx(40.0)
        assert np.arctan2(p.point[0], p.point[2]) == pytest.approx(0.4 + i * 10 / 40, abs=2e-3)
        assert abs(p.point[1] - 30.0) == pytest.approx(20.0 * j, abs=1e-6)


def test_places_round_an_axis():
    origin, frame = np.array([10.0, 0.0, 5.0]), np.eye(3)
    places = polar(spec.polar("4,z", "polar"), origin, frame, True)
    assert np.allclose([p.point for p in places], [[0, 10, 5], [-10, 0, 5], [0, -10, 5]])
    assert np.allclose([p.direction for p in places], [[0, 1, 0], [-1, 0, 0], [0, -1, 0]])
    about = polar(spec.polar("2,10,5,0,0,0,3", "polar"), origin, frame, False)
    assert np.allclose([p.point for p in about], [[10, 0, 5], [10, 10, 5]])


def test_places_along_an_edge_are_evenly_apart():
    """On the border of an uneven plane, of which the parameter is no length."""
    ground = Ground.of(sheet(grounds.uneven()), {0})
    places = along(ground, spec.along("edge#1,4", "along"))
    points = np.array([p.point for p in places])
    steps = np.diff(points, axis=0)
    assert np.abs(np.linalg.norm(steps, axis=1) - 50.0).max() < 1e-3
    assert np.abs([np.linalg.norm(np.cross(p.direction, steps[0])) for p in places]).max() < 1e-6
    inside = np.array([p.point for p in along(ground, spec.along("edge#1,4,20", "along"))])
    assert np.abs(np.linalg.norm(inside - points, axis=1) - 20.0).max() < 1e-6
    assert ((inside > 0) & (inside < 200))[:, :2].any(axis=1).all()


def test_scattered_places_stay_within_their_bounds():
    ground = Ground.of(sheet(grounds.uneven()), {0})
    places = grid(ground, spec.grid("6x6,20,20", "grid"), np.array([40.0, 40.0, 0.0]), np.eye(3), False)
    feet = ground.feet(np.array([p.point for p in places]))
    found = scattered(places, feet, 3.0, 0.5, 7)
    apart = np.array([p.point - q.point for p, q in zip(found, places, strict=True)])
    assert 2.0 < np.linalg.norm(apart, axis=1).max() <= 3.0 and np.abs(apart[:, 2]).max() < 1e-9
    assert 0.3 < max(abs(p.rotate) for p in found) <= 0.5
    again = scattered(places, feet, 3.0, 0.5, 7)
    assert all(np.array_equal(p.point, q.point) for p, q in zip(found, again, strict=True))
