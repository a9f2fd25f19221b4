"""A noisy panel in two halves that meet along a wavy trim curve, each on a surface of its own."""

import numpy as np

from mracad.bspline.knots import KnotVector
from mracad.bspline.surface import Net
from samples.models import documents, geometry, topology
from tests.edit import panels

SIZE = 200.0
LOW, HIGH = 60.0, 150.0
SHEAR = 0.25
"""The right half lies on a surface whose parameters are u = x − SHEAR y and v = y."""


def waist(y):
    """x of the trim curve."""
    return 85.0 + 0.15 * y + 8.0 * np.sin(2 * np.pi * y / SIZE)


def surfaces(noise, spans):
    """The clean panel, and the nets of both halves; the right one, with other knots, takes its heights from the left.

    Parameters
    ----------
    noise : float
        Standard deviation of the heights of the left net's control points, mm.
    spans : (int, int)
        Of the right net.
    """
    clean, left = panels.whole(16, noise, patches=(2, 2))
    left.poles[..., :2] = clean.poles[..., :2]
    return clean, left, _sheared(spans, lambda x, y: left.evaluate(np.stack([x, y], axis=1))[:, 2])


def quiet(noise, spans, distance=25.0, seed=3):
    """Nets of both halves of a cubic surface, which meet exactly; noise on the left only, and away from the seam."""

    def height(x, y):
        p, q = x / SIZE, y / SIZE
        return 40 * (p**3 - 2 * p * q * q + q * q - p * p)

    _, left = panels.whole(16, 0.0, patches=(2, 2))
    u, v = left.u, left.v
    x, y = left.poles[..., 0], left.poles[..., 1]
    left.poles[..., 2] = _fitted(u, v, height(x, y))
    rough = noise * np.random.default_rng(seed).standard_normal(x.shape)
    left.poles[..., 2] += np.where(np.abs(x - waist(y)) < distance, 0.0, rough)
    return left, _sheared(spans, height)


def _sheared(spans, height):
    u = KnotVector.clamped(np.linspace(LOW, HIGH, spans[0] + 1), 3)
    v = KnotVector.clamped(np.linspace(0.0, SIZE, spans[1] + 1), 3)
    places = np.stack(np.meshgrid(u.greville(), v.greville(), indexing="ij"), axis=-1)
    places[..., 0] += SHEAR * places[..., 1]
    heights = _fitted(u, v, height(*places.reshape(-1, 2).T).reshape(places.shape[:2]))
    return Net(u, v, np.concatenate([places, heights[..., None]], axis=-1))


def _fitted(u, v, heights):
    heights = panels.interpolated(u, u.greville(), heights)
    return panels.interpolated(v, v.greville(), heights.T).T


def document(left, right, sewn=True, beside=0.0):
    """Both halves in one shell; or each with edges of its own, the seam's running opposite ways at different paces.

    The vertices lie ``beside`` the ends of the seam, mm.
    """
    grounds = [geometry.surface(net.poles, net.u.knots, net.v.knots, (3, 3)) for net in (left, right)]
    faces = []
    edge = None
    for net, ground, shear, far in zip(
        (left, right), grounds, (0.0, SHEAR), (left.u.domain[0], right.u.domain[1]), strict=True
    ):
        row = 0 if far == net.u.domain[0] else -1
        back = not sewn and row == -1
        knots, path = _path(shear, back)
        trace = geometry.curve(path, knots.knots, 3)
        if edge is None or not sewn:
            curve = geometry.on_surface(ground, trace, 0.0, SIZE, 400)
            points = curve.poles[[-1, 0]] if back else curve.poles[[0, -1]]
            ends = [topology.vertex((x, y, z + beside), 1e-7 + 2 * beside) for x, y, z in points]
            edge = topology.edge(curve.geometry, tuple(ends[::-1] if back else ends), (0.0, SIZE), 1e-2)
        corners = [topology.vertex(net.poles[row, k]) for k in (0, -1)]
        rails = []
        for k, x in enumerate(sorted(path[[0, -1]].tolist(), key=lambda place: place[1])):
            low, high = sorted((far, x[0]))
            rail = geometry.curve(net.poles[:, -k], net.u.knots, 3)
            pair = (corners[k], ends[k]) if row == 0 else (ends[k], corners[k])
            rails.append(
                topology.Side(topology.edge(rail, pair, (low, high)), geometry.line2d((0.0, SIZE * k), (1, 0)), k == 0)
            )
        side = topology.edge(geometry.curve(net.poles[row], net.v.knots, 3), tuple(corners), (0.0, SIZE))
        outer = topology.Side(side, geometry.line2d((far, 0.0), (0, 1)), row == -1)
        inner = topology.Side(edge, trace, (row == 0) != back)
        loop = [rails[0], inner, rails[1], outer] if row == 0 else [rails[0], outer, rails[1], inner]
        faces.append(topology.face(ground, [loop]))
    return documents.single(topology.shell(faces), "halves")


def _path(shear, back):
    """Knots and control points of the trim curve in the parameter plane; ``back`` from the top down, ever faster."""
    knots = KnotVector.clamped(np.linspace(0.0, SIZE, 25), 3)
    y = knots.greville()
    if back:
        share = y / SIZE
        y = SIZE * (1 - share * (0.8 + 0.2 * share))
    points = np.stack([waist(y) - shear * y, y], axis=1)
    return knots, panels.interpolated(knots, knots.greville(), points)
