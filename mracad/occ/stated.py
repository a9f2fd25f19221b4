"""What a STEP file states, before the kernel makes (and heals) shapes of it."""

from __future__ import annotations

import io
from collections.abc import Iterator
from dataclasses import dataclass

from OCP.IFSelect import IFSelect_RetDone
from OCP.STEPControl import STEPControl_Reader

from mracad.errors import FileError
from mracad.occ.settings import exchange, quiet

_SHELLS = ("StepShape_ClosedShell", "StepShape_OpenShell", "StepShape_ConnectedFaceSet")


@dataclass(frozen=True)
class Stated:
    """A STEP file as parsed.

    Attributes
    ----------
    entities : int
    faces : int
        Of all shells, each once.
    uses : tuple of (int, int, bool)
        Every use of an edge: a number for the edge, the position of the face among all, and whether the face's
        boundary runs along the edge.
    broken : tuple of str
        Entities that could not be understood, at most a hundred: their place in the file and the reason.
    """

    entities: int
    faces: int
    uses: tuple[tuple[int, int, bool], ...]
    broken: tuple[str, ...]


def stated(text: bytes, name: str) -> Stated:
    """Parse a STEP file.

    Raises
    ------
    FileError
        When it is not one.
    """
    with quiet(), exchange({}):
        reader = STEPControl_Reader()
        if reader.ReadStream(name, io.BytesIO(text)) != IFSelect_RetDone:
            raise FileError(f"'{name}' cannot be parsed as STEP", "the file is damaged: export it again")
        model = reader.StepModel()
        count = model.NbEntities()
        broken: list[str] = []
        shells = []
        for i in range(1, count + 1):
            if len(broken) < 100 and model.IsRedefinedContent(i):
                check = model.Check(i, True)
                reason = check.CFail(1) if check.HasFailed() else "not understood"
                broken.append(f"entity {i}: {reason}")
            entity = model.Value(i)
            if type(entity).__name__ in _SHELLS:
                shells.append(entity)
        faces: dict[object, int] = {}
        uses: list[tuple[int, int, bool]] = []
        edges: dict[object, int] = {}
        for shell in shells:
            for k in range(1, shell.NbCfsFaces() + 1):
                face = shell.CfsFacesValue(k)
                if face not in faces:  # two shells may share one
                    faces[face] = len(faces)
                    uses += [(edges.setdefault(edge, len(edges)), faces[face], along) for edge, along in _uses(face)]
    return Stated(count, len(faces), tuple(uses), tuple(broken))


def _uses(face) -> Iterator[tuple[object, bool]]:
    """The edges of a face, and whether its boundary runs along each."""
    for i in range(1, face.NbBounds() + 1):
        bound = face.BoundsValue(i)
        loop = bound.Bound()
        if hasattr(loop, "EdgeListValue"):
            for k in range(1, loop.NbEdgeList() + 1):
                use = loop.EdgeListValue(k)
                yield use.EdgeElement(), use.Orientation() == bound.Orientation()
