"""A shape, or a tree of shapes, of another library."""

from __future__ import annotations

import sys
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

from mracad.occ.shapes import Node, Shape


@dataclass(frozen=True, eq=False)
class Guest:
    """What an object of another library holds.

    Attributes
    ----------
    node : Node
    back : callable
        ``back(shapes)`` is an object of the same kind with other shapes, in the order of the node's.
    chosen : sequence of TopoDS_Shape
        The faces that the object selects; none if it selects nothing.
    """

    node: Node
    back: Callable[[Sequence[Shape]], Any]
    chosen: Sequence[Shape] = ()


def guest(thing: object) -> Guest | None:
    """What an object holds; None for one of no library that is known.  A library that is not loaded has no objects.

    Raises
    ------
    UsageError
        For an object without faces.
    """
    if "cadquery" in sys.modules:
        from mracad.host import cq

        found = cq.guest(thing)
        if found:
            return found
    if isinstance(thing, Shape):
        return Guest(Node("shape", [thing]), lambda shapes: shapes[0])
    if "build123d" in sys.modules:
        from mracad.host import b3d

        return b3d.guest(thing)
    return None


def kernel(thing: object) -> Shape | None:
    """The kernel's shape of a face or edge of any library; None for other objects."""
    found = getattr(thing, "wrapped", thing)
    return found if isinstance(found, Shape) else None
