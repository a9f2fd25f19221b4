"""The words for places and windows."""

import numpy as np
import pytest

from mracad.edit.feature.ground import Ground
from mracad.edit.feature.locate import place, window
from mracad.errors import EditError
from mracad.spec import places as spec
from tests.edit.feature import grounds
from tests.edit.models import sheet


@pytest.fixture(scope="module")
def ground():
    return Ground.of(sheet(grounds.uneven()), {0})


def area(ground, text, width=None):
    return window(ground, spec.feature(text, "feature"), text, width)


def test_the_disc_of_a_window(ground):
    disc = area(ground, "near:80,90,1,radius:12")
    assert (disc.radius, disc.width, disc.reach) == (12.0, 3.0, 15.0)
    assert np.abs(disc.feet.points[0] - [80, 90, 0]).max() < 1e-9
    net = ground.patches[0].net
    xy = np.array([[0.0, 10.0], [0.0, 12.0], [13.5, 0.0], [0.0, 20.0]])
    shares = disc.shares(ground.patches[0], np.arange(4), xy)
    assert shares.shape == net.poles.shape[:2] and np.isinf(shares.ravel()[4:]).all()
    assert np.allclose(shares.ravel()[:4], [-2 / 3, 0.0, 0.5, 8 / 3])


def test_the_rectangle_of_a_window(ground):
    """On a plane with x = 200 u, y = 200 v: distances from it in millimetres."""
    box = area(ground, "#1@0.4:0.6,0.4:0.5", 10.0)
    patch = ground.patches[0]
    points = np.asarray(patch.net.grid(patch.net.u.greville(), patch.net.v.greville())).reshape(-1, 3)
    shares = box.shares(patch, np.arange(len(points)), points[:, :2])
    x, y = points[:, 0], points[:, 1]
    off = np.maximum(np.maximum(80 - x, x - 120), 0), np.maximum(np.maximum(80 - y, y - 100), 0)
    assert np.abs(10.0 * shares.ravel() - np.hypot(*off)).max() < 1e-8
    assert box.radius == pytest.approx(np.hypot(20.0, 10.0))


def test_places_off_the_face_are_told(ground):
    spot = place(ground, spec.spot("#1@0.25,0.5", "at"), "here")
    assert np.abs(spot.point - [50, 100, 0]).max() < 1e-9
    with pytest.raises(EditError, match="outside the face: u goes from 0 to 1"):
        place(ground, spec.spot("#1@1.5,0.5", "at"), "here")
    with pytest.raises(EditError, match="outside the face"):
        area(ground, "#1@0.5:1.5,0.4:0.5")
