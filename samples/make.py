"""Write the sample models: ``python samples/make.py [OUTDIR] [names…]``.

The models are built from poles and knots here, not with mracad, so that they can judge it. The same bytes come out each
time: noise is from a seeded PCG64, products and header are named, and whatever a mathematics library may round
differently on another machine (sines, the kernel's evaluations) is put on a dyadic grid, which also keeps the text
short. Lengths are millimetres.
"""

from __future__ import annotations

import io
import re
import sys
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from pathlib import Path

import numpy as np
from OCP.BRep import BRep_Builder
from OCP.BRepPrimAPI import BRepPrimAPI_MakeBox, BRepPrimAPI_MakeCylinder
from OCP.Geom import (
    Geom_BSplineCurve,
    Geom_BSplineSurface,
    Geom_Circle,
    Geom_Curve,
    Geom_CylindricalSurface,
    Geom_Line,
    Geom_Plane,
    Geom_Surface,
    Geom_SurfaceOfLinearExtrusion,
)
from OCP.Geom2d import Geom2d_BSplineCurve, Geom2d_Circle, Geom2d_Curve, Geom2d_Line
from OCP.GeomAbs import GeomAbs_C2
from OCP.gp import gp_Ax2, gp_Ax2d, gp_Ax3, gp_Dir, gp_Dir2d, gp_Pnt, gp_Pnt2d, gp_Trsf, gp_Vec, gp_Vec2d
from OCP.Quantity import Quantity_Color, Quantity_TOC_sRGB
from OCP.TColgp import TColgp_Array1OfPnt, TColgp_Array1OfPnt2d, TColgp_Array2OfPnt
from OCP.TCollection import TCollection_ExtendedString
from OCP.TColStd import TColStd_Array1OfInteger, TColStd_Array1OfReal, TColStd_Array2OfReal
from OCP.TDataStd import TDataStd_Name
from OCP.TDF import TDF_Label
from OCP.TDocStd import TDocStd_Document
from OCP.TopAbs import TopAbs_FACE, TopAbs_FORWARD, TopAbs_REVERSED
from OCP.TopExp import TopExp_Explorer
from OCP.TopLoc import TopLoc_Location
from OCP.TopoDS import TopoDS_Edge, TopoDS_Face, TopoDS_Shape, TopoDS_Shell, TopoDS_Solid, TopoDS_Vertex, TopoDS_Wire
from OCP.XCAFDoc import XCAFDoc_ColorSurf, XCAFDoc_DocumentTool

from mracad.occ.document import Document
from mracad.occ.step import write_step
from mracad.occ.units import Units, metres

TOL = 1e-7
FINE = 16  # bits after the point of what the kernel computed: 2e-5 mm
HERE = Path(__file__).resolve().parent


# ---------------------------------------------------------------------------------------------------------------------
# Splines
# ---------------------------------------------------------------------------------------------------------------------


def settle(values: np.ndarray, bits: int = 7) -> np.ndarray:
    """Round to multiples of ``2**-bits``: the last bits of a sine differ between machines, these do not."""
    return np.round(np.asarray(values) * 2.0**bits) / 2.0**bits


def breaks(
    rng: np.random.Generator, start: float, stop: float, spans: int, spread: float = 3.0, bits: int = 7
) -> np.ndarray:
    """Return ``spans + 1`` break points whose neighbouring spacings differ by up to `spread`.

    The inner ones are multiples of ``3 * 2**-bits``, so that a mean of three has a short decimal fraction.
    """
    steps = rng.uniform(1.0, spread, spans)
    inner = start + (stop - start) * np.cumsum(steps)[:-1] / steps.sum()
    return np.concatenate(([start], 3.0 * settle(inner / 3.0, bits), [stop]))


def clamped(points: np.ndarray, degree: int, double: Sequence[int] = ()) -> np.ndarray:
    """Return the full clamped knot vector on `points`, the inner points with index in `double` twice."""
    counts = np.ones(len(points), int)
    counts[list(double)] = 2
    counts[[0, -1]] = degree + 1
    return np.repeat(points, counts)


def greville(knots: np.ndarray, degree: int) -> np.ndarray:
    """Return the parameter each pole belongs to: the mean of `degree` successive knots."""
    return sum(knots[k : len(knots) - degree - 1 + k] for k in range(1, degree + 1)) / degree


