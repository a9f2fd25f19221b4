"""Write the sample models: ``python samples/make.py [OUTDIR] [names…]``.

The models are built from poles and knots here, not with mracad, so that they can judge it. The same bytes come out each
time: noise is from a seeded PCG64, products and header are named, and whatever a mathematics library may round
differently on another machine (sines, the kernel's evaluations) is put on a dyadic grid, which also keeps the text
short. Lengths are millimetres.
"""

from __future__ import annotations

import io
import sys
from collections.abc import Callable, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from OCP.APIHeaderSection import APIHeaderSection_MakeHeader
from OCP.BRep import BRep_Builder
from OCP.BRepCheck import BRepCheck_Analyzer
from OCP.BRepPrimAPI import BRepPrimAPI_MakeBox, BRepPrimAPI_MakeCylinder
from OCP.Geom import (
    Geom_BSplineCurve,
    Geom_BSplineSurface,
    Geom_Curve,
    Geom_Line,
    Geom_Plane,
    Geom_Surface,
    Geom_SurfaceOfLinearExtrusion,
)
from OCP.Geom2d import Geom2d_BSplineCurve, Geom2d_Circle, Geom2d_Curve, Geom2d_Line
from OCP.GeomAbs import GeomAbs_C2
from OCP.gp import gp_Ax1, gp_Ax2, gp_Ax2d, gp_Dir, gp_Dir2d, gp_Pnt, gp_Pnt2d, gp_Trsf, gp_Vec, gp_Vec2d
from OCP.IFSelect import IFSelect_RetDone
from OCP.Interface import Interface_Static
from OCP.Message import Message
from OCP.Quantity import Quantity_Color, Quantity_TOC_sRGB
from OCP.StepData import StepData_StepWriter
from OCP.STEPCAFControl import STEPCAFControl_Writer
from OCP.TColgp import TColgp_Array1OfPnt, TColgp_Array1OfPnt2d, TColgp_Array2OfPnt
from OCP.TCollection import TCollection_ExtendedString, TCollection_HAsciiString
from OCP.TColStd import TColStd_Array1OfInteger, TColStd_Array1OfReal, TColStd_Array2OfReal
from OCP.TDataStd import TDataStd_Name
from OCP.TDF import TDF_Label
from OCP.TDocStd import TDocStd_Document
from OCP.TopAbs import TopAbs_FACE, TopAbs_FORWARD, TopAbs_REVERSED
from OCP.TopExp import TopExp_Explorer
from OCP.TopLoc import TopLoc_Location
from OCP.TopoDS import TopoDS, TopoDS_Edge, TopoDS_Face, TopoDS_Shape, TopoDS_Shell, TopoDS_Solid, TopoDS_Vertex, TopoDS_Wire
from OCP.XCAFApp import XCAFApp_Application
from OCP.XCAFDoc import XCAFDoc_ColorSurf, XCAFDoc_DocumentTool

TOL = 1e-7
HERE = Path(__file__).resolve().parent


# ---------------------------------------------------------------------------------------------------------------------
# Splines
# ---------------------------------------------------------------------------------------------------------------------


def settle(values: np.ndarray, bits: int = 10) -> np.ndarray:
    """Round to multiples of ``2**-bits``: the last bits of a sine differ between machines, these do not."""
    return np.round(np.asarray(values) * 2.0**bits) / 2.0**bits


def breaks(rng: np.random.Generator, start: float, stop: float, spans: int, spread: float = 3.0) -> np.ndarray:
    """Return ``spans + 1`` break points whose neighbouring spacings differ by up to ``spread``, on a dyadic grid."""
    steps = rng.uniform(1.0, spread, spans)
    inner = start + (stop - start) * np.cumsum(steps)[:-1] / steps.sum()
    return np.concatenate(([start], settle(inner), [stop]))


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


