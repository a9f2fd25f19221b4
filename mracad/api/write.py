"""Writing anything that can be edited."""

from __future__ import annotations

import os
from inspect import Parameter, signature
from typing import Any, BinaryIO, TypeAlias

from mracad.api.document import Document
from mracad.api.speech import speaking
from mracad.api.things import Source, opened
from mracad.occ.files import Written

Target: TypeAlias = str | os.PathLike[str] | BinaryIO


def write(thing: Source, target: Target, **how: Any) -> Written:
    """Write a model, whole or not at all; the same bytes every time.

    An exact file is read back and judged, as on the command line.  Faces that would make it worse stay as they were
    before the edits; :func:`report_of` then says so.

    Parameters
    ----------
    thing : Document or shape
    target : path or binary stream
    format : str
        ``"step"``, ``"iges"``, ``"brep"``, ``"binbrep"``, ``"stl"``, ``"3mf"``, ``"obj"``, ``"ply"``, ``"gltf"``,
        ``"glb"``, ``"vtp"`` or ``"vtu"``.  Default: by the extension of a path, STEP for a stream.
    schema : str
        STEP: ``"AP203"``, ``"AP214"`` or ``"AP242"``.  Default: AP242 for a file that was read as such, else AP214.
    chord : str or float
        Meshes: largest distance of triangles from the surface, a length.
    angle : float, optional
        Meshes: largest angle between triangles, degrees.
    ascii : bool
        STL: write text.
    scalar : str or sequence of str
        Meshes: numbers at their points, ``"curvature:mean"``, ``"deviation"`` (from the input of edits),
        ``"roughness:10mm"``, ...; the first gives the colours.

    Returns
    -------
    Written
        What the file lacks (``lost``), and which faces it holds in another form (``cut``).

    Raises
    ------
    EditError
        When the file would be worse whichever faces stay unchanged.
    FileError
        When it cannot be written.
    UsageError
        For an unknown format or schema.

    Examples
    --------
    >>> import io
    >>> target = io.BytesIO()
    >>> mracad.write(mracad.read("assembly.step"), target, format="stl").lost
    ()
    """
    with speaking():
        document = opened(thing, change=False).document
    return document.write(target, **how)


_OF_DOCUMENT = signature(Document.write)
vars(write)["__signature__"] = _OF_DOCUMENT.replace(
    parameters=[
        Parameter("thing", Parameter.POSITIONAL_OR_KEYWORD, annotation="Source"),
        *list(_OF_DOCUMENT.parameters.values())[1:],
    ]
)
