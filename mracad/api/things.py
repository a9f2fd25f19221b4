"""Things that can be edited or measured: files, documents and shapes of other libraries, each seen as a document."""

from __future__ import annotations

import operator
import os
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Any, TypeAlias

from mracad.api import document
from mracad.api.document import Document
from mracad.errors import UsageError
from mracad.host.guest import guest, kernel
from mracad.occ.document import Document as KernelDocument
from mracad.occ.load import Text, load
from mracad.occ.shapes import Held, copied, held

Source: TypeAlias = Any
"""A path, binary stream, Document or shape."""


@dataclass(frozen=True, eq=False)
class Thing:
    """A thing as a document.

    Attributes
    ----------
    document : Document
        Of its own: editing it does not change the thing.
    back : callable
        The edited document as a thing of the same kind.
    held : Held or None
        The shapes of another library.
    faces : tuple of str
        Selectors of the faces that the thing itself selects.
    text : Text or None
        The content of a file.
    """

    document: Document
    back: Callable[[], Any]
    held: Held | None = None
    faces: tuple[str, ...] = ()
    text: Text | None = None

    def selectors(self, given: Any, option: str) -> list[str]:
        """Selectors of faces or edges from one or several of: a text, an index from 0, a face or edge of the thing."""
        if isinstance(given, str):
            return [given]
        shape = kernel(given)
        if shape is not None:
            if self.held is None:
                raise UsageError(f"{option}: {self.document.name} is a file, not a shape", "select faces as #3 or 2")
            return [self.held.selector(shape, option)]
        if isinstance(given, Iterable):
            return [text for each in given for text in self.selectors(each, option)]
        try:
            index = operator.index(given)
        except TypeError:
            raise UsageError(f"{option}: {given!r} is no face", "give #3, an index from 0 or a face") from None
        count = len(self.document.faces)
        if not 0 <= index < count:
            raise UsageError(f"{option}: there is no face with index {index}", f"indices are 0 to {count - 1}")
        return [f"#{index + 1}"]


def opened(thing: Source, *, change: bool) -> Thing:
    """A thing as a document; raises FileError and UsageError.

    Parameters
    ----------
    thing : path, binary stream, Document or shape
        Shapes are those of CadQuery, build123d and the kernel.
    change : bool
        Whether the document will be changed.
    """
    if isinstance(thing, KernelDocument):
        own = copied(thing) if change else thing
        if not isinstance(own, Document):
            own = document.of(own, lambda: copied(thing))
        return Thing(own, lambda: own)
    if isinstance(thing, str | os.PathLike) or hasattr(thing, "read"):
        text = load(thing)
        fresh = document.read(text)
        return Thing(fresh, lambda: fresh, text=text)
    found = guest(thing)
    if found is None:
        hint = "give a path, a Document, or a shape of CadQuery, build123d or the kernel"
        raise UsageError(f"{type(thing).__name__}: this is no model", hint)
    tree = held(found.node)
    whole = document.of(tree.document, lambda: held(found.node).document)
    tree.document = whole
    chosen = tuple(tree.selector(face, "faces") for face in found.chosen)
    return Thing(whole, lambda: found.back(tree.shapes()), tree, chosen)