def split(knots: np.ndarray, poles: np.ndarray, degree: int, at: Sequence[float]) -> list[tuple[np.ndarray, np.ndarray]]:
    """Cut a net along axis 0 at the given inner knots into clamped nets, each with its full knot vector."""
    for value in at:
        for _ in range(degree - np.count_nonzero(knots == value)):
            knots, poles = insert(knots, poles, degree, value)
    pieces = []
    ends = [knots[0], *at, knots[-1]]
    for low, high in zip(ends[:-1], ends[1:], strict=True):
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
    poles: np.ndarray, knots: np.ndarray, degree: int = 3, weights: np.ndarray | None = None
) -> Geom_BSplineCurve | Geom2d_BSplineCurve:
    """Return a clamped B-spline curve, planar where the poles have two coordinates."""
    flat = poles.shape[1] == 2
    net = (TColgp_Array1OfPnt2d if flat else TColgp_Array1OfPnt)(1, len(poles))
    for i, pole in enumerate(poles, 1):
        net.SetValue(i, (gp_Pnt2d if flat else gp_Pnt)(*map(float, pole)))
    kind = Geom2d_BSplineCurve if flat else Geom_BSplineCurve
    if weights is None:
        return kind(net, *_knots(knots), degree, False)
    return kind(net, _reals(weights), *_knots(knots), degree, False)


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


def on_surface(face: Geom_Surface, path: Geom2d_Curve, first: float, last: float, pieces: int) -> Path3:
    """Return the curve in space over a parameter-plane curve: C1 cubic Hermite interpolation in `pieces` pieces.

    The ends are kept as they are, the rest is put on a grid of 0.0002 mm.
    """
    times = np.linspace(first, last, pieces + 1)
    step = (last - first) / pieces / 3.0
    place, speed, point, along_u, along_v = gp_Pnt2d(), gp_Vec2d(), gp_Pnt(), gp_Vec(), gp_Vec()
    poles = []
    for time in times:
        path.D1(float(time), place, speed)
        face.D1(place.X(), place.Y(), point, along_u, along_v)
        here = np.array([point.X(), point.Y(), point.Z()])
        slope = speed.X() * np.array([along_u.X(), along_u.Y(), along_u.Z()])
        slope += speed.Y() * np.array([along_v.X(), along_v.Y(), along_v.Z()])
        poles += [here - step * slope, here + step * slope]
        ends = (here,) if time == times[0] else (ends[0], here)
    poles = settle(poles, 12)
    poles[0], poles[-1] = ends
    return Path3(poles, np.repeat(times, [4, *[2] * (pieces - 1), 4]))


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
    path: Geom_Curve | None, ends: tuple[TopoDS_Vertex, TopoDS_Vertex], span: tuple[float, float], tolerance: float = TOL
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


def face(on: Geom_Surface, loops: Sequence[Sequence[Side]], outward: bool = True, tolerance: float = TOL) -> TopoDS_Face:
    """Return a face; outer loops run anticlockwise in the parameter plane, holes clockwise.

    A closing edge comes as two successive sides of one loop that name the same edge with two different curves.
    """
    shape = TopoDS_Face()
    BUILD.MakeFace(shape, on, tolerance)
    where = TopLoc_Location()
    for loop in loops:
        wire = TopoDS_Wire()
        BUILD.MakeWire(wire)
        closing: dict[int, list[Side]] = {}
        for side in loop:
            BUILD.Add(wire, side.edge.Oriented(TopAbs_FORWARD if side.forward else TopAbs_REVERSED))
            closing.setdefault(hash(side.edge.TShape()), []).append(side)
        for sides in closing.values():
            if len(sides) == 2:
                ahead, back = sorted(sides, key=lambda side: not side.forward)
                BUILD.UpdateEdge(ahead.edge, ahead.path, back.path, on, where, tolerance)
                BUILD.Continuity(ahead.edge, on, on, where, where, GeomAbs_C2)
            elif sides[0].path is not None:
                BUILD.UpdateEdge(sides[0].edge, sides[0].path, on, where, tolerance)
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
    """One edge of the top of a `block`: its curve in space and in the parameter plane, and the sense walked."""

    path: Path3
    plane: Geom2d_Curve
    span: tuple[float, float]
    forward: bool = True
    tolerance: float = TOL


@dataclass(frozen=True)
class Corner:
    """A vertex of the top of a `block`, the one below it, and the edge between them."""

    high: TopoDS_Vertex
    low: TopoDS_Vertex
    upright: TopoDS_Edge


