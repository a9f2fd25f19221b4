"""Edges that slid along a neighbour: their curves on it, and the edges that end at their vertices."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, field

import numpy as np
from OCP.BRep import BRep_Builder, BRep_CurveRepresentation, BRep_Tool
from OCP.BRepAdaptor import BRepAdaptor_Curve, BRepAdaptor_Surface
from OCP.ElCLib import ElCLib
from OCP.Geom import Geom_BSplineCurve, Geom_Plane, Geom_Surface, Geom_TrimmedCurve
from OCP.Geom2d import Geom2d_Curve, Geom2d_Line
from OCP.GeomAbs import GeomAbs_CurveType
from OCP.GeomAPI import GeomAPI
from OCP.gp import gp_Pnt
from OCP.TopExp import TopExp
from OCP.TopLoc import TopLoc_Location
from OCP.TopoDS import TopoDS_Edge, TopoDS_Face, TopoDS_TShape, TopoDS_Vertex

from mracad.bspline.closest import feet
from mracad.bspline.curve import Curve
from mracad.bspline.fit import curve_through
from mracad.bspline.knots import KnotVector
from mracad.occ.geometry import basis, is_nurbs, nets, plane_spline
from mracad.occ.rails import elementary
from mracad.occ.topology import matrix

Array = np.ndarray

_CLOSE = 1e-8  # memory units by which a curve on a surface may miss its edge; knots are inserted up to then
_HALVINGS, _PIECES, _DEGREE = 5, 8, 3
_STILL = 1e-9  # memory units: a vertex that moved by less counts as still


@dataclass(eq=False)
class Laid:
    """The curve of an edge on a face, removed until there is a new one.

    Attributes
    ----------
    edge : TopoDS_Edge
        Forward.
    face : TopoDS_Face
        Forward.
    curve : Geom2d_Curve or None
        None on a plane that does not store it.
    span : (float, float)
        Its range.
    """

    edge: TopoDS_Edge
    face: TopoDS_Face
    curve: Geom2d_Curve | None
    span: tuple[float, float]

    @classmethod
    def bare(cls, edge: TopoDS_Edge, face: TopoDS_Face) -> Laid:
        """Remove the curve."""
        surface, span = BRep_Tool.Surface_s(face, TopLoc_Location()), BRep_Tool.Range_s(edge, face)
        curve = BRep_Tool.CurveOnSurface_s(edge, face, 0.0, 0.0)
        if any(each.IsCurveOnSurface() and each.Surface() == surface for each in edge.TShape().Curves()):
            BRep_Builder().UpdateEdge(edge, None, face, 0.0)
            return cls(edge, face, curve, span)
        return cls(edge, face, None, span)

    def again(self) -> None:
        """Give the edge a new one along its new 3D curve, near the old one."""
        if self.curve is None:
            return
        builder, (first, last) = BRep_Builder(), BRep_Tool.Range_s(self.edge)
        location = TopLoc_Location()
        surface = basis(BRep_Tool.Surface_s(self.face, location))
        if isinstance(surface, Geom_Plane):
            plane = surface.Pln().Transformed(location.Transformation())
            found = GeomAPI.To2d_s(BRep_Tool.Curve_s(self.edge, 0.0, 0.0), plane)
        else:
            found = plane_spline(_fitted(_knots(self.edge), self._placed, self._missed))
        builder.UpdateEdge(self.edge, found, self.face, 0.0)
        builder.Range(self.edge, first, last)

    def _placed(self, t: Array) -> Array:
        """Parameters ``(q, 2)`` on the face at those of the edge."""
        first, last = BRep_Tool.Range_s(self.edge)
        assert self.curve is not None
        then = self.span[0] + (t - first) / (last - first) * (self.span[1] - self.span[0])
        near, at = np.array([self.curve.Value(x).Coord() for x in then.tolist()]), _points(self.edge, t)
        location = TopLoc_Location()
        surface = basis(BRep_Tool.Surface_s(self.face, location))
        if is_nurbs(surface):
            frame = matrix(location)
            return feet(nets([surface])[0], (at - frame[:3, 3]) @ frame[:3, :3], near)[0]
        ground = elementary(self.face)
        assert ground is not None
        uv, turn = ground.parameters(at), np.array(ground.periods)
        return np.asarray(uv + turn * np.round((near - uv) / np.where(turn > 0, turn, 1.0)))

    def _missed(self, t: Array, uv: Array) -> Array:
        """Distances between places on the face and the edge, ``(q,)``."""
        surface = BRepAdaptor_Surface(self.face, False)
        on = np.array([surface.Value(*place).Coord() for place in uv.tolist()])
        return np.asarray(np.linalg.norm(on - _points(self.edge, t), axis=1))


@dataclass(eq=False)
class Sliding:
    """Edges that slide and edges that end on them, in their state before.

    Attributes
    ----------
    slid : dict of int to (TopoDS_Edge, TopoDS_Face)
        Edges that slide by index, each with the face that stays, both forward.
    ending : dict of int to (TopoDS_Edge, list of TopoDS_Face)
        Edges on lines and circles that end on them, by index, with their faces, all forward.
    curves : list of (TopoDS_Edge, list of BRep_CurveRepresentation, float)
        The curves and tolerances of all of them, without curves on faces that move.
    grounds : list of Geom_Surface
        The surfaces of faces that stay.
    vertices : dict of TopoDS_TShape to (gp_Pnt, float)
        Points, in their own frames, and tolerances of the vertices at their ends.
    """

    slid: dict[int, tuple[TopoDS_Edge, TopoDS_Face]]
    ending: dict[int, tuple[TopoDS_Edge, list[TopoDS_Face]]]
    curves: list[tuple[TopoDS_Edge, list[BRep_CurveRepresentation], float]] = field(init=False)
    grounds: list[Geom_Surface] = field(init=False)
    vertices: dict[TopoDS_TShape, tuple[gp_Pnt, float]] = field(init=False)

    def __post_init__(self) -> None:
        edges = [edge for edge, _ in (*self.slid.values(), *self.ending.values())]
        stays = [BRep_Tool.Surface_s(face, TopLoc_Location()) for face in self._staying()]
        self.grounds = stays
        self.curves = [
            (edge, [each.Copy() for each in _held(edge, stays)], BRep_Tool.Tolerance_s(edge)) for edge in edges
        ]
        self.vertices = {
            each.TShape(): (each.TShape().Pnt(), BRep_Tool.Tolerance_s(each)) for edge in edges for each in ends(edge)
        }

    def _staying(self) -> Iterator[TopoDS_Face]:
        """The faces that stay."""
        yield from (face for _, face in self.slid.values())
        yield from (face for _, faces in self.ending.values() for face in faces)

    def bare(self) -> list[Laid]:
        """Remove the curves of edges that slide from the faces that stay."""
        return [Laid.bare(*each) for each in self.slid.values()]

    def again(self, bare: Iterable[Laid]) -> list[tuple[TopoDS_Edge, TopoDS_Face]]:
        """Make new curves, and let edges end at vertices that moved; returns edges with new curves and their faces."""
        for each in bare:
            each.again()
        trimmed = [(edge, faces) for edge, faces in self.ending.values() if self._retrimmed(edge, faces)]
        return [*self.slid.values(), *((edge, face) for edge, faces in trimmed for face in faces)]

    def loose(self, limit: float) -> set[int]:
        """The edges whose tolerance has grown beyond a limit, memory units."""
        both = zip((*self.slid, *self.ending), self.curves, strict=True)
        return {number for number, (edge, _, was) in both if BRep_Tool.Tolerance_s(edge) > max(was, limit)}

    def restore(self) -> None:
        """Restore the state before."""
        for edge, curves, tolerance in self.curves:
            shape = edge.TShape()
            again = _held(edge, self.grounds)
            moved = [each for each in shape.Curves() if each not in again]
            held = shape.ChangeCurves()
            held.Clear()
            for curve in (*curves, *moved):
                held.Append(curve)
            shape.Tolerance(tolerance)
        for shape, (point, tolerance) in self.vertices.items():
            shape.Pnt(point)
            shape.Tolerance(tolerance)

    def _retrimmed(self, edge: TopoDS_Edge, faces: Iterable[TopoDS_Face]) -> bool:
        """Let an edge end at vertices that moved; returns whether any did."""
        span = BRep_Tool.Range_s(edge)
        where = [
            (self.vertices[each.TShape()][0].Transformed(each.Location().Transformation()), BRep_Tool.Pnt_s(each))
            for each in ends(edge)
        ]
        if all(old.Distance(new) <= _STILL for old, new in where):
            return False
        start, end = (t + _advance(edge, *pair) for t, pair in zip(span, where, strict=True))
        builder, location = BRep_Builder(), TopLoc_Location()
        curve = BRep_Tool.Curve_s(edge, location, 0.0, 0.0)
        if isinstance(curve, Geom_TrimmedCurve):
            builder.UpdateEdge(edge, curve.BasisCurve(), location, 0.0)
        straight = (BRep_Tool.CurveOnSurface_s(edge, face, 0.0, 0.0) for face in faces)
        again = [
            Laid.bare(edge, face)
            for face, curve in zip(faces, straight, strict=True)
            if not isinstance(curve, Geom2d_Line)
        ]
        builder.Range(edge, start, end)
        for each in again:
            each.again()
        return True


def _held(edge: TopoDS_Edge, surfaces: Sequence[Geom_Surface]) -> list[BRep_CurveRepresentation]:
    """The curves of an edge in space and on some surfaces."""
    return [
        each
        for each in edge.TShape().Curves()
        if each.IsCurve3D() or (each.IsCurveOnSurface() and each.Surface() in surfaces)
    ]


def ends(edge: TopoDS_Edge) -> tuple[TopoDS_Vertex, TopoDS_Vertex]:
    """The vertices at which a forward edge begins and ends."""
    return TopExp.FirstVertex_s(edge), TopExp.LastVertex_s(edge)


def _advance(edge: TopoDS_Edge, old: gp_Pnt, new: gp_Pnt) -> float:
    """How far a point moved along the line or circle of an edge, as a parameter."""
    curve = BRepAdaptor_Curve(edge)
    if curve.GetType() == GeomAbs_CurveType.GeomAbs_Line:
        return float(ElCLib.Parameter_s(curve.Line(), new) - ElCLib.Parameter_s(curve.Line(), old))
    step = float(ElCLib.Parameter_s(curve.Circle(), new) - ElCLib.Parameter_s(curve.Circle(), old))
    return step - 2 * np.pi * round(step / (2 * np.pi))


def _points(edge: TopoDS_Edge, t: Array) -> Array:
    """Points of an edge at parameters, ``(q, 3)``."""
    curve = BRepAdaptor_Curve(edge)
    return np.array([curve.Value(x).Coord() for x in t.tolist()])


def _knots(edge: TopoDS_Edge) -> KnotVector:
    """Initial knots for the curve of an edge."""
    curve, (first, last) = BRep_Tool.Curve_s(edge, 0.0, 0.0), BRep_Tool.Range_s(edge)
    if not isinstance(curve, Geom_BSplineCurve):
        return KnotVector.clamped(np.linspace(first, last, _PIECES + 1), _DEGREE)
    degree = max(curve.Degree(), _DEGREE)
    every = [(curve.Knot(i), curve.Multiplicity(i)) for i in range(1, curve.NbKnots() + 1)]
    inner = [(knot, min(times, degree)) for knot, times in every if first < knot < last]
    breaks, counts = [first, *(k for k, _ in inner), last], [degree + 1, *(n for _, n in inner), degree + 1]
    return KnotVector.from_multiplicities(breaks, counts, degree)


def _fitted(knots: KnotVector, place: Callable[[Array], Array], missed: Callable[[Array, Array], Array]) -> Curve:
    """The curve in a parameter plane through places at parameters; knots are inserted until it is close enough.

    Parameters
    ----------
    knots : KnotVector
        The initial knots.
    place : callable
        ``place(t)``, places ``(q, 2)``.
    missed : callable
        ``missed(t, uv)``, distances ``(q,)``.
    """
    for _ in range(_HALVINGS):
        found = curve_through(knots, place(knots.greville()))
        steps = np.diff(knots.breaks)
        between = (knots.breaks[:-1] + steps * np.array([[0.17], [0.5], [0.83]])).ravel()
        if missed(between, found.evaluate(between)[0]).max() <= _CLOSE:
            break
        knots = knots.refined(knots.breaks[:-1] + steps / 2)
    return found
