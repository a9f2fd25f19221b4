"""What is said about scales, against sheets whose detail is known."""

from dataclasses import replace

import numpy as np
import pytest

from mracad.bspline.knots import KnotVector
from mracad.inspect.scales import scales
from mracad.model.brep import Face, Model, Surface, Trim
from mracad.wavelet import project
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
    assert found.coarser and 0.98 * AMPLITUDE < found.detail < 1.2 * AMPLITUDE  # projections differ at the ends
    assert found.rms == pytest.approx(AMPLITUDE / np.sqrt(2), rel=0.05)


def test_a_ripple_coarser_than_the_scale_is_no_detail():
    found = scales(sheet(ripple(25.0)), 8.0)[0]
    assert found.coarser and found.detail < 0.02 * AMPLITUDE


def test_detail_does_not_hang_on_the_parameter():
    def u_of(t):
        return 100 * (t + 0.3 * t * (1 - t))

    even, other = (scales(sheet(net), 20.0)[0] for net in (ripple(10.0), ripple(10.0, u_of)))
    assert other.rms == pytest.approx(even.rms, rel=0.1)


def test_from_is_the_least_wavelength_that_the_knots_let_go():
    breaks = np.r_[0, np.cumsum([0.1, 0.03, 0.05, 0.12, 0.2, 0.2, 0.3])]
    net = fitted(KnotVector.clamped(breaks, 3), KnotVector.clamped([0, 1], 3), lambda x, y: 0 * x)
    found = scales(sheet(net), 1.0)[0]
    assert found.finest == pytest.approx(8.0, rel=1e-5) and found.spans == pytest.approx((3.0, 100.0), rel=1e-5)
    assert not found.coarser and not scales(sheet(net), 7.99)[0].coarser and scales(sheet(net), 8.01)[0].coarser


def test_a_single_span_has_no_scale():
    bezier = KnotVector.clamped([0, 1], 3)
    found = scales(sheet(fitted(bezier, bezier, lambda x, y: 0 * x)), 1e6)[0]
    assert found.finest == 0.0 and not found.coarser and found.detail == found.rms == 0.0


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
    assert rippled.rms == pytest.approx(AMPLITUDE / np.sqrt(2), rel=0.1) and flat.rms < 2e-2 * rippled.rms


def test_nothing_is_solved_or_refined_and_no_seam_is_looked_at(monkeypatch):
    """One projection in each direction that has anything to smooth is all the work."""
    calls = []
    real = project.projection
    monkeypatch.setattr(project, "projection", lambda *knots: calls.append(knots) or real(*knots))
    scales(sheet(ripple(10.0)), 20.0)
    assert 1 <= len(calls) <= 2
