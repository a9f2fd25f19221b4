"""Faces that a format cannot express as they are: readers would misinterpret them, so they become NURBS or parts.

A face that goes right round its surface has a closing edge.  STEP and IGES omit the edges that close it at poles, and a
reader has to guess; if the face has other boundaries too, it may guess wrong and take the hole for the face.  When the
face is cut along a parameter line, its parts close in one direction less, and readers need not guess.  A surface of
revolution is written without its limits, and may touch its axis beyond the face: as NURBS it ends where the face ends.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from functools import partial

import numpy as np
from OCP.BRep import BRep_Builder, BRep_Tool
from OCP.BRepBuilderAPI import BRepBuilderAPI_Copy
from OCP.BRepCheck import BRepCheck_Analyzer
from OCP.BRepGProp import BRepGProp
from OCP.BRepLib import BRepLib
from OCP.BRepTools import BRepTools
from OCP.Geom import (
    Geom_BezierSurface,
    Geom_BSplineSurface,
    Geom_ElementarySurface,
)
from OCP.GProp import GProp_GProps
from OCP.ShapeAnalysis import ShapeAnalysis_ShapeTolerance
from OCP.ShapeBuild import ShapeBuild_ReShape
from OCP.ShapeFix import ShapeFix_ComposeShell
from OCP.ShapeUpgrade import ShapeUpgrade_SplitSurface
from OCP.TColStd import TColStd_HSequenceOfReal
from OCP.TopAbs import TopAbs_EDGE, TopAbs_FACE, TopAbs_FORWARD, TopAbs_WIRE
from OCP.TopLoc import TopLoc_Location
from OCP.TopoDS import TopoDS, TopoDS_Edge, TopoDS_Face, TopoDS_Shape
from OCP.TopTools import TopTools_MapOfShape
from OCP.XCAFDoc import XCAFDoc_ShapeTool

from mracad.errors import EditError
from mracad.occ.convert import conversion, lay
from mracad.occ.document import Conversion, Document, Part
from mracad.occ.geometry import basis as untrimmed
from mracad.occ.instance import say
from mracad.occ.labels import labels
from mracad.occ.topology import edge_uses, inside
from mracad.occ.tubes import along, tubes

Array = np.ndarray
Copier = Callable[[TopoDS_Shape], TopoDS_Shape]
"""Writes a bare shape in some format and reads it back."""

_NURBS = Geom_BSplineSurface, Geom_BezierSurface
_NATURAL = 4  # edge uses of a face that is bounded only by parameter lines
_SAME = 2e-4  # largest relative difference of areas, and of centres to size, of the same face: the kernel's accuracy
_OTHER = 1e-2  # difference above which the face read back is surely another one
_EXACT = 1e-7  # relative error of areas; the kernel's fast method has errors of up to 1 % on NURBS faces
_LOOSER = 2.0, 1e-5  # allowed factor on the tolerance of a face read back, or allowed tolerance (memory units)
_ALL_THE_WAY = 0.9  # share of the whole range of a parameter
_PRECISION = 1e-7


@dataclass(frozen=True)
class CutFace:
    """A face that a file holds in another form.

    Attributes
    ----------
    face : int
        Its index.
    parts : int
        Number of its parts; 1 if it is on a NURBS surface instead of its own.
    """

    face: int
    parts: int

    def __str__(self) -> str:
        return f"#{self.face + 1} " + (f"in {self.parts} parts" if self.parts > 1 else "as NURBS")


@contextmanager
def writable(document: Document, copier: Copier) -> Iterator[tuple[CutFace, ...]]:
    """Make a document hold, inside the block, only faces that a format can express.

    Parameters
    ----------
    document : Document
        Its parts and their labels are restored when the block ends.
    copier : callable
        Writes a bare shape in that format and reads it back.

    Yields
    ------
    tuple of CutFace
        The faces that are on NURBS or in several parts, which keep their name, colour and layers.

    Raises
    ------
    EditError
        For a face that would not be read back correctly in that form either.
    """
    wrong: dict[int, list[int]] = {}
    for number, part in enumerate(document.parts):
        for index in part.numbers:
            face = document.faces[index]
            if _closes(face) and BRepCheck_Analyzer(face).IsValid() and not _kept(face, copier(face)):
                wrong.setdefault(number, []).append(index)
    if not wrong:
        yield ()
        return
    document.xcaf.SetUndoLimit(1)
    document.xcaf.OpenCommand()
    try:
        cuts = [
            cut for number, faces in wrong.items() for cut in _rewrite(document, document.parts[number], faces, copier)
        ]
        document.shape_tool.UpdateAssemblies()
        yield tuple(cuts)
    finally:
        document.xcaf.AbortCommand()
        document.xcaf.SetUndoLimit(0)


def _closes(face: TopoDS_Face) -> bool:
    """Whether a face goes right round a surface that is not elementary, so that a reader has to guess how."""
    forward = TopoDS.Face_s(face.Oriented(TopAbs_FORWARD))
    basis = untrimmed(BRep_Tool.Surface_s(forward, TopLoc_Location()))
    if isinstance(basis, Geom_ElementarySurface):
        return False
    edges = list(edge_uses(forward))
    natural = len(edges) <= _NATURAL and sum(1 for _ in inside(forward, TopAbs_WIRE)) == 1
    if natural and isinstance(basis, _NURBS):
        return False
    return any(BRep_Tool.IsClosed_s(edge, forward) for edge in edges)


def _kept(face: TopoDS_Shape, copy: TopoDS_Shape) -> bool:
    """Whether a face was read back as it was written."""
    loose, looser = _LOOSER
    return (
        _alike(face, copy, _SAME)
        and _tolerance(copy) <= max(loose * _tolerance(face), looser)
        and BRepCheck_Analyzer(copy).IsValid()
    )


def _alike(face: TopoDS_Shape, copy: TopoDS_Shape, slack: float) -> bool:
    """Whether there are as many faces, with the same area and centre."""
    same_count = len(_faces(copy)) == len(_faces(face))
    return same_count and (_as_large(face, copy, slack) or _as_large(face, copy, slack, _EXACT))


def _as_large(face: TopoDS_Shape, copy: TopoDS_Shape, slack: float, *exact: float) -> bool:
    """Whether two faces have the same area and centre, by a quick measurement that rejects some that do, or exactly."""
    old, new = GProp_GProps(), GProp_GProps()
    for shape, found in ((face, old), (copy, new)):
        BRepGProp.SurfaceProperties_s(shape, found, *exact)
    off = old.CentreOfMass().Distance(new.CentreOfMass())
    return abs(new.Mass() - old.Mass()) <= slack * abs(old.Mass()) and off <= slack * abs(old.Mass()) ** 0.5


def _tolerance(shape: TopoDS_Shape) -> float:
    return ShapeAnalysis_ShapeTolerance().Tolerance(shape, 1, TopAbs_EDGE)


def _rewrite(document: Document, part: Part, faces: Sequence[int], copier: Copier) -> Iterator[CutFace]:
    """Replace a part in the document by one with some faces on NURBS or in parts."""
    twins = BRepBuilderAPI_Copy(part.shape, False, False)
    context = ShapeBuild_ReShape()
    for index in faces:
        twin = twins.ModifiedShape(document.faces[index])
        if not _mended(document, index, twin, copier, context):
            if not _alike(twin, copier(twin), _OTHER):
                raise _mistaken(document, index)
            continue
        yield CutFace(index, len(_faces(context.Apply(twin))))
    whole = context.Apply(twins.Shape())
    if BRepCheck_Analyzer(part.shape).IsValid() and not BRepCheck_Analyzer(whole).IsValid():
        raise _mistaken(document, faces[0])
    tool = document.shape_tool
    subs = list(labels(lambda found: XCAFDoc_ShapeTool.GetSubShapes_s(part.label, found)))
    new = [context.Apply(twins.ModifiedShape(XCAFDoc_ShapeTool.GetShape_s(label))) for label in subs]
    tool.SetShape(part.label, whole)
    for label, shape in zip(subs, new, strict=True):
        is_face = XCAFDoc_ShapeTool.GetShape_s(label).ShapeType() == TopAbs_FACE
        first, *others = _faces(shape) if is_face else [shape]
        tool.SetShape(label, first)
        for other in others:
            say(document, label, tool.AddSubShape(part.label, other))


def _mended(document: Document, index: int, twin: TopoDS_Shape, copier: Copier, context: ShapeBuild_ReShape) -> bool:
    """Replace the twin of a face by NURBS or parts if that is read back correctly; returns whether it is."""
    made = _on_nurbs(document, index)
    if made is not None:
        trial = BRepBuilderAPI_Copy(_bare(twin), False, False).Shape()
        lay(TopoDS.Face_s(trial), made.surface, made.pcurves, made.tolerances)
        if BRepCheck_Analyzer(trial).IsValid() and _kept(trial, copier(trial)):
            lay(_bare(twin), made.surface, made.pcurves, made.tolerances)
            return True
    if _divided(_bare(context.Apply(twin)), copier, context):
        return True
    if made is None or context.IsRecorded(twin):
        return False
    lay(_bare(twin), made.surface, made.pcurves, made.tolerances)
    return _divided(_bare(twin), copier, context)


def _on_nurbs(document: Document, index: int) -> Conversion | None:
    """The NURBS form of a face on another surface; None for a NURBS face or if it cannot be converted."""
    if isinstance(untrimmed(BRep_Tool.Surface_s(document.faces[index], TopLoc_Location())), _NURBS):
        return None
    try:
        return conversion(document, index)
    except EditError:
        return None
    finally:
        document.conversions.pop(index, None)


def _bare(face: TopoDS_Shape) -> TopoDS_Face:
    return TopoDS.Face_s(face.Located(TopLoc_Location()).Oriented(TopAbs_FORWARD))


def _divided(face: TopoDS_Face, copier: Copier, context: ShapeBuild_ReShape) -> bool:
    """Replace a face by parts in a context if these are read back correctly; returns whether they are."""
    for divide in (_tubes, partial(_parts, axis=0), partial(_parts, axis=1)):
        parts = divide(face, ShapeBuild_ReShape())
        if parts is not None and BRepCheck_Analyzer(parts).IsValid() and _kept(parts, copier(parts)):
            divide(face, context)
            return True
    return False


def _tubes(face: TopoDS_Face, context: ShapeBuild_ReShape) -> TopoDS_Shape | None:
    """A face that goes round both ways as two tubes."""
    shell = tubes(face)
    if shell is not None:
        context.Replace(face, shell)
    return shell


def _mistaken(document: Document, index: int) -> EditError:
    what = "goes right round its surface in a way that readers of this format misinterpret"
    return EditError(f"{document.name}: #{index + 1} {what}", "write BREP, or split the face")


def _faces(shape: TopoDS_Shape) -> list[TopoDS_Shape]:
    return list(inside(shape, TopAbs_FACE))


def _parts(face: TopoDS_Face, context: ShapeBuild_ReShape, axis: int) -> TopoDS_Shape | None:
    """A face cut across a closed direction of its surface, u (0) or v (1)."""
    location = TopLoc_Location()
    surface = BRep_Tool.Surface_s(face, location)
    basis = untrimmed(surface)
    if not (basis.IsUClosed(), basis.IsVClosed())[axis]:
        return None
    bounds = BRepTools.UVBounds_s(face)
    splitter = ShapeUpgrade_SplitSurface()
    splitter.Init(surface, *bounds)
    at = TColStd_HSequenceOfReal()
    at.Append(_away(face, axis, *bounds[2 * axis : 2 * axis + 2]))
    (splitter.SetUSplitValues, splitter.SetVSplitValues)[axis](at)
    splitter.Perform(False)
    shell = ShapeFix_ComposeShell()
    shell.Init(splitter.ResSurfaces(), location, face, _PRECISION)
    shell.SetContext(context)
    if not shell.Perform():
        return None
    known = TopTools_MapOfShape()
    for edge in edge_uses(face):
        known.Add(edge)
    for edge in inside(shell.Result(), TopAbs_EDGE):
        if known.Add(edge):
            _time(TopoDS.Edge_s(edge))
    context.Replace(face, shell.Result())
    return shell.Result()


def _time(edge: TopoDS_Edge) -> None:
    """Give the curves of an edge the same parameterisation."""
    builder = BRep_Builder()
    builder.SameRange(edge, False)
    builder.SameParameter(edge, False)
    BRepLib.SameRange_s(edge, _PRECISION)
    BRepLib.SameParameter_s(edge, _PRECISION)


def _away(face: TopoDS_Face, axis: int, low: float, high: float) -> float:
    """The middle of the widest range of a parameter that no boundary enters, except those that go all the way round."""
    taken = [(high, high)]
    for edge in edge_uses(face):
        values = along(edge, face)[:, axis]
        if not BRep_Tool.IsClosed_s(edge, face) and np.ptp(values) < _ALL_THE_WAY * (high - low):
            taken.append((values.min(), values.max()))
    best, start = (0.0, (low + high) / 2), low
    for first, last in sorted(taken):
        best = max(best, (first - start, (first + start) / 2))
        start = max(start, last)
    return best[1]
