"""Surfaces and boundaries with closed forms."""

import numpy as np

from mracad.bspline.curve import Curve
from mracad.bspline.fit import interpolated
from mracad.bspline.knots import KnotVector
from mracad.bspline.surface import Net
from mracad.model.brep import Face, Trim

CORNERS = np.array([[1, 0], [1, 1], [0, 1], [-1, 1], [-1, 0], [-1, -1], [0, -1], [1, -1], [1, 0]], float)
WEIGHTS = np.where(np.arange(9) % 2, np.sqrt(0.5), 1.0)
QUARTERS = KnotVector.from_multiplicities(np.linspace(0, 1, 5), [3, 2, 2, 2, 3], 2)


def face(curves=()):
    """A face bounded by the given curves."""
    trims = tuple(Trim(i, curve) for i, curve in enumerate(curves))
    return Face(0, "bspline", 0, trims, False, np.eye(4), np.zeros((2, 3)))


def segment(a, b):
    return Curve(KnotVector.clamped([0, 1], 1), np.array([a, b], float))


def polygon(*points):
    return [segment(a, b) for a, b in zip(points, [*points[1:], points[0]], strict=True)]


def rectangle(u0, v0, u1, v1):
    return polygon((u0, v0), (u1, v0), (u1, v1), (u0, v1))


def circle(centre, radius):
    """Exact rational circle of four quadratic arcs."""
    return Curve(QUARTERS, np.asarray(centre) + radius * CORNERS, WEIGHTS)


def plane(spans=8, degree=3, size=1.0, height=1.0):
    """The rectangle [0, size] × [0, height], parameterised by x and y."""
    u = KnotVector.clamped(np.linspace(0, size, spans + 1), degree)
    v = KnotVector.clamped(np.linspace(0, height, spans + 1), degree)
    x, y = np.meshgrid(u.greville(), v.greville(), indexing="ij")
    return Net(u, v, np.stack([x, y, np.zeros_like(x)], axis=-1))


def graph(function, spans, degree=5, size=1.0):
    """z = function(x, y) over [0, size]², interpolated at the Greville points."""
    net = plane(spans, degree, size, size)
    x, y = np.meshgrid(net.u.greville(), net.v.greville(), indexing="ij")
    return Net(net.u, net.v, interpolated(net.u, net.v, np.stack([x, y, function(x, y)], axis=-1)))


def cylinder(radius=2.0, length=3.0, spans=4):
    """A rational cylinder about z with a periodic first direction, u from 0 to 1 once round."""
    u = KnotVector.from_multiplicities(np.linspace(0, 1, 5), [2] * 5, 2, periodic=True)
    v = KnotVector.clamped(np.linspace(0, length, spans + 1), 1)
    poles = np.empty((8, v.count, 3))
    poles[..., :2] = radius * CORNERS[:8, None]
    poles[..., 2] = v.greville()
    return Net(u, v, poles, np.tile(WEIGHTS[:8, None], (1, v.count)))


def revolved(profile, weights, knots):
    """The rational surface of revolution about z of a profile ``(n, 2)`` of radius and height."""
    u = KnotVector.from_multiplicities(np.linspace(0, 1, 5), [2] * 5, 2, periodic=True)
    profile = np.asarray(profile, float)
    poles = np.empty((8, len(profile), 3))
    poles[..., :2] = CORNERS[:8, None] * profile[:, :1]
    poles[..., 2] = profile[:, 1]
    return Net(u, knots, poles, WEIGHTS[:8, None] * weights)


def sphere(radius=2.0):
    """A whole sphere, degenerate at both ends of v."""
    arc = radius * CORNERS[[6, 7, 0, 1, 2]]
    knots = KnotVector.from_multiplicities([0, 1, 2], [3, 2, 3], 2)
    return revolved(arc, WEIGHTS[:5], knots)


def torus(ring=5.0, tube=2.0):
    """A whole torus, periodic in both directions."""
    knots = KnotVector.from_multiplicities(np.linspace(0, 1, 5), [2] * 5, 2, periodic=True)
    return revolved(np.array([ring, 0]) + tube * CORNERS[:8], WEIGHTS[:8], knots)


def roof(angle, gap=0.0):
    """Two planes of 1 × 2 that meet at x = 1 at an angle, in one cubic net; ``gap`` parts the three knots there."""
    knots = KnotVector(np.sort([0.0] * 4 + [1.0 - gap, 1.0, 1.0 + gap] + [2.0] * 4), 3)
    v = KnotVector.clamped([0, 1, 2], 2)
    x, y = np.meshgrid(knots.greville(), v.greville(), indexing="ij")
    rise = np.where(x > 1 + gap, x - 1, 0.0) * np.tan(angle)
    return Net(knots, v, np.stack([x, y, rise], axis=-1))
