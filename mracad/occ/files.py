"""Reading and writing documents in every format."""

from __future__ import annotations

import contextlib
import os
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, BinaryIO

from mracad.errors import EditError, FileError, UsageError
from mracad.formats import FORMATS, by_content, by_extension
from mracad.mesh.scene import Legend, Scene
from mracad.occ.document import Document, named_labels, nested_colours
from mracad.occ.healed import through_cache
from mracad.occ.labels import label_name
from mracad.occ.literals import known
from mracad.occ.load import load
from mracad.occ.writable import CutFace
from mracad.output import put


@dataclass(frozen=True)
class Lost:
    """What a written file lacks.

    Attributes
    ----------
    what : str
        ``"faces"``, which the kernel could not mesh; ``"names"``, ``"transparencies"``, ``"dimensions"``,
        ``"tolerances"``, ``"datums"`` or ``"notes"``.
    stated, written : int
        Their numbers in the document and in the file.
    names : tuple of str
        Names of the missing faces; of all such annotations, because the kernel does not keep their names.
    """

    what: str
    stated: int
    written: int
    names: tuple[str, ...]

    def __str__(self) -> str:
        names = list(dict.fromkeys(name for name in self.names if name))
        shown = ", ".join(names[:3]) + (" …" if len(names) > 3 else "")
        return f"{self.stated - self.written} of {self.stated} {self.what}" + (f" ({shown})" if shown else "")


@dataclass(frozen=True)
class Written:
    """How a written file differs from the document.

    Attributes
    ----------
    lost : tuple of Lost
        What it lacks.
    cut : tuple of CutFace
        Faces that are written as NURBS or in several parts, because readers would misinterpret them as they are.
    open : tuple of int
        Faces of closed bodies that a mesh leaves open.
    legends : tuple of Legend
        The numbers at the points of a mesh.
    """

    lost: tuple[Lost, ...] = ()
    cut: tuple[CutFace, ...] = ()
    open: tuple[int, ...] = ()
    legends: tuple[Legend, ...] = ()


def read(source: str | os.PathLike | BinaryIO, input_unit: str | None = None, encoding: str | None = None) -> Document:
    """Read a STEP, IGES, BREP or BinBREP file; the format is detected from the content.

    Parameters
    ----------
    source : path or binary stream
    input_unit : str, optional
        The length unit of the file's numbers, instead of the one that it states; also the unit of the output.
    encoding : str, optional
        The character set of its texts; by default UTF-8 if that fits, else the most likely one.

    Raises
    ------
    FileError
        For a file that is missing, unreadable, damaged, in another format, or without faces.
    UsageError
        For an unknown unit or character set.
    """
    if encoding is not None:
        encoding = known(encoding)
    file = load(source)
    format = by_content(file.getvalue(), file.name).name
    try:
        if format == "step":
            from mracad.occ.step import read_step

            return through_cache(file, (input_unit, encoding), lambda: read_step(file, input_unit, encoding))
        if format == "iges":
            from mracad.occ.iges import read_iges

            return through_cache(file, (input_unit, encoding), lambda: read_iges(file, input_unit, encoding))
        from mracad.occ.brep import read_brep

        return read_brep(file, input_unit)
    except Exception as error:
        if not type(error).__module__.startswith("OCP"):
            raise
        raise FileError(
            f"'{file.name}' cannot be read as {format}: {error}", "it is damaged: export it again"
        ) from error


@dataclass(frozen=True)
class FileOptions:
    """How a document is written.

    Attributes
    ----------
    schema : str
        Of STEP files; see ``write_step``.
    chord, angle : float, optional
        Of meshes; see ``scene``.
    ascii : bool
        Write STL as text instead of binary.
    paint : callable, optional
        Gives the points of a mesh numbers and colours, such as :func:`mracad.view.scalars.scalars`.
    options_text : str
        Description of the steps, for the header of STEP and IGES files.
    """

    schema: str = ""
    chord: float | None = None
    angle: float | None = None
    ascii: bool = False
    paint: Callable[[Scene], Scene] | None = None
    options_text: str = ""


