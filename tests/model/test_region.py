"""Regions of trimmed faces in the knot grid: never a crossed cell too few, inside and outside told apart."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mracad.bspline.curve import Curve
from mracad.bspline.knots import KnotVector
from mracad.bspline.surface import Net
from mracad.model.brep import Face, Trim
from mracad.model.region import Course, face_region, spanned, supported


def plane(nu=12, nv=9, periodic=False):
    u = (
        KnotVector.from_multiplicities(np.linspace(0, 1, nu + 1), [1] * (nu + 1), 3, periodic=True)
        if periodic
        else KnotVector.clamped(np.linspace(0, 1, nu + 1), 3)
    )
    v = KnotVector.clamped(np.linspace(0, 1, nv + 1), 2)
    return Net(u, v, np.zeros((u.count, v.count, 3)))


def segment(a, b):
    return Curve(KnotVector.clamped([0, 1], 1), np.array([a, b], float))


def face(curves):
    trims = tuple(Trim(edge, curve) for edge, curve in enumerate(curves))
    return Face(0, "bspline", 0, trims, False, np.eye(4), np.zeros((2, 3)))


def region_cells(net, curve):
    """Cells crossed by one curve."""
    return face_region(net, face([curve])).crossed[0]


def circle(centre, radius):
    """Exact rational circle of four quadratic arcs."""
    corners = np.array([[1, 0], [1, 1], [0, 1], [-1, 1], [-1, 0], [-1, -1], [0, -1], [1, -1], [1, 0]], float)
    weights = np.where(np.arange(9) % 2, np.sqrt(0.5), 1.0)
    knots = KnotVector.from_multiplicities(np.linspace(0, 1, 5), [3, 2, 2, 2, 3], 2)
    return Curve(knots, centre + radius * corners, weights)


def square(low, high):
    c = [(low, low), (high, low), (high, high), (low, high)]
    return [segment(c[i], c[(i + 1) % 4]) for i in range(4)]


@settings(max_examples=60, deadline=None)
@given(st.integers(0, 2**32 - 1), st.booleans())
def test_every_cell_that_a_curve_enters_is_crossed(seed, periodic):
    rng = np.random.default_rng(seed)
    net = plane(int(rng.integers(2, 20)), int(rng.integers(2, 20)), periodic)
    poles = rng.uniform(-0.4 if periodic else 0.0, 1.4 if periodic else 1.0, (7, 2))
    poles[:, 1] = np.clip(poles[:, 1], 0, 1)
    curve = Curve(KnotVector.clamped(np.sort(np.r_[0, rng.uniform(0, 1, 3), 1]), 3), poles, rng.uniform(0.3, 3, 7))
    points = curve.evaluate(np.linspace(0, 1, 2000))[0]
    u = points[:, 0] % 1.0 if periodic else points[:, 0]
    cells = region_cells(net, curve)
    i = np.clip(np.searchsorted(net.u.breaks, u, side="right") - 1, 0, cells.shape[0] - 1)
    j = np.clip(np.searchsorted(net.v.breaks, points[:, 1], side="right") - 1, 0, cells.shape[1] - 1)
    assert cells[i, j].all()
    entered = np.zeros_like(cells)
    entered[i, j] = True
    assert cells.sum() <= 1.6 * entered.sum() + 6  # conservative, yet close


@pytest.mark.parametrize("periodic", [False, True])
def test_a_course_followed_into_finer_knots_is_that_through_these_knots(periodic):
    curves = (circle([0.5, 0.5], 0.45), segment((-0.3 if periodic else 0.02, 0.1), (0.7, 0.93)), *square(0.25, 0.75))
    course = Course(curves)
    for halvings in range(5):
        net = plane(4 << halvings, 3 << halvings, periodic)
        boxes, owners = course.boxes(net.u, net.v)
        for i, curve in enumerate(curves):
            cells = region_cells(net, curve)
            for axis, knots in enumerate((net.u, net.v)):
                assert np.array_equal(spanned(knots, boxes[owners == i, :, axis]), cells.any(axis=1 - axis))


def test_a_curve_on_a_knot_line_crosses_the_cells_on_both_sides():
    net = plane(10, 10)
    cells = region_cells(net, segment((0.3, 0.05), (0.3, 0.95)))
    assert cells[2].all() and cells[3].all() and cells.sum() == 20


def test_inside_of_a_square_with_a_hole():
    net = plane(40, 40)
    area = face_region(net, face([*square(0.1, 0.9), circle([0.5, 0.5], 0.2)]))
    middles = (np.arange(40) + 0.5) / 40
    x, y = np.meshgrid(middles, middles, indexing="ij")
    r = np.hypot(x - 0.5, y - 0.5)
    truth = (np.maximum(abs(x - 0.5), abs(y - 0.5)) < 0.4) & (r > 0.2)
    clear = (abs(np.maximum(abs(x - 0.5), abs(y - 0.5)) - 0.4) > 0.04) & (abs(r - 0.2) > 0.04)
    assert np.array_equal(area.inside[clear], truth[clear])
    assert not (area.inside & ~np.logical_or.reduce(area.crossed) & ~truth).any()


def test_a_region_that_runs_over_the_seam_of_a_periodic_surface():
    net = plane(40, 10, periodic=True)
    c = [(0.8, 0.2), (1.3, 0.2), (1.3, 0.8), (0.8, 0.8)]
    area = face_region(net, face([segment(c[i], c[(i + 1) % 4]) for i in range(4)]))
    assert area.inside[:11, 5].all() and area.inside[33:, 5].all()
    assert not area.inside[14:31].any() and not area.inside[:, 9].any()


def test_a_face_without_edges_covers_its_surface():
    area = face_region(plane(5, 4), face([]))
    assert area.inside.all() and area.crossed == ()


@pytest.mark.parametrize("periodic", [False, True])
def test_supported_points_are_those_whose_function_lives_on_a_cell(periodic):
    rng = np.random.default_rng(3)
    net = plane(11, 7, periodic)
    cells = rng.random((11, 7)) < 0.1
    from mracad.bspline.basis import basis

    truth = np.zeros(net.poles.shape[:2], bool)
    for i, j in zip(*np.nonzero(cells), strict=True):
        at = [np.array([(k.breaks[c] + k.breaks[c + 1]) / 2]) for k, c in ((net.u, i), (net.v, j))]
        rows = (basis(net.u, at[0])[0][0] + np.arange(4)) % net.u.count
        columns = basis(net.v, at[1])[0][0] + np.arange(3)
        truth[np.ix_(rows, columns)] = True
    assert np.array_equal(supported(net, cells), truth)


def test_the_price_of_a_circle_is_the_one_in_the_literature():
    """Frozen points for a circle of radius 1/4 in the unit square: 20, 11, 6 % of the net."""
    for spans, expected in ((32, 249), (64, 505), (128, 1017)):
        k = KnotVector.clamped(np.linspace(0, 1, spans + 1), 3)
        net = Net(k, k, np.zeros((k.count, k.count, 3)))
        count = supported(net, region_cells(net, circle([0.5, 0.5], 0.25))).sum()
        assert count == pytest.approx(expected, rel=0.06)
