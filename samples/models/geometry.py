"""Curves and surfaces of the kernel from plain numbers."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from OCP.Geom import (
    Geom_BSplineCurve,
    Geom_BSplineSurface,
    Geom_Surface,
)
from OCP.Geom2d import Geom2d_BSplineCurve, Geom2d_Curve, Geom2d_Line
from OCP.gp import gp_Dir2d, gp_Pnt, gp_Pnt2d, gp_Vec, gp_Vec2d
from OCP.TColgp import TColgp_Array1OfPnt, TColgp_Array1OfPnt2d, TColgp_Array2OfPnt
from OCP.TColStd import TColStd_Array1OfInteger, TColStd_Array1OfReal, TColStd_Array2OfReal

from .splines import settle

FINE = 16  # bits after the point of what the kernel computed: 2e-5 mm


def _reals(values: Sequence[float]) -> TColStd_Array1OfReal:
    array = TColStd_Array1OfReal(1, len(values))
    for i, value in enumerate(values, 1):
        array.SetValue(i, float(value))
    return array


def _knots(knots: np.ndarray) -> tuple[TColStd_Array1OfReal, TColStd_Array1OfInteger]:
    values, counts = np.unique(knots, return_counts=True)
    multiplicities = TColStd_Array1OfInteger(1, len(counts))
    for i, count in enumerate(counts, 1):
        multiplicities.SetValue(i, int(count))
    return _reals(values), multiplicities


def surface(
    poles: np.ndarray,
    u_knots: np.ndarray,
    v_knots: np.ndarray,
    degrees: tuple[int, int] = (3, 3),
    weights: np.ndarray | None = None,
    u_periodic: bool = False,
) -> Geom_BSplineSurface:
    """Return a B-spline surface; a periodic one is given each distinct knot of one turn, ends included."""
    rows, columns, _ = poles.shape
    net = TColgp_Array2OfPnt(1, rows, 1, columns)
    shares = TColStd_Array2OfReal(1, rows, 1, columns)
    for i in range(rows):
        for j in range(columns):
            net.SetValue(i + 1, j + 1, gp_Pnt(*map(float, poles[i, j])))
            shares.SetValue(i + 1, j + 1, 1.0 if weights is None else float(weights[i, j]))
    (u, mu), (v, mv) = _knots(u_knots), _knots(v_knots)
    if weights is None:
        return Geom_BSplineSurface(net, u, v, mu, mv, *degrees, u_periodic, False)
    return Geom_BSplineSurface(net, shares, u, v, mu, mv, *degrees, u_periodic, False)


def curve(
    poles: np.ndarray, knots: np.ndarray, degree: int = 3, weights: np.ndarray | None = None, periodic: bool = False
) -> Geom_BSplineCurve | Geom2d_BSplineCurve:
    """Return a B-spline curve, planar where the poles have two coordinates; knots as for `surface`."""
    flat = poles.shape[1] == 2
    net = (TColgp_Array1OfPnt2d if flat else TColgp_Array1OfPnt)(1, len(poles))
    for i, pole in enumerate(poles, 1):
        net.SetValue(i, (gp_Pnt2d if flat else gp_Pnt)(*map(float, pole)))
    kind = Geom2d_BSplineCurve if flat else Geom_BSplineCurve
    if weights is None:
        return kind(net, *_knots(knots), degree, periodic)
    return kind(net, _reals(weights), *_knots(knots), degree, periodic)


def line2d(start: Sequence[float], direction: Sequence[float]) -> Geom2d_Line:
    """Return the line through `start` in the parameter plane."""
    return Geom2d_Line(gp_Pnt2d(*map(float, start)), gp_Dir2d(*map(float, direction)))


@dataclass(frozen=True)
class Path3:
    """A curve in space with its poles and knots at hand."""

    poles: np.ndarray
    knots: np.ndarray
    degree: int = 3
    weights: np.ndarray | None = None

    @property
    def geometry(self) -> Geom_BSplineCurve:
        """The kernel's curve."""
        return curve(self.poles, self.knots, self.degree, self.weights)


def on_surface(base: Geom_Surface, path: Geom2d_Curve, first: float, last: float, pieces: int) -> Path3:
    """Return the curve in space over a parameter-plane curve: C1 cubic Hermite interpolation in `pieces` pieces."""
    times = np.linspace(first, last, pieces + 1)
    step = (last - first) / pieces / 3.0
    place, speed, point, along_u, along_v = gp_Pnt2d(), gp_Vec2d(), gp_Pnt(), gp_Vec(), gp_Vec()
    places, poles = [], []
    for time in times:
        path.D1(float(time), place, speed)
        base.D1(place.X(), place.Y(), point, along_u, along_v)
        here = np.array([point.X(), point.Y(), point.Z()])
        slope = speed.X() * np.array([along_u.X(), along_u.Y(), along_u.Z()])
        slope += speed.Y() * np.array([along_v.X(), along_v.Y(), along_v.Z()])
        places.append(here)
        poles += [here - step * slope, here + step * slope]
    return Path3(settle([places[0], *poles[1:-1], places[-1]], FINE), np.repeat(times, [4, *[2] * (pieces - 1), 4]))
