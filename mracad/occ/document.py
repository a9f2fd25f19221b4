"""An open CAD document: the kernel's own structure, kept whole, and the parts and faces found in it."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from functools import cached_property

from OCP.BRep import BRep_Tool
from OCP.Geom import Geom_BezierSurface, Geom_BSplineSurface
from OCP.Geom2d import Geom2d_Curve
from OCP.TCollection import TCollection_ExtendedString
from OCP.TDataStd import TDataStd_Name
from OCP.TDF import TDF_AttributeSequence, TDF_ChildIterator, TDF_Label
from OCP.TDocStd import TDocStd_Document
from OCP.TopAbs import TopAbs_EDGE, TopAbs_FACE
from OCP.TopExp import TopExp
from OCP.TopLoc import TopLoc_Location
from OCP.TopoDS import TopoDS, TopoDS_Edge, TopoDS_Face, TopoDS_Shape
from OCP.TopTools import TopTools_IndexedMapOfShape
from OCP.XCAFDoc import XCAFDoc_DocumentTool, XCAFDoc_ShapeTool

from mracad.brief import model_line
from mracad.errors import FileError
from mracad.occ.labels import Title, components, label_colour, label_key, label_name, labels, usages
from mracad.occ.units import Units, metres


@dataclass(eq=False)
class Part:
    """One shape definition, which may have several instances.

    Attributes
    ----------
    label : TDF_Label
    shape : TopoDS_Shape
        Its shape, in the part's own frame.
    product : str
    first : int
        Document-wide index of its first face.
    faces : TopTools_IndexedMapOfShape
        Its faces, from 1.
    first_edge : int
        Document-wide index of its first edge.
    edges : TopTools_IndexedMapOfShape
        The edges of its faces, from 1.
    placements : list of TopLoc_Location
        Placements of its instances.
    colour : str
        Colour of the whole part, ``"#rrggbb"``, ``"#rrggbbaa"`` or ``""``.
    tint : str
        Colour of its first coloured instance.
    face_names, face_colours, body_colours : dict
        By position in the part, from 0, if the document states something about the face or its body.
    """

    label: TDF_Label
    shape: TopoDS_Shape
    product: str
    first: int
    faces: TopTools_IndexedMapOfShape
    first_edge: int
    edges: TopTools_IndexedMapOfShape
    placements: list[TopLoc_Location]
    colour: str
    tint: str
    face_names: dict[int, str]
    face_colours: dict[int, str]
    body_colours: dict[int, str]

    @property
    def numbers(self) -> range:
        """Document-wide indices of its faces."""
        return range(self.first, self.first + self.faces.Extent())

    def face_number(self, face: TopoDS_Shape) -> int:
        """Document-wide index of one of its faces."""
        return self.first + self.faces.FindIndex(face) - 1

    def edge_number(self, edge: TopoDS_Shape) -> int:
        """Document-wide index of one of its edges."""
        return self.first_edge + self.edges.FindIndex(edge) - 1

    def face_colour(self, position: int, tint: str = "") -> str:
        """The colour of a face by its position, in an instance with the colour ``tint``: its own takes precedence."""
        return self.face_colours.get(position) or tint or self.body_colours.get(position) or self.colour


@dataclass(eq=False)
class Conversion:
    """A NURBS surface that can replace the analytic one of a face (see ``convert``).

    Attributes
    ----------
    surface : Geom_BSplineSurface
    pcurves : list of Geom2d_Curve
        For each edge use of the face, in its own order, the curve on ``surface``, over the edge's own range.
    tolerances : list of float
        Least tolerance of each edge, memory units.
    """

    surface: Geom_BSplineSurface
    pcurves: list[Geom2d_Curve]
    tolerances: list[float]


@dataclass(eq=False)
class Document:
    """A CAD document.

    Attributes
    ----------
    xcaf : TDocStd_Document
        The kernel's document: shapes, names, colours, layers, tolerances, properties.
    name : str
        File name without folder.
    units : Units
    schema : str
        ``"AP203"``, ``"AP214"``, ``"AP242"``, ``"IGES"``, ``"BREP"``, ``"BinBREP"`` or ``""``.
    annotations : dict
        Names of the annotations in the file, by kind: ``"dimensions"``, ``"tolerances"``, ``"datums"``, ``"notes"``.
    warnings : tuple of str
        What had to be guessed about the file, or was lost.
    titles : dict
        Titles of products and instances in a STEP file, by label (its key).
    conversions : dict
        Surfaces made by ``view(document, convert=…)``, by face index, for ``apply``.
    moved : set of str
        The labels (their keys) of the parts that an edit has changed.
    origins : dict
        The label (its key) of each product that ``isolate`` made, and of the one that it was copied from.
    """

    xcaf: TDocStd_Document
    name: str
    units: Units = field(default_factory=Units)
    schema: str = ""
    annotations: dict[str, tuple[str, ...]] = field(default_factory=dict)
    warnings: tuple[str, ...] = ()
    titles: dict[str, Title] = field(default_factory=dict)
    conversions: dict[int, Conversion] = field(default_factory=dict)
    moved: set[str] = field(default_factory=set)
    origins: dict[str, str] = field(default_factory=dict)

    def __repr__(self) -> str:
        return self.told()

    def told(self, *more: str) -> str:
        """What it is, and more, in one line."""
        return model_line("Document", self.name, (self.nurbs, len(self.faces)), self.unit, self.schema, *more)

    def checked(self) -> Document:
        """The document, if it has faces, all on surfaces; raises FileError."""
        grounds = [
            BRep_Tool.Surface_s(TopoDS.Face_s(faces.FindKey(i)), TopLoc_Location())
            for _, _, faces in self._definitions()
            for i in range(1, faces.Extent() + 1)
        ]
        if not grounds:
            raise no_faces(self.name)
        if None in grounds:
            number = grounds.index(None) + 1
            raise FileError(f"'{self.name}': #{number} is a mesh, not a surface", "export surfaces or solids")
        return self

    def _definitions(self) -> Iterator[tuple[TDF_Label, TopoDS_Shape, TopTools_IndexedMapOfShape]]:
        """The shape definitions that may hold geometry, and their faces."""
        for label in labels(self.shape_tool.GetShapes):
            if XCAFDoc_ShapeTool.IsSimpleShape_s(label):
                shape, faces = XCAFDoc_ShapeTool.GetShape_s(label), TopTools_IndexedMapOfShape()
                TopExp.MapShapes_s(shape, TopAbs_FACE, faces)
                yield label, shape, faces

    @property
    def unit(self) -> str:
        """The length unit of the file (and of what is written)."""
        return self.units.name

    @property
    def shape_tool(self) -> XCAFDoc_ShapeTool:
        return XCAFDoc_DocumentTool.ShapeTool_s(self.xcaf.Main())

    @property
    def shape(self) -> TopoDS_Shape:
        """Everything, placed, as one shape."""
        return self.shape_tool.GetOneShape()

    def changed(self) -> None:
        """Find parts, faces and edges anew, after a change of the kernel's document."""
        for name in ("parts", "faces", "edges"):
            vars(self).pop(name, None)

    @cached_property
    def parts(self) -> list[Part]:
        """The shape definitions that hold geometry, in document order."""
        placed: dict[str, list[TopLoc_Location]] = {}
        tints: dict[str, str] = {}
        for usage in usages(self.shape_tool):
            key = label_key(usage.product)
            placed.setdefault(key, []).append(usage.frame)
            tint = next(filter(None, map(label_colour, usage.chain)), "")
            if tint:
                tints.setdefault(key, tint)
        parts: list[Part] = []
        first = first_edge = 0
        for label, shape, faces in self._definitions():
            edges = TopTools_IndexedMapOfShape()
            for i in range(1, faces.Extent() + 1):
                TopExp.MapShapes_s(faces.FindKey(i), TopAbs_EDGE, edges)
            key = label_key(label)
            parts.append(
                Part(
                    label, shape, label_name(label), first, faces, first_edge, edges, placed.get(key, []),
                    label_colour(label), tints.get(key, ""), *_described(label, faces),
                )
            )  # fmt: skip
            first += faces.Extent()
            first_edge += edges.Extent()
        return parts

    @cached_property
    def faces(self) -> list[TopoDS_Face]:
        """All faces, in their part's frame, in the order of ``Model.faces``."""
        return [TopoDS.Face_s(part.faces.FindKey(i)) for part in self.parts for i in range(1, part.faces.Extent() + 1)]

    @property
    def nurbs(self) -> int:
        """The number of faces on NURBS surfaces."""
        grounds = (BRep_Tool.Surface_s(face, TopLoc_Location()) for face in self.faces)
        return sum(isinstance(each, Geom_BSplineSurface | Geom_BezierSurface) for each in grounds)

    def part_of(self, face: int) -> Part:
        """The part that a face belongs to."""
        return next(part for part in reversed(self.parts) if part.first <= face)

    @cached_property
    def edges(self) -> list[TopoDS_Edge]:
        """All edges of faces, in their part's frame, in the order of ``Model.edges``."""
        return [TopoDS.Edge_s(part.edges.FindKey(i)) for part in self.parts for i in range(1, part.edges.Extent() + 1)]


