"""Kernel-free models for the edits: one untrimmed face on a surface."""

import numpy as np

from mracad.bspline.curve import Curve
from mracad.bspline.knots import KnotVector
from mracad.bspline.surface import Net
from mracad.model.brep import Edge, Face, Model, Side, Surface, Trim


def segment(a, b):
    return Curve(KnotVector.clamped([0, 1], 1), np.array([a, b], float))


def sheet(net, frame=None, diagonal=None):
    """A model of one face that covers all of ``net``, its four sides free edges."""
    (u0, u1), (v0, v1) = net.u.domain, net.v.domain
    corners = [(u0, v0), (u1, v0), (u1, v1), (u0, v1)]
    trims = tuple(Trim(i, segment(corners[i], corners[(i + 1) % 4])) for i in range(4))
    flat = net.poles.reshape(-1, 3)
    box = np.array([flat.min(axis=0), flat.max(axis=0)])
    face = Face(0, "bspline", 0, trims, False, np.eye(4) if frame is None else frame, box)
    size = float(np.linalg.norm(box[1] - box[0])) if diagonal is None else diagonal
    edges = tuple(free_edge(i, net, trim.curve) for i, trim in enumerate(trims))
    return Model("sheet", (Surface(0, net, (0,)),), (face,), edges, size)


def free_edge(index, net, curve):
    """An edge of one face along a pcurve."""
    uv = curve.evaluate(0.5 - 0.5 * np.cos(np.pi * (np.arange(25) + 0.5) / 25))[0]
    points = net.evaluate(uv)
    tangents = np.gradient(points, axis=0)
    tangents /= np.maximum(np.linalg.norm(tangents, axis=1, keepdims=True), 1e-300)
    return Edge(index, points, tangents, (Side(0, uv=uv),), 1e-7)


def fitted(u, v, height, size=100.0, u_of=None, v_of=None):
    """A height field z = height(x, y) over a square of ``size`` mm as a net: x = u_of(u) and y = v_of(v) in mm.

    Coordinates are interpolated at the Greville points, so x and y are reproduced as far as the spaces allow.
    """
    from mracad.bspline.basis import basis

    def collocation(k):
        first, values = basis(k, k.greville())
        dense = np.zeros((k.count, k.count))
        for i, (f, row) in enumerate(zip(first, values, strict=True)):
            dense[i, f : f + len(row)] = row
        return dense

    us, vs = u.greville(), v.greville()
    x = us * size if u_of is None else u_of(us)
    y = vs * size if v_of is None else v_of(vs)
    grid = np.stack([*np.meshgrid(x, y, indexing="ij"), height(*np.meshgrid(x, y, indexing="ij"))], axis=-1)
    a, b = collocation(u), collocation(v)
    poles = np.linalg.solve(a, grid.reshape(len(us), -1)).reshape(grid.shape)
    return Net(
        u,
        v,
        np.linalg.solve(b, poles.transpose(1, 0, 2).reshape(len(vs), -1))
        .reshape(len(vs), len(us), 3)
        .transpose(1, 0, 2),
    )


def rotation(axis, angle):
    """Rotation matrix about an axis."""
    k = np.asarray(axis, float) / np.linalg.norm(axis)
    cross = np.array([[0, -k[2], k[1]], [k[2], 0, -k[0]], [-k[1], k[0], 0]])
    return np.eye(3) + np.sin(angle) * cross + (1 - np.cos(angle)) * cross @ cross


def noisy():
    """A curved net of 16 × 14 control points on uneven knots, about 1 mm apart, with noise of 0.02 mm."""
    u, v = (KnotVector.clamped(np.cumsum([0.0, *(1 + 0.2 * np.sin(np.arange(n)))]), 3) for n in (13, 11))
    x, y = np.meshgrid(u.greville(), v.greville(), indexing="ij")
    noise = 0.02 * np.random.default_rng(2).standard_normal(x.shape)
    return Net(u, v, np.stack([x, y, 0.02 * (x - 6) ** 2 + 0.01 * x * y + noise], axis=-1))