def insert(knots: np.ndarray, poles: np.ndarray, degree: int, value: float) -> tuple[np.ndarray, np.ndarray]:
    """Insert one knot into a clamped net along axis 0 (Boehm), exact up to the arithmetic."""
    span = int(np.searchsorted(knots, value, side="right")) - 1
    new = np.empty((len(poles) + 1, *poles.shape[1:]))
    new[: span - degree + 1] = poles[: span - degree + 1]
    new[span + 1 :] = poles[span:]
    for i in range(span - degree + 1, span + 1):
        share = (value - knots[i]) / (knots[i + degree] - knots[i])
        new[i] = share * poles[i] + (1.0 - share) * poles[i - 1]
    return np.insert(knots, span + 1, value), new


def split(
    knots: np.ndarray, poles: np.ndarray, degree: int, at: Sequence[float]
) -> list[tuple[np.ndarray, np.ndarray]]:
    """Cut a net along axis 0 at the given inner knots into clamped nets, each with its full knot vector."""
    for value in at:
        for _ in range(degree - np.count_nonzero(knots == value)):
            knots, poles = insert(knots, poles, degree, value)
    pieces = []
    ends = [knots[0], *at, knots[-1]]
    for low, high in pairwise(ends):
        inner = knots[(knots > low) & (knots < high)]
        first = int(np.searchsorted(knots, low, side="right")) - degree - 1
        own = np.concatenate(([low] * (degree + 1), inner, [high] * (degree + 1)))
        pieces.append((own, poles[first : first + len(own) - degree - 1]))
    return pieces


# ---------------------------------------------------------------------------------------------------------------------
# Kernel geometry
# ---------------------------------------------------------------------------------------------------------------------


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


# ---------------------------------------------------------------------------------------------------------------------
# Kernel topology
# ---------------------------------------------------------------------------------------------------------------------

BUILD = BRep_Builder()


def vertex(point: Sequence[float], tolerance: float = TOL) -> TopoDS_Vertex:
    """Return a vertex."""
    shape = TopoDS_Vertex()
    BUILD.MakeVertex(shape, gp_Pnt(*map(float, point)), tolerance)
    return shape


def edge(
    path: Geom_Curve | None,
    ends: tuple[TopoDS_Vertex, TopoDS_Vertex],
    span: tuple[float, float],
    tolerance: float = TOL,
) -> TopoDS_Edge:
    """Return an edge along `path` over the parameters `span`; without a path it is degenerate."""
    shape = TopoDS_Edge()
    if path is None:
        BUILD.MakeEdge(shape)
        BUILD.Degenerated(shape, True)
    else:
        BUILD.MakeEdge(shape, path, tolerance)
        BUILD.Range(shape, *span)
    BUILD.Add(shape, ends[0].Oriented(TopAbs_FORWARD))
    BUILD.Add(shape, ends[1].Oriented(TopAbs_REVERSED))
    return shape


@dataclass(frozen=True)
class Side:
    """One step round a face: an edge, its curve in the parameter plane (none on a plane), and the sense walked."""

    edge: TopoDS_Edge
    path: Geom2d_Curve | None = None
    forward: bool = True


def face(
    on: Geom_Surface, loops: Sequence[Sequence[Side]], outward: bool = True, tolerance: float = TOL
) -> TopoDS_Face:
    """Return a face; outer loops run anticlockwise in the parameter plane, holes clockwise.

    A closing edge comes as two successive sides of one loop that name the same edge with two different curves.
    """
    shape = TopoDS_Face()
    BUILD.MakeFace(shape, on, tolerance)
    where = TopLoc_Location()
    for loop in loops:
        wire = TopoDS_Wire()
        BUILD.MakeWire(wire)
        for side in loop:
            BUILD.Add(wire, side.edge.Oriented(TopAbs_FORWARD if side.forward else TopAbs_REVERSED))
            other = next((item for item in loop if item is not side and item.edge.IsSame(side.edge)), None)
            if side.path is not None and other is None:
                BUILD.UpdateEdge(side.edge, side.path, on, where, tolerance)
            elif other is not None and side.forward:
                BUILD.UpdateEdge(side.edge, side.path, other.path, on, where, tolerance)
                BUILD.Continuity(side.edge, on, on, where, where, GeomAbs_C2)
        wire.Closed(True)
        BUILD.Add(shape, wire)
    return shape if outward else shape.Reversed()


