"""Comparisons of whole documents: measured by the kernel, judged on plain data."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from mracad.errors import UsageError
from mracad.formats import unheld
from mracad.inspect.compare import CompareLimits, Subject
from mracad.inspect.compare import compare as differences
from mracad.inspect.compare.same import same
from mracad.job.judge import Judged, Original
from mracad.spec.quantity import length
from mracad.spec.steps import Compare

if TYPE_CHECKING:
    import numpy as np

    from mracad.model.brep import Model
    from mracad.occ.document import Document

    Array = np.ndarray


def compare(document: Document, options: Compare, original: Original | None = None) -> Judged:
    """Compare a document with the reference that ``options`` names, or else with the original.

    Raises
    ------
    UsageError
        When there is neither.
    """
    from mracad.occ.files import read

    if options.reference:
        reference = read(options.reference, options.reference_unit)
    elif original:
        reference = original()
    else:
        raise UsageError("compare has nothing to compare with", "name a reference")

    place = "assembly" in unheld(reference.schema, document.schema)
    old, each = _measured(reference, place)
    new, _ = _measured(document, place, (old.model, each))
    growth, volume, size = options.max_gap_growth, options.max_volume_change, old.model.diagonal
    limits = CompareLimits(
        deviation=length(options.max_deviation, size, "max-deviation"),
        gap_growth=None if growth is None else length(growth, size, "max-gap-growth"),
        angle_growth=options.max_angle_growth,
        volume_change=None if volume is None else volume / 100,
    )
    verdict = differences(old, new, limits, options.ignore)
    return Judged(verdict, verdict.failed())


def _measured(document: Document, place: bool, ref: tuple[Model, Array] | None = None) -> tuple[Subject, Array]:
    """A measured document, and the sizes of its faces; with ``place`` all instances at their places in the assembly.

    Faces that are the same as in the model ``ref`` have the same sizes.
    """
    from mracad.occ.check import check, lone_faces
    from mracad.occ.contents import contents
    from mracad.occ.measure import KernelGauge
    from mracad.occ.placed import placed
    from mracad.occ.sizes import document_sizes, face_masses, mass
    from mracad.occ.view import view

    whole = placed(document) if place else None
    seen = whole.document if whole else document
    model = view(seen)
    if whole:
        faces = (replace(face, colour=colour) for face, colour in zip(model.faces, whole.colours, strict=True))
        model = replace(model, faces=tuple(faces))
    alike = same(ref[0], model) if ref else {}
    each = document_sizes(seen, {face: ref[1][face] for face in alike} if ref else {})
    subject = Subject(
        model=model,
        schema=document.schema,
        contents=contents(document),
        mass=mass(seen, each),
        faces=face_masses(seen, each),
        validity=check(seen),
        lone_faces=lone_faces(seen),
        gauge=KernelGauge(seen),
        face_numbers=whole.faces if whole else range(len(model.faces)),
        edge_numbers=whole.edges if whole else range(len(model.edges)),
        same=alike,
    )
    return subject, each
