"""Bulk conversion of curves and surfaces between the kernel and numpy.

Getting control points one at a time costs a microsecond each, setting them several.  The kernel's binary writer and
reader transfer the same numbers at a fraction of that, and numpy reads and writes them in place.
"""

from __future__ import annotations

import io
from collections.abc import Sequence

import numpy as np
from OCP.BinTools import BinTools_Curve2dSet, BinTools_CurveSet, BinTools_SurfaceSet
from OCP.Geom import Geom_BezierSurface, Geom_BSplineSurface, Geom_RectangularTrimmedSurface, Geom_Surface
from OCP.Geom2d import Geom2d_BSplineCurve, Geom2d_Curve, Geom2d_Line, Geom2d_TrimmedCurve
from OCP.Geom2dConvert import Geom2dConvert
from OCP.gp import gp_Pnt, gp_Pnt2d
from OCP.TColgp import TColgp_Array1OfPnt2d, TColgp_Array2OfPnt
from OCP.TColStd import TColStd_Array1OfInteger, TColStd_Array1OfReal, TColStd_Array2OfReal

from mracad.bspline.curve import Curve
from mracad.bspline.knots import KnotVector
from mracad.bspline.surface import Net
from mracad.memo import kept

Array = np.ndarray
_KNOTS = np.dtype([("knot", "<f8"), ("mult", "<i4")])
_SPLINE = 7  # the kernel's number for a B-spline curve
_SAME_RANGE = 1e-9  # relative to the range: a curve whose domain differs by less is used as it is


def basis(surface: Geom_Surface) -> Geom_Surface:
    """The surface under any rectangular trimming."""
    while isinstance(surface, Geom_RectangularTrimmedSurface):
        surface = surface.BasisSurface()
    return surface


def is_nurbs(surface: Geom_Surface) -> bool:
    """Whether an (untrimmed) surface is a B-spline or Bézier surface."""
    return isinstance(surface, Geom_BSplineSurface | Geom_BezierSurface)


def nets(surfaces: Sequence[Geom_Surface]) -> list[Net]:
    """The control nets of B-spline and Bézier surfaces.

    Parameters
    ----------
    surfaces : sequence of Geom_BSplineSurface or Geom_BezierSurface
        Distinct surfaces.
    """
    collection = BinTools_SurfaceSet()
    for surface in surfaces:
        collection.Add(surface)
    stream = _Stream(collection)
    return [_net(stream, isinstance(surface, Geom_BezierSurface)) for surface in surfaces]


def set_poles(surface: Geom_BSplineSurface | Geom_BezierSurface, poles: Array) -> None:
    """Give a surface other control points ``(nu, nv, 3)``, in place; weights stay.

    The kernel takes them from the columns' polygons.
    """
    count, polygons = poles.shape[:2]
    table = np.zeros(
        polygons,
        [
            ("type", "u1"), ("rational", "u1"), ("periodic", "u1"), ("degree", "<u2"), ("poles", "<i4"),
            ("knots", "<i4"), ("pole", "<f8", (count, 3)), ("knot", _KNOTS, count),
        ],
    )  # fmt: skip
    table["type"], table["degree"], table["poles"], table["knots"] = _SPLINE, 1, count, count
    table["pole"] = poles.swapaxes(0, 1)
    table["knot"]["knot"], table["knot"]["mult"] = np.arange(count), 1
    table["knot"]["mult"][:, [0, -1]] = 2
    columns = BinTools_CurveSet()
    columns.Read(io.BytesIO(b"Curves %d\n" % polygons + table.tobytes()))
    for j in range(1, polygons + 1):
        surface.SetPoleCol(j, columns.Curve(j).Poles())


def spline(net: Net) -> Geom_BSplineSurface:
    """The kernel's surface over a control net."""
    poles = TColgp_Array2OfPnt(1, net.u.count, 1, net.v.count)
    weights = TColStd_Array2OfReal(1, net.u.count, 1, net.v.count)
    given = np.ones(net.poles.shape[:2]) if net.weights is None else net.weights
    for (i, j), weight in np.ndenumerate(given):
        poles.SetValue(i + 1, j + 1, gp_Pnt(*net.poles[i, j].tolist()))
        weights.SetValue(i + 1, j + 1, float(weight))
    (u, u_mults), (v, v_mults) = _multiplicities(net.u), _multiplicities(net.v)
    directions = net.u.degree, net.v.degree, net.u.periodic, net.v.periodic
    if net.weights is None:
        return Geom_BSplineSurface(poles, u, v, u_mults, v_mults, *directions)
    return Geom_BSplineSurface(poles, weights, u, v, u_mults, v_mults, *directions)


def _multiplicities(knots: KnotVector) -> tuple[TColStd_Array1OfReal, TColStd_Array1OfInteger]:
    """Distinct knots and their multiplicities as the kernel wants them."""
    values, counts = knots.breaks, knots.multiplicities
    if not knots.periodic:
        values, counts = np.unique(knots.knots, return_counts=True)
    breaks, mults = TColStd_Array1OfReal(1, len(values)), TColStd_Array1OfInteger(1, len(values))
    for i, (value, count) in enumerate(zip(values.tolist(), counts.tolist(), strict=True), 1):
        breaks.SetValue(i, value)
        mults.SetValue(i, count)
    return breaks, mults


