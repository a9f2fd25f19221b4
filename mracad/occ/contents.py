"""What a document says beyond geometry, as plain data: structure, names, colours, layers, materials, annotations."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass

from OCP.Quantity import Quantity_ColorRGBA
from OCP.TDF import TDF_Label
from OCP.TopAbs import TopAbs_FACE
from OCP.TopLoc import TopLoc_Location
from OCP.XCAFDoc import (
    XCAFDoc_ColorTool,
    XCAFDoc_ColorType,
    XCAFDoc_DocumentTool,
    XCAFDoc_LayerTool,
    XCAFDoc_MaterialTool,
    XCAFDoc_ShapeTool,
)

from mracad.occ.document import Document, colour_text, components, label_key, label_name, labels, referred
from mracad.occ.topology import matrix

_COLOURS = {
    "surface": XCAFDoc_ColorType.XCAFDoc_ColorSurf,
    "curve": XCAFDoc_ColorType.XCAFDoc_ColorCurv,
    "all": XCAFDoc_ColorType.XCAFDoc_ColorGen,
}


@dataclass(frozen=True)
class Placed:
    """One part, assembly or instance where it stands in the whole.

    Attributes
    ----------
    path : tuple of str
        Names of the instances from the top down (of the product for a free shape).
    product : str
    frame : tuple of float
        The upper three rows of its placement in the whole, row-major, mm.
    """

    path: tuple[str, ...]
    product: str
    frame: tuple[float, ...]


@dataclass(frozen=True, order=True)
class Place:
    """What carries an attribute: a product, one of its components, or something inside it.

    Attributes
    ----------
    product, component : str
        ``component`` is ``""`` unless it is one.
    face : int
        Index of the face; -1 for everything else.
    inside : bool
        Whether it is another shape inside the product: a body or an edge.
    """

    product: str
    component: str = ""
    face: int = -1
    inside: bool = False


@dataclass(frozen=True)
class Contents:
    """What a document says beyond geometry.

    Attributes
    ----------
    unit : str
    products : tuple of str
        Of every part and assembly.
    usages : int
        How often some product is used in an assembly definition.
    tree : tuple of Placed
    colours : tuple of (Place, str, str)
        Where, of what, ``"#rrggbb"`` or ``"#rrggbbaa"``; sorted.
    layers : tuple of (Place, str)
        Where, and the layer; sorted.
    materials : tuple of (Place, float)
        Where, and the density as the kernel gives it; sorted.
    annotations : dict of str to int
        How many ``"dimensions"``, ``"tolerances"`` and ``"datums"`` there are.
    """

    unit: str
    products: tuple[str, ...]
    usages: int
    tree: tuple[Placed, ...]
    colours: tuple[tuple[Place, str, str], ...]
    layers: tuple[tuple[Place, str], ...]
    materials: tuple[tuple[Place, float], ...]
    annotations: dict[str, int]


def contents(document: Document) -> Contents:
    """Collect it from the kernel's document."""
    main = document.xcaf.Main()
    layer_tool = XCAFDoc_DocumentTool.LayerTool_s(main)
    pmi = XCAFDoc_DocumentTool.DimTolTool_s(main)
    products = list(labels(document.shape_tool.GetShapes))
    where = {label_key(label): (label, place) for label, place in _places(document, products)}
    tree: list[Placed] = []
    for label in labels(document.shape_tool.GetFreeShapes):
        _grow(label, (), TopLoc_Location(), tree)
    on_layers = [
        (where[label_key(shape)][1], label_name(layer))
        for layer in labels(layer_tool.GetLayerLabels)
        for shape in labels(lambda found, layer=layer: XCAFDoc_LayerTool.GetShapesOfLayer_s(layer, found))
        if label_key(shape) in where
    ]
    densities = [(place, XCAFDoc_MaterialTool.GetDensityForShape_s(label)) for label, place in where.values()]
    return Contents(
        unit=document.unit,
        products=tuple(label_name(label) for label in products),
        usages=sum(1 for label in products for _ in components(label)),
        tree=tuple(tree),
        colours=tuple(sorted(_colours(where.values()))),
        layers=tuple(sorted(on_layers)),
        materials=tuple(sorted((place, density) for place, density in densities if density)),
        annotations={
            "dimensions": sum(1 for _ in labels(pmi.GetDimensionLabels)),
            "tolerances": sum(1 for _ in labels(pmi.GetGeomToleranceLabels)),
            "datums": sum(1 for _ in labels(pmi.GetDatumLabels)),
        },
    )


def _places(document: Document, products: list[TDF_Label]) -> Iterator[tuple[TDF_Label, Place]]:
    """Everything that can be coloured or put on a layer."""
    parts = {label_key(part.label): part for part in document.parts}
    for label in products:
        product = label_name(label)
        yield label, Place(product)
        for component in components(label):
            yield component, Place(product, component=label_name(component))
        part = parts.get(label_key(label))
        for sub in labels(lambda found, label=label: XCAFDoc_ShapeTool.GetSubShapes_s(label, found)):
            shape = XCAFDoc_ShapeTool.GetShape_s(sub)
            if part and shape.ShapeType() == TopAbs_FACE:
                yield sub, Place(product, face=part.first + part.faces.FindIndex(shape) - 1)
            else:
                yield sub, Place(product, inside=True)


def _colours(places: Iterable[tuple[TDF_Label, Place]]) -> Iterator[tuple[Place, str, str]]:
    colour = Quantity_ColorRGBA()
    for label, place in places:
        for name, kind in _COLOURS.items():
            if XCAFDoc_ColorTool.GetColor_s(label, kind, colour):
                yield place, name, colour_text(colour)


def _grow(label: TDF_Label, above: tuple[str, ...], frame: TopLoc_Location, tree: list[Placed]) -> None:
    """Add a label and what it is made of."""
    frame = frame * XCAFDoc_ShapeTool.GetLocation_s(label)
    path, product = (*above, label_name(label)), referred(label)
    tree.append(Placed(path, label_name(product), tuple(matrix(frame)[:3].ravel().tolist())))
    for component in components(product):
        _grow(component, path, frame, tree)
