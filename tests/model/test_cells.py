"""Trimmed faces in the knot grid: areas by closed forms and the kernel, points by the equations of the loops."""

from itertools import permutations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mracad.bspline.basis import basis
from mracad.bspline.curve import Curve
from mracad.bspline.knots import KnotVector
from mracad.model.cells import inside_grid, quadrature
from tests.model.shapes import circle, cylinder, face, plane, polygon, rectangle, segment


def area(net, faces, points=None):
    rule = quadrature(net, faces, points)
    _, su, sv = net.grid(rule.u.ravel(), rule.v.ravel(), 1)
    return float((np.linalg.norm(np.cross(su, sv), axis=-1) * rule.weights).sum())


def grid(n=101):
    return np.linspace(0, 1, n)


def test_a_face_without_a_boundary_is_the_whole_surface():
    net = plane(5)
    assert inside_grid(face(), net, grid(), grid()).all()
    assert not inside_grid(face(), net, [-0.1, 1.1], grid()).any()
    assert area(net, [face()]) == pytest.approx(1, abs=1e-14)


@pytest.mark.parametrize("wobble", [0, 5e-8])
def test_a_natural_boundary_is_the_whole_surface(wobble):
    net = plane(5)
    whole = face(rectangle(wobble, -wobble, 1 + wobble, 1))
    assert inside_grid(whole, net, grid(), grid()).all()
    assert area(net, [whole]) == pytest.approx(1, abs=1e-14)


@pytest.mark.parametrize("box", [(0.2, 0.3, 0.65, 0.9), (0.31, 0.1, 0.32, 0.101), (0, 0.5, 1, 0.5001)])
def test_faces_bounded_by_parameter_lines_are_integrated_exactly(box):
    u0, v0, u1, v1 = box
    assert area(plane(4), [face(rectangle(*box))]) == pytest.approx((u1 - u0) * (v1 - v0), rel=1e-7)


def test_area_of_an_annulus_converges_with_the_knots():
    ring = face([circle((0.5, 0.48), 0.41), circle((0.55, 0.5), 0.2)])
    exact = np.pi * (0.41**2 - 0.2**2)
    errors = [abs(area(plane(spans), [ring]) / exact - 1) for spans in (4, 16, 64)]
    assert errors[0] < 0.05 and errors[1] < 5e-3 and errors[2] < 4e-4


def test_a_wavy_boundary():
    """r = 0.3 + 0.05 sin 9φ, a cubic spline through 400 of its points."""
    knots = KnotVector.clamped(np.linspace(0, 2 * np.pi, 398), 3)
    at = knots.greville()
    first, values = basis(knots, at)
    matrix = np.zeros((len(at), len(at)))
    np.put_along_axis(matrix, first[:, None] + np.arange(4), values, axis=1)
    r = 0.3 + 0.05 * np.sin(9 * at)
    curve = Curve(knots, np.linalg.solve(matrix, np.stack([0.5 + r * np.cos(at), 0.5 + r * np.sin(at)], axis=1)))
    found = inside_grid(face([curve]), plane(10), grid(), grid())
    x, y = grid()[:, None] - 0.5, grid() - 0.5
    limit = 0.3 + 0.05 * np.sin(9 * np.arctan2(y, x))
    clear = np.abs(np.hypot(x, y) - limit) > 2e-4
    assert (found == (np.hypot(x, y) < limit))[clear].all()
    assert area(plane(40), [face([curve])]) == pytest.approx(np.pi * (0.3**2 + 0.05**2 / 2), rel=1e-3)


@pytest.mark.parametrize("order", list(permutations(range(4))))
def test_curves_may_come_in_any_order_and_direction_with_gaps(order):
    corners = np.array([(0.1, 0.1), (0.9, 0.2), (0.8, 0.9), (0.2, 0.7)])
    sides = [(corners[i] + 1e-4, corners[(i + 1) % 4] - 1e-4) for i in range(4)]
    curves = [segment(*(side if i % 2 else side[::-1])) for i, side in ((i, sides[i]) for i in order)]
    exact = face(polygon(*map(tuple, corners)))
    net, at = plane(7), np.append(grid(), corners[:, 1])
    found, wanted = inside_grid(face(curves), net, at, at), inside_grid(exact, net, at, at)
    assert (found != wanted).mean() < 0.01
    assert area(net, [face(curves)]) == pytest.approx(area(net, [exact]), rel=0.02)


def test_points_on_the_box_of_a_face_and_on_corners():
    diamond = face(polygon((0.5, 0), (1, 0.5), (0.5, 1), (0, 0.5)))
    found = inside_grid(diamond, plane(4), grid(5), grid(5))
    assert found[1:4, 1:4].all() and not found[0, [0, 1, 3, 4]].any() and not found[4, [0, 1, 3, 4]].any()
    window = inside_grid(face(rectangle(0.25, 0.25, 0.75, 0.75)), plane(4), grid(5), grid(5))
    assert (window == np.outer([0, 1, 1, 1, 0], [0, 1, 1, 1, 0])).all()


def test_parameters_in_any_order():
    disc = face([circle((0.5, 0.5), 0.3)])
    u, v = np.random.default_rng(3).uniform(0, 1, (2, 50))
    expected = np.hypot(u[:, None] - 0.5, v - 0.5) < 0.3
    assert (inside_grid(disc, plane(6), u, v) == expected).all()


def test_several_faces_of_one_surface():
    parts = [face(rectangle(0.1, 0.1, 0.4, 0.8)), face([circle((0.7, 0.5), 0.2)])]
    assert area(plane(30), parts) == pytest.approx(0.3 * 0.7 + np.pi * 0.04, rel=2e-3)