def write(document: Document, target: str | os.PathLike | BinaryIO, format: str = "", **how: Any) -> Written:
    """Write a document, whole or not at all; the same bytes every time.

    Parameters
    ----------
    document : Document
    target : path or binary stream
    format : str
        A key of ``mracad.formats.FORMATS``; by default that of the file extension, STEP for a stream.
    **how
        The fields of :class:`FileOptions`.

    Returns
    -------
    Written
        What could not be written (faces of a mesh, annotations of an exact model, names beyond ASCII in IGES, in STEP
        the transparency of single instances inside assemblies), and what was written in another form.

    Raises
    ------
    EditError
        For a face that readers of that format would misinterpret.
    EditError
        When the kernel's writer fails on the document, though another format may hold it.
    FileError
        When the document cannot be expressed in that format, or the target cannot be written.
    UsageError
        For an unknown format or schema, or invalid settings.
    """
    wanted, name = FileOptions(**how), document.name
    if isinstance(target, str | os.PathLike):
        format, name = format or by_extension(target).name, Path(target).name
    format = format or "step"
    if format not in FORMATS:
        raise UsageError(f"unknown format '{format}'", "use one of " + ", ".join(FORMATS))
    if FORMATS[format].kind == "picture":
        raise UsageError(f"{format} is a picture, not a model", "make it with mracad render")
    data, written = _MAKERS.get(format, _mesh)(document, name, format, wanted)
    if FORMATS[format].kind == "exact" and document.annotations:
        from mracad.occ.part21 import pmi

        kept = pmi(data) if format == "step" else {}
        counts = {what: (names, len(kept.get(what, ()))) for what, names in document.annotations.items()}
        gone = (Lost(what, len(ns), count, ns) for what, (ns, count) in counts.items() if count < len(ns))
        written = replace(written, lost=(*written.lost, *gone))
    put(data, target)
    return written


def _step(document: Document, name: str, format: str, how: FileOptions) -> tuple[bytes, Written]:
    from mracad.occ.step import step

    with _expressing(document.name, format):
        data, cut = step(document, name, how.schema, how.options_text)
    return data, Written(_opaque(document), cut)


def _iges(document: Document, name: str, format: str, how: FileOptions) -> tuple[bytes, Written]:
    from mracad.occ.iges import iges

    with _expressing(document.name, format):
        data, cut = iges(document, name, how.options_text)
    return data, Written(_unwritten(document), cut)


def _brep(document: Document, name: str, format: str, how: FileOptions) -> tuple[bytes, Written]:
    from mracad.occ.brep import brep

    return brep(document, binary=format == "binbrep"), Written()


def _mesh(document: Document, name: str, format: str, how: FileOptions) -> tuple[bytes, Written]:
    from mracad.mesh import write as write_mesh
    from mracad.occ.scene import scene

    seen, missing, torn = scene(document, how.chord, how.angle)
    count, names = len(document.faces), tuple(f"#{face + 1}" for face in missing)
    lost = (Lost("faces", count, count - len(missing), names),) if missing else ()
    if how.paint is not None:
        if not FORMATS[format].scalars:
            able = " ".join(each.extensions[0] for each in FORMATS.values() if each.scalars)
            raise UsageError(f"{format} holds no numbers at points", f"use one of {able}")
        seen = how.paint(seen)
    return write_mesh(seen, format, how.ascii), Written(lost, open=torn, legends=seen.legends)


_MAKERS = {"step": _step, "iges": _iges, "brep": _brep, "binbrep": _brep}


@contextlib.contextmanager
def _expressing(name: str, format: str) -> Iterator[None]:
    """Raise failures of the kernel's writer as such: the input need not be at fault."""
    try:
        yield
    except Exception as error:
        if not type(error).__module__.startswith("OCP"):
            raise
        raise EditError(
            f"the kernel cannot express '{name}' as {format.upper()}: {error}",
            "write BREP, which holds faces as they are",
        ) from error


def _opaque(document: Document) -> tuple[Lost, ...]:
    """Instances that are transparent only inside one instance of an assembly: the kernel writes just their colour."""
    count = sum(len(colour) > len("#rrggbb") for _, colour in nested_colours(document))
    return (Lost("transparencies", count, 0, ()),) if count else ()


def _unwritten(document: Document) -> tuple[Lost, ...]:
    """Names that are not ASCII, which IGES cannot hold."""
    names = [name for name in map(label_name, named_labels(document)) if name]
    beyond = tuple(name for name in names if not name.isascii())
    return (Lost("names", len(names), len(names) - len(beyond), beyond),) if beyond else ()