def shell(faces: Sequence[TopoDS_Face], closed: bool = False) -> TopoDS_Shell:
    """Return the shell of faces that already share their edges."""
    shape = TopoDS_Shell()
    BUILD.MakeShell(shape)
    for item in faces:
        BUILD.Add(shape, item)
    shape.Closed(closed)
    return shape


def solid(faces: Sequence[TopoDS_Face]) -> TopoDS_Solid:
    """Return the solid inside a closed set of faces that point outward."""
    shape = TopoDS_Solid()
    BUILD.MakeSolid(shape)
    BUILD.Add(shape, shell(faces, closed=True))
    return shape


@dataclass(frozen=True)
class Rim:
    """One edge of the top of a `block`.

    Its curve in space, in the parameter plane of the top and on the ground z = 0 share one parameter.
    """

    path: Path3
    plane: Geom2d_Curve
    ground: Geom_Line | Geom_Circle | Geom_BSplineCurve
    span: tuple[float, float]
    forward: bool = True
    tolerance: float = TOL

    def wall(self) -> Geom_Surface:
        """Return the surface swept from the ground along z: a plane, a cylinder, or an extrusion."""
        up = gp_Dir(0, 0, 1)
        if isinstance(self.ground, Geom_Line):
            start = self.ground.Position()
            return Geom_Plane(start.Location(), start.Direction().Crossed(up))
        if isinstance(self.ground, Geom_Circle):
            circle = self.ground.Circ()
            return Geom_CylindricalSurface(gp_Ax3(circle.Position()), circle.Radius())
        return Geom_SurfaceOfLinearExtrusion(self.ground, up)


@dataclass(frozen=True)
class Corner:
    """A vertex of the top of a `block`, the one below it, and the edge between them."""

    high: TopoDS_Vertex
    low: TopoDS_Vertex
    upright: TopoDS_Edge

    @classmethod
    def at(cls, rim: Rim) -> Corner:
        """Return the corner where a rim is entered."""
        point = rim.path.geometry.Value(rim.span[not rim.forward])
        x, y, z = settle([point.X(), point.Y(), point.Z()], FINE).tolist()
        tolerance = max(rim.tolerance, 2.0**-FINE)
        high, low = vertex((x, y, z), tolerance), vertex((x, y, 0.0), tolerance)
        return cls(high, low, edge(Geom_Line(gp_Pnt(x, y, 0.0), gp_Dir(0, 0, 1)), (low, high), (0.0, z), tolerance))


def block(top: Geom_BSplineSurface, loops: Sequence[Sequence[Rim]]) -> TopoDS_Solid:
    """Return the solid between a freeform top and the plane z = 0, with walls swept along z."""
    walls, tops, bottoms = [], [], []
    for loop in loops:
        upper, lower = [], []
        corners = [Corner.at(rim) for rim in loop]
        for rim, *pair in zip(loop, corners, corners[1:] + corners[:1], strict=True):
            start, end = pair if rim.forward else pair[::-1]
            path, wall = rim.path, rim.wall()
            high = edge(path.geometry, (start.high, end.high), rim.span, rim.tolerance)
            low = edge(rim.ground, (start.low, end.low), rim.span, rim.tolerance)
            walk = [Side(low), Side(end.upright), Side(high, None, False), Side(start.upright, None, False)]
            if not isinstance(wall, Geom_Plane):
                height = np.column_stack((greville(path.knots, path.degree), path.poles[:, 2]))
                flat = [
                    line2d((0.0, 0.0), (1, 0)),
                    line2d((rim.span[1], 0.0), (0, 1)),
                    curve(height, path.knots, path.degree),
                    line2d((rim.span[0], 0.0), (0, 1)),
                ]
                walk = [replace(side, path=trace) for side, trace in zip(walk, flat, strict=True)]
            walls.append(face(wall, [walk], rim.forward, rim.tolerance))
            upper.append(Side(high, rim.plane, rim.forward))
            lower.append(Side(low, None, rim.forward))
        tops.append(upper)
        bottoms.append(lower)
    floor = face(Geom_Plane(gp_Pnt(0, 0, 0), gp_Dir(0, 0, 1)), bottoms, outward=False)
    return solid([face(top, tops), floor, *walls])


