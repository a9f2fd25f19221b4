"""Feet on grounds of known geometry."""

from dataclasses import replace

import numpy as np

from mracad.edit.feature.ground import Ground, axes
from mracad.model.brep import Surface, Trim
from tests.edit.feature import grounds
from tests.edit.models import segment, sheet


def test_feet_are_radial():
    rng = np.random.default_rng(2)
    way = np.abs(rng.normal(size=(40, 3))) + 0.2
    way /= np.linalg.norm(way, axis=1, keepdims=True)
    far = rng.uniform(35.0, 47.0, (40, 1))
    feet = Ground.of(sheet(grounds.sphere(40.0)), {0}).feet(far * way)
    assert np.abs(feet.points - 40.0 * way).max() < 1e-7
    assert np.abs(feet.apart - np.abs(far[:, 0] - 40.0)).max() < 1e-9
    assert np.abs(np.abs((feet.normals * way).sum(axis=1)) - 1.0).max() < 1e-9
    assert feet.beside(far * way).max() < 1e-6
    assert np.abs(feet.part(slice(3, 5)).points - feet.points[3:5]).max() == 0


def test_a_surface_counts_only_within_its_trims():
    """Above a plane lies another, trimmed to its left third: over the rest of it places are on the lower one."""
    lower, upper = grounds.uneven(), grounds.uneven(origin=(0.0, 0.0, 1.0))
    corners = [(0, 0), (0.3, 0), (0.3, 1), (0, 1)]
    trims = tuple(Trim(i, segment(corners[i], corners[(i + 1) % 4])) for i in range(4))
    whole = sheet(lower)
    faces = (whole.faces[0], replace(whole.faces[0], index=1, surface=1, trims=trims))
    model = replace(whole, surfaces=(whole.surfaces[0], Surface(1, upper, (1,))), faces=faces, edges=())
    points = np.array([[20.0, 90.0, 0.8], [90.0, 90.0, 0.8], [58.0, 90.0, 0.8], [60.3, 90.0, 0.8]])
    ground = Ground.of(model, {0, 1})
    feet = ground.feet(points)
    assert feet.surface.tolist() == [1, 0, 1, 1]  # the last is nearest to the rim, and its foot beyond it
    assert ground.faces(feet.surface, feet.uv).tolist() == [1, 0, 1, -1]
    assert np.abs(feet.apart - [0.2, 0.8, 0.2, 0.2]).max() < 1e-9


def test_beside_is_what_is_not_along_the_normal():
    feet = Ground.of(sheet(grounds.uneven()), {0}).feet(np.array([[30.0, 40.0, 2.0], [-3.0, 40.0, 4.0]]))
    assert np.abs(feet.beside(np.array([[30.0, 40.0, 2.0], [-3.0, 40.0, 4.0]])) - [0.0, 3.0]).max() < 1e-9


def test_a_ground_without_an_offset():
    model = sheet(grounds.uneven())
    offset = np.random.default_rng(0).normal(size=model.surfaces[0].net.poles.shape)
    clear = Ground.of(model, {0}).without({0: offset})
    assert np.abs(clear.patches[0].net.poles + offset - model.surfaces[0].net.poles).max() < 1e-12


def test_frames_are_right_handed_and_near_their_directions():
    rng = np.random.default_rng(1)
    normals = rng.normal(size=(30, 3))
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    ways = np.concatenate([rng.normal(size=(29, 3)), normals[29:]])  # the last says nothing of x
    frames = axes(normals, ways)
    assert np.abs(frames @ frames.swapaxes(1, 2) - np.eye(3)).max() < 1e-12
    assert (np.linalg.det(frames) > 0).all() and np.abs(frames[:, 2] - normals).max() < 1e-12
    assert (np.einsum("qi,qi->q", frames[:29, 0], ways[:29]) > 0).all()
    assert np.abs(np.einsum("qi,qi->q", frames[:29, 1], ways[:29])).max() < 1e-12
