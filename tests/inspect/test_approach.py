"""Faces that cross between the corners of few triangles."""

import numpy as np
import pytest

from mracad.bspline.knots import KnotVector
from mracad.bspline.surface import Net
from mracad.inspect.approach import crossing_faces
from mracad.model.brep import Face, Model, Surface
from mracad.model.facts import Triangles

FLAT = KnotVector.clamped([0.0, 1.0], 1)
ROUND = KnotVector.clamped([0.0, 1.0], 2)


def arch(height, base=0.0):
    """z = base + 4 height x (1 - x) over the unit square."""
    poles = np.array([[(x, y, base + z) for y in (0.0, 1.0)] for x, z in ((0, 0), (0.5, 2 * height), (1, 0))])
    return Net(ROUND, FLAT, poles)


def crossed(*nets, cells=2, lift=0.0):
    """Pairs of the faces on nets that cross, on a mesh of the squares of a grid, whose borders are off by ``lift``."""
    surfaces = tuple(Surface(i, net, (i,)) for i, net in enumerate(nets))
    faces = tuple(Face(i, "bspline", i, (), False, np.eye(4), np.zeros((2, 3))) for i in range(len(nets)))
    at = np.linspace(0, 1, cells + 1)
    uv = np.stack(np.meshgrid(at, at, indexing="ij"), axis=-1).reshape(-1, 2)
    names = np.arange(len(uv)).reshape(cells + 1, -1)
    a, b, c, d = (each.ravel() for each in (names[:-1, :-1], names[1:, :-1], names[1:, 1:], names[:-1, 1:]))
    one = np.concatenate([np.stack([a, b, c], axis=1), np.stack([a, c, d], axis=1)])
    corners = np.concatenate([one + i * len(uv) for i in range(len(nets))])
    points = np.concatenate([net.evaluate(uv) for net in nets])
    points[:, 2] += lift * np.tile(((uv == 0) | (uv == 1)).any(axis=1), len(nets))
    owner = np.repeat(np.arange(len(nets)), len(one))
    mesh = Triangles(points, np.tile(uv, (len(nets), 1)), corners, corners, owner, np.zeros_like(owner), ())
    return crossing_faces(mesh, Model("m", surfaces, faces, (), 2.0), 1e-3)


def test_an_arch_through_a_plate_between_their_corners():
    ((pair, where),) = crossed(arch(0.2), arch(0.0, 0.17)).items()
    assert pair == (0, 1)
    assert where[2] == pytest.approx(0.17, abs=1e-6)
    assert 0.8 * where[0] * (1 - where[0]) == pytest.approx(0.17, abs=1e-3)


@pytest.mark.parametrize("base", [0.01, 0.21])
def test_arches_one_above_the_other_and_a_plate_above(base):
    assert crossed(arch(0.2), arch(0.2 if base < 0.1 else 0.0, base)) == {}


def test_edges_off_their_faces_are_followed():
    assert crossed(arch(0.2), arch(0.2, 0.01), lift=0.02) == {}
    assert list(crossed(arch(0.2), arch(0.0, 0.17), lift=0.02)) == [(0, 1)]


def test_a_sheet_rolled_through_itself():
    poles = np.array([[(x, y, z) for y in (0.0, 1.0)] for x, z in ((0, 0), (3, 1), (-2, 1), (1, 0))])
    loop = Net(KnotVector.clamped([0.0, 1.0], 3), FLAT, poles)
    ((pair, where),) = crossed(loop).items()
    assert pair == (0, 0) and where[0] == pytest.approx(0.5, abs=1e-2)
