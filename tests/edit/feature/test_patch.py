"""One surface of the ground: outward normals, what lies inside, samples about a place."""

from dataclasses import replace

import numpy as np

from mracad.bspline.surface import pairs
from mracad.edit.feature.patch import Patch
from tests.edit.feature import grounds
from tests.edit.models import sheet


def patch(net, **changes):
    model = sheet(net)
    return Patch.of(replace(model, faces=(replace(model.faces[0], **changes),)), 0, {0})


def test_normals_point_outward_and_lattices_are_points():
    one = patch(grounds.cylinder(40.0, 120.0))
    us, vs = np.linspace(0.1, 0.9, 5), np.linspace(0.2, 0.8, 4)
    points, _, _, normals = one.evaluate(pairs(us, vs))
    radial = points * [1, 0, 1] / 40.0
    assert np.abs(normals - radial).max() < 1e-12
    lattice = one.lattice(us, vs)
    assert np.abs(lattice[0].reshape(-1, 3) - points).max() < 1e-12
    assert np.abs(lattice[1].reshape(-1, 3) - normals).max() < 1e-12
    assert np.abs(patch(one.net, reversed=True).evaluate(pairs(us, vs))[3] + normals).max() < 1e-12


def test_places_in_a_frame():
    """A patch stands where its first face does."""
    frame = np.eye(4)
    frame[:3, :3], frame[:3, 3] = [[0, -1, 0], [1, 0, 0], [0, 0, 1]], [5, 6, 7]
    one = patch(grounds.uneven(), frame=frame)
    assert np.abs(one.net.poles[0, 0] - [5, 6, 7]).max() < 1e-12
    assert np.abs(one.net.poles[-1, 0] - [5, 206, 7]).max() < 1e-12


def test_samples_reach_as_far_as_asked_and_no_farther_than_the_face():
    one = patch(grounds.uneven())
    uv = np.array([[0.5, 0.5], [0.02, 0.5]])
    centre = np.asarray(one.net.evaluate(uv))
    points, normals, near = one.around(uv, centre, np.array([20.0, 20.0]), 11)
    assert points.shape == (2, 121, 3) and np.abs(normals - [0, 0, 1]).max() < 1e-12
    far = np.linalg.norm(points - centre[:, None], axis=2)
    assert (far[near] <= 22.0).all() and far[0][near[0]].max() > 19.0
    assert points[..., 0].min() >= -1e-9