# ---------------------------------------------------------------------------------------------------------------------
# Documents
# ---------------------------------------------------------------------------------------------------------------------


def name(label: TDF_Label, text: str) -> None:
    """Name a label."""
    TDataStd_Name.Set_s(label, TCollection_ExtendedString(text))


def blank(text: str, units: Units | None = None) -> Document:
    """Return an empty document, held in millimetres, for a file in some unit, millimetres by default."""
    units = units or Units()
    xcaf = TDocStd_Document(TCollection_ExtendedString("BinXCAF"))
    XCAFDoc_DocumentTool.SetLengthUnit_s(xcaf, metres(1.0))
    return Document(xcaf, text, units)


def single(shape: TopoDS_Shape, text: str) -> Document:
    """Return a document with one named part."""
    made = blank(text)
    name(made.shape_tool.AddShape(shape, False), text)
    return made


def write(document: Document, path: Path) -> None:
    """Write a document, with a header that changes neither with the date nor with mracad's version."""
    stream = io.BytesIO()
    write_step(document, stream, schema="AP214")
    header = f"FILE_NAME('{path.name}','1970-01-01T00:00:00',(''),(''),'','mracad samples','');"
    path.write_bytes(re.sub(rb"FILE_NAME\(.*?\);", header.encode(), stream.getvalue(), count=1, flags=re.DOTALL))


# ---------------------------------------------------------------------------------------------------------------------
# The panel
# ---------------------------------------------------------------------------------------------------------------------

PANEL = (300.0, 200.0)
PATCHES = (3, 2)
PATCH_SPANS = 32