def empty() -> TDocStd_Document:
    """A document of the kernel without content, in millimetres."""
    xcaf = TDocStd_Document(TCollection_ExtendedString("BinXCAF"))
    set_unit(xcaf, 1.0)
    return xcaf


def set_unit(xcaf: TDocStd_Document, mm: float) -> None:
    """Set the length unit of a document of the kernel."""
    XCAFDoc_DocumentTool.SetLengthUnit_s(xcaf, metres(mm))


def no_faces(name: str) -> FileError:
    """The error for a file without faces."""
    return FileError(f"'{name}' holds no faces", "the file needs surfaces or solids, not only curves or meshes")


def named_labels(document: Document) -> Iterator[TDF_Label]:
    """All labels that may have a name: products, instances, faces."""
    every = TDF_ChildIterator(document.shape_tool.Label(), True)
    while every.More():
        label = every.Value()
        every.Next()
        if label.IsAttribute(TDataStd_Name.GetID_s()):
            yield label


def nested_colours(document: Document) -> Iterator[tuple[tuple[str, ...], str]]:
    """Colours of instances inside one instance of an assembly: the path of labels, and the colour."""
    for product in labels(document.shape_tool.GetShapes):
        for component in components(product):
            found = TDF_AttributeSequence()
            if not XCAFDoc_ShapeTool.GetAllComponentSHUO_s(component, found):
                continue
            for i in range(1, found.Length() + 1):
                node = found.Value(i)
                colour, path = label_colour(node.Label()), [label_key(component)]
                while node.NbChildren():
                    node = node.GetChild(1)
                    path.append(label_key(node.Label().Father()))
                if colour:
                    yield tuple(path), colour


