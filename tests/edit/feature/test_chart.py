"""Charts on a plane, a cylinder and a sphere: normal coordinates and carried frames in closed form."""

import numpy as np
import pytest

from mracad.edit.feature.chart import charts

RADIUS, REACH = 40.0, 25.0


def plane(x, y):
    return np.stack([x, y, 0 * x], -1), np.broadcast_to(np.eye(3), (*x.shape, 3, 3))


def cylinder(x, y):
    c, s, o, i = np.cos(x / RADIUS), np.sin(x / RADIUS), 0 * x, 0 * x + 1
    frame = np.stack([np.stack([c, o, -s], -1), np.stack([o, i, o], -1), np.stack([s, o, c], -1)], axis=-2)
    return np.stack([RADIUS * s, y, RADIUS * c], -1), frame


def sphere(x, y):
    r, t = np.hypot(x, y), np.arctan2(y, x)
    c, s, o = np.cos(r / RADIUS), np.sin(r / RADIUS), 0 * r
    ray, side = np.stack([c * np.cos(t), c * np.sin(t), -s], -1), np.stack([-np.sin(t), np.cos(t), o], -1)
    normal = np.stack([s * np.cos(t), s * np.sin(t), c], -1)
    cos, sin = np.cos(t)[..., None], np.sin(t)[..., None]
    return RADIUS * normal, np.stack([cos * ray - sin * side, sin * ray + cos * side, normal], axis=-2)


@pytest.mark.parametrize(("ground", "limit"), [(plane, 1e-12), (cylinder, 1e-3), (sphere, 1e-3)])
def test_normal_coordinates_and_frames(ground, limit):
    side = np.linspace(-REACH, REACH, 15)
    x, y = (z.ravel() for z in np.meshgrid(side, side))
    near = np.hypot(x, y) <= 1.1 * REACH
    origin = ground(np.zeros(1), np.zeros(1))[0]
    chart = charts(origin, np.eye(3)[None], np.array([REACH]), ground(x, y)[0][None], near[None])
    rng = np.random.default_rng(1)
    r, t = REACH * np.sqrt(rng.random(400)), 2 * np.pi * rng.random(400)
    xy = np.stack([r * np.cos(t), r * np.sin(t)], axis=1)
    points, frames = ground(*xy.T)
    zero = np.zeros(400, int)
    local = chart.local(points, zero)
    found, carried = chart.jets(local, zero)
    assert np.abs(found - xy).max() <= limit
    assert np.abs(chart.places(xy, zero) - local[:, :2]).max() <= limit
    assert np.abs(carried - frames).max() <= limit


@pytest.mark.parametrize("steep", [30.0, 100.0, 1e4])
def test_a_ground_that_is_too_steep_for_a_chart_gives_numbers(steep):
    side = np.linspace(-1.0, 1.0, 21)
    x, y = (z.ravel() for z in np.meshgrid(side, side))
    points = np.stack([x, y, steep * x**2], axis=-1)
    chart = charts(np.zeros((1, 3)), np.eye(3)[None], np.ones(1), points[None], np.ones((1, len(x)), bool))
    assert np.isfinite(chart.log).all() and np.isfinite(chart.exp).all()
