"""Solids whose noisy, sculpted top meets flat and round sides in sharp edges; the top is known without its noise."""

from itertools import pairwise

import cadquery
import numpy as np
from OCP.BRepBuilderAPI import BRepBuilderAPI_MakeFace
from OCP.gp import gp_Dir, gp_Pln, gp_Pnt
from OCP.ShapeFix import ShapeFix_Solid

from mracad.bspline.knots import KnotVector
from mracad.bspline.surface import Net
from mracad.occ.geometry import spline
from samples.models import documents

SIZE, HEIGHT = 100.0, 30.0
SPANS, NOISE, SEED = 40, 0.05, 1
SCALE = "12mm"


def nets(spans=SPANS, noise=NOISE, seed=SEED):
    """The top without its noise and with it; along its sides the noise is only upward."""
    knots = KnotVector.clamped(np.linspace(0, SIZE, spans + 1), 3)
    x, y = np.meshgrid(knots.greville(), knots.greville(), indexing="ij")
    poles = np.stack([x, y, HEIGHT + 4 * np.sin(2 * np.pi * x / 90) * np.cos(2 * np.pi * y / 110)], axis=-1)
    shake = noise * np.random.default_rng(seed).standard_normal(poles.shape)
    for side in (0, -1):
        shake[side, :, :2] = shake[:, side, :2] = 0.0
    return Net(knots, knots, poles), Net(knots, knots, poles + shake)


def halves(net):
    """A top cut in two along its middle, as two patches of the same knots."""
    middle, degree = SIZE / 2, net.u.degree
    fine = net.refined(np.repeat(middle, degree - 1), ())
    knots = fine.u.knots
    at = int(np.searchsorted(knots, middle, side="right"))
    left = KnotVector(np.append(knots[:at], middle), degree)
    right = KnotVector(np.append(middle, knots[at - degree :]), degree)
    return Net(left, fine.v, fine.poles[: left.count]), Net(right, fine.v, fine.poles[left.count - 1 :])


def block(*nets):
    """A solid of a top, in one or more patches, four flat sides and a flat bottom."""
    tops = [cadquery.Face(BRepBuilderAPI_MakeFace(spline(net), 1e-7).Face()) for net in nets]
    corners = [(0, 0, 0), (SIZE, 0, 0), (SIZE, SIZE, 0), (0, SIZE, 0)]
    bottom = cadquery.Wire.makePolygon([cadquery.Vector(*each) for each in corners], close=True)
    sides = [_side(tops, axis, at) for axis in (0, 1) for at in (0.0, SIZE)]
    faces = [*tops, cadquery.Face.makeFromWires(bottom), *sides]
    fix = ShapeFix_Solid(cadquery.Solid.makeSolid(cadquery.Shell.makeShell(faces)).wrapped)
    fix.Perform()
    return cadquery.Shape.cast(fix.Solid())


def _side(tops, axis, at):
    """The flat face under the edges of tops in a plane x or y = const."""
    ends = {e: [p.toTuple() for p in (e.startPoint(), e.endPoint())] for top in tops for e in top.Edges()}
    edges = [each for each, points in ends.items() if all(abs(point[axis] - at) < 1e-6 for point in points)]
    start, *_, end = sorted((point for each in edges for point in ends[each]), key=lambda point: point[1 - axis])
    path = [start, (*start[:2], 0.0), (*end[:2], 0.0), end]
    lines = [cadquery.Edge.makeLine(cadquery.Vector(*a), cadquery.Vector(*b)) for a, b in pairwise(path)]
    wire = cadquery.Wire.assembleEdges([*edges, *lines])
    normal = gp_Dir(*np.eye(3)[axis].tolist())
    return cadquery.Face(BRepBuilderAPI_MakeFace(gp_Pln(gp_Pnt(*start), normal), wire.wrapped).Face())


def _up(solid):
    return lambda body: body.intersect(solid())


MIDDLE = cadquery.Vector(50, 50, 0)
SHAPES = {
    "block": lambda body: body,
    "boss": lambda body: body.fuse(cadquery.Solid.makeCylinder(15, 50, cadquery.Vector(45, 55, 0))),
    "cone": _up(lambda: cadquery.Solid.makeCone(45, 25, 60, MIDDLE)),
    "sphere": _up(lambda: cadquery.Solid.makeSphere(40, MIDDLE + cadquery.Vector(0, 0, 20), angleDegrees1=-90)),
    "torus": _up(lambda: cadquery.Solid.makeTorus(25, 20, MIDDLE + cadquery.Vector(0, 0, 22))),
    "rounded": _up(lambda: cadquery.Workplane().rect(80, 80).extrude(60).edges("|Z").fillet(12).val().move(_there())),
    "drafted": _up(lambda: cadquery.Workplane().rect(70, 75).extrude(60, taper=8).val().move(_there())),
}


def _there():
    return cadquery.Location(MIDDLE)


def document(name, net):
    """A block, with a boss through it, or on another base."""
    return documents.single(SHAPES[name](block(net)).wrapped, name)


def walled(net):
    """A block cut out by a vertical NURBS wall, which stays: a wave in plan, extruded through the top."""
    knots = KnotVector.clamped(np.linspace(0, 1, 9), 3)
    across = KnotVector.clamped([0.0, 1.0], 1)
    x = -10 + 120 * knots.greville()
    wall = np.stack([x, 60 + 6 * np.sin(x / 15), np.full_like(x, -10)], axis=-1)
    poles = np.stack([wall, wall + np.array([0, 0, 70])], axis=1)
    tool = cadquery.Face(BRepBuilderAPI_MakeFace(spline(Net(knots, across, poles)), 1e-7).Face())
    halves = block(net).split(tool).Solids()
    return documents.single(min(halves, key=lambda each: each.Center().y).wrapped, "walled")