def block(top: Geom_BSplineSurface, loops: Sequence[Sequence[Rim]]) -> TopoDS_Solid:
    """Return the solid between a freeform top and the plane z = 0, with walls swept along z."""

    def corner(rim: Rim, last: bool) -> Corner:
        point = rim.path.geometry.Value(rim.span[last == rim.forward])
        x, y, z = point.X(), point.Y(), point.Z()
        high, low = vertex((x, y, z), rim.tolerance), vertex((x, y, 0.0))
        return Corner(high, low, edge(Geom_Line(gp_Pnt(x, y, 0.0), gp_Dir(0, 0, 1)), (low, high), (0.0, z)))

    walls, tops, bottoms = [], [], []
    for loop in loops:
        upper, lower = [], []
        corners = [corner(rim, False) for rim in loop]
        for rim, *pair in zip(loop, corners, corners[1:] + corners[:1], strict=True):
            start, end = pair if rim.forward else pair[::-1]
            path = rim.path
            high = edge(path.geometry, (start.high, end.high), rim.span, rim.tolerance)
            ground = Path3(path.poles * (1.0, 1.0, 0.0), path.knots, path.degree).geometry
            low = edge(ground, (start.low, end.low), rim.span)
            height = np.column_stack((greville(path.knots, path.degree), path.poles[:, 2]))
            walk = [
                Side(low, line2d((0.0, 0.0), (1, 0))),
                Side(end.upright, line2d((rim.span[1], 0.0), (0, 1))),
                Side(high, curve(height, path.knots, path.degree), False),
                Side(start.upright, line2d((rim.span[0], 0.0), (0, 1)), False),
            ]
            walls.append(face(Geom_SurfaceOfLinearExtrusion(ground, gp_Dir(0, 0, 1)), [walk], rim.forward))
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


def document() -> TDocStd_Document:
    """Return an empty XCAF document in millimetres."""
    made = TDocStd_Document(TCollection_ExtendedString("BinXCAF"))
    XCAFApp_Application.GetApplication_s().NewDocument(TCollection_ExtendedString("BinXCAF"), made)
    XCAFDoc_DocumentTool.SetLengthUnit_s(made, 0.001)
    return made


def single(shape: TopoDS_Shape, text: str) -> TDocStd_Document:
    """Return a document with one named part."""
    made = document()
    name(XCAFDoc_DocumentTool.ShapeTool_s(made.Main()).AddShape(shape, False), text)
    return made


@contextmanager
def settings(**values: str):
    """Hold the kernel's process-wide settings (``write_step_unit`` is ``write.step.unit``) for a while."""
    names = {key.replace("_", "."): value for key, value in values.items()}
    before = {key: Interface_Static.CVal_s(key) for key in names}
    try:
        for key, value in names.items():
            Interface_Static.SetCVal_s(key, value)
        yield
    finally:
        for key, value in before.items():
            Interface_Static.SetCVal_s(key, value)


def write(made: TDocStd_Document, path: Path, unit: str = "MM") -> None:
    """Write a document as STEP with 17 digits and a header that depends on nothing but the file's name."""
    writer = STEPCAFControl_Writer()
    with settings(write_step_unit=unit, write_step_schema="AP214IS"):
        if not writer.Transfer(made):
            raise RuntimeError(f"{path.name}: the STEP writer takes nothing from the document")
        model = writer.ChangeWriter().Model()
        header = APIHeaderSection_MakeHeader(model)
        header.SetName(TCollection_HAsciiString(path.name))
        header.SetTimeStamp(TCollection_HAsciiString("1970-01-01T00:00:00"))
        header.SetOriginatingSystem(TCollection_HAsciiString("mracad samples"))
        step = StepData_StepWriter(model)
        step.FloatWriter().SetFormat("%.17G")
        step.SendModel(writer.ChangeWriter().WS().Protocol())
    stream = io.BytesIO()
    step.Print(stream)
    path.write_bytes(stream.getvalue())


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
        cuts = [breaks(rng, low, high, PATCH_SPANS) for low, high in zip(ends[:-1], ends[1:], strict=True)]
        knots.append(clamped(np.unique(np.concatenate(cuts)), 3))
    u, v = np.meshgrid(*(greville(k, 3) for k in knots), indexing="ij")
    p, q = u / 150.0 - 1.0, v / 100.0 - 1.0
    x = u + 6.0 * p * (1.0 - q * q)
    y = v + 4.0 * q * (1.0 - p * p)
    line = (v - 118.0 - 14.0 * p) / 16.0
    crown = 42.0 - 26.0 * p * p - 15.0 * q * q + 4.0 * p * q * q
    z = crown + 5.0 * line / np.sqrt(1.0 + line * line) + 4.0 / (1.0 + 5.0 * ((p - 0.3) ** 2 + (q + 0.4) ** 2))
    return *knots, np.stack((x, y, z), axis=-1)


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


