"""Solids whose noisy, sculpted top meets flat and round sides in sharp edges; the top is known without its noise."""

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


def block(net):
    """A solid of a top, four flat sides and a flat bottom."""
    top = cadquery.Face(BRepBuilderAPI_MakeFace(spline(net), 1e-7).Face())
    corners = [(0, 0, 0), (SIZE, 0, 0), (SIZE, SIZE, 0), (0, SIZE, 0)]
    bottom = cadquery.Wire.makePolygon([cadquery.Vector(*each) for each in corners], close=True)
    faces = [top, cadquery.Face.makeFromWires(bottom), *map(_side, top.Edges())]
    fix = ShapeFix_Solid(cadquery.Solid.makeSolid(cadquery.Shell.makeShell(faces)).wrapped)
    fix.Perform()
    return cadquery.Shape.cast(fix.Solid())


def _side(edge):
    """The flat face under an edge of the top."""
    start, end = edge.startPoint(), edge.endPoint()
    below = [cadquery.Vector(each.x, each.y, 0) for each in (end, start)]
    lines = zip([end, *below], [*below, start], strict=True)
    wire = cadquery.Wire.assembleEdges([edge, *(cadquery.Edge.makeLine(*each) for each in lines)])
    normal = (end - start).cross(cadquery.Vector(0, 0, 1)).normalized()
    plane = gp_Pln(gp_Pnt(*below[1].toTuple()), gp_Dir(*normal.toTuple()))
    return cadquery.Face(BRepBuilderAPI_MakeFace(plane, wire.wrapped).Face())


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