def panel_net() -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return knots in u and v and the poles of the smooth panel before it is cut into patches.

    A crowned surface of 300 × 200 mm with a soft character line and a slight bulge, made with + − × ÷ and √ alone, so
    that every machine gets the same bits.
    """
    rng = np.random.default_rng(101)
    knots = []
    for length, patches in zip(PANEL, PATCHES, strict=True):
        ends = np.linspace(0.0, length, patches + 1)
        cuts = [breaks(rng, low, high, PATCH_SPANS) for low, high in pairwise(ends)]
        knots.append(clamped(np.unique(np.concatenate(cuts)), 3))
    u, v = np.meshgrid(*(greville(k, 3) for k in knots), indexing="ij")
    p, q = u / 150.0 - 1.0, v / 100.0 - 1.0
    bulged = v + 6.0 * q * (1.0 - p * p)
    line = (v - 118.0 - 14.0 * p) / 32.0
    crown = 42.0 - 26.0 * p * p - 15.0 * q * q + 4.0 * p * q * q
    z = crown + 8.0 * line / np.sqrt(1.0 + line * line) + 4.0 / (1.0 + 5.0 * ((p - 0.3) ** 2 + (q + 0.4) ** 2))
    return *knots, np.stack((u, bulged, z), axis=-1)


def panel_noise(shape: Sequence[int]) -> np.ndarray:
    """Return displacements of 0.05 mm rms, equal in every direction."""
    return 0.05 / 3.0**0.5 * np.random.default_rng(102).standard_normal(shape)


def panel_patches(
    u_knots: np.ndarray, v_knots: np.ndarray, poles: np.ndarray
) -> list[list[tuple[np.ndarray, np.ndarray, np.ndarray]]]:
    """Cut the panel at its seam knots into patches, each with knots in u and v and poles; exact, so C2 across."""
    seams_u = np.linspace(0.0, PANEL[0], PATCHES[0] + 1)[1:-1]
    seams_v = np.linspace(0.0, PANEL[1], PATCHES[1] + 1)[1:-1]
    rows = []
    for u, strip in split(u_knots, poles, 3, seams_u):
        columns = split(v_knots, strip.swapaxes(0, 1), 3, seams_v)
        rows.append([(u, v, net.swapaxes(0, 1)) for v, net in columns])
    return rows


def panel_shell(rows: Sequence[Sequence[tuple[np.ndarray, np.ndarray, np.ndarray]]]) -> TopoDS_Shell:
    """Join a grid of patches into one shell; neighbours share their edge and its curve."""
    count_u, count_v = len(rows), len(rows[0])
    corners = {
        (i, j): vertex(rows[min(i, count_u - 1)][min(j, count_v - 1)][2][-(i == count_u), -(j == count_v)])
        for i in range(count_u + 1)
        for j in range(count_v + 1)
    }
    along: dict[tuple[str, int, int], TopoDS_Edge] = {}
    for i in range(count_u):
        for j in range(count_v + 1):
            u, _, net = rows[i][min(j, count_v - 1)]
            path = curve(net[:, -(j == count_v)], u)
            along["u", i, j] = edge(path, (corners[i, j], corners[i + 1, j]), (u[0], u[-1]))
    for i in range(count_u + 1):
        for j in range(count_v):
            _, v, net = rows[min(i, count_u - 1)][j]
            path = curve(net[-(i == count_u)], v)
            along["v", i, j] = edge(path, (corners[i, j], corners[i, j + 1]), (v[0], v[-1]))
    faces = []
    for i, row in enumerate(rows):
        for j, (u, v, net) in enumerate(row):
            loop = [
                Side(along["u", i, j], line2d((0.0, v[0]), (1, 0))),
                Side(along["v", i + 1, j], line2d((u[-1], 0.0), (0, 1))),
                Side(along["u", i, j + 1], line2d((0.0, v[-1]), (1, 0)), False),
                Side(along["v", i, j], line2d((u[0], 0.0), (0, 1)), False),
            ]
            faces.append(face(surface(net, u, v), [loop]))
    return shell(faces)


def panel_clean() -> Document:
    """The panel as it should be: 3 × 2 bicubic patches of 35 × 35 poles on uneven knots, C2 across every seam."""
    return single(panel_shell(panel_patches(*panel_net())), "panel clean")


def panel() -> Document:
    """The panel with noise on every pole, put on before cutting: patches are rough but still C2 across the seams."""
    u, v, poles = panel_net()
    return single(panel_shell(panel_patches(u, v, settle(poles + panel_noise(poles.shape), 6))), "panel")


def panel_inside() -> Document:
    """The panel with noise inside the patches only: two rows of poles round each are clean, so every seam is G1."""
    rows = panel_patches(*panel_net())
    noise = panel_noise((*PATCHES, PATCH_SPANS + 3, PATCH_SPANS + 3, 3))
    for i, row in enumerate(rows):
        for j, (u, v, net) in enumerate(row):
            rough = net.copy()
            rough[2:-2, 2:-2] = settle(net + noise[i, j], 6)[2:-2, 2:-2]
            row[j] = u, v, rough
    return single(panel_shell(rows), "panel inside")


# ---------------------------------------------------------------------------------------------------------------------
# Single parts
# ---------------------------------------------------------------------------------------------------------------------


def rough_top(
    seed: int, size: tuple[float, float], spans: tuple[int, int], height: float, noise: float, bits: int = 7
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return knots in u and v and poles of a gently saddled bicubic surface over a rectangle, rough along z.

    Its parameters are x and y; `bits` says how fine the grid is that numbers are put on.
    """
    rng = np.random.default_rng(seed)
    u_knots, v_knots = (clamped(breaks(rng, 0.0, *pair, 2.0, bits), 3) for pair in zip(size, spans, strict=True))
    x, y = np.meshgrid(greville(u_knots, 3), greville(v_knots, 3), indexing="ij")
    p, q = 2.0 * x / size[0] - 1.0, 2.0 * y / size[1] - 1.0
    z = height * (1.0 - 0.45 * p * p + 0.3 * q * q + 0.15 * p * q + 0.2 * p * p * p)
    return u_knots, v_knots, np.stack((x, y, settle(z + noise * rng.standard_normal(z.shape), bits)), axis=-1)


def natural_rims(net: tuple[np.ndarray, np.ndarray, np.ndarray]) -> dict[str, Rim]:
    """Return the four sides of a `rough_top` as rims walked anticlockwise."""
    u, v, poles = net
    along_u, along_v = (u[0], u[-1]), (v[0], v[-1])

    def side(
        row: np.ndarray, knots: np.ndarray, start: tuple[float, float], way: tuple[int, int], forward: bool
    ) -> Rim:
        ground = Geom_Line(gp_Pnt(*start, 0.0), gp_Dir(*way, 0))
        return Rim(Path3(row, knots), line2d(start, way), ground, (knots[0], knots[-1]), forward)

    return {
        "bottom": side(poles[:, 0], u, (0.0, along_v[0]), (1, 0), True),
        "right": side(poles[-1], v, (along_u[1], 0.0), (0, 1), True),
        "top": side(poles[:, -1], u, (0.0, along_v[1]), (1, 0), False),
        "left": side(poles[0], v, (along_u[0], 0.0), (0, 1), False),
    }


