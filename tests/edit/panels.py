"""Panels of patches with known truth, as documents: cut from one surface, then given other knots, degrees, senses."""

from dataclasses import dataclass, field, replace
from itertools import pairwise

import numpy as np

from mracad.bspline.basis import basis
from mracad.bspline.knots import KnotVector
from mracad.bspline.surface import Net
from samples.models import documents, geometry, topology

SIZE = 100.0


@dataclass(frozen=True)
class Patch:
    """A piece of the panel; ``turns`` are ``u``, ``v`` reversed, ``x`` swapped."""

    net: Net
    turns: str = ""
    frame: tuple = field(default=())

    def place(self, point):
        """Where a point of the original parameters went."""
        u, v = point
        (u0, u1), (v0, v1) = self.frame
        if "u" in self.turns:
            u = u0 + u1 - u
        if "v" in self.turns:
            v = v0 + v1 - v
        return (v, u) if "x" in self.turns else (u, v)


def truth(x, y):
    """The height of the panel."""
    p, q = 2 * np.pi * x / (3 * SIZE), 2 * np.pi * y / (2 * SIZE)
    return 15 * np.sin(p) * np.cos(0.7 * q) + 8 * np.cos(0.6 * p + q)


def whole(spans, noise, seed=3, degree=3, patches=(2, 3)):
    """Clean and noisy nets of the unsplit panel; uneven knots, those at the seams among them."""
    rng = np.random.default_rng(seed)
    knots = []
    for count in patches:
        cuts = [rng.uniform(0.7, 1.3, spans) for _ in range(count)]
        breaks = np.concatenate([[0.0], *[SIZE * (k + np.cumsum(c) / c.sum()) for k, c in enumerate(cuts)]])
        breaks[spans::spans] = SIZE * np.arange(1, count + 1)
        knots.append(KnotVector.clamped(breaks, degree))
    u, v = knots
    x, y = np.meshgrid(u.greville(), v.greville(), indexing="ij")
    poles = np.stack([x, y, truth(x, y)], axis=-1)
    return Net(u, v, poles), Net(u, v, poles + noise * rng.standard_normal(poles.shape))


def cut(net, patches):
    """Patches ``{(i, j): Patch}`` of a net along its lines u, v = multiples of the size."""
    found = {}
    u, v = (
        k.refined(np.repeat(SIZE * np.arange(1, n), k.degree - 1)) for k, n in zip((net.u, net.v), patches, strict=True)
    )
    fine = net.over(u, v)
    for i in range(patches[0]):
        for j in range(patches[1]):
            (rows, ku), (columns, kv) = _piece(u, i), _piece(v, j)
            frame = (SIZE * i, SIZE * (i + 1)), (SIZE * j, SIZE * (j + 1))
            found[i, j] = Patch(Net(ku, kv, fine.poles[rows][:, columns]), "", frame)
    return found


def _piece(knots, k):
    low, high = SIZE * k, SIZE * (k + 1)
    d = knots.degree
    inner = knots.knots[(knots.knots > low) & (knots.knots < high)]
    first = int(np.searchsorted(knots.knots, low, side="right")) - d - 1
    own = KnotVector(np.concatenate([[low] * (d + 1), inner, [high] * (d + 1)]), d)
    return slice(first, first + own.count), own


def refined(patch, u_knots=(), v_knots=()):
    """The patch with more knots."""
    return replace(patch, net=patch.net.refined(np.asarray(u_knots, float), np.asarray(v_knots, float)))


def elevated(net, axis, times=1):
    """The net with a higher degree in one direction, by interpolation at the new Greville points."""
    for _ in range(times):
        old = (net.u, net.v)[axis]
        new = KnotVector.from_multiplicities(old.breaks, old.multiplicities + 1, old.degree + 1)
        at = new.greville()
        poles = interpolated(new, at, values(old, at) @ np.moveaxis(net.poles, axis, 0).reshape(old.count, -1))
        shape = (new.count, *np.moveaxis(net.poles, axis, 0).shape[1:])
        poles = np.moveaxis(poles.reshape(shape), 0, axis)
        net = Net(new, net.v, poles) if axis == 0 else Net(net.u, new, poles)
    return net


