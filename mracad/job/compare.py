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
    old, found = _measured(reference, place)
    new, _ = _measured(document, place, (old.model, *found))
    growth, volume, size = options.max_gap_growth, options.max_volume_change, old.model.diagonal
    limits = CompareLimits(
        deviation=length(options.max_deviation, size, "max-deviation"),
        gap_growth=None if growth is None else length(growth, size, "max-gap-growth"),
        angle_growth=options.max_angle_growth,
        volume_change=None if volume is None else volume / 100,
    )
    verdict = differences(old, new, limits, options.ignore)
    return Judged(verdict, verdict.failed())


def _measured(
    document: Document, place: bool, ref: tuple[Model, Array, Array] | None = None
) -> tuple[Subject, tuple[Array, Array]]:
    """A measured document, and its :func:`mracad.occ.sizes.document_sizes`; with ``place`` all instances at their
    places in the assembly.

    Faces that are the same as in the model of ``ref`` have the same sizes.
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
    if ref:
        alike = same(ref[0], model)
        found = document_sizes(seen, {face: ref[1][face] for face in alike}, ref[2])
    else:
        alike, found = {}, document_sizes(seen)
    subject = Subject(
        model=model,
        schema=document.schema,
        contents=contents(document),
        mass=mass(seen, found[0]),
        faces=face_masses(seen, found[0]),
        validity=check(seen),
        lone_faces=lone_faces(seen),
        gauge=KernelGauge(seen),
        face_numbers=whole.faces if whole else range(len(model.faces)),
        edge_numbers=whole.edges if whole else range(len(model.edges)),
        same=alike,
    )
    return subject, found
