"""One output of a document: a model, a mesh or a picture, as bytes."""

from __future__ import annotations

import io
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from mracad.formats import FORMATS, Kind
from mracad.inspect.faults import ReadBack
from mracad.job.document import Report
from mracad.job.judge import Judged, Original
from mracad.spec.pictures import Picture, Scalars, Show
from mracad.spec.quantity import length
from mracad.spec.steps import Selection

if TYPE_CHECKING:
    from mracad.occ.document import Document
    from mracad.occ.files import Written
    from mracad.spec.recipe import Step
    from mracad.view.picture import Rendered


@dataclass(frozen=True)
class Target:
    """An output: its name, and how it is written (see :func:`mracad.occ.files.write`).

    Attributes
    ----------
    chord : str
        Meshes: largest distance of triangles from the surface, a length or a share of the diagonal.
    picture : Picture
        Pictures: what they show.
    scalars : Scalars
        Meshes: the numbers at their points.
    """

    name: str
    format: str = "step"
    schema: str = ""
    chord: str = "0.02%"
    angle: float | None = None
    ascii: bool = False
    picture: Picture = field(default_factory=Picture)
    scalars: Scalars = field(default_factory=Scalars)

    @property
    def kind(self) -> Kind:
        """Whether it is a model, a mesh or a picture."""
        return FORMATS[self.format].kind


@dataclass(frozen=True)
class Made:
    """The content of an output, how it differs from the document, what it is as read back (None: not read back), and
    what a picture does not show."""

    target: Target
    data: bytes = field(repr=False)
    written: Written
    read_back: ReadBack | None = None
    note: str = ""


def written(document: Document, target: Target, title: str = "", original: Original | None = None) -> Made:
    """A document written to a file, not yet judged; the points of a mesh have numbers if the ``original`` is given."""
    from mracad.occ.files import write

    meshed, paint = target.kind == "mesh", None
    if meshed and target.scalars.scalar and original:
        from mracad.view.scalars import scalars

        shows = target.scalars.shows
        paint = scalars(document, target.scalars.scalar, reference=_reference(shows, original))
    stream = io.BytesIO()
    told = write(
        document,
        stream,
        target.format,
        schema=target.schema,
        chord=length(target.chord, _diagonal(document), "chord") if meshed else None,
        angle=target.angle,
        ascii=target.ascii,
        paint=paint,
        options_text=title,
    )
    return Made(target, stream.getvalue(), told)


def pictured(
    document: Document,
    target: Target,
    original: Original,
    done: Sequence[tuple[Step, Report | Judged]] = (),
) -> Made:
    """A picture of a document after its steps as an output; see :func:`drawn`."""
    from mracad.occ.files import Written

    found = drawn(document, target.picture, original, done, target.format)
    return Made(target, found.data, Written(), note=found.note)


def drawn(
    document: Document,
    picture: Picture,
    original: Original,
    done: Sequence[tuple[Step, Report | Judged]] = (),
    format: str = "png",
) -> Rendered:
    """A picture of a document after its steps; what it is compared with is the document as it was, unless a file is
    named, and what was done to it is what the last edit did."""
    from mracad.job import treated
    from mracad.occ.files import read
    from mracad.spec.pictures import show_of
    from mracad.view.picture import render

    show = show_of(picture.show)
    before = read(picture.before) if picture.before else original() if picture.wipe else None
    reference = _reference([show], original)
    told = rings = None
    for step, result in done:
        if isinstance(result, Report) and isinstance(step.options, Selection):
            told, rings = treated.told(result, step.options), treated.rings(result)
    return render(document, picture, before=before, reference=reference, told=told, rings=rings, format=format)


def _reference(shows: Sequence[Show], original: Original) -> Document | None:
    """What deviation is measured from: a file, or the document as it was; None where nothing shows it."""
    from mracad.occ.files import read

    found = [read(show.of) if show.of else original() for show in shows if show.kind == "deviation"]
    return found[0] if found else None


def _diagonal(document: Document) -> float:
    """Diagonal of the bounding box of a document, mm."""
    from mracad.occ.view import view

    return view(document).diagonal