def values(knots, at):
    """The dense matrix of basis functions at parameters."""
    first, local = basis(knots, at)
    matrix = np.zeros((len(at), knots.count))
    for k in range(knots.degree + 1):
        matrix[np.arange(len(at)), first + k] = local[:, k]
    return matrix


def interpolated(knots, at, wanted):
    """Poles of the spline that takes values at parameters."""
    return np.linalg.solve(values(knots, at), wanted)


def turned(patch, how):
    """The patch with parameters reversed (``u``, ``v``) and then swapped (``x``)."""
    net = patch.net
    if "u" in how:
        net = Net(_mirrored(net.u), net.v, net.poles[::-1])
    if "v" in how:
        net = Net(net.u, _mirrored(net.v), net.poles[:, ::-1])
    if "x" in how:
        net = Net(net.v, net.u, net.poles.swapaxes(0, 1))
    return replace(patch, net=net, turns=how)


def _mirrored(knots):
    low, high = knots.domain
    return KnotVector((low + high - knots.knots)[::-1], knots.degree)


def document(patches, sewn=True):
    """The patches as a document, in one shell or each with edges of its own.

    Edges run along the growing parameter of the unsplit panel.
    """
    corners, edges = {}, {}
    grid = [max(k[axis] for k in patches) + 1 for axis in (0, 1)]

    def corner(i, j):
        if (i, j) not in corners:
            patch = patches[min(i, grid[0] - 1), min(j, grid[1] - 1)]
            at = patch.place((SIZE * i, SIZE * j))
            corners[i, j] = topology.vertex(patch.net.evaluate([at])[0])
        return corners[i, j]

    def edge(start, stop, patch):
        if (start, stop) not in edges:
            path = _boundary(patch, start, stop)
            edges[start, stop] = topology.edge(path, (corner(*start), corner(*stop)), (0.0, 1.0))
        return edges[start, stop]

    faces = []
    for (i, j), patch in sorted(patches.items()):
        if not sewn:
            corners, edges, grid = {}, {}, (i + 1, j + 1)
        ring = [(i, j), (i + 1, j), (i + 1, j + 1), (i, j + 1)]
        loop = []
        for k in range(4):
            start, stop = ring[k], ring[(k + 1) % 4]
            forward = start < stop
            low, high = (start, stop) if forward else (stop, start)
            ends = np.array([patch.place((SIZE * a, SIZE * b)) for a, b in (low, high)], float)
            path = geometry.curve(ends, np.array([0.0, 0.0, 1.0, 1.0]), 1)
            loop.append(topology.Side(edge(low, high, patch), path, forward))
        odd = len(patch.turns) % 2 == 1
        if odd:
            loop = [replace(side, forward=not side.forward) for side in loop[::-1]]
        net = patch.net
        on = geometry.surface(net.poles, net.u.knots, net.v.knots, (net.u.degree, net.v.degree))
        faces.append(topology.face(on, [loop], outward=not odd))
    return documents.single(topology.shell(faces), "panel")


def _boundary(patch, start, stop):
    """The curve of a patch between two corners, over 0 to 1."""
    ends = np.array([patch.place((SIZE * a, SIZE * b)) for a, b in (start, stop)], float)
    axis = 0 if ends[0, 0] == ends[1, 0] else 1
    net = patch.net
    across, along = (net.u, net.v) if axis == 0 else (net.v, net.u)
    row = 0 if ends[0, axis] == across.domain[0] else -1
    poles = net.poles[row] if axis == 0 else net.poles[:, row]
    low, high = along.domain
    knots = (along.knots - low) / (high - low)
    if ends[0, 1 - axis] > ends[1, 1 - axis]:
        knots, poles = (1.0 - knots)[::-1], poles[::-1]
    return geometry.curve(poles, knots, along.degree)


