"""Validation properties: the volumes, areas and centroids that a file states are kept up to date."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

from OCP.gp import gp_Pnt
from OCP.TDF import TDF_ChildIterator, TDF_Label
from OCP.XCAFDoc import XCAFDoc_Area, XCAFDoc_Centroid, XCAFDoc_ShapeTool, XCAFDoc_Volume

from mracad.occ.document import Document
from mracad.occ.labels import components, label_key, referred
from mracad.occ.sizes import mass_of

_KINDS = (XCAFDoc_Area, XCAFDoc_Volume, XCAFDoc_Centroid)


@contextmanager
def restated(document: Document) -> Iterator[None]:
    """Update the stated properties of everything that has moved, inside the block in the form that the kernel writes.

    The kernel reads areas and volumes as bare numbers whatever their unit, and writes them as millimetres, so all are
    measured again if the unit is a different one.  It writes centroids without converting them.
    """
    written: list[tuple[TDF_Label, gp_Pnt]] = []
    labels = TDF_ChildIterator(document.shape_tool.Label(), True)
    while labels.More():
        label = labels.Value()
        labels.Next()
        stated = [kind for kind in _KINDS if label.IsAttribute(kind.GetID_s())]
        if not stated or (document.unit == "mm" and not _moved(document, label)):
            continue
        found = mass_of(XCAFDoc_ShapeTool.GetShape_s(label))
        if XCAFDoc_Area in stated:
            XCAFDoc_Area.Set_s(label, found.area)
        if XCAFDoc_Volume in stated:
            XCAFDoc_Volume.Set_s(label, found.volume)
        if XCAFDoc_Centroid in stated:
            written.append((label, gp_Pnt(*found.centre)))
    try:
        for label, centre in written:
            XCAFDoc_Centroid.Set_s(label, gp_Pnt(*(x / document.units.mm for x in centre.Coord())))
        yield
    finally:
        for label, centre in written:
            XCAFDoc_Centroid.Set_s(label, centre)


def _moved(document: Document, label: TDF_Label) -> bool:
    """Whether a part, any part of an assembly, or the part of a face has moved."""
    product = label.Father() if XCAFDoc_ShapeTool.IsSubShape_s(label) else referred(label)
    return label_key(product) in document.moved or any(_moved(document, part) for part in components(product))
