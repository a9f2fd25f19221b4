"""The content of a document beyond geometry, as plain data: structure, names, colours, layers, materials,
annotations."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

from OCP.Quantity import Quantity_ColorRGBA
from OCP.TDF import TDF_Label
from OCP.TopAbs import TopAbs_FACE
from OCP.XCAFDoc import (
    XCAFDoc_ColorTool,
    XCAFDoc_ColorType,
    XCAFDoc_DocumentTool,
    XCAFDoc_LayerTool,
    XCAFDoc_MaterialTool,
    XCAFDoc_ShapeTool,
)

from mracad.model.facts import Carrier, Contents, Occurrence
from mracad.occ.document import Document
from mracad.occ.labels import colour_text, components, label_key, label_name, labels, usages
from mracad.occ.topology import matrix

_COLOURS = {
    "surface": XCAFDoc_ColorType.XCAFDoc_ColorSurf,
    "curve": XCAFDoc_ColorType.XCAFDoc_ColorCurv,
    "all": XCAFDoc_ColorType.XCAFDoc_ColorGen,
}


def contents(document: Document) -> Contents:
    """Collect the content of a document."""
    main = document.xcaf.Main()
    layer_tool = XCAFDoc_DocumentTool.LayerTool_s(main)
    pmi = XCAFDoc_DocumentTool.DimTolTool_s(main)
    products = list(labels(document.shape_tool.GetShapes))
    where = {label_key(label): (label, place) for label, place in _places(document, products)}
    tree = [
        Occurrence(
            tuple(map(label_name, usage.chain)),
            label_name(usage.product),
            tuple(matrix(usage.frame)[:3].ravel().tolist()),
        )
        for usage in usages(document.shape_tool)
    ]
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


def _places(document: Document, products: list[TDF_Label]) -> Iterator[tuple[TDF_Label, Carrier]]:
    """All labels that can have a colour or a layer, and what they stand for."""
    parts = {label_key(part.label): part for part in document.parts}
    for label in products:
        product = label_name(label)
        yield label, Carrier(product)
        for component in components(label):
            yield component, Carrier(product, component=label_name(component))
        part = parts.get(label_key(label))
        for sub in labels(lambda found, label=label: XCAFDoc_ShapeTool.GetSubShapes_s(label, found)):
            shape = XCAFDoc_ShapeTool.GetShape_s(sub)
            if part and shape.ShapeType() == TopAbs_FACE:
                yield sub, Carrier(product, face=part.face_number(shape))
            else:
                yield sub, Carrier(product, inside=True)


def _colours(places: Iterable[tuple[TDF_Label, Carrier]]) -> Iterator[tuple[Carrier, str, str]]:
    colour = Quantity_ColorRGBA()
    for label, place in places:
        for name, kind in _COLOURS.items():
            if XCAFDoc_ColorTool.GetColor_s(label, kind, colour):
                yield place, name, colour_text(colour)
