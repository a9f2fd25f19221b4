"""A zoo of bodies with faces that go right round: what exchange formats express in more than one way, or in none."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator

import cadquery as cq
import numpy as np
from OCP.BRep import BRep_Builder, BRep_Tool
from OCP.BRepBuilderAPI import (
    BRepBuilderAPI_MakeFace,
    BRepBuilderAPI_MakeSolid,
    BRepBuilderAPI_NurbsConvert,
    BRepBuilderAPI_Sewing,
    BRepBuilderAPI_Transform,
)
from OCP.BRepCheck import BRepCheck_Analyzer
from OCP.BRepLib import BRepLib
from OCP.BRepTools import BRepTools
from OCP.gp import gp_Ax1, gp_Ax2, gp_Dir, gp_Pnt, gp_Trsf
from OCP.ShapeFix import ShapeFix_Shape
from OCP.TopAbs import TopAbs_FACE
from OCP.TopExp import TopExp_Explorer
from OCP.TopLoc import TopLoc_Location
from OCP.TopoDS import TopoDS, TopoDS_Face, TopoDS_Shape, TopoDS_Shell

from mracad.model.displacement import Displacement, Offset
from mracad.occ.apply import apply
from mracad.occ.document import Document
from mracad.occ.view import view
from mracad.seam.hold import separate
from mracad.wavelet.ladder import arc_lengths
from tests.occ import shapes

Maker = Callable[[], TopoDS_Shape]
_FREE = 30  # control points that should get noise


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


def capsule() -> cq.Workplane:
    """Domes of revolution whose arcs would go on beyond the axis."""
    profile = cq.Workplane("XZ").moveTo(0, -15).threePointArc((8, -8), (8, 0)).lineTo(8, 10)
    return profile.threePointArc((6, 16), (0, 18)).close().revolve(360, (0, 0, 0), (0, 1, 0))


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
    return sound(made.val().wrapped)


def sound(shape: TopoDS_Shape) -> TopoDS_Shape:
    """A shape as the kernel heals it, where its booleans left it invalid."""
    if BRepCheck_Analyzer(shape).IsValid():
        return shape
    healing = ShapeFix_Shape(shape)
    healing.Perform()
    return healing.Shape()


def cavity(body: str, hole: str) -> TopoDS_Shape:
    """A block with a body out of its middle, and channels to it."""
    made = cq.Workplane().box(90, 90, 90).cut(BODIES[body]())
    for tool in HOLES[hole](height(body)):
        made = made.cut(tool)
    return sound(made.val().wrapped)


def mirrored(shape: TopoDS_Shape) -> TopoDS_Shape:
    flip = gp_Trsf()
    flip.SetMirror(gp_Ax2(gp_Pnt(1, 2, 3), gp_Dir(1, 1, 0)))
    return BRepBuilderAPI_Transform(shape, flip, True).Shape()


def placed(shape: TopoDS_Shape) -> TopoDS_Shape:
    turn = gp_Trsf()
    turn.SetRotation(gp_Ax1(gp_Pnt(1, 2, 3), gp_Dir(1, 2, 2)), 1.1)
    return shape.Moved(TopLoc_Location(turn))


def halved(body: str) -> TopoDS_Shape:
    """A body whose faces are in two parts on the same surfaces."""
    half = cq.Workplane().box(100, 50, 100)
    left, right = (BODIES[body]().intersect(half.translate((0, y, 0))) for y in (25, -25))
    return sound(left.union(right, clean=False).val().wrapped)


def turned(shape: TopoDS_Shape, angle: float = 1.0) -> TopoDS_Shape:
    """A whole body of revolution whose one closing edge lies elsewhere than that of its surface."""
    made = BRepBuilderAPI_Sewing(1e-6)
    for face in faces(shape):
        surface = BRep_Tool.Surface_s(face)
        low_u, high_u, low_v, high_v = BRepTools.UVBounds_s(face)
        if surface.IsUPeriodic():
            face = BRepBuilderAPI_MakeFace(surface, low_u + angle, high_u + angle, low_v, high_v, 1e-7).Face()
        made.Add(face)
    made.Perform()
    builder, shell = BRep_Builder(), TopoDS_Shell()
    builder.MakeShell(shell)
    for face in faces(made.SewedShape()):
        builder.Add(shell, face)
    shell.Closed(True)
    solid = BRepBuilderAPI_MakeSolid(shell).Solid()
    BRepLib.OrientClosedSolid_s(solid)
    return solid


def faces(shape: TopoDS_Shape) -> Iterator[TopoDS_Face]:
    explorer = TopExp_Explorer(shape, TopAbs_FACE)
    while explorer.More():
        yield TopoDS.Face_s(explorer.Current())
        explorer.Next()


def closed() -> Iterator[tuple[str, Maker]]:
    """Every body with every hole, as it is and as NURBS; and more ways to have them."""

    def both(name: str, maker: Maker) -> Iterator[tuple[str, Maker]]:
        yield name, maker
        yield f"{name}-nurbs", lambda: sound(nurbs(maker()))

    for body in BODIES:
        for hole in HOLES:
            yield from both(f"{body}-{hole}", lambda body=body, hole=hole: cut(body, hole))
        yield from both(f"{body}-halved", lambda body=body: halved(body))
    yield from both("capsule", lambda: capsule().val().wrapped)
    for body in ("sphere", "egg", "vase", "cylinder", "cone"):
        yield from both(f"{body}-turned", lambda body=body: turned(cut(body, "whole")))
    for body in ("sphere", "egg", "ring", "vase"):
        for hole in ("whole", "hole", "seam", "pole"):
            yield from both(f"{body}-{hole}-cavity", lambda body=body, hole=hole: cavity(body, hole))
        for hole in ("hole", "holes", "seam"):
            yield from both(f"{body}-{hole}-mirrored", lambda body=body, hole=hole: mirrored(cut(body, hole)))
            yield from both(f"{body}-{hole}-placed", lambda body=body, hole=hole: placed(cut(body, hole)))


def rounded_box() -> cq.Workplane:
    return cq.Workplane().box(40, 30, 20).edges().fillet(4)


def chamfered_box() -> cq.Workplane:
    return cq.Workplane().box(40, 30, 20).edges("|Z").fillet(6).faces(">Z").chamfer(2)


def shelled() -> cq.Workplane:
    return cq.Workplane().box(40, 30, 20).edges("|Z").fillet(6).faces(">Z").shell(2)


def square_to_round() -> cq.Workplane:
    return cq.Workplane().rect(30, 20).workplane(offset=25).circle(8).loft()


def pipe() -> cq.Workplane:
    path = cq.Workplane("XY").spline([(0, 0), (20, 5), (40, 30), (60, 20)])
    return cq.Workplane("YZ").circle(4).sweep(path)


def twisted() -> cq.Workplane:
    return cq.Workplane().rect(20, 12).twistExtrude(30, 60)


def sector() -> cq.Workplane:
    """Revolved by less than a turn."""
    profile = cq.Workplane("XZ").moveTo(10, 0).spline([(18, 6), (14, 16), (20, 25)], includeCurrent=True)
    return profile.lineTo(10, 25).close().revolve(200, (0, 0, 0), (0, 1, 0))


def crossing_pipes() -> cq.Workplane:
    across = cq.Workplane("YZ").circle(6).extrude(50).translate((-25, 0, 0))
    return cq.Workplane().circle(10).extrude(40, both=True).union(across)


def blended() -> cq.Workplane:
    """A boss on a plate, the joint between them filleted."""
    return cq.Workplane().box(40, 40, 6).faces(">Z").workplane().circle(10).extrude(12).edges("%CIRCLE").fillet(2)


def drilled() -> cq.Workplane:
    """A freeform top with holes through it."""
    profile = cq.Workplane("XZ").lineTo(40, 0).lineTo(40, 10).spline([(28, 14), (12, 8), (0, 12)], includeCurrent=True)
    return profile.close().extrude(-30).faces("<Z").workplane(origin=(20, 15, 0)).rarray(16, 12, 2, 2).hole(5)


def lettered() -> cq.Workplane:
    return cq.Workplane().box(40, 20, 4).faces(">Z").workplane().text("Sg", 12, 2)


SOLIDS: dict[str, Callable[[], cq.Workplane]] = {
    each.__name__: each
    for each in (
        rounded_box, chamfered_box, shelled, square_to_round, pipe, twisted, sector, crossing_pipes, blended, drilled,
        lettered,
    )
}  # fmt: skip
"""Bodies as they are drawn every day."""


def halvings(net):
    """A surface with ever more knots, in search of free points: ever shorter spans are halved."""
    coarse, u_knots, v_knots = net, np.empty(0), np.empty(0)
    while net.poles.shape[0] * net.poles.shape[1] < 10_000:
        spans = arc_lengths(net, 0), arc_lengths(net, 1)
        halves_u, halves_v = (
            ((k.breaks[:-1] + k.breaks[1:]) / 2)[s > max(spans[0].max(), spans[1].max()) / 2]
            for k, s in zip((net.u, net.v), spans, strict=True)
        )
        u_knots, v_knots = np.sort(np.r_[u_knots, halves_u]), np.sort(np.r_[v_knots, halves_v])
        net = coarse.refined(u_knots, v_knots)
        yield net, u_knots, v_knots


def noisy(shape: TopoDS_Shape, size: float = 0.03, seed: int = 1) -> Document:
    """A document with a body as NURBS, and noise on those control points (of finer nets) that no edge looks at."""
    document = shapes.document(nurbs(shape), names={0: "body"})
    model = view(document)
    rng, offsets = np.random.default_rng(seed), {}
    for surface in model.surfaces:
        on = [model.faces[face] for face in surface.faces]
        for net, *knots in halvings(surface.net):
            free = separate(net, on, surface.faces).free
            if free.sum() >= _FREE:
                noise = size * rng.standard_normal(net.poles.shape)
                offsets[surface.index] = Offset(np.where(free[..., None], noise, 0.0), *knots)
                break
    apply(document, model, Displacement(offsets))
    return document


def bumped(place: tuple[float, float, float] = (-8.0, 0.0, 10.0), width: float = 1.2) -> Document:
    """The rounded box as NURBS, with a bump on its top."""
    document = shapes.document(nurbs(rounded_box().val().wrapped), names={0: "box"})
    model = view(document)
    tops = [s for s in model.surfaces if np.abs(s.net.poles[..., 2] - place[2]).max() < 1e-9]
    inner = np.linspace(0, 1, 42)[1:-1]
    knots = [low + (high - low) * inner for low, high in (kv.domain for kv in (tops[0].net.u, tops[0].net.v))]
    poles = tops[0].net.refined(*knots).poles
    rise = np.exp(-np.square(poles - place).sum(axis=-1) / (2 * width**2))
    delta = np.where((rise > 1e-6)[..., None], rise[..., None] * np.array([0.0, 0.0, 0.5]), 0.0)
    apply(document, model, Displacement({tops[0].index: Offset(delta, *knots)}))
    return document