def panel_clean() -> TDocStd_Document:
    """The panel as it should be: 3 × 2 bicubic patches of 35 × 35 poles on uneven knots, C2 across every seam."""
    return single(panel_shell(panel_patches(*panel_net())), "panel clean")


def panel() -> TDocStd_Document:
    """The panel with noise on every pole, put on before cutting: patches are rough but still C2 across the seams."""
    u, v, poles = panel_net()
    return single(panel_shell(panel_patches(u, v, settle(poles + panel_noise(poles.shape)))), "panel")


def panel_inside() -> TDocStd_Document:
    """The panel with noise inside the patches only: two rows of poles round each are clean, so every seam is G1."""
    rows = panel_patches(*panel_net())
    noise = panel_noise((*PATCHES, PATCH_SPANS + 3, PATCH_SPANS + 3, 3))
    for i, row in enumerate(rows):
        for j, (u, v, net) in enumerate(row):
            rough = net.copy()
            rough[2:-2, 2:-2] = settle(net + noise[i, j])[2:-2, 2:-2]
            row[j] = u, v, rough
    return single(panel_shell(rows), "panel inside")


# ---------------------------------------------------------------------------------------------------------------------
# Single parts
# ---------------------------------------------------------------------------------------------------------------------


def rough_top(
    seed: int, size: tuple[float, float], spans: tuple[int, int], height: float, noise: float
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return knots in u and v and poles of a rough, gently saddled bicubic surface over a rectangle."""
    rng = np.random.default_rng(seed)
    u_knots, v_knots = (clamped(breaks(rng, 0.0, *pair, 2.0), 3) for pair in zip(size, spans, strict=True))
    x, y = np.meshgrid(greville(u_knots, 3), greville(v_knots, 3), indexing="ij")
    p, q = 2.0 * x / size[0] - 1.0, 2.0 * y / size[1] - 1.0
    z = height * (1.0 - 0.45 * p * p + 0.3 * q * q + 0.15 * p * q + 0.2 * p * p * p)
    poles = np.stack((x, y, z), axis=-1)
    return u_knots, v_knots, settle(poles + noise / 3.0**0.5 * rng.standard_normal(poles.shape))


def natural_rims(net: tuple[np.ndarray, np.ndarray, np.ndarray]) -> dict[str, Rim]:
    """Return the four sides of a bicubic net as rims walked anticlockwise."""
    u, v, poles = net
    return {
        "bottom": Rim(Path3(poles[:, 0], u), line2d((0.0, v[0]), (1, 0)), (u[0], u[-1])),
        "right": Rim(Path3(poles[-1], v), line2d((u[-1], 0.0), (0, 1)), (v[0], v[-1])),
        "top": Rim(Path3(poles[:, -1], u), line2d((0.0, v[-1]), (1, 0)), (u[0], u[-1]), False),
        "left": Rim(Path3(poles[0], v), line2d((u[0], 0.0), (0, 1)), (v[0], v[-1]), False),
    }


def trimmed() -> TDocStd_Document:
    """A cover plate whose rough top ends on two natural sides and two trim curves that cross it, with a round hole.

    The trim curves and the circle are exact in the parameter plane; the edges in space lie within 0.001 mm of them.
    """
    size = (130.0, 56.0)
    net = rough_top(201, size, (90, 39), 9.0, 0.09)
    top = surface(net[2], net[0], net[1])
    sides = natural_rims(net)

    def trim(path: Geom2d_Curve, span: tuple[float, float], pieces: int, forward: bool = True) -> Rim:
        return Rim(on_surface(top, path, *span, pieces), path, span, forward, 1e-3)

    bezier = np.repeat([0.0, 1.0], 4)
    slant = curve(np.array([(116.0, 0.0), (130.0, 14.0), (112.0, 28.0), (122.0, 46.0)]), bezier)
    bow = curve(np.array([(122.0, 46.0), (90.0, 58.0), (40.0, 40.0), (0.0, 50.0)]), bezier)
    circle = Geom2d_Circle(gp_Ax2d(gp_Pnt2d(52.0, 24.0), gp_Dir2d(1, 0)), 11.0)
    outer = [
        Rim(sides["bottom"].path, sides["bottom"].plane, (0.0, 116.0)),
        trim(slant, (0.0, 1.0), 120),
        trim(bow, (0.0, 1.0), 280),
        Rim(sides["left"].path, sides["left"].plane, (0.0, 50.0), False),
    ]
    half = float(np.pi)
    hole = [trim(circle, (half, 2.0 * half), 80, False), trim(circle, (0.0, half), 80, False)]
    return single(block(top, [outer, hole]), "cover plate")


def bottle() -> TDocStd_Document:
    """A bottle whose wall and base are one rippled face, periodic round the axis, its first row of poles one point.

    The ripples fade towards the base and the neck. A plane closes the mouth.
    """
    rng = np.random.default_rng(301)
    coarse = np.array([0.0, 14.0, 26.0, 50.0, 74.0, 92.0, 104.0, 116.0, 126.0, 140.0, 160.0])
    knots = clamped(coarse, 3)
    r = np.array([0.0, 5.0, 13.5, 14.5, 14.0, 14.0, 14.5, 14.0, 9.0, 5.5, 6.0, 6.5, 6.5])
    z = np.array([0.0, 0.0, -1.5, 10.0, 25.0, 45.0, 64.0, 84.0, 96.0, 102.0, 118.0, 128.0, 136.0])
    profile = np.column_stack((r, z))
    for value in np.setdiff1d(breaks(rng, 0.0, 160.0, 96, 2.0), coarse):
        knots, profile = insert(knots, profile, 3, value)
    r, z = profile.T
    around = 60
    turn = 2.0 * np.pi * np.arange(around) / around
    fade = np.clip((z - 6.0) / 8.0, 0.0, 1.0) * np.clip((96.0 - z) / 8.0, 0.0, 1.0)
    fade[: 12] = 0.0
    ripples = 0.06 * rng.standard_normal((around, len(z))) + 0.05 * np.cos(30.0 * turn)[:, None]
    radius = r + ripples * fade
    poles = np.stack((radius * np.cos(turn)[:, None], radius * np.sin(turn)[:, None], np.broadcast_to(z, radius.shape)), -1)
    wall = surface(settle(poles), np.arange(around + 1.0), knots, u_periodic=True)

    low, high = wall.Value(0.0, 0.0), wall.Value(0.0, knots[-1])
    base, mouth = vertex((0.0, 0.0, low.Z())), vertex((high.X(), high.Y(), high.Z()))
    apex = edge(None, (base, base), (0.0, around))
    closing = edge(wall.UIso(0.0), (base, mouth), (0.0, knots[-1]))
    rim = edge(wall.VIso(knots[-1]), (mouth, mouth), (0.0, around))
    loop = [
        Side(apex, line2d((0.0, 0.0), (1, 0))),
        Side(closing, line2d((around, 0.0), (0, 1))),
        Side(rim, line2d((0.0, knots[-1]), (1, 0)), False),
        Side(closing, line2d((0.0, 0.0), (0, 1)), False),
    ]
    side = face(wall, [loop])
    BUILD.Range(apex, side, 0.0, around)
    lid = face(Geom_Plane(gp_Pnt(0, 0, high.Z()), gp_Dir(0, 0, 1)), [[Side(rim)]])
    return single(solid([side, lid]), "bottle")


def blade() -> TDocStd_Document:
    """A twisted, tapered blade: one rational face round the section, degree 3 × 5, double knots both ways, rough.

    It runs from the trailing edge over the leading edge back; a ruled strip closes the blunt trailing edge, planes the
    root and the tip.
    """
    rng = np.random.default_rng(401)
    u_breaks, v_breaks = breaks(rng, 0.0, 1.0, 34, 2.0), breaks(rng, 0.0, 150.0, 92, 2.0)
    u_breaks[17] = 0.5
    u, v = clamped(u_breaks, 3, [9, 17, 26]), clamped(v_breaks, 5, [20, 45, 46, 70])
    section, span = greville(u, 3), greville(v, 5)
    half = np.pi * section
    x = np.cos(half) ** 2
    camber = 0.16 * x * (1.0 - x)
    thick = np.sin(half) * np.cos(half) * (0.3 * (1.0 - 0.45 * x)) + 0.012 * np.cos(half) ** 3
    along = (span / 150.0)[None, :]
    chord = 30.0 - 13.0 * along * along
    twist = np.pi / 180.0 * (52.0 - 46.0 * along + 14.0 * along * along)
    right, up = chord * (x - 0.35)[:, None], chord * (camber + thick)[:, None]
    lean = 10.0 * along * along
    poles = np.stack(
        (right * np.cos(twist) - up * np.sin(twist), right * np.sin(twist) + up * np.cos(twist) + lean, 0.0 * up + span), -1
    )
    noise = 0.03 * rng.standard_normal(poles.shape)
    noise[:, [0, -1], 2] = 0.0
    poles = settle(poles + noise)
    weights = settle(1.0 + 0.3 * np.sin(2.0 * np.pi * section)[:, None] * np.cos(np.pi * along) + 0.1 * along)
    skin = surface(poles, u, v, (3, 5), weights)

    def path(row: np.ndarray, knots: np.ndarray, degree: int, shares: np.ndarray) -> Geom_BSplineCurve:
        return curve(row, knots, degree, shares)

    root = [vertex(poles[0, 0]), vertex(poles[-1, 0])]
    tip = [vertex(poles[0, -1]), vertex(poles[-1, -1])]
    section_root = edge(path(poles[:, 0], u, 3, weights[:, 0]), tuple(root), (0.0, 1.0))
    section_tip = edge(path(poles[:, -1], u, 3, weights[:, -1]), tuple(tip), (0.0, 1.0))
    upper = edge(path(poles[0], v, 5, weights[0]), (root[0], tip[0]), (0.0, 150.0))
    lower = edge(path(poles[-1], v, 5, weights[-1]), (root[1], tip[1]), (0.0, 150.0))
    ends = [0.0, 0.0, 1.0, 1.0]
    blunt_root, blunt_tip = (edge(curve(net[[-1, 0], k], ends, 1), (pair[1], pair[0]), (0.0, 1.0)) for net, k, pair in ((poles, 0, root), (poles, -1, tip)))
    strip = surface(poles[[-1, 0]], np.array(ends), v, (1, 5), weights[[-1, 0]])
    faces = []
    for on, width, first, last, low, high in (
        (skin, 1.0, upper, lower, section_root, section_tip),
        (strip, 1.0, lower, upper, blunt_root, blunt_tip),
    ):
        loop = [
            Side(low, line2d((0.0, 0.0), (1, 0))),
            Side(last, line2d((width, 0.0), (0, 1))),
            Side(high, line2d((0.0, 150.0), (1, 0)), False),
            Side(first, line2d((0.0, 0.0), (0, 1)), False),
        ]
        faces.append(face(on, [loop]))
    floor = face(Geom_Plane(gp_Pnt(0, 0, 0), gp_Dir(0, 0, 1)), [[Side(section_root), Side(blunt_root)]], outward=False)
    cap = face(Geom_Plane(gp_Pnt(0, 0, 150.0), gp_Dir(0, 0, 1)), [[Side(section_tip), Side(blunt_tip)]])
    return single(solid([*faces, floor, cap]), "blade")


# ---------------------------------------------------------------------------------------------------------------------
# The assembly
# ---------------------------------------------------------------------------------------------------------------------


def placed(x: float, y: float, z: float) -> TopLoc_Location:
    """Return a shift."""
    move = gp_Trsf()
    move.SetTranslation(gp_Vec(x, y, z))
    return TopLoc_Location(move)


def assembly() -> TDocStd_Document:
    """A fixture in inches: a base plate, a pin, and two pairs of one rough pad (a nested subassembly placed twice).

    Parts and instances have names; each part has a colour, the top of the pad its own; the base plate is on a layer.
    """
    made = document()
    shapes = XCAFDoc_DocumentTool.ShapeTool_s(made.Main())
    colours = XCAFDoc_DocumentTool.ColorTool_s(made.Main())
    layers = XCAFDoc_DocumentTool.LayerTool_s(made.Main())

    def part(shape: TopoDS_Shape, text: str, colour: tuple[float, float, float]) -> TDF_Label:
        label = shapes.AddShape(shape, False)
        name(label, text)
        colours.SetColor(label, Quantity_Color(*colour, Quantity_TOC_sRGB), XCAFDoc_ColorSurf)
        return label

    def group(text: str, items: Sequence[tuple[TDF_Label, str, tuple[float, float, float]]]) -> TDF_Label:
        label = shapes.NewShape()
        name(label, text)
        for item, instance, place in items:
            name(shapes.AddComponent(label, item, placed(*place)), instance)
        return label

    net = rough_top(501, (50.8, 25.4), (30, 16), 10.0, 0.1)
    pad_shape = block(surface(net[2], net[0], net[1]), [list(natural_rims(net).values())])
    plate = part(BRepPrimAPI_MakeBox(gp_Pnt(0, 0, 0), 177.8, 101.6, 12.7).Shape(), "base plate", (0.5, 0.5, 0.5))
    pad = part(pad_shape, "pad", (0.0, 0.0, 1.0))
    axis = gp_Ax2(gp_Pnt(0, 0, 0), gp_Dir(0, 0, 1))
    pin = part(BRepPrimAPI_MakeCylinder(axis, 6.35, 38.1).Shape(), "pin", (1.0, 1.0, 0.0))
    rough = TopoDS.Face_s(TopExp_Explorer(pad_shape, TopAbs_FACE).Current())
    colours.SetColor(shapes.AddSubShape(pad, rough), Quantity_Color(1.0, 0.0, 0.0, Quantity_TOC_sRGB), XCAFDoc_ColorSurf)
    layers.SetLayer(plate, TCollection_ExtendedString("tooling"))
    pair = group("pad pair", [(pad, "pad left", (0.0, 0.0, 0.0)), (pad, "pad right", (76.2, 0.0, 0.0))])
    group(
        "fixture",
        [
            (plate, "base", (0.0, 0.0, 0.0)),
            (pair, "front pair", (25.4, 12.7, 12.7)),
            (pair, "back pair", (25.4, 63.5, 12.7)),
            (pin, "locating pin", (88.9, 50.8, 12.7)),
        ],
    )
    shapes.UpdateAssemblies()
    return made


SAMPLES: dict[str, Callable[[], TDocStd_Document]] = {
    build.__name__: build for build in (panel, panel_clean, panel_inside, trimmed, bottle, blade, assembly)
}
UNITS = {"assembly": "INCH"}


def main(arguments: Sequence[str]) -> int:
    """Write the named samples (all when none is named) into a folder, this one by default."""
    known = [argument for argument in arguments if argument in SAMPLES]
    folders = [argument for argument in arguments if argument not in SAMPLES]
    if len(folders) > 1:
        print(f"no such sample: {' '.join(folders[1:])}; there are {' '.join(SAMPLES)}", file=sys.stderr)
        return 2
    folder = Path(folders[0]) if folders else HERE
    folder.mkdir(parents=True, exist_ok=True)
    for printer in list(Message.DefaultMessenger_s().Printers()):
        Message.DefaultMessenger_s().RemovePrinter(printer)
    for key in known or SAMPLES:
        path = folder / f"{key}.step"
        write(SAMPLES[key](), path, UNITS.get(key, "MM"))
        print(f"{path}  {path.stat().st_size / 1e6:.2f} MB")
    return 0


if __name__ == "__main__":
    raise SystemExit(main(sys.argv[1:]))
