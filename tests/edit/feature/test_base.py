"""What features stand above."""

import numpy as np
import pytest

from mracad.bspline.knots import KnotVector
from mracad.edit.feature.base import under
from mracad.edit.feature.ground import Ground
from mracad.edit.feature.locate import window
from mracad.errors import EditError
from mracad.spec import places as spec
from tests.edit.feature import grounds
from tests.edit.models import fitted, sheet


def base(net, text):
    ground = Ground.of(sheet(net), {0})
    return under(ground, window(ground, spec.feature(text, "feature"), text, None))


def test_a_plane_is_found_below_a_bump():
    found = base(grounds.plane(100.0, (50.0, 50.0)), "near:50,50,2,radius:20")
    local = np.random.default_rng(0).uniform(-15, 15, (200, 3))
    assert np.abs(found.feet(local)[:, 2]).max() < 1e-3
    assert np.abs(found.chart.origin[0] - [50, 50, 0]).max() < 1e-3


TERMS = {"plane": 1, "cylinder 30": 10, "cone 40": 10, "torus 60/25": 35}
"""Of the form that is exact and has the fewest: a plane, a quadric, a cyclide."""


@pytest.mark.parametrize("name", grounds.GROUNDS)
def test_curved_ground_is_found_below_a_bump(name):
    """Exactly where it is of a canonical kind; elsewhere the stated error tells how well."""
    ground = grounds.GROUNDS[name]
    x, y, z = ground(np.zeros(1), np.zeros(1), np.full(1, grounds.HEIGHT))
    found = base(grounds.above(name, lambda a, b: grounds.bump(np.hypot(a, b))), f"near:{x[0]},{y[0]},{z[0]},radius:20")
    a, b = np.random.default_rng(0).uniform(-14, 14, (2, 400))
    true = np.stack(ground(a, b, 0 * a), axis=1)
    local = (true - found.chart.origin[0]) @ found.chart.axes[0].T
    off = np.linalg.norm(found.feet(local) - local, axis=1).max()
    print(f"{name}: {len(found.form.coefficients)} terms, off by {off:.1e} mm, stated {found.error:.1e} mm")
    assert off <= (1e-3 if name.startswith("waves") else 2e-5) * grounds.HEIGHT
    assert off <= max(10 * found.error, 2e-5)
    terms = len(found.form.coefficients)
    assert terms == TERMS.get(name, terms)


def test_noise_does_not_call_for_a_form_that_swings():
    """On a noisy plane, algebraic forms could be anything within the ring."""
    rng = np.random.default_rng(1)
    noisy = lambda a, b: grounds.bump(np.hypot(a, b)) + 0.02 * rng.standard_normal(a.shape)  # noqa: E731
    found = base(grounds.above("plane", noisy), "near:0,0,2,radius:20")
    a, b = np.random.default_rng(0).uniform(-14, 14, (2, 400))
    local = np.stack([a, b, 0 * a], axis=1) - found.chart.origin[0]
    local = local @ found.chart.axes[0].T
    assert np.linalg.norm(found.feet(local) - local, axis=1).max() <= 0.08
    assert 0.01 <= found.error <= 0.04


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
