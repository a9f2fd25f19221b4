"""Shapes in memory as documents and back: a tree of named, placed and coloured shapes, copied so that none changes."""

from __future__ import annotations

import dataclasses
import tempfile
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

from OCP.BRepBuilderAPI import BRepBuilderAPI_Copy
from OCP.Quantity import Quantity_ColorRGBA
from OCP.TDF import TDF_ChildIterator, TDF_Label
from OCP.TNaming import TNaming_Builder, TNaming_NamedShape
from OCP.TopAbs import TopAbs_EDGE, TopAbs_FACE
from OCP.TopExp import TopExp
from OCP.TopLoc import TopLoc_Location
from OCP.TopoDS import TopoDS, TopoDS_Iterator, TopoDS_Shape
from OCP.TopTools import TopTools_IndexedMapOfShape
from OCP.XCAFDoc import XCAFDoc_ColorType, XCAFDoc_DocumentTool, XCAFDoc_Location, XCAFDoc_ShapeTool

from mracad.errors import CrashError, FileError, UsageError
from mracad.occ.document import Document, empty
from mracad.occ.healed import restored, stored
from mracad.occ.labels import label_key, name_label, referred, usages
from mracad.occ.settings import quiet
from mracad.occ.topology import compound

HERE = TopLoc_Location()

Shape = TopoDS_Shape

Colour = tuple[float, float, float, float]


@dataclass(frozen=True, eq=False)
class Node:
    """A named place in a tree of shapes.

    Attributes
    ----------
    name : str
    shapes : sequence of TopoDS_Shape
        Each becomes a part; equal ones are instances of one part.
    place : TopLoc_Location
        Its placement in the node above.
    colour : Colour, optional
        Red, green, blue and opacity.
    inside : sequence of (TopoDS_Shape, str, tuple of float or None)
        Names and colours of faces and bodies of its shapes.
    children : sequence of Node
    """

    name: str
    shapes: Sequence[TopoDS_Shape] = ()
    place: TopLoc_Location = HERE
    colour: Colour | None = None
    inside: Sequence[tuple[TopoDS_Shape, str, Colour | None]] = ()
    children: Sequence[Node] = ()

    def every(self) -> Iterator[Node]:
        """This node and all below, each before its children."""
        yield self
        for child in self.children:
            yield from child.every()


@dataclass(eq=False)
class Held:
    """A tree of shapes as a document.

    Attributes
    ----------
    document : Document
        Of copies.
    originals : list of TopoDS_Shape
        The shapes of all nodes, in the order of :meth:`Node.every`.
    usages : list of TDF_Label
        Their instances in the document, in the same order.
    """

    document: Document
    originals: list[TopoDS_Shape]
    usages: list[TDF_Label]

    def shapes(self) -> list[TopoDS_Shape]:
        """The shapes as they are now, in the same order; those that no edit has changed are the originals."""
        return [
            _cast(XCAFDoc_ShapeTool.GetShape_s(product).Located(shape.Location()).Oriented(shape.Orientation()))
            if label_key(product := referred(usage)) in self.document.moved
            else shape
            for shape, usage in zip(self.originals, self.usages, strict=True)
        ]

    def selector(self, shape: TopoDS_Shape, option: str) -> str:
        """``"#3"`` or ``"edge#4"`` for a face or edge of the originals; raises UsageError."""
        parts = {label_key(part.label): part for part in self.document.parts}
        kinds = {TopAbs_FACE: "", TopAbs_EDGE: "edge"}
        if shape.ShapeType() not in kinds:
            raise UsageError(f"{option}: a {shape.ShapeType().name[7:].lower()} is no face", "give faces")
        for exact in (True, False):  # the face itself, or else the same one in another place
            for original, usage in zip(self.originals, self.usages, strict=True):
                inside = _inside(original, shape, exact)
                if inside:
                    part = parts[label_key(referred(usage))]
                    numbered = part.faces if shape.ShapeType() == TopAbs_FACE else part.edges
                    first = part.first if shape.ShapeType() == TopAbs_FACE else part.first_edge
                    twin = counterpart(original, XCAFDoc_ShapeTool.GetShape_s(part.label), inside)
                    return f"{kinds[shape.ShapeType()]}#{first + numbered.FindIndex(twin)}"
        raise UsageError(f"{option}: a face or edge that was given is not in {self.document.name}", "take one of it")


