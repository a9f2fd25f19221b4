"""A document as one part with every instance in its place, for formats without products."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from OCP.TopLoc import TopLoc_Location
from OCP.XCAFDoc import XCAFDoc_DocumentTool, XCAFDoc_ShapeTool

from mracad.occ.document import Document, Part, empty
from mracad.occ.labels import label_colour, label_key, usages
from mracad.occ.topology import compound


@dataclass(frozen=True, eq=False)
class OnePart:
    """A document with one part, and the origin of its shapes.

    Attributes
    ----------
    document : Document
    faces, edges : tuple of int
        For each face and edge, its index in the original document.
    colours : tuple of str
        Colour of each face: its own, that of the instance, or that of the part; ``""`` for none.
    """

    document: Document
    faces: tuple[int, ...]
    edges: tuple[int, ...]
    colours: tuple[str, ...]


def placed(document: Document) -> OnePart:
    """Put all instances of a document, in their places, into one part."""
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
    return OnePart(whole, tuple(faces), tuple(edges), tuple(colours))


def _stands(document: Document) -> Iterator[tuple[Part, TopLoc_Location, str]]:
    """Every instance of a part: its placement, and the colour that the instance gives it."""
    parts = {label_key(part.label): part for part in document.parts}
    for usage in usages(document.shape_tool):
        if label_key(usage.product) in parts:
            instances = (label for label in usage.chain if XCAFDoc_ShapeTool.IsReference_s(label))
            colour = next(filter(None, map(label_colour, instances)), "")
            yield parts[label_key(usage.product)], usage.frame, colour
