"""Documents as Python sees them: they know what was done to them, and are judged as they are written."""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, fields
from functools import partial
from typing import BinaryIO

from mracad.api.speech import speaking
from mracad.api.threads import one_thread
from mracad.errors import UsageError
from mracad.formats import FORMATS, by_extension
from mracad.job.document import Report
from mracad.job.output import Target
from mracad.job.produce import produce
from mracad.occ import document as kernel
from mracad.occ.files import Written
from mracad.occ.files import read as read_file
from mracad.occ.load import load
from mracad.output import put
from mracad.spec.pictures import Scalars
from mracad.spec.recipe import Step
from mracad.store import location


@dataclass(eq=False)
class Document(kernel.Document):
    """A CAD document: what a STEP, IGES or BREP file holds, kept whole.

    Made by :func:`mracad.read`, and by every edit of a file.  Lengths are millimetres, whatever the unit of the file.

    Attributes
    ----------
    name : str
        Name of the file, without its folder.
    unit : str
        Length unit of the file, and of those that are written.
    reports : tuple of Report
        What each edit did, in order.

    Examples
    --------
    >>> document = mracad.read("assembly.step")
    >>> document.name, document.unit, document.reports
    ('assembly.step', 'in', ())
    """

    origin: Callable[[], kernel.Document] | None = field(default=None, repr=False)
    steps: tuple[Step, ...] = field(default=(), repr=False)
    reports: tuple[Report, ...] = field(default=(), repr=False)

    def __repr__(self) -> str:
        count = len(self.reports)
        return self.told(f"{count} edit{'s' * (count > 1)}" if count else "")

    def _repr_html_(self) -> str:
        """A table and the model to turn, in notebooks."""
        from mracad.report.notebook import cell

        facts = [
            ("Model", self.name),
            ("Faces", f"{len(self.faces)}, of which {self.nurbs} NURBS"),
            ("Products", ", ".join(part.product for part in self.parts if part.product) or "–"),
            ("Length unit", self.unit),
            ("Schema", self.schema or "–"),
        ]
        edits = [(_called(step), report.told) for step, report in zip(self.steps, self.reports, strict=True)]
        return cell(facts, ("Edit", "Result"), edits, self)

    def write(
        self,
        target: str | os.PathLike[str] | BinaryIO,
        *,
        format: str = "",
        schema: str = "",
        chord: str | float = "0.02%",
        angle: float | None = None,
        ascii: bool = False,
        scalar: str | Sequence[str] = (),
    ) -> Written:
        """Write a file, whole or not at all; the same as :func:`mracad.write`.  An existing file is replaced.

        An exact file is read back and judged, as on the command line: faces that would make it worse stay as they were
        before the edits, and ``reports`` then says so.  ``scalar`` gives the points of meshes numbers, such as
        ``"curvature:mean"``, ``"deviation"`` (from the model as it was read), ``"deviation:old.step"`` or
        ``"roughness:10mm"``, and the colours of the first.
        """
        with speaking():
            name, format = _name(self, target), _format(target, format)
            numbers = Scalars(scalar=(scalar,) if isinstance(scalar, str) else tuple(scalar))
            if numbers.scalar and not FORMATS[format].scalars:
                known = ", ".join(name for name, each in FORMATS.items() if each.scalars)
                raise UsageError(f"scalar: {format.upper()} holds no numbers at points", f"write {known}")
            wanted = Target(name, format, schema, str(chord), angle, ascii, scalars=numbers)
            return self._write(wanted, target)

    def original(self) -> kernel.Document:
        """The document as it was before all edits."""
        return self.origin() if self.origin else self

    def _write(self, wanted: Target, target: str | os.PathLike[str] | BinaryIO) -> Written:
        with one_thread():
            made = produce(self, self.original, self.steps, [wanted], done=self.reports)
        if made.document is not self:
            self.changed()
            vars(self).update(vars(made.document))
        self.reports = tuple(result for result in made.results if isinstance(result, Report))
        put(made.made[0].data, target)
        return made.made[0].written


def of(document: kernel.Document, origin: Callable[[], kernel.Document]) -> Document:
    """A document of the kernel room, and how to get it again as it is now."""
    return Document(**{each.name: getattr(document, each.name) for each in fields(kernel.Document)}, origin=origin)


def read(
    source: str | os.PathLike[str] | BinaryIO, *, input_unit: str | None = None, encoding: str | None = None
) -> Document:
    """Read a STEP, IGES, BREP or BinBREP file; the format is detected from its content.

    Parameters
    ----------
    source : path or binary stream
    input_unit : str, optional
        Length unit of the file's numbers, instead of the one that it states: ``"mm"``, ``"in"``, ...
    encoding : str, optional
        Character set of its texts.  Default: UTF-8 if that fits, else the most likely one.

    Returns
    -------
    Document

    Raises
    ------
    FileError
        For a file that is missing, damaged, in another format or without faces.
    UsageError
        For an unknown unit or character set.

    Examples
    --------
    >>> mracad.read("assembly.step")
    Document(assembly.step: 1 NURBS face of 15, in, AP214)
    """
    with speaking():
        text = load(source)
        again = partial(read_file, text, input_unit, encoding)
        return of(again(), again)


def _called(step: Step) -> str:
    """A step as Python calls it."""
    return f"{step.use}({', '.join(f'{name}={value!r}' for name, value in step.options.given().items())})"


def _name(document: kernel.Document, target: str | os.PathLike[str] | BinaryIO) -> str:
    return location(target).name if isinstance(target, str | os.PathLike) else document.name


def _format(target: str | os.PathLike[str] | BinaryIO, format: str) -> str:
    """The name of the format to write."""
    if not format:
        format = by_extension(target).name if isinstance(target, str | os.PathLike) else "step"
    if format not in FORMATS:
        raise UsageError(f"unknown format '{format}'", "use one of " + ", ".join(FORMATS))
    if FORMATS[format].kind == "picture":
        raise UsageError(f"{format} is a picture, not a model", "make it with mracad.render")
    return format
