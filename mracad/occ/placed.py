"""A document as one part: every instance where it stands, for formats that do not know of products."""

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


def placed(document: Document) -> OnePart:
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
    return OnePart(whole, tuple(faces), tuple(edges), tuple(colours))


def _stands(document: Document) -> Iterator[tuple[Part, TopLoc_Location, str]]:
    """Every part where it stands, and the colour that its instances give it there."""
    parts = {label_key(part.label): part for part in document.parts}
    for usage in usages(document.shape_tool):
        if label_key(usage.product) in parts:
            instances = (label for label in usage.chain if XCAFDoc_ShapeTool.IsReference_s(label))
            colour = next(filter(None, map(label_colour, instances)), "")
            yield parts[label_key(usage.product)], usage.frame, colour
