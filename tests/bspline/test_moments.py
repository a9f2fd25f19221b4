"""Integrals over trimmed faces, against closed forms."""

import numpy as np
import pytest

from mracad.bspline.curve import Curve
from mracad.bspline.knots import KnotVector
from mracad.bspline.moments import moments
from mracad.bspline.surface import Net
from tests.model.shapes import circle, cylinder, graph, plane, polygon, sphere, torus


def loop(curves, way=1):
    return [(curve, way) for curve in curves]


def reversed_loop(curves):
    return loop(curves, -1)


@pytest.mark.parametrize(
    ("shape", "area", "volume"),
    [
        (sphere(2.0), 16 * np.pi, 32 * np.pi / 3),
        (torus(5.0, 2.0), 40 * np.pi**2, 40 * np.pi**2),
        (cylinder(2.0, 3.0), 12 * np.pi, 8 * np.pi),  # its two discs, at z = 0 and 3, add 4 π
    ],
)
def test_whole_surfaces(shape, area, volume):
    found = moments(shape, [])
    assert found[0] == pytest.approx(area, rel=1e-9)
    assert abs(found[4]) == pytest.approx(volume, rel=1e-9)
    assert np.abs(found[1:3]).max() < 1e-9 * area


@pytest.mark.parametrize("spans", [1, 7])
def test_a_disc_in_a_plane_and_the_plane_without_it(spans):
    net, disc = plane(spans, size=4.0, height=4.0), [circle((1.7, 2.1), 0.8)]
    net = net.with_poles(net.poles + np.array([0, 0, 1]))
    whole, inner = moments(net, []), moments(net, loop(disc))
    area = np.pi * 0.64
    assert inner[0] == pytest.approx(area, rel=1e-9)
    assert inner[1:3] / inner[0] == pytest.approx([1.7, 2.1], rel=1e-9)
    assert inner[4] == pytest.approx(inner[3] / 3, rel=1e-9)  # a cone over the disc, of its height
    outer = moments(net, loop(polygon((0, 0), (4, 0), (4, 4), (0, 4))) + reversed_loop(disc))
    assert np.allclose(outer, whole - inner, rtol=1e-9, atol=1e-9)


def test_the_flux_through_a_graph_is_exact_whatever_its_knots():
    """z = x² y over a triangle: ∫ x · n dA = ∬ z − x z_x − y z_y = −2 ∬ x² y."""
    net = graph(lambda x, y: x**2 * y, 3)
    corner = polygon((0.1, 0.2), (0.9, 0.3), (0.4, 0.95))
    found = moments(net, loop(corner))
    fine = net.refined([0.11, 0.5, 0.52], [0.25, 0.26])
    assert np.allclose(moments(fine, loop(corner)), found, rtol=1e-9)
    a, b, c = np.array([(0.1, 0.2), (0.9, 0.3), (0.4, 0.95)])
    nodes, weights = np.polynomial.legendre.leggauss(6)
    s, t = np.meshgrid((nodes + 1) / 2, (nodes + 1) / 2, indexing="ij")
    x, y = (a + s[..., None] * ((1 - t)[..., None] * (b - a) + t[..., None] * (c - a))).T
    jacobian = s.T * abs(np.linalg.det([b - a, c - a])) * np.outer(weights, weights) / 4
    assert found[4] == pytest.approx(-2 / 3 * (x**2 * y * jacobian).sum(), rel=1e-12)
    assert found[6] == pytest.approx(-2 / 4 * (x**2 * y**2 * jacobian).sum(), rel=1e-12)


def test_a_loop_across_the_ends_of_a_period():
    """A window of a cylinder that goes over its first knot."""
    net = cylinder(2.0, 3.0)
    low, period = net.u.breaks[0], net.u.period
    shares = -0.1 * period, 0.15 * period
    window = polygon((low + shares[0], 0.25), (low + shares[1], 0.25), (low + shares[1], 0.75), (low + shares[0], 0.75))
    ends = net.evaluate(np.array([(low + share, 0.25) for share in shares]))[:, :2]
    angle = np.arccos((ends[0] @ ends[1]) / 4)
    height = np.ptp(net.evaluate(np.array([(low, 0.25), (low, 0.75)]))[:, 2])
    assert abs(moments(net, loop(window))[0]) == pytest.approx(2 * angle * height, rel=1e-9)


def test_curved_boundaries_that_run_along_knot_lines():
    """A cubic along v = 1/2 is no crossing; together with straight lines it bounds half a square."""
    net = plane(2)
    knots = KnotVector([0.0] * 4 + [1.0] * 4, 3)
    lid = Curve(knots, np.array([(1.0, 0.5), (0.4, 0.5), (0.6, 0.5), (0.0, 0.5)]))
    rest = polygon((0, 0.5), (0, 0), (1, 0), (1, 0.5))[:3]
    assert moments(net, loop([*rest, lid]))[0] == pytest.approx(0.5, rel=1e-12)


def test_rational_surfaces_with_many_spans_and_weights():
    net = sphere(1.0)
    fine = net.refined(np.linspace(*net.u.domain, 23)[1:-1], np.linspace(*net.v.domain, 19)[1:-1])
    assert isinstance(fine, Net)
    assert np.allclose(moments(fine, []), moments(net, []), rtol=1e-7, atol=1e-9)
