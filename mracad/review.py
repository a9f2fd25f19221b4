"""Verdicts on whole documents: measured by the kernel, judged on plain data."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING

from mracad.audit import compare as audit
from mracad.audit.verdict import Verdict

if TYPE_CHECKING:
    from mracad.occ.document import Document


def compare(ref: Document, new: Document, limits: audit.Limits | None = None, ignore: Iterable[str] = ()) -> Verdict:
    """Judge a new version of a document by a reference.

    Parameters
    ----------
    ref, new : Document
    limits : Limits, optional
        What may differ; by default faces may deviate by a millionth of a millimetre.
    ignore : iterable of str
        Names of layers (see :data:`mracad.audit.compare.LAYERS`) that are left out.
    """
    return audit.compare(_measured(ref), _measured(new), limits or audit.Limits(1e-6), ignore)


def diagonal(document: Document) -> float:
    """Diagonal of the bounding box of a document, mm."""
    from mracad.occ.view import view

    return view(document).diagonal


def _measured(document: Document) -> audit.Subject:
    from mracad.occ.check import check
    from mracad.occ.contents import contents
    from mracad.occ.measure import Gauge, face_masses, mass
    from mracad.occ.view import view

    return audit.Subject(
        model=view(document),
        contents=contents(document),
        mass=mass(document),
        faces=face_masses(document),
        validity=check(document),
        gauge=Gauge(document),
    )