def held(root: Node) -> Held:
    """A document of copies of the shapes of a tree; raises FileError where they have no faces, or are meshes."""
    originals = [shape for node in root.every() for shape in node.shapes]
    with quiet():
        copies = _Copies(originals)
        xcaf = empty()
        document = Document(xcaf, root.name)
        if not any(_subs(shape, TopAbs_FACE).Extent() for shape in originals):
            raise FileError(f"'{root.name}' holds no faces", "give shapes with faces")
        plan = _Plan(document.shape_tool, copies)
        if len(originals) == 1 and not root.children and _bare(root, originals[0]):
            made = [plan.product(originals[0], root)]
        else:
            made = []
            top = plan.assembly(root, made)
            if not root.place.IsIdentity():
                placed = TDF_Label()
                document.shape_tool.SetLocation(top, root.place, placed)
                name_label(placed, root.name)
        document.shape_tool.UpdateAssemblies()
    return Held(document.checked(), originals, made)


def within(before: TopoDS_Shape, after: TopoDS_Shape, inside: TopoDS_Shape) -> TopoDS_Shape | None:
    """What a face or body of a shape has become in the shape as it is after an edit; None if it was not in it."""
    found = _inside(before, inside, True)
    return None if found is None else _cast(counterpart(before, after, found).Moved(after.Location()))


def counterpart(before: TopoDS_Shape, after: TopoDS_Shape, inside: TopoDS_Shape) -> TopoDS_Shape:
    """The part of a shape that corresponds to a part of the shape of which it is a copy."""
    kind = inside.ShapeType()
    at = _subs(before.Located(HERE), kind).FindIndex(_unplaced(before, inside))
    return _subs(after.Located(HERE), kind).FindKey(at)


