"""Differences between two versions of a document, with layers for geometry, structure and attributes.

A face's *deviation* is measured from points inside it to the whole surface under its partner, and back; the motion of
its boundary is its *outline*.  So a wall that only grew longer with the face above it has only moved in its outline.

The limits of a format, and the representation of a shape (the kind of a surface, edges in one piece or several), are
only noted and fail nothing.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from functools import cache

from mracad.formats import unheld
from mracad.inspect.compare import attributes, geometry, structure
from mracad.inspect.compare.match import match
from mracad.inspect.compare.subject import CompareLimits, Subject
from mracad.inspect.verdict import Layer, Verdict

__all__ = ["LAYERS", "CompareLimits", "Subject", "compare"]

LAYERS = (
    "faces", "deviation", "seams", "topology", "validity", "size", "units", "assembly", "names", "colours", "layers",
    "materials", "annotations",
)  # fmt: skip
"""Names of the layers of a comparison, in order."""


def compare(ref: Subject, new: Subject, limits: CompareLimits, ignore: Iterable[str] = ()) -> Verdict:
    """Compare a new version of a document with a reference.

    Parameters
    ----------
    ref, new : Subject
    limits : CompareLimits
    ignore : iterable of str
        Names of layers that are left out.
    """
    lacks = unheld(ref.schema, new.schema)
    groups = match(ref, new, limits.deviation, by_product="assembly" not in lacks)
    apart = cache(lambda: geometry.deviations(ref, new, groups))
    makers: dict[str, Callable[[], Layer]] = {
        "faces": lambda: structure.faces(ref, new, groups),
        "deviation": lambda: geometry.deviation(ref, new, apart(), limits, exact="assembly" not in lacks),
        "seams": lambda: structure.seams(ref, new, groups, limits, geometry.unchanged(ref, apart())),
        "topology": lambda: structure.topology(ref, new, lacks.get("shells", "")),
        "validity": lambda: structure.validity(ref, new),
        "size": lambda: structure.size(ref.mass, new.mass, limits, lacks.get("shells", "")),
        "units": lambda: attributes.units(ref.contents.unit, new.contents.unit),
        "assembly": lambda: attributes.assembly(ref, new),
        "names": lambda: attributes.names(ref, new, groups),
        "colours": lambda: attributes.colours(ref, new, groups, lacks),
        "layers": lambda: attributes.marks("layers", ref, new, groups),
        "materials": lambda: attributes.marks("materials", ref, new, groups),
        "annotations": lambda: attributes.pmi(ref.contents.annotations, new.contents.annotations),
    }
    left = frozenset(ignore)

    def made(name: str) -> Layer:
        if name in left:
            return Layer(name, "skipped", "ignored")
        layer = makers[name]()
        return attributes.noted(layer, lacks[name]) if name in lacks else layer

    return Verdict(new.model.name, tuple(made(name) for name in LAYERS), new.validity.valid)
