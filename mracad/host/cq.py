"""CadQuery: shapes, workplanes and assemblies."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any, TypeVar

import cadquery

from mracad.errors import UsageError
from mracad.host.guest import Guest
from mracad.occ.shapes import Colour, Node, Shape

Object = TypeVar("Object")

FLAT = cadquery.Edge, cadquery.Wire, cadquery.Vertex
"""What has no faces."""


def guest(thing: object) -> Guest | None:
    """What an object of CadQuery holds; None for other objects."""
    if isinstance(thing, cadquery.Shape):
        return Guest(_node("shape", [thing]), lambda shapes: _shape(thing, shapes[0]))
    if isinstance(thing, cadquery.Workplane):
        return _workplane(thing)
    if isinstance(thing, cadquery.Assembly):
        return Guest(_tree(thing), lambda shapes: _again(thing, iter(shapes)))
    return None


def _workplane(work: cadquery.Workplane) -> Guest:
    """What a workplane holds: the solid of its chain if it selects faces of that, or else the shapes on its stack."""
    stack = [each for each in work.vals() if isinstance(each, cadquery.Shape)]
    if not stack or isinstance(stack[0], FLAT):
        what = f"{stack[0].ShapeType().lower()}s" if stack else "no shape"
        raise UsageError(f"the workplane has {what} on its stack", "select solids or faces")
    chosen = [each.wrapped for each in stack if isinstance(each, cadquery.Face)]
    whole = _whole(work.parent, chosen[0]) if len(chosen) == len(stack) else None
    node = _node("workplane", [whole] if whole else stack)

    def back(shapes: Sequence[Shape]) -> cadquery.Workplane:
        return work.newObject([_shape(old, new) for old, new in zip([whole] if whole else stack, shapes, strict=True)])

    return Guest(node, back, chosen if whole else ())


def _whole(work: cadquery.Workplane | None, face: Shape) -> cadquery.Shape | None:
    """The last shape in a chain of workplanes that a face belongs to."""
    while work is not None:
        for each in work.objects:
            if isinstance(each, cadquery.Solid | cadquery.Compound | cadquery.Shell) and any(
                face.IsSame(own.wrapped) for own in each.Faces()
            ):
                return each
        work = work.parent
    return None


def _tree(assembly: cadquery.Assembly) -> Node:
    inside = [
        (shape.wrapped, assembly._subshape_names.get(shape, ""), _colour(assembly._subshape_colors.get(shape)))
        for shape in dict.fromkeys([*assembly._subshape_names, *assembly._subshape_colors])
    ]
    return Node(
        assembly.name,
        [each.wrapped for each in assembly.shapes],
        assembly.loc.wrapped,
        _colour(assembly.color),
        inside,
        [_tree(child) for child in assembly.children],
    )


def _again(assembly: cadquery.Assembly, shapes: Iterator[Shape]) -> cadquery.Assembly:
    """An assembly with other shapes and all else as it was."""
    twins: dict[int, cadquery.Assembly] = {}

    def twin(node: cadquery.Assembly, parent: cadquery.Assembly | None) -> cadquery.Assembly:
        copy = twins[id(node)] = _like(node, parent=parent, metadata=dict(node.metadata))
        pairs = [(old, _shape(old, next(shapes))) for old in node.shapes]
        if isinstance(node.obj, cadquery.Workplane):
            copy.obj = node.obj.newObject([new for _, new in pairs])
        elif pairs:
            copy.obj = pairs[0][1]
        for name in ("_subshape_names", "_subshape_colors", "_subshape_layers"):
            told = getattr(node, name)
            setattr(copy, name, type(told)({_moved(shape, pairs): value for shape, value in told.items()}))
        copy.children = [twin(child, copy) for child in node.children]
        return copy

    whole = twin(assembly, assembly.parent)
    for node in assembly.traverse():
        copy = twins[id(node[1])]
        copy.objects = {name: twins.get(id(each), each) for name, each in node[1].objects.items()}
    return whole


def _moved(inside: cadquery.Shape, pairs: Sequence[tuple[cadquery.Shape, cadquery.Shape]]) -> cadquery.Shape:
    """What a face or body of a shape has become."""
    from mracad.occ.shapes import within

    for old, new in pairs:
        found = within(old.wrapped, new.wrapped, inside.wrapped)
        if found is not None:
            return _shape(inside, found)
    return inside


def _shape(old: cadquery.Shape, new: Shape) -> cadquery.Shape:
    """A shape of the kernel as CadQuery's, with the label and kind of another one."""
    return _like(old, wrapped=new)


def _like(old: Object, **changed: Any) -> Object:
    """An object like another one, but for some attributes."""
    made = object.__new__(type(old))
    vars(made).update(vars(old) | changed)
    return made


def _node(name: str, shapes: Sequence[cadquery.Shape]) -> Node:
    return Node(name, [each.wrapped for each in shapes])


def _colour(colour: cadquery.Color | None) -> Colour | None:
    return None if colour is None else colour.toTuple()