def copied(document: Document) -> Document:
    """A document of its own that equals another one; raises MracadError where the kernel cannot store it."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "document"
        twin = restored(path) if stored(document.xcaf, path) else None
    if twin is None:
        raise CrashError(f"'{document.name}' cannot be copied", "read it again instead")
    moved, origins = set(document.moved), dict(document.origins)
    copy = dataclasses.replace(document, xcaf=twin, conversions={}, moved=moved, origins=origins)
    with quiet():
        _exactly(document, copy)
    return copy


def _exactly(document: Document, copy: Document) -> None:
    """Give a copy the same bits: saving a document turns directions and placements by rounding."""
    shapes = [part.shape for part in document.parts]
    twins = _Copies(shapes)
    every = _named_shapes(document)
    for key, label in _named_shapes(copy).items():
        shape = XCAFDoc_ShapeTool.GetShape_s(every[key])
        owner = next((s for s in shapes if shape.IsSame(s) or _subs(s, shape.ShapeType()).Contains(shape)), None)
        if owner is not None:
            TNaming_Builder(label).Generated(counterpart(owner, twins.of(owner), shape))
    for old, new in zip(usages(document.shape_tool), usages(copy.shape_tool), strict=True):
        if XCAFDoc_ShapeTool.IsReference_s(new.chain[-1]):
            XCAFDoc_Location.Set_s(new.chain[-1], XCAFDoc_ShapeTool.GetLocation_s(old.chain[-1]))
    copy.shape_tool.UpdateAssemblies()
    copy.changed()


def _named_shapes(document: Document) -> dict[str, TDF_Label]:
    """The labels of parts and of faces and bodies in them, by their keys."""
    found: dict[str, TDF_Label] = {}
    every = TDF_ChildIterator(document.shape_tool.Label(), True)
    while every.More():
        label = every.Value()
        every.Next()
        simple = XCAFDoc_ShapeTool.IsSimpleShape_s(label) or XCAFDoc_ShapeTool.IsSubShape_s(label)
        if simple and label.IsAttribute(TNaming_NamedShape.GetID_s()):
            found[label_key(label)] = label
    return found


class _Copies:
    """Copies of shapes in their own frames; what they share, their copies share."""

    def __init__(self, shapes: Iterable[TopoDS_Shape]) -> None:
        self._index = TopTools_IndexedMapOfShape()
        for shape in shapes:
            self._index.Add(shape.Located(HERE))
        own = [self._index.FindKey(i) for i in range(1, self._index.Extent() + 1)]
        self._copies = list(children(BRepBuilderAPI_Copy(compound(own), True, False).Shape()))

    def place(self, shape: TopoDS_Shape) -> int:
        """The position of a shape among the different ones."""
        return self._index.FindIndex(shape.Located(HERE)) - 1

    def of(self, shape: TopoDS_Shape) -> TopoDS_Shape:
        """The copy of a shape, in its own frame."""
        return self._copies[self.place(shape)]


class _Plan:
    """A document that is built."""

    def __init__(self, tool: XCAFDoc_ShapeTool, copies: _Copies) -> None:
        self.tool, self.copies = tool, copies
        self.colours = XCAFDoc_DocumentTool.ColorTool_s(tool.Label())
        self.products: dict[int, TDF_Label] = {}

    def assembly(self, node: Node, made: list[TDF_Label]) -> TDF_Label:
        """A product for a node; adds the instances of its shapes and of those below."""
        product = self.tool.NewShape()
        name_label(product, node.name)
        made += [self.use(product, self.product(shape, node), shape.Location(), node) for shape in node.shapes]
        for child in node.children:
            if child.children or len(child.shapes) != 1:
                self.use(product, self.assembly(child, made), child.place, child)
            else:
                (shape,) = child.shapes
                place = child.place * shape.Location()
                made.append(self.use(product, self.product(shape, child), place, child))
        return product

    def use(self, product: TDF_Label, part: TDF_Label, place: TopLoc_Location, node: Node) -> TDF_Label:
        """An instance of a part in a product."""
        usage = self.tool.AddComponent(product, part, place)
        name_label(usage, node.name)
        self.paint(usage, node.colour)
        return usage

    def product(self, shape: TopoDS_Shape, node: Node) -> TDF_Label:
        """The part of a shape."""
        place, copy = self.copies.place(shape), self.copies.of(shape)
        if place not in self.products:
            self.products[place] = self.tool.AddShape(copy, False)
            name_label(self.products[place], node.name)
        label = self.products[place]
        for sub, name, colour in node.inside:
            meant = _inside(shape, sub, True)
            if meant:
                below = self.tool.AddSubShape(label, counterpart(shape, copy, meant))
                name_label(below, name)
                self.paint(below, colour)
        return label

    def paint(self, label: TDF_Label, colour: Colour | None) -> None:
        if colour is not None:
            self.colours.SetColor(label, Quantity_ColorRGBA(*colour), XCAFDoc_ColorType.XCAFDoc_ColorGen)


def _bare(root: Node, shape: TopoDS_Shape) -> bool:
    """Whether a tree is one shape in its own place, without a colour."""
    return root.place.IsIdentity() and shape.Location().IsIdentity() and root.colour is None


def children(shape: TopoDS_Shape) -> Iterator[TopoDS_Shape]:
    """What a compound directly holds."""
    found = TopoDS_Iterator(shape)
    while found.More():
        yield found.Value()
        found.Next()


def _inside(whole: TopoDS_Shape, shape: TopoDS_Shape, exact: bool) -> TopoDS_Shape | None:
    """The face, edge or body of a shape that is meant: the same, or unless ``exact``, also in another place."""
    every = _subs(whole, shape.ShapeType())
    if exact:
        places = (shape, shape.Moved(whole.Location()))  # as placed, or in the frame of the shape
        return next((each for each in places if every.Contains(each)), None)
    found = (every.FindKey(i) for i in range(1, every.Extent() + 1))
    return next((each for each in found if each.IsPartner(shape)), None)


def _cast(shape: TopoDS_Shape) -> TopoDS_Shape:
    """A shape as the class of its kind."""
    return getattr(TopoDS, f"{shape.ShapeType().name[7:].title().replace('solid', 'Solid')}_s")(shape)


def _unplaced(whole: TopoDS_Shape, inside: TopoDS_Shape) -> TopoDS_Shape:
    """A part of a shape in the shape's own frame."""
    return inside.Located(whole.Location().Inverted() * inside.Location())


def _subs(shape: TopoDS_Shape, kind: object) -> TopTools_IndexedMapOfShape:
    found = TopTools_IndexedMapOfShape()
    TopExp.MapShapes_s(shape, kind, found)
    return found
