"""Places of a face: where waves appear that no sum over the face shows, and what they lost."""

import numpy as np
import pytest

from mracad.bspline.knots import KnotVector
from mracad.bspline.surface import Net
from mracad.inspect.places import SIDES, SLOPE
from mracad.inspect.roughness import Growth, Rougher, better, places, worse
from mracad.inspect.survey import surveys
from tests.inspect.ramps import changes
from tests.model.shapes import face

WIDTH = 10.0
ALLOWED = Growth(0.005, 0.005, 0.005, 0.02, 30.0, 0.1)


def strip(height, length=100.0, breadth=20.0):
    """A sheet z = height(x, y) over a rectangle, a control point about every millimetre."""
    u, v = (KnotVector.clamped(np.linspace(0, size, int(size) + 1), 3) for size in (length, breadth))
    x, y = np.meshgrid(u.greville(), v.greville(), indexing="ij")
    return Net(u, v, np.stack([x, y, height(x, y)], axis=-1))


def change(before, after, width=WIDTH):
    seen = surveys([(before.over(after.u, after.v), [face()])], reaches=[(width, width)])
    return changes(seen, [after])[0]


def bump(x, middle, width):
    return np.exp(-(((x - middle) / width) ** 2))


def rough(x, y):
    """Waves of 4 mm about x = 20."""
    return 0.2 * np.sin(2 * np.pi * x / 4) * bump(x, 20, 8)


def wave(x, y, middle=70.0, size=0.01):
    """Waves of 8 mm elsewhere."""
    return size * np.sin(2 * np.pi * x / 8) * bump(x, middle, 8)


def test_waves_made_where_it_was_smooth_show_although_all_sums_fall():
    made = change(strip(rough), strip(wave))
    assert made.after.bending < 0.1 * made.before.bending and made.after.curvature < made.before.curvature
    assert {each.what for each in worse(made, ALLOWED)} == {Rougher.SPREAD}
    found = places(made, ALLOWED)
    count = int(100 / WIDTH * SIDES)
    assert found.shape[0] == pytest.approx(count, abs=1)
    middle = (np.arange(found.shape[0]) + 0.5) / found.shape[0] * 100
    assert np.abs(middle[found.any(axis=1)] - 70).max() < 25 and not found[middle < 35].any()


def test_what_goes_may_spread_to_the_places_beside():
    """A kink rounded over half a wavelength; over two, waves are where it was plane."""
    sharp = strip(lambda x, y: 0.1 * np.abs(x - 50))
    near, far = (
        strip(lambda x, y, a=a: 0.1 * np.where(np.abs(x - 50) < a, (x - 50) ** 2 / (2 * a) + a / 2, np.abs(x - 50)))
        for a in (WIDTH / 4, WIDTH)
    )
    assert not worse(change(sharp, near), ALLOWED)
    assert {each.what for each in worse(change(sharp, far), ALLOWED)} == {Rougher.SPREAD}


@pytest.mark.parametrize(("share", "shows"), [(0.5, False), (3.0, True)])
def test_waves_of_no_slope_show_nowhere(share, shows):
    """On a plane, waves as long as the edit's: from SLOPE on they count."""
    size = share * SLOPE * WIDTH / (2 * np.pi)
    made = change(strip(lambda x, y: 0 * x), strip(lambda x, y: size * np.sin(2 * np.pi * x / WIDTH)))
    assert (Rougher.SPREAD in {each.what for each in worse(made, Growth(1e30, 1e30, 1e30, 1.0, 30.0, 0.1))}) == shows


def test_what_places_lose_counts_however_rough_another_is():
    """A spike holds nearly all of the bending; waves go elsewhere."""
    spike = lambda x, y: 20 * bump(np.hypot(x - 20, y - 10), 0, 1.5)  # noqa: E731
    before, after = strip(lambda x, y: spike(x, y) + wave(x, y)), strip(spike)
    made = change(before, after)
    assert made.after.bending > 0.995 * made.before.bending and made.after.variation > 0.995 * made.before.variation
    assert 0.25 < made.lost <= 1.0 and better(made, 0.05, 0.25) and not better(made, 0.05, 1.0)
    assert not better(change(before, before), 0.0, 0.0)


def test_folds_kinks_and_peaks_are_found_where_they_are():
    plane = strip(lambda x, y: 0 * x)
    tilted = change(plane, strip(lambda x, y: 5 * bump(x, 70, 4)))
    found = places(tilted, Growth(1e30, 1e30, 1e30, 1e30, 30.0, 1e30))
    middle = (np.arange(found.shape[0]) + 0.5) / found.shape[0] * 100
    assert found.any() and np.abs(middle[found.any(axis=1)] - 70).max() < 20
    u = KnotVector.clamped(np.sort(np.r_[np.linspace(0, 100, 101), 30.0, 30.0]), 3)
    net = strip(lambda x, y: 0 * x).over(u, plane.v)
    bent = Net(u, net.v, net.poles + np.array([0, 0, 1]) * (0.02 * np.abs(u.greville() - 30))[:, None, None])
    opened = places(change(net, bent), Growth(1e30, 1e30, 1e30, 0.1, 180.0, 1e30))
    assert opened.any() and set(np.flatnonzero(opened.any(axis=1))) <= {5, 6}
