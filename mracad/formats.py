"""File formats by name, file extension and first bytes; ``mracad.occ`` and ``mracad.mesh`` read and write them,
``mracad.view`` makes pictures."""

from __future__ import annotations

import os
from dataclasses import dataclass
from pathlib import PurePath
from typing import Literal

from mracad.errors import FileError

Kind = Literal["exact", "mesh", "picture"]


@dataclass(frozen=True)
class Format:
    """A file format.

    Attributes
    ----------
    name : str
        As ``--format`` takes it.
    extensions : tuple of str
        In lower case, with the dot; the first is the usual one.
    kind : {"exact", "mesh", "picture"}
        Exact formats are read and written, meshes and pictures only written.
    scalars : bool
        Whether it holds numbers or colours at the points of a mesh, face by face.
    """

    name: str
    extensions: tuple[str, ...]
    kind: Kind
    scalars: bool = False


FORMATS = {
    format.name: format
    for format in (
        Format("step", (".step", ".stp", ".p21"), "exact"),
        Format("iges", (".iges", ".igs"), "exact"),
        Format("brep", (".brep", ".brp"), "exact"),
        Format("binbrep", (".bbrep", ".binbrep"), "exact"),
        Format("stl", (".stl",), "mesh"),
        Format("3mf", (".3mf",), "mesh", scalars=True),
        Format("obj", (".obj",), "mesh"),
        Format("ply", (".ply",), "mesh", scalars=True),
        Format("gltf", (".gltf",), "mesh", scalars=True),
        Format("glb", (".glb",), "mesh", scalars=True),
        Format("vtp", (".vtp",), "mesh", scalars=True),
        Format("vtu", (".vtu",), "mesh", scalars=True),
        Format("png", (".png",), "picture"),
        Format("gif", (".gif",), "picture"),
        Format("mp4", (".mp4",), "picture"),
    )
}

READABLE = frozenset(
    extension for format in FORMATS.values() if format.kind == "exact" for extension in format.extensions
)
"""File extensions that can be read."""


def by_extension(path: str | os.PathLike[str], kind: Kind | None = None) -> Format:
    """The format for the extension of a file name; raises FileError, with the formats of a kind if that is wanted."""
    extension = PurePath(path).suffix.lower()
    for format in FORMATS.values():
        if extension in format.extensions:
            return format
    known = " ".join(format.extensions[0] for format in FORMATS.values() if kind in (None, format.kind))
    raise FileError(f"cannot write {path}: unknown extension {extension!r}", f"use one of {known}")


def by_content(data: bytes, name: str) -> Format:
    """The format of a file, by its content alone.

    Raises
    ------
    FileError
        When the file is empty or in no format that can be read.
    """
    if not data.strip():
        raise FileError(f"'{name}' is empty", "export it again")
    start = data[:4096]
    if b"ISO-10303-21" in start:
        return FORMATS["step"]
    if start.lstrip().startswith((b"CASCADE Topology V", b"DBRep_DrawableShape")):
        return FORMATS["brep"]
    if start.lstrip().startswith(b"Open CASCADE Topology V"):
        return FORMATS["binbrep"]
    if start[72:73] == b"S" and start[73:80].strip().isdigit():
        return FORMATS["iges"]
    raise FileError(f"'{name}' is not a STEP, IGES, BREP or BinBREP file", "export it as one of them")


_GEOMETRY_ONLY = frozenset({"assembly", "names", "colours", "layers", "materials", "annotations"})
_LACKS = {
    "AP203": frozenset({"annotations"}),
    "AP214": frozenset({"annotations"}),
    "IGES": frozenset({"assembly", "names", "transparency", "layers", "materials", "annotations", "shells"}),
    "BREP": _GEOMETRY_ONLY,
    "BinBREP": _GEOMETRY_ONLY,
}


def unheld(*schemas: str) -> dict[str, str]:
    """What cannot be compared between two documents, and the format or schema that does not hold it.

    Two STEP or two IGES files are compared in full.  A format that holds something only in some cases (layers in IGES
    are numbers) counts as not holding it.
    """
    if len(set(schemas)) == 1 and _LACKS.get(schemas[0]) != _GEOMETRY_ONLY:
        return {}
    return {what: schema for schema in schemas for what in sorted(_LACKS.get(schema, frozenset()))}
