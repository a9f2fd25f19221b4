"""Documents in and out, in every format: one function each way."""

from __future__ import annotations

import os
from pathlib import Path
from typing import BinaryIO

from mracad.errors import UsageError
from mracad.formats import FORMATS, by_content, by_ending
from mracad.occ.document import Document
from mracad.occ.load import load
from mracad.output import put


def read(source: str | os.PathLike | BinaryIO, input_unit: str | None = None) -> Document:
    """Read a STEP, IGES, BREP or BinBREP file, which it is by its content.

    Parameters
    ----------
    source : path or binary stream
    input_unit : str, optional
        The length unit that the file's numbers are in, whatever it says itself; also that of the output.

    Raises
    ------
    FileError
        For a file that is missing, unreadable, damaged, in another format, or without faces.
    UsageError
        For an unknown unit.
    """
    file = load(source)
    format = by_content(file.getvalue(), file.name).name
    if format == "step":
        from mracad.occ.step import read_step

        return read_step(file, input_unit)
    if format == "iges":
        from mracad.occ.iges import read_iges

        return read_iges(file, input_unit)
    from mracad.occ.brep import read_brep

    return read_brep(file, input_unit)


def write(
    document: Document,
    target: str | os.PathLike | BinaryIO,
    format: str = "",
    *,
    schema: str = "",
    chord: float | None = None,
    angle: float | None = None,
    ascii: bool = False,
    options_text: str = "",
) -> tuple[int, ...]:
    """Write a document, whole or not at all; the same bytes every time.

    Parameters
    ----------
    document : Document
    target : path or binary stream
    format : str
        A key of ``mracad.formats.FORMATS``; by default what the ending of the path means, STEP for a stream.
    schema : str
        STEP: see ``write_step``.
    chord, angle : float, optional
        Meshes: see ``scene``.
    ascii : bool
        STL: text rather than binary.
    options_text : str
        What was done, for the header of STEP and IGES files.

    Returns
    -------
    tuple of int
        Faces that the kernel could not mesh: a mesh has holes there.

    Raises
    ------
    FileError
        When the document cannot be expressed in that format, or the target cannot be written.
    UsageError
        For an unknown format or schema, or settings that make no sense.
    """
    named = isinstance(target, str | os.PathLike)
    if not format:
        format = by_ending(target).name if named else "step"  # type: ignore[arg-type]
    if format not in FORMATS:
        raise UsageError(f"unknown format '{format}'", "use one of " + ", ".join(FORMATS))
    name = Path(target).name if named else document.name  # type: ignore[arg-type]
    missing: tuple[int, ...] = ()
    if format == "step":
        from mracad.occ.step import step

        data = step(document, name, schema, options_text)
    elif format == "iges":
        from mracad.occ.iges import iges

        data = iges(document, name, options_text)
    elif format in ("brep", "binbrep"):
        from mracad.occ.brep import brep

        data = brep(document, binary=format == "binbrep")
    else:
        from mracad.mesh import write as write_mesh
        from mracad.occ.scene import scene

        seen, missing = scene(document, chord, angle)
        data = write_mesh(seen, format, ascii)
    put(data, target)
    return missing
