"""Lofted blades with waves along the span, and their truth."""

import numpy as np

from mracad.bspline.fit import interpolated
from mracad.bspline.knots import KnotVector
from mracad.bspline.surface import Net

SPAN, CHORD, WAVE, HEIGHT = 600.0, 100.0, 60.0, 0.5


def profile(s, edge=0.02):
    """Around a NACA 0012 with a blunt trailing edge: s from −1 below over the nose to 1, x = s²."""
    x, a = s * s, np.abs(s)
    half = 0.6 * (0.2969 * a - 0.126 * x - 0.3516 * x**2 + 0.2843 * x**3 - 0.1015 * x**4) + edge * x
    return x, np.sign(s) * half


def blade(counts=(61, 81)):
    """A tapered, twisted and swept blade with its span along z, u around the profile; and the same with waves."""
    u = KnotVector.clamped(np.linspace(-1, 1, counts[0] - 2), 3)
    v = KnotVector.clamped(np.linspace(0, 1, counts[1] - 2), 3)
    us, vs = np.meshgrid(u.greville(), v.greville(), indexing="ij")
    x, y = profile(us)
    chord, twist = CHORD * (1 - 0.4 * vs), np.radians(20.0) * vs
    x, y = (x - 0.3) * chord, y * chord
    turned = x * np.cos(twist) - y * np.sin(twist) + 30.0 * vs, x * np.sin(twist) + y * np.cos(twist)
    points = np.stack([*turned, SPAN * vs], axis=-1)
    clean = Net(u, v, interpolated(u, v, points))
    normals = clean.normals(np.stack([us.ravel(), vs.ravel()], axis=1)).reshape(points.shape)
    waves = HEIGHT * np.sin(2 * np.pi * SPAN * vs / WAVE)
    return clean, Net(u, v, interpolated(u, v, points + waves[..., None] * normals))


def swapped(net):
    """The same surface with u and v swapped."""
    return Net(net.v, net.u, net.poles.swapaxes(0, 1))


def left(clean, net, margin=0.1):
    """Largest wave that is left, mm, and largest change of the profile, over the span without its ends."""
    us, vs = np.linspace(-1, 1, 201), np.linspace(margin, 1 - margin, 401)[:-1]
    normals = clean.normals(np.stack(np.meshgrid(us, vs, indexing="ij"), axis=-1).reshape(-1, 2))
    off = ((net.grid(us, vs) - clean.grid(us, vs)) * normals.reshape(len(us), len(vs), 3)).sum(axis=-1)
    wave = np.exp(2j * np.pi * SPAN * vs / WAVE)
    return float(2 * np.abs(off @ wave / len(vs)).max()), float(np.abs(off.mean(axis=1)).max())
