"""What is said about scales, against sheets whose detail is known."""

from dataclasses import replace

import numpy as np
import pytest

from mracad.bspline.knots import KnotVector
from mracad.edit.smooth import smooth
from mracad.inspect.scales import scales
from mracad.model.brep import Face, Model, Surface, Trim
from mracad.spec.steps import Smooth
from tests.edit.models import fitted, segment, sheet

SIZE, SPANS = 100.0, 80
AMPLITUDE = 0.05


def ripple(wavelength, u_of=None, degree=3, breaks=None):
    """A plane square with one ripple along x, on spans of 1.25 mm."""
    u = KnotVector.clamped(np.linspace(0, 1, SPANS + 1) if breaks is None else breaks, degree)
    v = KnotVector.clamped(np.linspace(0, 1, 9), 3)
    return fitted(u, v, lambda x, y: AMPLITUDE * np.sin(2 * np.pi * x / wavelength) + 0 * y, SIZE, u_of)


@pytest.mark.parametrize("degree", [2, 3, 5])
def test_a_ripple_finer_than_the_scale_is_found_with_its_height(degree):
    found = scales(sheet(ripple(10.0, degree=degree)), 40.0)[0]
    assert found.detail == pytest.approx(AMPLITUDE / np.sqrt(2), rel=0.05)
    assert found.first <= 10.0


def test_a_ripple_coarser_than_the_scale_is_no_detail():
    assert scales(sheet(ripple(10.0)), 4.0)[0].detail < 0.02 * AMPLITUDE


def test_detail_does_not_hang_on_the_parameter():
    def u_of(t):
        return 100 * (t + 0.3 * t * (1 - t))

    even, other = (scales(sheet(net), 20.0)[0] for net in (ripple(10.0), ripple(10.0, u_of)))
    assert other.detail == pytest.approx(even.detail, rel=0.05)


@pytest.mark.parametrize("scale", [8.0, 11.0, 16.0])
def test_smoothing_removes_what_is_said(scale):
    model = sheet(ripple(10.0))
    smoothed = smooth(model, Smooth(scale=f"{scale}mm")).displacement.applied(model)
    uv = np.random.default_rng(0).uniform(0.2, 0.8, (2000, 2))
    before, after = (each.surfaces[0].net.evaluate(uv)[:, 2] for each in (model, smoothed))
    assert scales(model, scale)[0].detail == pytest.approx(np.std(after - before), rel=0.1)


def test_a_shape_without_waves_has_no_detail():
    u = KnotVector.clamped(np.linspace(0, 1, 33), 3)
    bowl = fitted(u, u, lambda x, y: 10 * np.cosh(x / 40 - 1) + 0 * y, SIZE)
    found = scales(sheet(bowl), 20.0)[0]
    assert found.first == found.detail == 0.0


@pytest.mark.parametrize(("keep", "rows"), [("g0", 1), ("g1", 2), ("g2", 3)])
def test_free_points_are_those_that_edges_leave(keep, rows):
    net = ripple(10.0)
    found = scales(sheet(net), 20.0, keep)[0]
    (nu, nv) = net.poles.shape[:2]
    assert (found.free, found.points) == ((nu - 2 * rows) * (nv - 2 * rows), nu * nv)


def test_detail_counts_only_where_the_face_is():
    net = ripple(10.0)
    heights = net.poles.copy()
    heights[net.u.greville() < 0.5] *= [1.0, 1.0, 0.0]
    net = replace(net, poles=heights)
    ends = {"flat": (0.0, 0.2), "rippled": (0.6, 1.0)}
    faces = []
    for number, (low, high) in enumerate(ends.values()):
        corners = [(low, 0), (high, 0), (high, 1), (low, 1)]
        trims = tuple(Trim(4 * number + i, segment(corners[i], corners[(i + 1) % 4])) for i in range(4))
        faces.append(Face(number, "bspline", 0, trims, False, np.eye(4), np.zeros((2, 3))))
    flat, rippled = scales(Model("two", (Surface(0, net, (0, 1)),), tuple(faces), (), SIZE), 20.0).values()
    assert rippled.detail == pytest.approx(AMPLITUDE / np.sqrt(2), rel=0.1) and flat.detail < 2e-2 * rippled.detail
