"""Grounds with known geometry for features to lie on, as STEP files, and the closed form of a bump on them."""

import numpy as np

from mracad.bspline.fit import interpolated as at_greville
from mracad.bspline.knots import KnotVector
from mracad.bspline.surface import Net
from mracad.wavelet.ladder import arc_lengths
from samples.models import documents, geometry, topology
from tests.edit.models import fitted
from tests.edit.panels import interpolated
from tests.occ import shapes

HEIGHT, SIGMA = 2.0, 4.0


def bump(r, height=HEIGHT, sigma=SIGMA):
    """The height of a bump at a geodesic distance from its middle, mm."""
    return height * np.exp(-((r / sigma) ** 2) / 2)


def plane(side=200.0, centre=(50.0, 50.0), height=HEIGHT):
    """A plane of 1 mm bicubic spans with one bump."""
    k = KnotVector.clamped(np.linspace(0.0, side, int(side) + 1), 3)
    return fitted(
        k, k, lambda x, y: bump(np.hypot(x - centre[0], y - centre[1]), height), u_of=lambda t: t, v_of=lambda t: t
    )


def uneven(side=200.0, degrees=(2, 3), origin=(0.0, 0.0, 0.0), seed=1):
    """A bare plane over other knots of spans up to a sixth of the side; x and y are not the parameters."""
    rng = np.random.default_rng(seed)
    knots = []
    for degree in degrees:
        steps = np.cumsum(rng.uniform(0.3, 3.0, 12))
        knots.append(KnotVector.clamped(np.r_[0.0, steps / steps[-1]], degree))
    u, v = knots
    x, y = np.meshgrid(side * u.greville(), side * v.greville(), indexing="ij")
    return Net(u, v, np.stack([x, y, 0 * x], axis=-1) + np.array(origin))


_ARC = np.sqrt(0.5)


def _quarter():
    """Poles (cos, sin) and weights of a quarter of a circle."""
    return np.array([[1.0, 0.0], [1.0, 1.0], [0.0, 1.0]]), np.array([1.0, _ARC, 1.0])


def cylinder(radius, length, origin=(0.0, 0.0, 0.0)):
    """A quarter of a cylinder about y through the origin, outside up: rational quadratic times quadratic, one span."""
    arc, weights = _quarter()
    k = KnotVector.clamped([0.0, 1.0], 2)
    heights = np.array([0.0, length / 2, length])
    poles = np.zeros((3, 3, 3))
    poles[..., 0], poles[..., 2] = radius * arc[::-1, 0][:, None], radius * arc[::-1, 1][:, None]
    poles[..., 1] = heights
    return Net(k, k, poles + np.array(origin), np.repeat(weights[:, None], 3, axis=1))


def sphere(radius, origin=(0.0, 0.0, 0.0)):
    """An eighth of a sphere, rational biquadratic with a pole at the top."""
    arc, weights = _quarter()
    k = KnotVector.clamped([0.0, 1.0], 2)
    poles = np.zeros((3, 3, 3))
    for j in range(3):
        poles[:, j, 0], poles[:, j, 1] = radius * arc[j, 0] * arc[:, 0], radius * arc[j, 0] * arc[:, 1]
        poles[:, j, 2] = radius * arc[j, 1]
    return Net(k, k, poles + np.array(origin), np.outer(weights, weights))


def save(path, *nets):
    """Faces on nets, in one STEP file."""
    faces = []
    for net in nets:
        degrees = (net.u.degree, net.v.degree)
        weights = () if net.weights is None else (net.weights,)
        faces.append(shapes.face_on(geometry.surface(net.poles, net.u.knots, net.v.knots, degrees, *weights)))
    return shapes.save(shapes.compound(*faces) if len(faces) > 1 else faces[0], path)


