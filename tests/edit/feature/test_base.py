"""What features stand above."""

import numpy as np
import pytest

from mracad.bspline.knots import KnotVector
from mracad.edit.feature.base import plate
from mracad.edit.feature.ground import Ground
from mracad.edit.feature.locate import window
from mracad.errors import EditError
from mracad.spec import places as spec
from tests.edit.feature import grounds
from tests.edit.models import fitted, sheet


def base(net, text):
    ground = Ground.of(sheet(net), {0})
    return plate(ground, window(ground, spec.feature(text, "feature"), text, None))


def test_a_plane_is_found_below_a_bump():
    found = base(grounds.plane(100.0, (50.0, 50.0)), "near:50,50,2,radius:20")
    local = np.random.default_rng(0).uniform(-15, 15, (200, 3))
    assert np.abs(found.feet(local)[:, 2]).max() < 1e-3
    assert np.abs(found.chart.origin[0] - [50, 50, 0]).max() < 1e-3


def test_a_cubic_ground_is_found_whatever_stands_on_it():
    """A thin plate reproduces cubics; feet stand on its normals."""
    k = KnotVector.clamped(np.linspace(0.0, 100.0, 101), 3)
    ridge = lambda x, y: 1e-5 * (x - 50) ** 3 + 2e-3 * (y - 50) ** 2  # noqa: E731
    both = lambda x, y: ridge(x, y) + grounds.bump(np.hypot(x - 50, y - 50))  # noqa: E731
    found = base(fitted(k, k, both, u_of=lambda t: t, v_of=lambda t: t), "near:50,50,2,radius:22")
    feet = found.feet(np.random.default_rng(0).uniform(-10, 10, (200, 3)))
    points = feet @ found.chart.axes[0] + found.chart.origin[0]
    assert np.abs(points[:, 2] - ridge(points[:, 0], points[:, 1])).max() < 5e-3


def test_a_window_larger_than_its_face_is_refused():
    with pytest.raises(EditError, match="larger than its face"):
        base(grounds.plane(60.0, (30.0, 30.0)), "near:30,30,2,radius:40")
