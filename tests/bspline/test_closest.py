"""Nearest points of surfaces of which they are known."""

import numpy as np
import pytest

from mracad.bspline.closest import distances, feet
from tests.model.shapes import cylinder, graph, plane, sphere, torus


def cloud(seed=0, count=200, size=4.0):
    return np.random.default_rng(seed).uniform(-size, size, (count, 3))


@pytest.mark.parametrize(
    ("net", "away"),
    [
        (sphere(2.0), lambda p: abs(np.linalg.norm(p, axis=1) - 2.0)),
        (torus(5.0, 2.0), lambda p: abs(np.hypot(np.hypot(p[:, 0], p[:, 1]) - 5.0, p[:, 2]) - 2.0)),
        (plane(), lambda p: np.linalg.norm(p - np.clip(p, [0, 0, 0], [1, 1, 0]), axis=1)),
        (
            cylinder(2.0, 3.0),
            lambda p: np.hypot(np.hypot(p[:, 0], p[:, 1]) - 2.0, p[:, 2] - np.clip(p[:, 2], 0, 3)),
        ),
    ],
)
def test_distances_are_those_of_closed_forms(net, away):
    points = cloud()
    np.testing.assert_allclose(distances(net, points), away(points), rtol=0, atol=1e-9)


def test_points_off_a_wavy_surface_along_its_normals():
    net = graph(lambda x, y: 0.1 * np.sin(7 * x) * np.cos(5 * y), 12)
    uv = np.stack(np.meshgrid(*[np.linspace(0.1, 0.9, 12)] * 2), axis=-1).reshape(-1, 2)
    points = net.evaluate(uv) + 1e-3 * net.normals(uv)
    np.testing.assert_allclose(distances(net, points), 1e-3, rtol=1e-9)
    found, off = feet(net, points, np.clip(uv + 0.02, 0, 1))
    np.testing.assert_allclose(found, uv, atol=1e-9)
    np.testing.assert_allclose(off, 1e-3, rtol=1e-9)


def test_feet_stay_within_the_surface():
    found, off = feet(plane(), np.array([[3.0, 0.5, 4.0]]), np.array([[0.2, 0.2]]))
    np.testing.assert_allclose(found, [[1.0, 0.5]], atol=1e-12)
    assert off[0] == pytest.approx(np.hypot(2, 4))