def rhombi(side=60.0, spans=30, bend=0.0, degree=3, turns=("", "", "")):
    """Three rhombi around the origin, on z = bend (x² + y²) / 2, as one shell: a corner of three patches.

    ``turns``: per patch, ``x`` where its parameters are swapped.
    """
    corner = [side * np.array([np.cos(a), np.sin(a)]) for a in np.radians([90, 210, 330])]
    k = KnotVector.clamped(np.linspace(0.0, 1.0, spans + 1), degree)
    lift = lambda p: np.r_[p, bend * (p @ p) / 2]  # noqa: E731
    hub = topology.vertex(lift(np.zeros(2)))
    rim = [topology.vertex(lift(c)) for c in corner]
    tips = [topology.vertex(lift(corner[i] + corner[(i + 1) % 3])) for i in range(3)]

    u, v = np.meshgrid(k.greville(), k.greville(), indexing="ij")
    nets = []
    for i in range(3):
        p, q = corner[i], corner[(i + 1) % 3]
        x, y = (u * p[axis] + v * q[axis] for axis in (0, 1))
        paraboloid = lambda s, t, p=p, q=q: bend / 2 * sum((s * p[k] + t * q[k]) ** 2 for k in (0, 1))  # noqa: E731
        nets.append(Net(k, k, np.stack([x, y, _interpolated(k, paraboloid)], axis=-1)))
    spokes = [
        topology.edge(geometry.curve(nets[i].poles[:, 0], k.knots, degree), (hub, rim[i]), (0.0, 1.0)) for i in range(3)
    ]
    faces = []
    for i, n in enumerate(nets):
        far = [
            topology.edge(geometry.curve(n.poles[-1], k.knots, degree), (rim[i], tips[i]), (0.0, 1.0)),
            topology.edge(geometry.curve(n.poles[:, -1], k.knots, degree), (rim[(i + 1) % 3], tips[i]), (0.0, 1.0)),
        ]
        way = (lambda a, b: (b, a)) if turns[i] == "x" else (lambda a, b: (a, b))
        loop = [
            topology.Side(spokes[i], geometry.line2d(way(0.0, 0.0), way(1, 0))),
            topology.Side(far[0], geometry.line2d(way(1.0, 0.0), way(0, 1))),
            topology.Side(far[1], geometry.line2d(way(0.0, 1.0), way(1, 0)), False),
            topology.Side(spokes[(i + 1) % 3], geometry.line2d(way(0.0, 0.0), way(0, 1)), False),
        ]
        poles = n.poles.swapaxes(0, 1) if turns[i] == "x" else n.poles
        face = topology.face(
            geometry.surface(poles, k.knots, k.knots, (degree, degree)), [loop], outward=turns[i] != "x"
        )
        faces.append(face)
    return documents.single(topology.shell(faces), "rhombi")


def _cylinder(a, b, h, radius):
    return (radius + h) * np.sin(a / radius), b, (radius + h) * np.cos(a / radius)


def _sphere(a, b, h, radius):
    s, t, r = a / radius, b / radius, radius + h
    return r * np.sin(s) * np.cos(t), r * np.sin(t), r * np.cos(s) * np.cos(t)


def _torus(a, b, h, radius, tube):
    s, t = a / tube, b / (radius + tube)
    away = radius + (tube + h) * np.cos(s)
    return (tube + h) * np.sin(s), away * np.sin(t), away * np.cos(t)


def _cone(a, b, h, radius, slope):
    cos, sin = 1 / np.hypot(1, slope), slope / np.hypot(1, slope)
    away = radius + slope * cos * a + h * cos
    return a * cos - h * sin, away * np.sin(b / radius), away * np.cos(b / radius)


def _waves(a, b, h, height, length):
    s, t = a / length + 0.3, 0.8 * b / length + 0.2
    slopes = height / length * np.cos(s) * np.cos(t), -0.8 * height / length * np.sin(s) * np.sin(t)
    size = np.sqrt(1 + slopes[0] ** 2 + slopes[1] ** 2)
    return a - h * slopes[0] / size, b - h * slopes[1] / size, height * np.sin(s) * np.cos(t) + h / size


GROUNDS = {
    "plane": lambda a, b, h: (a, b, 0 * a + h),
    "cylinder 30": lambda a, b, h: _cylinder(a, b, h, 30.0),
    "cone 40": lambda a, b, h: _cone(a, b, h, 40.0, 0.3),
    "sphere 60": lambda a, b, h: _sphere(a, b, h, 60.0),
    "torus 60/25": lambda a, b, h: _torus(a, b, h, 60.0, 25.0),
    "waves 8/30": lambda a, b, h: _waves(a, b, h, 8.0, 30.0),
}
"""Grounds as functions to x, y and z of a, b and the height above, mm; at a = b = 0 they are 1 mm to the mm."""


