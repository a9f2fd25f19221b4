"""The view of a document that an edit gets, and what the edit may move."""

from __future__ import annotations

from functools import partial

from mracad.errors import UsageError
from mracad.model.brep import Model
from mracad.occ.document import Document
from mracad.occ.instance import isolate
from mracad.occ.rails import railed
from mracad.occ.select import select_cq
from mracad.occ.view import view
from mracad.spec.select import Scope, every_nurbs
from mracad.spec.select import scope as select_scope
from mracad.spec.steps import Selection


def snapshot(document: Document) -> Model:
    """The geometry of a document as plain arrays (mm), with what edges can slide along; errors as for ``view``."""
    return railed(document, view(document))


def looked_at(document: Document, options: Selection) -> tuple[Model, Scope]:
    """The view of a document for an edit, and what the edit may move.

    Selected faces that are not NURBS are converted.  An instance is made a separate part first.
    """
    own = isolate(document, options.instance) if options.instance else None
    model = view(document)
    nurbs = [i for i in every_nurbs(model) if own is None or i not in own.copies]
    scope = select_scope(model, options, partial(select_cq, document), nurbs)
    if own is not None:
        faces, held, named = (
            frozenset(own.faces[i] for i in each & own.faces.keys()) for each in (scope.faces, scope.held, scope.named)
        )
        edges = frozenset(own.edges.get(i, i) for i in scope.edges)
        scope = Scope(faces, held, edges, named, scope.zones)
        if options.faces and not faces:
            raise UsageError(f"no selected face is in '{options.instance}'", "leave out --faces, or select others")
    convertible = {i for i in scope.chosen if model.faces[i].surface is None}
    model = view(document, convert=convertible) if convertible else model
    return railed(document, model) if options.edges == "slide" else model, scope