def tint(nested: Mapping[tuple[str, ...], str], above: tuple[str, ...], label: TDF_Label, so_far: str) -> str:
    """The colour that an instance gives what is in it.

    Parameters
    ----------
    nested : mapping
        :func:`nested_colours`.
    above : tuple of str
        The keys of the instances from the top down to this one.
    label : TDF_Label
        The instance.
    so_far : str
        The colour given by the instances that contain it.
    """
    given = next((nested[above[k:]] for k in range(len(above)) if above[k:] in nested), "")
    return given or so_far or label_colour(label)


def _described(
    label: TDF_Label, faces: TopTools_IndexedMapOfShape
) -> tuple[dict[int, str], dict[int, str], dict[int, str]]:
    """Names and colours of the faces of a part, and colours of its bodies, from its sub-shape labels."""
    names: dict[int, str] = {}
    colours: dict[int, str] = {}
    inherited: dict[int, str] = {}
    for sub in labels(lambda sequence: XCAFDoc_ShapeTool.GetSubShapes_s(label, sequence)):
        shape = XCAFDoc_ShapeTool.GetShape_s(sub)
        colour = label_colour(sub)
        if shape.ShapeType() == TopAbs_FACE:
            position = faces.FindIndex(shape) - 1
            if position >= 0:
                name = label_name(sub)
                if name and name != "NONE":  # some systems write this for no name
                    names[position] = name
                if colour:
                    colours[position] = colour
        elif colour:
            inside = TopTools_IndexedMapOfShape()
            TopExp.MapShapes_s(shape, TopAbs_FACE, inside)
            for i in range(1, inside.Extent() + 1):
                inherited[faces.FindIndex(inside.FindKey(i)) - 1] = colour
    return names, colours, inherited
