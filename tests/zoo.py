"""A zoo of bodies with faces that go right round: what exchange formats express in more than one way, or in none."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator

import cadquery as cq
from OCP.BRepBuilderAPI import BRepBuilderAPI_NurbsConvert
from OCP.TopoDS import TopoDS_Shape

Maker = Callable[[], TopoDS_Shape]


def sphere() -> cq.Workplane:
    return cq.Workplane().sphere(20)


def half_sphere() -> cq.Workplane:
    return cq.Workplane().sphere(20).cut(cq.Workplane().box(50, 50, 50).translate((0, 0, -25)))


def torus() -> cq.Workplane:
    return cq.Workplane(obj=cq.Solid.makeTorus(20, 8))


def cylinder() -> cq.Workplane:
    return cq.Workplane().circle(15).extrude(30)


def cone() -> cq.Workplane:
    return cq.Workplane(obj=cq.Solid.makeCone(18, 0, 30))


def frustum() -> cq.Workplane:
    return cq.Workplane(obj=cq.Solid.makeCone(18, 10, 30))


def vase() -> cq.Workplane:
    """A tube of revolution about z, closed by two discs."""
    profile = cq.Workplane("XZ").lineTo(12, 0).spline([(18, 10), (11, 22), (15, 32)], includeCurrent=True)
    return profile.lineTo(0, 32).close().revolve(360, (0, 0, 0), (0, 1, 0))


def egg() -> cq.Workplane:
    """Of revolution about z, with poles at both ends."""
    profile = cq.Workplane("XZ").spline(
        [(0, -18), (14, -6), (11, 10), (0, 20)], tangents=[(1, 0), (-1, 0)], includeCurrent=False
    )
    return profile.close().revolve(360, (0, 0, 0), (0, 1, 0))


def ring() -> cq.Workplane:
    """A closed profile of spline about z."""
    profile = cq.Workplane("XZ").spline([(14, 0), (21, 6), (27, 1), (20, -7)], periodic=True).wire().val()
    return cq.Workplane(obj=cq.Solid.revolve(profile, [], 360, cq.Vector(0, 0, 0), cq.Vector(0, 0, 1)))


def loft() -> cq.Workplane:
    return cq.Workplane().circle(14).workplane(offset=16).ellipse(18, 11).workplane(offset=16).circle(12).loft()


def bean() -> cq.Workplane:
    """A closed spline, extruded: a periodic B-spline curve makes its wall."""
    points = [(15, 0), (9, 12), (-8, 9), (-14, -3), (-3, -8), (8, -12)]
    return cq.Workplane().spline(points, periodic=True).close().extrude(30)


BODIES: dict[str, Callable[[], cq.Workplane]] = {
    each.__name__: each for each in (sphere, half_sphere, torus, cylinder, cone, frustum, vase, egg, ring, loft, bean)
}
"""Bodies around the z axis, their closing edges in the half plane y = 0 < x."""


def rod(angle: float, height: float, radius: float = 3.0, start: float = 0.0) -> cq.Workplane:
    """A rod outwards, from a distance to the axis."""
    radial = cq.Vector(math.cos(math.radians(angle)), math.sin(math.radians(angle)), 0)
    axis = cq.Solid.makeCylinder(radius, 60, radial * start + cq.Vector(0, 0, height), radial)
    return cq.Workplane(obj=axis)


def post(low: float, high: float, radius: float = 4.0, x: float = 0.0) -> cq.Workplane:
    return cq.Workplane(obj=cq.Solid.makeCylinder(radius, high - low, cq.Vector(x, 0, low), cq.Vector(0, 0, 1)))


HOLES: dict[str, Callable[[float], list[cq.Workplane]]] = {
    "whole": lambda z: [],
    "hole": lambda z: [rod(130, z)],
    "holes": lambda z: [rod(100, z), rod(220, z)],
    "seam": lambda z: [rod(0, z)],
    "opposite": lambda z: [rod(180, z)],
    "pole": lambda z: [post(z, 60)],
    "poles": lambda z: [post(-60, 60)],
    "offpole": lambda z: [post(z, 60, x=3.0)],
    "blind": lambda z: [rod(130, z, start=20 if z < 1.5 else 0)],
    "blinds": lambda z: [rod(100, z, start=20), rod(220, z, start=20)],
    "blindseam": lambda z: [rod(0, z, start=20)],
    "slot": lambda z: [cq.Workplane().box(60, 6, 6).translate((0, 0, z))],
    "ringcut": lambda z: [cq.Workplane().circle(60).circle(5).extrude(3).translate((0, 0, z))],
}


def height(body: str) -> float:
    return {"sphere": 4.0, "half_sphere": 9.0, "torus": 1.0, "egg": 2.0, "ring": 0.5}.get(body, 12.0)


def nurbs(shape: TopoDS_Shape) -> TopoDS_Shape:
    return BRepBuilderAPI_NurbsConvert(shape, True).Shape()


def cut(body: str, hole: str) -> TopoDS_Shape:
    made = BODIES[body]()
    for tool in HOLES[hole](height(body)):
        made = made.cut(tool)
    return made.val().wrapped


def zoo() -> Iterator[tuple[str, Maker]]:
    for body in BODIES:
        for hole in HOLES:
            yield f"{body}-{hole}", lambda body=body, hole=hole: cut(body, hole)
            yield f"{body}-{hole}-nurbs", lambda body=body, hole=hole: nurbs(cut(body, hole))
