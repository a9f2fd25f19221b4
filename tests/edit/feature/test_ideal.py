"""What copies ideally are."""

import numpy as np
import pytest

from mracad.edit.feature.detail import Feature
from mracad.edit.feature.ground import Ground
from mracad.edit.feature.ideal import Way, copies
from mracad.edit.feature.locate import Place
from tests.edit.feature import grounds
from tests.edit.feature.grounds import HEIGHT, bump
from tests.edit.models import sheet


def feature(reach=15.0, cells=200):
    """A bump, and along x as much as it is high."""
    side = np.linspace(-reach, reach, cells + 1)
    x, y = np.meshgrid(side, side, indexing="ij")
    high = np.where(np.hypot(x, y) <= reach, bump(np.hypot(x, y)), 0.0)
    return Feature(12.0, reach, 1.0, np.stack([high, 0 * high, high, high / HEIGHT], axis=-1))


def laid(overlap, *places, mirror=False):
    ground = Ground.of(sheet(grounds.uneven()), {0})
    feet = ground.feet(np.array([p.point for p in places]))
    return ground.patches[0], copies(ground, feature(), places, feet, overlap, mirror)


@pytest.mark.parametrize("mirror", [False, True])
def test_detail_comes_back_to_where_it_was(mirror):
    way = Way(0.7, 2.0, -0.5, mirror)
    at = np.array([[3.0, 1.0]])
    cos, sin = np.cos(0.7), np.sin(0.7)
    flip = -1.0 if mirror else 1.0
    there = 2.0 * np.array([[cos * 3 - sin * flip * 1, sin * 3 + cos * flip * 1]])
    assert np.abs(way.back(there) - at).max() < 1e-12
    assert np.abs(way.on(np.array([[3.0, 1.0, 4.0]])) - [*there[0], -2.0]).max() < 1e-12


def test_a_copy_on_a_plane_is_the_feature():
    place = Place("here", np.array([80.0, 90.0, 0.0]), rotate=np.pi / 2, size=1.5, height=2.0)
    patch, every = laid("add", place)
    uv = np.random.default_rng(0).uniform(0.2, 0.7, (2000, 2))
    points = np.asarray(patch.net.evaluate(uv))
    far = np.hypot(*(points - place.point)[:, :2].T)
    high, found = bump(far / 1.5), every.at(patch, uv)
    # along x once, now along y, as much larger as the copy is
    wanted = np.stack([0 * high, 1.5 * high, 2.0 * high], axis=1)
    assert np.abs(found - wanted)[far < 21].max() < 5e-4 and not found[far > 23].any()
    assert every.height == pytest.approx(2.0 * np.sqrt(2) * HEIGHT) and every.reach[0] == 22.5


def test_copies_that_overlap():
    one, two = (Place(x, np.array([a, 90.0, 0.0]), height=h) for x, a, h in (("a", 80.0, 1.0), ("b", 84.0, 0.5)))
    uv = np.random.default_rng(0).uniform(0.3, 0.6, (2000, 2))
    each = [laid("add", place)[1].at(laid("add", place)[0], uv) for place in (one, two)]
    for overlap in ("add", "max", "replace"):
        patch, every = laid(overlap, one, two)
        found = every.at(patch, uv)
        size = [np.linalg.norm(x, axis=1)[:, None] for x in each]
        share = each[1][:, 2:] / 0.5 / HEIGHT
        wanted = {
            "add": each[0] + each[1],
            "max": np.where(size[1] > size[0], each[1], each[0]),
            "replace": (1 - share) * each[0] + each[1],
        }[overlap]
        assert np.abs(found - wanted).max() < 1e-3
    only = every.only(np.array([False, True]))
    assert np.abs(only.at(patch, uv) - each[1]).max() < 1e-12
