"""A document as one part: every instance where it stands, for formats that do not know of products."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from OCP.TDF import TDF_Label
from OCP.TopLoc import TopLoc_Location
from OCP.XCAFDoc import XCAFDoc_DocumentTool, XCAFDoc_ShapeTool

from mracad.occ.document import Document, Part, components, empty, label_colour, label_key, labels, referred
from mracad.occ.topology import compound


@dataclass(frozen=True, eq=False)
class Placed:
    """A document with one part, and where its shapes come from.

    Attributes
    ----------
    document : Document
    faces, edges : tuple of int
        For each face and edge of it, the one of the original document.
    colours : tuple of str
        What colour each face has where it stands: its own, that of the instance, or that of the part; ``""`` for none.
    """

    document: Document
    faces: tuple[int, ...]
    edges: tuple[int, ...]
    colours: tuple[str, ...]


def placed(document: Document) -> Placed:
    """Put every instance of a document into one part, in its place."""
    stands = list(_stands(document))
    xcaf = empty()
    shape = compound(part.shape.Moved(frame) for part, frame, _ in stands)
    XCAFDoc_DocumentTool.ShapeTool_s(xcaf.Main()).AddShape(shape, False)
    whole = Document(xcaf, document.name, document.units, document.schema)
    (one,) = whole.parts
    faces, edges = [0] * one.faces.Extent(), [0] * one.edges.Extent()
    colours = [""] * len(faces)
    for part, frame, colour in stands:
        for i in range(part.faces.Extent()):
            at = one.faces.FindIndex(part.faces.FindKey(i + 1).Moved(frame)) - 1
            faces[at] = part.first + i
            colours[at] = part.face_colour(i, colour)
        for i in range(part.edges.Extent()):
            edges[one.edges.FindIndex(part.edges.FindKey(i + 1).Moved(frame)) - 1] = part.first_edge + i
    return Placed(whole, tuple(faces), tuple(edges), tuple(colours))


def _stands(document: Document) -> Iterator[tuple[Part, TopLoc_Location, str]]:
    """Every part where it stands, and the colour that its instances give it there."""
    parts = {label_key(part.label): part for part in document.parts}

    def walk(label: TDF_Label, frame: TopLoc_Location, colour: str) -> Iterator[tuple[Part, TopLoc_Location, str]]:
        product = referred(label)
        frame = frame * XCAFDoc_ShapeTool.GetLocation_s(label)
        if label_key(product) != label_key(label):
            colour = colour or label_colour(label)
        if label_key(product) in parts:
            yield parts[label_key(product)], frame, colour
        for component in components(product):
            yield from walk(component, frame, colour)

    for label in labels(document.shape_tool.GetFreeShapes):
        yield from walk(label, TopLoc_Location(), "")
