"""Labels of the kernel's documents: names, colours, and the structure of assemblies."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from OCP.Quantity import Quantity_ColorRGBA
from OCP.TCollection import TCollection_ExtendedString
from OCP.TDataStd import TDataStd_Name
from OCP.TDF import TDF_Label, TDF_LabelSequence
from OCP.TopLoc import TopLoc_Location
from OCP.XCAFDoc import XCAFDoc_ColorTool, XCAFDoc_ColorType, XCAFDoc_ShapeTool


@dataclass(frozen=True)
class Title:
    """Identifier, name and description of a product or an instance; without an identifier it gets a free number."""

    identifier: str | None
    name: str
    description: str = ""

    @property
    def shown(self) -> str:
        """The name, or else the identifier."""
        return self.name if self.name.strip() else self.identifier or ""


def label_key(label: TDF_Label) -> str:
    """A text that identifies a label within its document."""
    tags = []
    while not label.IsRoot():
        tags.append(label.Tag())
        label = label.Father()
    return ":".join(map(str, reversed(tags)))


def label_name(label: TDF_Label) -> str:
    """The name on a label, or ``""``."""
    if not label.IsAttribute(TDataStd_Name.GetID_s()):
        return ""
    attribute = TDataStd_Name()
    label.FindAttribute(TDataStd_Name.GetID_s(), attribute)
    return attribute.Get().ToExtString()


def name_label(label: TDF_Label, name: str) -> None:
    """Give a label a name."""
    TDataStd_Name.Set_s(label, TCollection_ExtendedString(name, True))


def label_colour(label: TDF_Label) -> str:
    """The surface (or general) colour of a label in the form of :func:`colour_text`, or ``""``."""
    colour = Quantity_ColorRGBA()
    for kind in (XCAFDoc_ColorType.XCAFDoc_ColorSurf, XCAFDoc_ColorType.XCAFDoc_ColorGen):
        if XCAFDoc_ColorTool.GetColor_s(label, kind, colour):
            return colour_text(colour)
    return ""


def colour_text(colour: Quantity_ColorRGBA) -> str:
    """A colour as ``"#rrggbb"``, or ``"#rrggbbaa"`` if it is transparent."""
    text = Quantity_ColorRGBA.ColorToHex_s(colour).ToCString().lower()
    return text[:7] if colour.Alpha() > 1 - 1e-3 else text


def labels(fill) -> Iterator[TDF_Label]:
    """The labels that a kernel function puts into the sequence that it is given."""
    sequence = TDF_LabelSequence()
    fill(sequence)
    for i in range(1, sequence.Length() + 1):
        yield sequence.Value(i)


def referred(label: TDF_Label) -> TDF_Label:
    """The product of an instance; a product itself."""
    if not XCAFDoc_ShapeTool.IsReference_s(label):
        return label
    product = TDF_Label()
    XCAFDoc_ShapeTool.GetReferredShape_s(label, product)
    return product


def components(label: TDF_Label) -> Iterator[TDF_Label]:
    """The instances in an assembly; none for a part."""
    return labels(lambda found: XCAFDoc_ShapeTool.GetComponents_s(label, found, False))


@dataclass(frozen=True)
class Usage:
    """A free shape or an instance in the tree of a document.

    Attributes
    ----------
    chain : tuple of TDF_Label
        The free shape at the top, and the instances from there down to this one.
    product : TDF_Label
        Its product.
    frame : TopLoc_Location
        Its placement in the document.
    """

    chain: tuple[TDF_Label, ...]
    product: TDF_Label
    frame: TopLoc_Location


def usages(shapes: XCAFDoc_ShapeTool) -> Iterator[Usage]:
    """All free shapes and instances of a document, each before its components."""

    def below(label: TDF_Label, above: tuple[TDF_Label, ...], frame: TopLoc_Location) -> Iterator[Usage]:
        usage = Usage((*above, label), referred(label), frame * XCAFDoc_ShapeTool.GetLocation_s(label))
        yield usage
        for component in components(usage.product):
            yield from below(component, usage.chain, usage.frame)

    for label in labels(shapes.GetFreeShapes):
        yield from below(label, (), TopLoc_Location())
