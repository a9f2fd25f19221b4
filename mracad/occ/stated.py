"""The content of a STEP file as stated, before the kernel makes (and heals) shapes of it."""

from __future__ import annotations

import io
import math
import re
from collections.abc import Iterator
from typing import Any

from OCP.IFSelect import IFSelect_RetDone
from OCP.STEPControl import STEPControl_Reader

from mracad.errors import FileError
from mracad.model.facts import Stated
from mracad.occ.settings import exchange, quiet

_SHELLS = ("StepShape_ClosedShell", "StepShape_OpenShell", "StepShape_ConnectedFaceSet")


def stated(text: bytes, name: str) -> Stated:
    """Parse a STEP file.

    Raises
    ------
    FileError
        When it cannot be parsed.
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
        faces: dict[Any, int] = {}
        uses: list[tuple[int, int, bool]] = []
        edges: dict[object, int] = {}
        for shell in shells:
            for k in range(1, shell.NbCfsFaces() + 1):
                face = shell.CfsFacesValue(k)
                if face not in faces:  # two shells may share one
                    faces[face] = len(faces)
                    uses += [(edges.setdefault(edge, len(edges)), faces[face], along) for edge, along in _uses(face)]
        centres = tuple(_centre(face) for face in faces)
        senses = tuple(face.SameSense() if hasattr(face, "SameSense") else None for face in faces)
    return Stated(count, len(faces), tuple(uses), centres, senses, tuple(broken))


def _centre(face) -> tuple[float, float, float]:
    """The middle of the vertices of a face; far away if it has none."""
    vertices = {vertex for edge, _ in _uses(face) for vertex in (edge.EdgeStart(), edge.EdgeEnd())}
    points = [vertex.VertexGeometry() for vertex in vertices if hasattr(vertex, "VertexGeometry")]
    if not points or not all(hasattr(point, "CoordinatesValue") for point in points):
        return (math.inf,) * 3
    x, y, z = (sum(point.CoordinatesValue(k) for point in points) / len(points) for k in (1, 2, 3))
    return x, y, z


def unloaded(text: bytes, name: str) -> list[str]:
    """The faces of a STEP file that the kernel cannot load, and why: ``"#243: Surface has not been created"``."""
    with quiet(), exchange({}):
        reader = STEPControl_Reader()
        reader.ReadStream(name, io.BytesIO(text))
        reader.TransferRoots()
        model = reader.StepModel()
        place = {model.Value(i): i - 1 for i in range(1, model.NbEntities() + 1)}
        process = reader.WS().TransferReader().TransientProcess()
        checks = {process.Mapped(i): process.MapItem(i).Check() for i in range(1, process.NbMapped() + 1)}
    numbers = re.findall(rb"(?:^|;)\s*#(\d+)\s*=", text, re.MULTILINE)
    found = []
    for entity, check in checks.items():
        if any("not mapped" in check.CWarning(k) for k in range(1, check.NbWarnings() + 1)):
            label = (
                f"#{numbers[place[entity]].decode()}" if len(numbers) == len(place) else f"entity {place[entity] + 1}"
            )
            cause = checks.get(entity.FaceGeometry(), check) if hasattr(entity, "FaceGeometry") else check
            reason = cause.CFail(1) if cause.NbFails() else "the kernel gives no reason"
            found.append(f"{label}: {reason.strip()}")
    return found


def _uses(face) -> Iterator[tuple[Any, bool]]:
    """The edges of a face, and whether its boundary runs along each."""
    for i in range(1, face.NbBounds() + 1):
        bound = face.BoundsValue(i)
        loop = bound.Bound()
        if hasattr(loop, "EdgeListValue"):
            for k in range(1, loop.NbEdgeList() + 1):
                use = loop.EdgeListValue(k)
                yield use.EdgeElement(), use.Orientation() == bound.Orientation()