def trimmed() -> Document:
    """A cover plate whose rough top ends on three natural sides and a trim curve across it, with a round hole.

    The trim curve and the hole are exact in the parameter plane; the edges in space are within 0.001 mm of the surface.
    """
    net = rough_top(201, (115.0, 52.0), (80, 36), 9.0, 0.05)
    top = surface(net[2], net[0], net[1])
    sides = natural_rims(net)
    bow = np.array([(98.0, 0.0), (121.0, 15.0), (90.0, 31.0), (106.0, 52.0)])
    bezier = np.repeat([0.0, 1.0], 4)
    slant, slant_ground = curve(bow, bezier), curve(np.column_stack((bow, np.zeros(4))), bezier)
    ring = Geom2d_Circle(gp_Ax2d(gp_Pnt2d(46.0, 24.0), gp_Dir2d(1, 0)), 10.0)
    ring_ground = Geom_Circle(gp_Ax2(gp_Pnt(46.0, 24.0, 0.0), gp_Dir(0, 0, 1), gp_Dir(1, 0, 0)), 10.0)

    def trim(path: Geom2d_Curve, ground: Geom_Curve, span: tuple[float, float], pieces: int, forward: bool) -> Rim:
        return Rim(on_surface(top, path, *span, pieces), path, ground, span, forward, 1e-3)

    outer = [
        replace(sides["bottom"], span=(0.0, 98.0)),
        trim(slant, slant_ground, (0.0, 1.0), 140, True),
        replace(sides["top"], span=(0.0, 106.0)),
        sides["left"],
    ]
    half = float(np.pi)
    hole = [trim(ring, ring_ground, span, 64, False) for span in ((half, 2.0 * half), (0.0, half))]
    return single(block(top, [outer, hole]), "cover plate")


def bottle() -> Document:
    """A bottle whose wall and base are one rippled face, periodic round the axis, its first row of poles one point.

    The ripples fade towards the base and the neck. A plane closes the mouth.
    """
    rng = np.random.default_rng(301)
    coarse = np.array([0.0, 11.0, 22.0, 43.0, 64.0, 80.0, 91.0, 101.0, 110.0, 124.0, 142.0])
    knots = clamped(coarse, 3)
    r = np.array([0.0, 4.0, 10.5, 11.5, 11.0, 11.0, 11.5, 11.0, 7.5, 4.8, 5.0, 5.4, 5.4])
    z = np.array([0.0, 0.0, -1.2, 9.0, 22.0, 39.0, 56.0, 73.0, 84.0, 90.0, 104.0, 113.0, 120.0])
    profile = np.column_stack((r, z))
    for value in np.setdiff1d(breaks(rng, 14.0, 102.0, 62, 2.0), coarse):
        knots, profile = insert(knots, profile, 3, value)
    r, z = profile.T
    place = greville(knots, 3)
    around = 48
    turn = 2.0 * np.pi * np.arange(around) / around
    fade = np.clip((place - 18.0) / 8.0, 0.0, 1.0) * np.clip((98.0 - place) / 8.0, 0.0, 1.0)
    ripples = 0.05 * rng.standard_normal((around, len(z))) + 0.05 * np.cos(16.0 * turn)[:, None]
    radius = r + ripples * fade
    x, y = radius * np.cos(turn)[:, None], radius * np.sin(turn)[:, None]
    poles = np.stack((x, y, np.broadcast_to(z, radius.shape)), axis=-1)
    poles, u = settle(poles), np.arange(around + 1.0)
    wall = surface(poles, u, knots, u_periodic=True)
    meridian = (poles[0] + 4.0 * poles[1] + poles[2]) / 6.0  # where the face meets itself, u = 0

    base, mouth = vertex(meridian[0]), vertex(meridian[-1])
    apex = edge(None, (base, base), (u[0], u[-1]))
    closing = edge(curve(meridian, knots), (base, mouth), (knots[0], knots[-1]))
    rim = edge(curve(poles[:, -1], u, periodic=True), (mouth, mouth), (u[0], u[-1]))
    loop = [
        Side(apex, line2d((0.0, 0.0), (1, 0))),
        Side(closing, line2d((u[-1], 0.0), (0, 1))),
        Side(rim, line2d((0.0, knots[-1]), (1, 0)), False),
        Side(closing, line2d((0.0, 0.0), (0, 1)), False),
    ]
    side = face(wall, [loop])
    BUILD.Range(apex, side, u[0], u[-1])
    lid = face(Geom_Plane(gp_Pnt(0, 0, meridian[-1, 2]), gp_Dir(0, 0, 1)), [[Side(rim)]])
    return single(solid([side, lid]), "bottle")