def above(name, height, half=40.0, spans=160):
    """A bicubic net on a ground, with a height function of a and b, for both up to ``half`` mm."""
    k = KnotVector.clamped(np.linspace(-half, half, spans + 1), 3)
    a, b = np.meshgrid(k.greville(), k.greville(), indexing="ij")
    return Net(k, k, at_greville(k, k, np.stack(GROUNDS[name](a, b, height(a, b)), axis=-1)))


def _interpolated(k, function):
    """Poles of the spline over k × k that takes the values of a function at the Greville points."""
    at = k.greville()
    return interpolated(k, at, interpolated(k, at, function(*np.meshgrid(at, at, indexing="ij"))).T).T


def bumped(net, span, distance, normal):
    """A net refined to spans of about ``span`` mm, with a bump along normals; both are functions of points."""
    lengths = [arc_lengths(net, axis).sum() for axis in (0, 1)]
    extra = [np.linspace(*k.domain, int(x / span) + 1)[1:-1] for k, x in zip((net.u, net.v), lengths, strict=True)]
    fine = net.refined(*extra)
    at = fine.u.greville(), fine.v.greville()
    points = fine.grid(*at)
    weight = Net(fine.u, fine.v, fine.weights[..., None]).grid(*at)
    delta = at_greville(fine.u, fine.v, weight * bump(distance(points))[..., None] * normal(points))
    return Net(fine.u, fine.v, fine.poles + delta / fine.weights[..., None], fine.weights)


def ball(radius, spans=12, degree=3):
    """A sphere of six sewn patches, those of a cube: bicubic, equiangular, outside out."""
    k = KnotVector.clamped(np.linspace(-np.pi / 4, np.pi / 4, spans + 1), degree)
    u, v = np.tan(np.meshgrid(k.greville(), k.greville(), indexing="ij"))
    nets = []
    for axis in range(3):
        for sign in (1.0, -1.0):
            normal = sign * np.eye(3)[axis]
            a = np.eye(3)[(axis + 1) % 3]
            points = normal + u[..., None] * a + v[..., None] * np.cross(normal, a)
            points *= radius / np.linalg.norm(points, axis=-1, keepdims=True)
            nets.append(Net(k, k, at_greville(k, k, points)))
    return nets


def sewn(nets, name="sewn"):
    """Patches over natural domains as one shell: sides whose control points agree share an edge, corners a vertex."""
    vertices, edges, faces = {}, {}, []
    for net in nets:
        (u0, u1), (v0, v1) = net.u.domain, net.v.domain
        sides = [
            (net.poles[:, 0], net.u, (0.0, v0), (1, 0), True),
            (net.poles[-1], net.v, (u1, 0.0), (0, 1), True),
            (net.poles[:, -1], net.u, (0.0, v1), (1, 0), False),
            (net.poles[0], net.v, (u0, 0.0), (0, 1), False),
        ]
        loop = []
        for poles, k, at, way, forward in sides:
            ends = [tuple(np.round(p, 6) + 0.0) for p in (poles[0], poles[-1])]
            for end, p in zip(ends, (poles[0], poles[-1]), strict=True):
                vertices.setdefault(end, topology.vertex(p))
            key = (*sorted(ends), *np.round(np.sort(poles.mean(axis=0)), 5).tolist())
            if key not in edges:
                curve = geometry.curve(poles, k.knots, k.degree)
                edges[key] = topology.edge(curve, (vertices[ends[0]], vertices[ends[1]]), k.domain), ends[0]
            shape, first = edges[key]
            turned = first != ends[0]
            low, high = k.domain
            start = np.array(at) + np.array(way) * (low + high if turned else 0.0)
            line = geometry.line2d(tuple(start), tuple(-w if turned else w for w in way))
            loop.append(topology.Side(shape, line, forward != turned))
        surface = geometry.surface(net.poles, net.u.knots, net.v.knots, (net.u.degree, net.v.degree))
        faces.append(topology.face(surface, [loop]))
    closed = len(edges) == 2 * len(nets)
    return documents.single(topology.solid(faces) if closed else topology.shell(faces), name)