def curves(pieces: Sequence[tuple[Geom2d_Curve, float, float]]) -> list[Curve]:
    """Plane curves as NURBS, each over its own range.

    Parameters
    ----------
    pieces : sequence of (curve, first, last)
        A conic keeps its shape and its ends, but its parameter differs inside the range.
    """
    splines: list[Geom2d_BSplineCurve | None] = [_spline(*piece) for piece in pieces]
    collection = BinTools_Curve2dSet()
    places = [collection.Add(spline) if spline is not None else 0 for spline in splines]
    stream = _Stream(collection)
    read = [_curve(stream) for _ in range(max(places, default=0))]
    return [read[place - 1] if place else _segment(*piece) for piece, place in zip(pieces, places, strict=True)]


def plane_spline(curve: Curve) -> Geom2d_BSplineCurve:
    """The kernel's curve of a polynomial plane curve that is not periodic."""
    poles = TColgp_Array1OfPnt2d(1, len(curve.poles))
    for i, (x, y) in enumerate(curve.poles.tolist(), 1):
        poles.SetValue(i, gp_Pnt2d(x, y))
    return Geom2d_BSplineCurve(poles, *_multiplicities(curve.knots), curve.knots.degree)


class _Stream:
    """The output of the kernel's binary writer, read from the front; little-endian on every machine."""

    def __init__(self, collection: BinTools_SurfaceSet | BinTools_Curve2dSet) -> None:
        buffer = io.BytesIO()
        collection.Write(buffer)
        self.data = buffer.getvalue()
        self.at = self.data.index(b"\n") + 1

    def take(self, dtype: str | np.dtype, count: int) -> Array:
        """The next ``count`` values."""
        values = np.frombuffer(self.data, dtype, count, self.at)
        self.at += values.nbytes
        return values


def _net(stream: _Stream, bezier: bool) -> Net:
    """The next surface."""
    if bezier:
        _, u_rational, v_rational = stream.take("u1", 3).tolist()
        p, q = stream.take("<u2", 2).tolist()
        poles, weights = _poles(stream, (p + 1, q + 1), 3, u_rational or v_rational)
        u, v = KnotVector.clamped([0.0, 1.0], p), KnotVector.clamped([0.0, 1.0], q)
    else:
        _, u_rational, v_rational, u_periodic, v_periodic = stream.take("u1", 5).tolist()
        p, q = stream.take("<u2", 2).tolist()
        nu, nv, mu, mv = stream.take("<i4", 4).tolist()
        poles, weights = _poles(stream, (nu, nv), 3, u_rational or v_rational)
        u = _knots(stream, mu, p, bool(u_periodic))
        v = _knots(stream, mv, q, bool(v_periodic))
    return Net(u, v, poles, weights)


def _curve(stream: _Stream) -> Curve:
    """The next B-spline curve."""
    _, rational, periodic = stream.take("u1", 3).tolist()
    (degree,) = stream.take("<u2", 1).tolist()
    count, knots = stream.take("<i4", 2).tolist()
    poles, weights = _poles(stream, (count,), 2, rational)
    return Curve(_knots(stream, knots, degree, bool(periodic)), poles, weights)


def _poles(stream: _Stream, shape: tuple[int, ...], dimension: int, rational: int) -> tuple[Array, Array | None]:
    """Poles, and weights where the kernel interleaves them."""
    width = dimension + bool(rational)
    values = stream.take("<f8", int(np.prod(shape)) * width).reshape(*shape, width)
    poles = np.ascontiguousarray(values[..., :dimension])
    return poles, np.ascontiguousarray(values[..., dimension]) if rational else None


def _knots(stream: _Stream, count: int, degree: int, periodic: bool) -> KnotVector:
    return _vector(stream.take(_KNOTS, count).tobytes(), degree, periodic)


@kept(4096)
def _vector(table: bytes, degree: int, periodic: bool) -> KnotVector:
    """The vector of a table of knots, which many curves and surfaces share."""
    knots = np.frombuffer(table, _KNOTS)
    return KnotVector.from_multiplicities(knots["knot"], knots["mult"], degree, periodic)


def _spline(curve: Geom2d_Curve, first: float, last: float) -> Geom2d_BSplineCurve | None:
    """A plane curve over its range as a B-spline; None for a line."""
    if isinstance(curve, Geom2d_Line):
        return None
    slack = _SAME_RANGE * (last - first)
    whole = abs(curve.FirstParameter() - first) <= slack and abs(curve.LastParameter() - last) <= slack
    if isinstance(curve, Geom2d_BSplineCurve) and whole and not curve.IsPeriodic():
        return curve
    if whole and not curve.IsPeriodic():
        return Geom2dConvert.CurveToBSplineCurve_s(curve)
    return Geom2dConvert.CurveToBSplineCurve_s(Geom2d_TrimmedCurve(curve, first, last))


def _segment(line: Geom2d_Curve, first: float, last: float) -> Curve:
    """A straight line over its range."""
    ends = (line.Value(first), line.Value(last))
    return Curve(KnotVector([first, first, last, last], 1), np.array([point.Coord() for point in ends]), None)