def blade() -> Document:
    """A twisted, tapered blade: one rational face round the section, degree 3 × 5, double knots both ways, rough.

    It runs from the trailing edge over the leading edge back; a ruled strip closes the blunt trailing edge, planes the
    root and the tip.
    """
    rng = np.random.default_rng(401)
    u_breaks, v_breaks = breaks(rng, 0.0, 48.0, 32, 2.0), breaks(rng, 0.0, 135.0, 75, 2.0)
    u_breaks[16] = 24.0
    u, v = clamped(u_breaks, 3, [8, 16, 25]), clamped(v_breaks, 5, [18, 37, 38, 58])
    section, span = greville(u, 3) / 48.0, greville(v, 5)
    half = np.pi * section
    x = np.cos(half) ** 2
    camber = 0.16 * x * (1.0 - x)
    thick = np.sin(half) * np.cos(half) * (0.3 * (1.0 - 0.45 * x)) + 0.012 * np.cos(half) ** 3
    along = (span / 135.0)[None, :]
    chord = 24.0 - 10.0 * along * along
    twist = np.pi / 180.0 * (52.0 - 46.0 * along + 14.0 * along * along)
    right, up = chord * (x - 0.35)[:, None], chord * (camber + thick)[:, None]
    across = right * np.cos(twist) - up * np.sin(twist)
    upward = right * np.sin(twist) + up * np.cos(twist) + 10.0 * along * along
    poles = np.stack((across, upward, np.broadcast_to(span, up.shape)), axis=-1)
    noise = 0.03 * rng.standard_normal(poles.shape)
    noise[:, [0, -1], 2] = 0.0
    poles = settle(poles + noise)
    weights = settle(1.0 + 0.3 * np.sin(2.0 * np.pi * section)[:, None] * np.cos(np.pi * along) + 0.1 * along)
    skin = surface(poles, u, v, (3, 5), weights)
    rear = np.array([0.0, 0.0, 1.0, 1.0])
    strip = surface(poles[[-1, 0]], rear, v, (1, 5), weights[[-1, 0]])

    ends = {(i, j): vertex(poles[i, j]) for i in (0, -1) for j in (0, -1)}
    rounds, closes, rails = {}, {}, {}
    for k in (0, -1):
        path = curve(poles[:, k], u, 3, weights[:, k])
        rounds[k] = edge(path, (ends[0, k], ends[-1, k]), (u[0], u[-1]))
        closes[k] = edge(curve(poles[[-1, 0], k], rear, 1), (ends[-1, k], ends[0, k]), (0.0, 1.0))
        rails[k] = edge(curve(poles[k], v, 5, weights[k]), (ends[k, 0], ends[k, -1]), (v[0], v[-1]))

    def sheet(on: Geom_Surface, sides: dict[int, TopoDS_Edge], width: float, left: int, right: int) -> TopoDS_Face:
        loop = [
            Side(sides[0], line2d((0.0, 0.0), (1, 0))),
            Side(rails[right], line2d((width, 0.0), (0, 1))),
            Side(sides[-1], line2d((0.0, v[-1]), (1, 0)), False),
            Side(rails[left], line2d((0.0, 0.0), (0, 1)), False),
        ]
        return face(on, [loop])

    def cap(k: int) -> TopoDS_Face:
        plane = Geom_Plane(gp_Pnt(0, 0, float(poles[0, k, 2])), gp_Dir(0, 0, 1))
        return face(plane, [[Side(rounds[k]), Side(closes[k])]], outward=k != 0)

    return single(
        solid([sheet(skin, rounds, u[-1], 0, -1), sheet(strip, closes, 1.0, -1, 0), cap(0), cap(-1)]), "blade"
    )


