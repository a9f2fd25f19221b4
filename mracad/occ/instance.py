"""Making one instance of a shared part a separate part, so that an edit of it does not change the others."""

from __future__ import annotations

import difflib
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass

from OCP.BRepBuilderAPI import BRepBuilderAPI_Copy
from OCP.TDataStd import TDataStd_Name, TDataStd_NamedData, TDataStd_TreeNode
from OCP.TDF import TDF_Attribute, TDF_AttributeIterator, TDF_Label, TDF_LabelSequence, TDF_RelocationTable
from OCP.TopLoc import TopLoc_Location
from OCP.XCAFDoc import (
    XCAFDoc,
    XCAFDoc_Area,
    XCAFDoc_Centroid,
    XCAFDoc_DocumentTool,
    XCAFDoc_ShapeTool,
    XCAFDoc_Volume,
)

from mracad.errors import UsageError
from mracad.occ.document import Document
from mracad.occ.labels import components, label_key, label_name, labels, referred

_VALUES = (TDataStd_Name, TDataStd_NamedData, XCAFDoc_Area, XCAFDoc_Volume, XCAFDoc_Centroid)


def instances(document: Document) -> dict[str, list[TDF_Label]]:
    """All instances of parts by path, with the labels from the top down to each.

    A path consists of the names of the instances (or of their products, if those have none), separated by slashes; the
    second neighbour of the same name ends in ``#2``.
    """
    return dict(_below(document.shape_tool.GetFreeShapes, "", []))


@dataclass(frozen=True)
class Own:
    """The faces and edges of an instance, by their own indices, with those of the part that they were copied from."""

    faces: dict[int, int]
    edges: dict[int, int]

    @property
    def copies(self) -> set[int]:
        """The faces that were made for it."""
        return {new for old, new in self.faces.items() if old != new}


def isolate(document: Document, path: str) -> Own:
    """Make one instance a separate part, with the names, colours and other attributes of the part.

    Assemblies above it that are also used elsewhere are copied too.

    Parameters
    ----------
    document : Document
        Changed in place, unless the part has no other instance; the copy's faces come after all others.
    path : str
        Path of the instance, or the end of it.

    Returns
    -------
    Own
        The faces and edges of the instance.

    Raises
    ------
    UsageError
        When no instance has that path, or several.
    """
    every = instances(document)
    fitting = [name for name in every if name == path or name.endswith(f"/{path}")]
    if len(fitting) != 1:
        near = fitting or difflib.get_close_matches(path, every, n=3, cutoff=0.3) or list(every)[:3]
        what = f"'{path}' names {len(fitting)} instances" if fitting else f"there is no instance '{path}'"
        raise UsageError(f"{document.name}: {what}", f"use one of {', '.join(near[:6])}; see mracad info --all")
    _, *chain = every[fitting[0]]
    if not chain:
        return _own(document, every[fitting[0]][0])
    for number, component in enumerate(chain):
        product = referred(component)
        if len(list(labels(lambda found, product=product: XCAFDoc_ShapeTool.GetUsers_s(product, found, False)))) > 1:
            order = list(components(product))
            copy = _copied(document, product)
            document.origins[label_key(copy)] = document.origins.get(label_key(product), label_key(product))
            _point(component, copy)
            if number + 1 < len(chain):
                below = [label_key(label) for label in order].index(label_key(chain[number + 1]))
                chain[number + 1] = list(components(copy))[below]
    document.shape_tool.UpdateAssemblies()
    document.changed()
    return _own(document, referred(chain[-1]))


def _below(fill, path: str, above: list[TDF_Label]) -> Iterator[tuple[str, list[TDF_Label]]]:
    seen: Counter[str] = Counter()
    for label in labels(fill):
        product = referred(label)
        name = label_name(label) or label_name(product)
        seen[name] += 1
        place = f"{path}{name}" + (f"#{seen[name]}" if seen[name] > 1 else "")
        if XCAFDoc_ShapeTool.IsAssembly_s(product):
            inside = lambda found, product=product: XCAFDoc_ShapeTool.GetComponents_s(product, found, False)  # noqa: E731
            yield from _below(inside, f"{place}/", [*above, label])
        else:
            yield place, [*above, label]


def _own(document: Document, product: TDF_Label) -> Own:
    parts = {label_key(part.label): part for part in document.parts}
    key = label_key(product)
    part, origin = parts[key], parts.get(document.origins.get(key, key))
    found = Own({}, {})
    for source in filter(None, (origin, part)):
        found.faces.update((source.first + i, part.first + i) for i in range(part.faces.Extent()))
        found.edges.update((source.first_edge + i, part.first_edge + i) for i in range(part.edges.Extent()))
    return found


def _copied(document: Document, product: TDF_Label) -> TDF_Label:
    """A copy: a part with its own geometry, or an assembly of the same products."""
    tool = document.shape_tool
    if XCAFDoc_ShapeTool.IsAssembly_s(product):
        copy = tool.NewShape()
        for component in list(components(product)):
            # a location of its own: the writer tells instances apart by shape and location
            location = TopLoc_Location(XCAFDoc_ShapeTool.GetLocation_s(component).Transformation())
            twin = tool.AddComponent(copy, referred(component), location)
            say(document, component, twin)
    else:
        copier = BRepBuilderAPI_Copy(XCAFDoc_ShapeTool.GetShape_s(product), True, False)
        copy = tool.AddShape(copier.Shape(), False)
        for sub in list(labels(lambda found: XCAFDoc_ShapeTool.GetSubShapes_s(product, found))):
            twin = tool.AddSubShape(copy, copier.ModifiedShape(XCAFDoc_ShapeTool.GetShape_s(sub)))
            if not twin.IsNull():
                say(document, sub, twin)
    say(document, product, copy)
    return copy


def say(document: Document, old: TDF_Label, new: TDF_Label) -> None:
    """Copy the attributes of a label to another: name, properties, colours, material, layers."""
    link = XCAFDoc.ShapeRefGUID_s()
    for kind in _VALUES:
        new.ForgetAttribute(kind.GetID_s())
    for attribute in _attributes(old):
        if isinstance(attribute, _VALUES):
            copy = attribute.NewEmpty()
            new.AddAttribute(copy)
            attribute.Paste(copy, TDF_RelocationTable())
        elif isinstance(attribute, TDataStd_TreeNode) and attribute.HasFather() and not link.IsSame(attribute.ID()):
            attribute.Father().Append(TDataStd_TreeNode.Set_s(new, attribute.ID()))  # a colour or material
    layers = TDF_LabelSequence()
    tool = XCAFDoc_DocumentTool.LayerTool_s(document.xcaf.Main())
    tool.GetLayers(old, layers)
    for i in range(1, layers.Length() + 1):
        tool.SetLayer(new, layers.Value(i), False)


def _point(component: TDF_Label, product: TDF_Label) -> None:
    """Make a component an instance of another product."""
    link = XCAFDoc.ShapeRefGUID_s()
    node = next(
        node for node in _attributes(component) if isinstance(node, TDataStd_TreeNode) and link.IsSame(node.ID())
    )
    node.Remove()
    TDataStd_TreeNode.Set_s(product, link).Append(node)


def _attributes(label: TDF_Label) -> list[TDF_Attribute]:
    found = []
    attributes = TDF_AttributeIterator(label)
    while attributes.More():
        found.append(attributes.Value())
        attributes.Next()
    return found
