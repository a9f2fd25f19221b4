"""A B-spline face out of the kernel, and what scipy says of its derivatives: the tests' own view of surfaces."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise, product
from math import comb

import numpy as np
from OCP.BRep import BRep_Tool
from OCP.BRepTools import BRepTools
from OCP.BRepTopAdaptor import BRepTopAdaptor_FClass2d
from OCP.Geom import Geom_BezierSurface, Geom_BSplineSurface, Geom_RectangularTrimmedSurface
from OCP.GeomConvert import GeomConvert
from OCP.gp import gp_Pnt2d
from OCP.TColStd import TColStd_Array1OfReal
from OCP.TopAbs import TopAbs_EDGE, TopAbs_OUT
from OCP.TopExp import TopExp_Explorer
from OCP.TopLoc import TopLoc_Location
from OCP.TopoDS import TopoDS, TopoDS_Face
from scipy.interpolate import BSpline
from scipy.ndimage import label

Array = np.ndarray


@dataclass(eq=False)
class Sheet:
    """A B-spline face of a file, out of the kernel."""

    face: TopoDS_Face
    knots: tuple[Array, Array]
    degrees: tuple[int, int]
    poles: Array
    weights: Array

    @classmethod
    def of(cls, face: TopoDS_Face) -> Sheet | None:
        """The face, or None where it lies on no B-spline surface."""
        ground = BRep_Tool.Surface_s(face, TopLoc_Location())
        while isinstance(ground, Geom_RectangularTrimmedSurface):
            ground = ground.BasisSurface()
        if isinstance(ground, Geom_BezierSurface):
            ground = GeomConvert.SurfaceToBSplineSurface_s(ground)
        if not isinstance(ground, Geom_BSplineSurface):
            return None
        ground = ground.Copy()
        ground.SetUNotPeriodic()
        ground.SetVNotPeriodic()
        nu, nv = ground.NbUPoles(), ground.NbVPoles()
        rational = ground.IsURational() or ground.IsVRational()  # the kernel gives weights 0 for made-unperiodic others
        points = (
            (ground.Pole(i + 1, j + 1).Coord(), ground.Weight(i + 1, j + 1)) for i in range(nu) for j in range(nv)
        )
        poles, weights = zip(*points, strict=True)
        flat = [np.array([seq.Value(i) for i in range(1, seq.Length() + 1)]) for seq in _flat_knots(ground)]
        degrees = ground.UDegree(), ground.VDegree()
        given = np.reshape(weights, (nu, nv)) if rational else np.ones((nu, nv))
        return cls(face, (flat[0], flat[1]), degrees, np.reshape(poles, (nu, nv, 3)), given)

    @property
    def domain(self) -> Array:
        """Lowest and highest ``u, v``."""
        return np.array([(k[d], k[-d - 1]) for k, d in zip(self.knots, self.degrees, strict=True)]).T

    @cached_property
    def bounds(self) -> Array:
        """Lowest and highest ``u, v`` of the boundary."""
        u0, u1, v0, v1 = BRepTools.UVBounds_s(self.face)
        return np.array([[u0, v0], [u1, v1]])

    def inside(self, u: Array, v: Array) -> Array:
        """Which products of parameters lie on the face.

        The kernel's classifier is asked for each point of a cell that the boundary goes through, and once for each
        region of points that no boundary parts.
        """
        classifier = BRepTopAdaptor_FClass2d(self.face, 1e-9)
        orders, lines = (np.argsort(u), np.argsort(v)), (np.sort(u), np.sort(v))
        near = np.zeros((len(u), len(v)), dtype=bool)
        for points in self._boundary():
            place = np.stack([_place(lines[i], points[:, i]) for i in (0, 1)], axis=1)
            steps = np.maximum(np.ceil(4 * np.abs(np.diff(place, axis=0)).max(axis=1)), 1)
            along = np.append(0, np.cumsum(steps))
            cells = [np.floor(np.interp(np.arange(along[-1] + 1), along, place[:, i])).astype(int) for i in (0, 1)]
            for i in (0, 1):
                for j in (0, 1):
                    at = np.stack([cells[0] + i, cells[1] + j])
                    at = at[:, (at >= 0).all(axis=0) & (at[0] < len(u)) & (at[1] < len(v))]
                    near[at[0], at[1]] = True
        regions, count = label(~near)
        _, first = np.unique(regions, return_index=True)
        asked = np.union1d(np.flatnonzero(near), first)
        rows, columns = np.unravel_index(asked, near.shape)
        places = zip(lines[0][rows].tolist(), lines[1][columns].tolist(), strict=True)
        on = np.zeros(near.size, dtype=bool)
        on[asked] = [classifier.Perform(gp_Pnt2d(*place), True) != TopAbs_OUT for place in places]
        of_region = np.zeros(count + 1, dtype=bool)
        of_region[regions.ravel()[first]] = on[first]
        found = np.empty_like(near)
        found[np.ix_(*orders)] = np.where(near, on.reshape(near.shape), of_region[regions])
        return found

    def _boundary(self) -> Iterator[Array]:
        """Points along each boundary curve, in all periods that may meet the domain."""
        low, high = self.domain
        over = (self.bounds[0] < low - 1e-6 * (high - low)) | (self.bounds[1] > high + 1e-6 * (high - low))
        turns = np.array(list(product(*(range(-2, 3) if each else (0,) for each in over))))
        explorer = TopExp_Explorer(self.face, TopAbs_EDGE)
        while explorer.More():
            edge = TopoDS.Edge_s(explorer.Current())
            curve = BRep_Tool.CurveOnSurface_s(edge, self.face, 0.0, 0.0)
            first, last = BRep_Tool.Range_s(edge, self.face)
            points = np.array([curve.Value(t).Coord() for t in np.linspace(first, last, 200).tolist()])
            for turn in turns:
                yield points + turn * (high - low)
            explorer.Next()

    def derivatives(self, u: Array, v: Array, highest: int) -> dict[tuple[int, int], Array]:
        """Derivatives ``(nu, nv, 3)`` of points by how often they are taken along u and v."""
        lifted = np.concatenate([self.poles * self.weights[..., None], self.weights[..., None]], axis=2)
        along = [
            [basis(self.knots[i], self.degrees[i], x, r) for r in range(highest + 1)] for i, x in enumerate((u, v))
        ]
        top = {
            (r, s): np.einsum("ui,ijk,vj->uvk", along[0][r], lifted, along[1][s], optimize=True)
            for r in range(highest + 1)
            for s in range(highest + 1 - r)
        }
        return _divided(top)


def _place(lines: Array, x: Array) -> Array:
    """Places among ascending values, in fractions of their numbers; -1 and their count far outside."""
    wide = lines[-1] - lines[0]
    return np.interp(x, [lines[0] - wide, *lines, lines[-1] + wide], np.arange(-1, len(lines) + 1))


def _flat_knots(ground: Geom_BSplineSurface) -> tuple:
    found = []
    for count, degree, fill in (
        (ground.NbUPoles(), ground.UDegree(), ground.UKnotSequence),
        (ground.NbVPoles(), ground.VDegree(), ground.VKnotSequence),
    ):
        sequence = TColStd_Array1OfReal(1, count + degree + 1)
        fill(sequence)
        found.append(sequence)
    return tuple(found)


def basis(knots: Array, degree: int, x: Array, derivative: int = 0) -> Array:
    """Values of all B-splines, or of their derivatives, ``(len(x), count)``."""
    count = len(knots) - degree - 1
    if derivative > degree:
        return np.zeros((len(x), count))
    return BSpline(knots, np.eye(count), degree)(x, nu=derivative)


def _divided(top: dict[tuple[int, int], Array]) -> dict[tuple[int, int], Array]:
    """Derivatives of A / w: of A = w S, order by order."""
    w = {order: each[..., 3:] for order, each in top.items()}
    found: dict[tuple[int, int], Array] = {}
    for r, s in sorted(top, key=sum):
        rest = sum(
            comb(r, i) * comb(s, j) * w[i, j] * found[r - i, s - j]
            for i in range(r + 1)
            for j in range(s + 1)
            if (i, j) != (0, 0)
        )
        found[r, s] = (top[r, s][..., :3] - rest) / w[0, 0]
    return found


@dataclass(eq=False)
class Looked:
    """What was seen of a face at a grid of parameters, as ``(nu, nv)`` arrays."""

    points: Array
    normals: Array
    density: Array
    speeds: tuple[Array, Array]
    bending: Array
    variation: Array
    largest: Array


def look(sheet: Sheet, u: Array, v: Array) -> Looked:
    """Curvature by determinants: with D = EG − F², L = [S_uu S_u S_v], …, H = ½ (EN − 2FM + GL) D^-1.5.

    The derivatives of H are those of this quotient.
    """
    s = sheet.derivatives(u, v, 3)
    su, sv = s[1, 0], s[0, 1]

    def det(a: Array, b: Array, c: Array) -> Array:
        return (a * np.cross(b, c)).sum(axis=2)

    def dot(a: Array, b: Array) -> Array:
        return (a * b).sum(axis=2)

    e, f, g = dot(su, su), dot(su, sv), dot(sv, sv)
    area2 = e * g - f * f
    cross = np.cross(su, sv)
    density = np.linalg.norm(cross, axis=2)
    with np.errstate(all="ignore"):
        second = [det(s[each], su, sv) for each in ((2, 0), (1, 1), (0, 2))]
        top = e * second[2] - 2 * f * second[1] + g * second[0]
        mean, gauss = top / 2 / density**3, (second[0] * second[2] - second[1] ** 2) / density**4
        slopes = []
        for a, b in ((1, 0), (0, 1)):
            dsu, dsv = s[1 + a, b], s[a, 1 + b]
            de, df, dg = 2 * dot(su, dsu), dot(dsu, sv) + dot(su, dsv), 2 * dot(sv, dsv)
            dd = de * g + e * dg - 2 * f * df
            third = [
                det(s[i + a, j + b], su, sv) + det(s[i, j], dsu, sv) + det(s[i, j], su, dsv)
                for i, j in ((2, 0), (1, 1), (0, 2))
            ]
            dtop = de * second[2] + e * third[2] - 2 * (df * second[1] + f * third[1]) + dg * second[0] + g * third[0]
            slopes.append(dtop / 2 / density**3 - 1.5 * mean * dd / area2)
        variation = (g * slopes[0] ** 2 - 2 * f * slopes[0] * slopes[1] + e * slopes[1] ** 2) / area2
        largest = np.abs(mean) + np.sqrt(np.maximum(mean**2 - gauss, 0))
        regular = density > 1e-6 * np.sqrt(e * g)
        normals = cross / density[..., None]
    clean = [np.where(regular, each, 0.0) for each in (4 * mean**2 - 2 * gauss, variation, largest)]
    return Looked(s[0, 0], np.where(regular[..., None], normals, 0.0), density, (np.sqrt(e), np.sqrt(g)), *clean)


def grid(sheet: Sheet, points: int, fewest: int, axis: int, whole: bool = False) -> tuple[Array, Array, Array]:
    """Points of every span, its ends among them: parameters, weights by Simpson's rule, lengths of the spans."""
    knots, degree = sheet.knots[axis], sheet.degrees[axis]
    low, high = sheet.domain[:, axis] if whole else sheet.bounds[:, axis]
    breaks = np.unique(knots[degree : len(knots) - degree])
    period = breaks[-1] - breaks[0]
    turns = (
        np.arange(np.floor((low - breaks[0]) / period), np.ceil((high - breaks[0]) / period)) if not whole else [0.0]
    )
    pieces = [(a + t * period, b + t * period) for t in turns for a, b in pairwise(breaks)]
    pieces = [(max(a, low), min(b, high), b - a) for a, b in pieces if min(b, high) - max(a, low) > 1e-6 * (high - low)]
    count = 2 * (max(points, -(-fewest // len(pieces))) // 2)
    starts, ends, spans = np.array(pieces).T
    place, simpson = np.arange(count + 1) / count, np.array([1, *([4, 2] * (count // 2))]) / 3 / count
    simpson[-1] /= 2
    place = 1e-6 + (1 - 2e-6) * place
    x = (starts[:, None] + (ends - starts)[:, None] * place).ravel()
    weights = ((ends - starts)[:, None] * simpson).ravel()
    return breaks[0] + np.mod(x - breaks[0], period), weights, np.repeat(spans, count + 1)