def rms(nets, patches, clean, count=40):
    """Root mean square distance of the patches, with nets ``{key: Net}``, to the unsplit clean net."""
    places = SIZE * (np.arange(count) + 0.5) / count
    total = []
    for key, patch in patches.items():
        (u0, _), (v0, _) = patch.frame
        u, v = np.meshgrid(u0 + places, v0 + places, indexing="ij")
        original = np.stack([u.ravel(), v.ravel()], axis=1)
        own = np.stack(patch.place(original.T), axis=1)
        total.append(((nets[key].evaluate(own) - clean.evaluate(original)) ** 2).sum(axis=1))
    return float(np.sqrt(np.mean(total)))


def pair(left, right):
    """Two nets over the unit square, that share the curve u = 0, as a document."""
    ends = [topology.vertex(left.poles[0, 0]), topology.vertex(left.poles[0, -1])]
    common = topology.edge(geometry.curve(right.poles[0], right.v.knots, right.v.degree), ends, (0.0, 1.0))
    faces = []
    for net in (left, right):
        far = [topology.vertex(net.poles[-1, 0]), topology.vertex(net.poles[-1, -1])]
        rails = [
            topology.edge(geometry.curve(net.poles[:, k], net.u.knots, net.u.degree), (ends[k], far[k]), (0.0, 1.0))
            for k in (0, -1)
        ]
        end = topology.edge(geometry.curve(net.poles[-1], net.v.knots, net.v.degree), far, (0.0, 1.0))
        loop = [
            topology.Side(rails[0], geometry.line2d((0.0, 0.0), (1, 0))),
            topology.Side(end, geometry.line2d((1.0, 0.0), (0, 1))),
            topology.Side(rails[1], geometry.line2d((0.0, 1.0), (1, 0)), False),
            topology.Side(common, geometry.line2d((0.0, 0.0), (0, 1)), False),
        ]
        on = geometry.surface(net.poles, net.u.knots, net.v.knots, (net.u.degree, net.v.degree))
        faces.append(topology.face(on, [loop]))
    return documents.single(topology.shell([faces[0].Reversed(), faces[1]]), "pair")


def thirds(noisy):
    """The nets of half of the panel and of two quarters beside it, by their corners."""
    quarters = cut(noisy, (2, 2))
    fine = noisy.over(noisy.u.refined(np.repeat(SIZE, noisy.u.degree - 1)), noisy.v)
    rows, u = _piece(fine.u, 0)
    return {
        (0, 0, 1, 2): Net(u, noisy.v, fine.poles[rows]),
        (1, 0, 2, 1): quarters[1, 0].net,
        (1, 1, 2, 2): quarters[1, 1].net,
    }


def junction(noisy):
    """Half of the panel as one patch and two quarters beside it, as a document: a T-junction."""
    quarters, nets = cut(noisy, (2, 2)), thirds(noisy)
    corners = {(i, j): topology.vertex(noisy.evaluate([(SIZE * i, SIZE * j)])[0]) for i in range(3) for j in range(3)}
    edges, faces = {}, []
    for (i0, j0, i1, j1), net in nets.items():
        right = [(i1, j) for j in ([j0, 1, j1] if j1 - j0 == 2 and i1 == 1 else [j0, j1])]
        ring = [(i0, j0), *right, (i0, j1), (i0, j0)]
        loop = []
        for start, stop in pairwise(ring):
            low, high = sorted((start, stop))
            if (low, high) not in edges:
                short = high[0] - low[0] + high[1] - low[1] == 1
                beside = (
                    quarters[min(low[0], 1), min(low[1], 1)] if short else Patch(net, "", ((0, SIZE), (0, 2 * SIZE)))
                )
                edges[low, high] = topology.edge(
                    _boundary(beside, low, high), (corners[low], corners[high]), (0.0, 1.0)
                )
            ends = SIZE * np.array([low, high], float)
            path = geometry.curve(ends, np.array([0.0, 0.0, 1.0, 1.0]), 1)
            loop.append(topology.Side(edges[low, high], path, start < stop))
        on = geometry.surface(net.poles, net.u.knots, net.v.knots, (net.u.degree, net.v.degree))
        faces.append(topology.face(on, [loop]))
    return documents.single(topology.shell(faces), "junction")