# ---------------------------------------------------------------------------------------------------------------------
# The assembly
# ---------------------------------------------------------------------------------------------------------------------


INCH = 25.4


def placed(x: float, y: float, z: float) -> TopLoc_Location:
    """Return a shift by inches."""
    move = gp_Trsf()
    move.SetTranslation(gp_Vec(x * INCH, y * INCH, z * INCH))
    return TopLoc_Location(move)


def assembly() -> Document:
    """A fixture in inches: a base plate, a pin, and two pairs of one rough pad (a nested subassembly placed twice).

    Parts and instances have names; each part has a colour, the top of the pad its own; the base plate is on a layer.
    """
    made = blank("fixture", Units("in", INCH))
    shapes = made.shape_tool
    colours = XCAFDoc_DocumentTool.ColorTool_s(made.xcaf.Main())
    layers = XCAFDoc_DocumentTool.LayerTool_s(made.xcaf.Main())

    def paint(label: TDF_Label, *rgb: float) -> None:
        colours.SetColor(label, Quantity_Color(*rgb, Quantity_TOC_sRGB), XCAFDoc_ColorSurf)

    def part(shape: TopoDS_Shape, text: str, *rgb: float) -> TDF_Label:
        label = shapes.AddShape(shape, False)
        name(label, text)
        paint(label, *rgb)
        return label

    def group(text: str, items: Sequence[tuple[TDF_Label, str, tuple[float, float, float]]]) -> TDF_Label:
        label = shapes.NewShape()
        name(label, text)
        for item, instance, place in items:
            name(shapes.AddComponent(label, item, placed(*place)), instance)
        return label

    net = rough_top(501, (50.75, 25.5), (26, 14), 10.0, 0.075)
    body = block(surface(net[2], net[0], net[1]), [list(natural_rims(net).values())])
    axis = gp_Ax2(gp_Pnt(0, 0, 0), gp_Dir(0, 0, 1))
    box = BRepPrimAPI_MakeBox(gp_Pnt(0, 0, 0), 7.0 * INCH, 4.0 * INCH, 0.5 * INCH)
    plate = part(box.Shape(), "base plate", 0.0, 1.0, 0.0)
    pad = part(body, "pad", 0.0, 0.0, 1.0)
    pin = part(BRepPrimAPI_MakeCylinder(axis, 0.25 * INCH, 1.5 * INCH).Shape(), "pin", 1.0, 1.0, 0.0)
    paint(shapes.AddSubShape(pad, TopExp_Explorer(body, TopAbs_FACE).Current()), 1.0, 0.0, 0.0)
    layers.SetLayer(plate, TCollection_ExtendedString("tooling"))
    pair = group("pad pair", [(pad, "pad left", (0.0, 0.0, 0.0)), (pad, "pad right", (3.0, 0.0, 0.0))])
    group(
        "fixture",
        [
            (plate, "base", (0.0, 0.0, 0.0)),
            (pair, "front pair", (1.0, 0.5, 0.5)),
            (pair, "back pair", (1.0, 2.5, 0.5)),
            (pin, "locating pin", (3.5, 2.0, 0.5)),
        ],
    )
    shapes.UpdateAssemblies()
    return made


SAMPLES: dict[str, Callable[[], Document]] = {
    build.__name__: build for build in (panel, panel_clean, panel_inside, trimmed, bottle, blade, assembly)
}


def main(arguments: Sequence[str]) -> int:
    """Write the named samples (all when none is named) into a folder, this one by default."""
    known = [argument for argument in arguments if argument in SAMPLES]
    folders = [argument for argument in arguments if argument not in SAMPLES]
    if len(folders) > 1:
        print(f"no such sample: {' '.join(folders[1:])}; there are {' '.join(SAMPLES)}", file=sys.stderr)
        return 2
    folder = Path(folders[0]) if folders else HERE
    folder.mkdir(parents=True, exist_ok=True)
    for key in known or SAMPLES:
        path = folder / f"{key}.step"
        write(SAMPLES[key](), path)
        print(f"{path}  {path.stat().st_size / 1e6:.2f} MB")
    return 0


if __name__ == "__main__":
    raise SystemExit(main(sys.argv[1:]))