def test_a_sliver_has_points():
    """0.7 long and 1e-4 wide across one span."""
    sliver = face(polygon((0.1, 0.1), (0.6, 0.6), (0.6, 0.6001), (0.1, 0.1001)))
    assert quadrature(plane(1), [sliver]).mask.any()


@pytest.mark.parametrize("ends", [False, True])
@pytest.mark.parametrize("corners", [[(0.2, 0.3), (0.7, 0.6), (0.7, 0.6 + 1e-9)], [(0.4, 0.2), (0.4, 0.7), (0.4, 0.9)]])
def test_a_face_too_narrow_for_points_counts_as_its_box(corners, ends):
    rule = quadrature(plane(5), [face(polygon(*corners))], ends=ends)
    assert rule.mask.any()
    low, high = np.min(corners, axis=0), np.max(corners, axis=0)
    for axis, x in enumerate((rule.u, rule.v)):
        on = x.ravel()[rule.mask.any(axis=1 - axis)]
        assert on.min() >= low[axis] - 1e-6 and on.max() <= high[axis] + 1e-6


@pytest.mark.parametrize("start", [0.0, 0.3, -0.7, 0.9, 2.4])
@pytest.mark.parametrize("width", [0.25, 1.0])
def test_windows_of_a_periodic_cylinder(start, width):
    net = cylinder(2.0, 3.0)
    window = face(rectangle(start, 0.5, start + width, 2.5))
    assert area(net, [window], 8) == pytest.approx(2 * np.pi * 2.0 * width * 2.0, rel=1e-2 if width < 1 else 1e-6)
    u = np.linspace(0, 1, 40, endpoint=False) + 0.0123
    expected = np.mod(u - start, 1) < width
    assert (inside_grid(window, net, u, [1.0])[:, 0] == expected).all()


def band(low, high, shift=0.0):
    """Two lines right round the cylinder, without an edge that closes them."""
    return [segment((shift, low), (1 + shift, low)), segment((0, high), (1, high))]


@pytest.mark.parametrize("shift", [0.0, 0.4, 3.4])
def test_loops_that_go_round_a_periodic_surface(shift):
    net = cylinder(2.0, 3.0)
    slanted = face(
        [segment((shift, 0.5), (shift + 0.5, 1.0)), segment((shift + 1, 0.5), (shift + 0.5, 1.0)), band(0, 2)[1]]
    )
    u = np.linspace(0, 1, 50)
    low = 0.5 + np.abs(np.mod(u - shift + 0.5, 1) - 0.5)
    found = inside_grid(slanted, net, u, np.linspace(0, 3, 61) + 1e-4)
    v = np.linspace(0, 3, 61) + 1e-4
    assert (found == ((v > low[:, None]) & (v < 2))).all()


def test_a_hole_in_another_period():
    net = cylinder(2.0, 3.0)
    whole = rectangle(0, 0, 1, 3)
    for turn in (0, 1, -2):
        holed = face([*whole, circle((0.3 + turn, 1.5), 0.2)])
        found = inside_grid(holed, net, [0.3, 0.49, 0.51, 0.9], [1.5])
        assert found[:, 0].tolist() == [False, False, True, True]


@settings(max_examples=40, deadline=None)
@given(st.integers(0, 2**32 - 1))
def test_polygons_by_winding(seed):
    """Star-shaped polygons on planes of random knots and on the other axis: the same points as by angles."""
    rng = np.random.default_rng(seed)
    count = int(rng.integers(3, 30))
    phi = np.linspace(0, 2 * np.pi, count, endpoint=False) + rng.uniform(0, 0.9 * 2 * np.pi / count, count)
    r = rng.uniform(0.1, 0.5, count)
    corners = 0.5 + r[:, None] * np.stack([np.cos(phi), np.sin(phi)], axis=1)
    u, v = rng.uniform(0, 1, (2, 40))
    angles = np.arctan2(corners[:, 1, None, None] - v, corners[:, 0, None, None] - u[:, None])
    turned = np.mod(np.diff(angles, axis=0, append=angles[:1]) + np.pi, 2 * np.pi) - np.pi
    winding = np.round(turned.sum(axis=0) / (2 * np.pi))
    found = inside_grid(face(polygon(*map(tuple, corners))), plane(int(rng.integers(1, 9))), u, v)
    clear = (np.abs(turned) < np.pi - 1e-5).all(axis=0)  # nothing lies on a side, which would be seen from it straight
    assert (found == (winding != 0))[clear].all()


def test_real_faces_have_the_kernels_area(refined_file):
    """Within what lies about the quadrature points along the boundary."""
    from OCP.BRepGProp import BRepGProp
    from OCP.GProp import GProp_GProps

    from mracad.occ.step import read_step
    from mracad.occ.view import view

    document = read_step(refined_file)
    model = view(document)
    for surface in model.surfaces:
        for index in surface.faces:
            net, properties = surface.net, GProp_GProps()
            rule = quadrature(net, [model.faces[index]], 8)
            _, su, sv = net.grid(rule.u.ravel(), rule.v.ravel(), 1)
            density = np.linalg.norm(np.cross(su, sv), axis=-1)
            BRepGProp.SurfaceProperties_s(document.faces[index], properties, 1e-4)
            beside = np.lib.stride_tricks.sliding_window_view(np.pad(rule.mask, 1), (3, 3))
            boundary = beside.any(axis=(2, 3)) & ~beside.all(axis=(2, 3))
            along = (density * boundary * rule.wu.reshape(-1, 1) * rule.wv.reshape(-1)).sum()
            found = (density * rule.weights).sum()
            assert abs(found - properties.Mass()) < 0.3 * along + 1e-4 * properties.Mass(), index
