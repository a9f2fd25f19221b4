"""build123d: shapes, and assemblies of them (compounds with children)."""

from __future__ import annotations

from collections.abc import Iterator
from copy import copy
from typing import Any

from mracad.host.guest import Guest
from mracad.occ.shapes import Colour, Node, Shape


def guest(thing: object) -> Guest | None:
    """What an object of build123d holds; None for other objects."""
    import build123d

    if not isinstance(thing, build123d.Shape) or thing.wrapped is None:
        return None
    return Guest(_tree(thing), lambda shapes: _again(thing, iter(shapes)))


def _tree(shape: Any) -> Node:
    colour = _colour(shape.color)
    if not shape.children:
        return Node(shape.label or "shape", [shape.wrapped], colour=colour)
    below = [_tree(child) for child in shape.children]
    return Node(shape.label or "assembly", (), shape.wrapped.Location(), colour, children=below)


def _again(shape: Any, shapes: Iterator[Shape]) -> Any:
    """A shape, or assembly, with other shapes and all else as it was."""
    made = object.__new__(type(shape))
    vars(made).update({name: value for name, value in vars(shape).items() if not name.startswith("_NodeMixin")})
    made.joints = {name: copy(joint) for name, joint in shape.joints.items()}
    for joint in made.joints.values():
        joint.parent = made
    if shape.children:
        made.children = [_again(child, shapes) for child in shape.children]
        made.wrapped = made.wrapped.Located(shape.wrapped.Location())
    else:
        made.wrapped = next(shapes)
    return made


def _colour(colour: Any) -> Colour | None:
    return None if colour is None else tuple(colour)
