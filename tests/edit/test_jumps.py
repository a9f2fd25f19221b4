"""Jumps of curvature along tangent seams may not grow: a plane beside a parabolic cylinder, in closed form."""

import numpy as np
import pytest

from mracad.edit.fair import Filter
from mracad.edit.jumps import MORE, Jumps
from mracad.edit.pose import Scene
from mracad.edit.target import sheets
from mracad.edit.tolerances import Tolerances
from mracad.edit.trial import displaced
from mracad.occ.view import view
from mracad.seam.interface import joints
from mracad.seam.wishes import Wishes
from tests.occ import shapes

LENGTH, WIDTH = 30.0, 40.0
BEND = 0.02
"""Curvature of the cylinder z = BEND x² / 2 at x = 0, 1/mm."""


def patch(start, bend):
    """A bicubic Bézier patch of z = bend x² / 2 over 30 mm from a start, by the polar form of x²."""
    u = np.linspace(0, 1, 4)
    x, y = np.meshgrid(start + LENGTH * u, LENGTH * u, indexing="ij")
    ends = start, start + LENGTH
    polar = np.array(
        [ends[0] ** 2, (ends[0] ** 2 + 2 * ends[0] * ends[1]) / 3, (2 * ends[0] * ends[1] + ends[1] ** 2) / 3]
    )
    square = np.append(polar, ends[1] ** 2)[:, None]
    return np.stack([x, y, bend * square / 2 + 0 * y], axis=-1)


@pytest.fixture(scope="module")
def model():
    faces = (shapes.face_on(shapes.bspline(patch(start, bend))) for start, bend in ((-LENGTH, 0.0), (0.0, BEND)))
    return view(shapes.document(shapes.sewn(*faces)))


def room(model, movable, bend, keep="as-is"):
    """What is left of bending the plane."""
    wishes = Wishes(keep, bend=1e-4)
    joined = joints(model, movable, wishes).among({0})
    scene = Scene(model, sheets(model, movable, Filter(WIDTH)), joined, Tolerances())
    net = scene.sheets[0].net
    offset = patch(-LENGTH, bend) - patch(-LENGTH, 0.0)
    return Jumps(scene, {0: net}, joined, WIDTH).room({0: displaced(net, offset)}).get(0)


@pytest.mark.parametrize(("movable", "sharing"), [({0}, 1), ({0, 1}, 2)])
def test_a_jump_grows_by_what_counts_for_none_and_a_tenth(model, movable, sharing):
    """Two faces that move each by itself share that."""
    allowed = (Tolerances().jump / WIDTH + MORE * BEND) / sharing
    for bend in (-0.01, -0.05, 0.06):
        grown = abs(BEND - bend) - BEND
        assert room(model, movable, bend) == pytest.approx(allowed / grown, rel=1e-6)


def test_a_jump_may_shrink_and_grow_where_only_the_tangent_is_to_be_kept(model):
    assert room(model, {0}, BEND / 2) is None and room(model, {0}, -1e-4) is None
    assert room(model, {0}, -0.05, "g1") is None
