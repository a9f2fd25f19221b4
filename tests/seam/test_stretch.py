"""Lengths by direction and place: what waves count for, against closed forms."""

import numpy as np
import pytest

from mracad.bspline.fit import interpolated
from mracad.bspline.knots import KnotVector
from mracad.bspline.surface import Net
from mracad.compiled import Compiled
from mracad.model.cells import quadrature
from mracad.seam.energy import forms
from mracad.seam.points import limited
from mracad.seam.stretch import THETA, Limit, Stretch, orthonormal
from tests.model.shapes import face

RADIUS = 10.0


def surface(points, spans=(12, 12), size=(1.0, 1.0)):
    """A surface through ``points(u, v)``, of degree 5, over uneven knots."""
    u, v = (
        KnotVector.clamped(length * (0.8 * t + 0.2 * t * t), 5)
        for length, t in zip(size, (np.linspace(0, 1, n + 1) for n in spans), strict=True)
    )
    us, vs = np.meshgrid(u.greville(), v.greville(), indexing="ij")
    return Net(u, v, interpolated(u, v, np.stack(points(us, vs), axis=-1)))


def bent(net, heights, stretch):
    """The bending of a function ``heights(points)`` on a surface, over its area."""
    form = forms(net, net, quadrature(net, [face()]), stretch=stretch)
    at = net.grid(net.u.greville(), net.v.greville())
    x = interpolated(net.u, net.v, heights(at)[..., None]).ravel()
    return float(x @ (form.bending @ x) / form.mass.sum())


@pytest.mark.parametrize("lead", [0, 1])
@pytest.mark.parametrize("skew", [0.0, 0.7])
@pytest.mark.parametrize("way", [0.0, 0.5, 1.2, 2.5])
def test_a_wave_counts_by_its_length_along_and_across(lead, skew, way):
    """(k · x)² / 2 has the second derivatives of a wave of wavevector k where that is highest."""
    net = surface(lambda u, v: [3 * u + 2 * skew * v * v + v, 2 * v, 0 * u])
    tangent = np.array([1.0, 0.0])
    if lead:  # lines of v are parabolas: take those that are straight
        net = surface(lambda u, v: [3 * u + skew * v, 2 * v, 0 * u])
        tangent = np.array([skew, 2.0]) / np.hypot(skew, 2.0)
    k = np.array([np.cos(way), np.sin(way)])
    lengths = 0.7, 0.2
    found = bent(net, lambda p: (p[..., :2] @ k) ** 2 / 2, Stretch(lengths, lead))
    along, across = lengths[:: 1 - 2 * lead]
    both = k @ tangent, k @ [-tangent[1], tangent[0]]
    assert found == pytest.approx(((along * both[0]) ** 2 + (across * both[1]) ** 2) ** 2, rel=1e-9)


def tube(ripple=0.0, waves=1):
    """Half a cylinder, with ripples along it."""

    def points(u, v):
        r = RADIUS + ripple * np.sin(2 * np.pi * waves * v / 40)
        return [r * np.cos(u), r * np.sin(u), v]

    return surface(points, (16, 60), (np.pi, 40.0))


@pytest.mark.parametrize("length", [0.5, 30.0])
def test_a_round_limits_lengths_around_it_and_none_along_it(length):
    net = tube()
    stretch = Stretch(limit=Limit(length, ((0.0, net),)))
    around = (1 + (length / (THETA * RADIUS)) ** 4) ** -0.25
    arc, height = (lambda p: RADIUS * np.arctan2(p[..., 1], p[..., 0])), lambda p: p[..., 2]
    assert bent(net, lambda p: arc(p) ** 2 / 2, stretch) == pytest.approx(around**4, rel=1e-3)
    assert bent(net, lambda p: arc(p) * height(p), stretch) == pytest.approx(2 * around**2, rel=1e-3)
    assert bent(net, lambda p: height(p) ** 2 / 2, stretch) == pytest.approx(1.0, rel=1e-3)


@pytest.mark.parametrize("wavelength", [10.0, 40.0])
def test_the_shape_is_seen_without_the_ripples_on_it(wavelength):
    """Ripples that bend three times as much as the tube."""
    waves = 10
    height = 3 / RADIUS / (2 * np.pi * waves / 40) ** 2
    limit = Limit.of(tube(height, waves), (wavelength, wavelength), (frozenset(), frozenset()))
    u, v = np.linspace(0.3, 2.8, 40)[:, None], np.linspace(10.0, 30.0, 50)[:, None]
    one = np.ones((50, 40))
    around, both, along = limit.shape(u, v, np.stack([one / RADIUS, 0 * one, one]))
    assert np.abs(np.abs(around) * RADIUS - 1).max() < 0.1
    assert np.abs(both).max() < 0.01 and np.abs(along).max() < 0.25 * 3 / RADIUS


def test_a_limit_never_makes_a_length_longer():
    """Along a round of tiny radius nothing is limited, however much it is across: there rounding takes all digits."""
    radius = 1e-4
    net = surface(lambda u, v: (radius * np.cos(u + 0.3 * v), radius * np.sin(u + 0.3 * v), v))
    us, vs = np.full((1, 1), 0.4), np.full((1, 1), 0.5)
    limit, one = Limit(10.0, ((1e-6, net),)), np.ones((1, 1))
    found = limited((one, 0 * one, one), limit.shape(us, vs, orthonormal(net, us, vs)), limit.scale, 1.0)
    a, b, c = (float(each[0, 0]) for each in found)
    lengths = np.linalg.eigvalsh([[a, b], [b, c]])
    assert 0.0 < lengths[0] < 1e-3 and lengths[1] == pytest.approx(1.0, abs=1e-6)


@pytest.mark.parametrize("used", [False, True])
def test_shapes_do_not_depend_on_how_frames_lie_in_memory(used, monkeypatch):
    """Half a tube, most bent where it is narrow: around it, all spans are too long, and none along it."""
    monkeypatch.setattr(Compiled, "pays", lambda self, work: used)
    net = surface(lambda u, v: [(2 + v) * np.cos(u), (2 + v) * np.sin(u), 3 * v], (7, 5), (np.pi, 4.0))
    us, vs = (np.linspace(0.1, 0.9, n)[:, None] * size for n, size in ((7, np.pi), (5, 4.0)))
    limit, frame = Limit(10.0, ((1e-6, net),)), orthonormal(net, us, vs)
    around, *_ = limit.shape(us, vs, np.ascontiguousarray(frame))
    np.testing.assert_allclose(np.abs(around), np.repeat(3 / np.sqrt(10) / (2 + vs), 7, axis=1), rtol=1e-3)
    np.testing.assert_array_equal(limit.shape(us, vs, np.asfortranarray(frame))[0], around)
