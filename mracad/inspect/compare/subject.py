"""One of two compared documents, measured; allowed differences; layers from findings."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Protocol

import numpy as np

from mracad.inspect.verdict import Finding, Layer
from mracad.model.brep import Model
from mracad.model.facts import Contents, Mass, Validity

Array = np.ndarray
Point = tuple[float, float, float]

EQUAL = 1e-9
"""Share of the diagonal below which two lengths count as equal."""


class Gauge(Protocol):
    """Exact measures on one document; see :class:`mracad.occ.measure.KernelGauge`."""

    def sample(self, index: int, lines: tuple[int, int]) -> Array: ...

    def distances(self, index: int, points: Array) -> Array: ...

    def face_distances(self, index: int, points: Array) -> Array: ...

    def edge_distances(self, edges: Iterable[int], points: Array) -> Array: ...

    def facing(self, index: int) -> Array: ...


@dataclass(frozen=True, eq=False)
class Subject:
    """One of the two documents, measured.

    Attributes
    ----------
    model : Model
        Its geometry: the parts, or all instances in their places as one part.
    schema : str
        Its source format, see :attr:`mracad.occ.document.Document.schema`.
    contents : Contents
    mass : Mass
    faces : list of Mass
        Area and centre of each face of ``model``.
    validity : Validity
    lone_faces : int
        Open shells of one face.
    gauge : Gauge
        Exact measurements on the faces of ``model``.
    face_numbers, edge_numbers : sequence of int
        The face and edge of the document for each one of ``model``.
    same : mapping of int to float
        The faces that :func:`mracad.inspect.compare.same.same` finds; none in the reference.
    """

    model: Model
    schema: str
    contents: Contents
    mass: Mass
    faces: list[Mass]
    validity: Validity
    lone_faces: int
    gauge: Gauge
    face_numbers: Sequence[int]
    edge_numbers: Sequence[int]
    same: Mapping[int, float] = field(default_factory=dict)

    def named(self, faces: Iterable[int]) -> tuple[int, ...]:
        """The indices in the document of some faces of ``model``."""
        return tuple(self.face_numbers[face] for face in faces)


@dataclass(frozen=True)
class CompareLimits:
    """Allowed differences; None for no limit.  Lengths in millimetres, angles in degrees, volume as a share."""

    deviation: float
    gap_growth: float | None = None
    angle_growth: float | None = None
    volume_change: float | None = None


@dataclass(frozen=True)
class Match:
    """Matching faces of the reference and of the new document: one each, or one and its parts."""

    ref: tuple[int, ...]
    new: tuple[int, ...]

    def pairs(self) -> list[tuple[int, int]]:
        return [(i, j) for i in self.ref for j in self.new]


def layer(
    name: str, text: str, findings: Sequence[Finding], figures: Mapping[str, object], notes: Sequence[Finding] = ()
) -> Layer:
    """A layer that fails if anything was found."""
    return Layer(name, "fail" if findings else "pass", text, tuple(findings), figures, tuple(notes))


def paired(ref: Subject, new: Subject, i: int, j: int, rule: str, **figures: float | str) -> Finding:
    """A finding about a face of the new document and its partner."""
    return Finding(rule, new.named([j]), figures={"was_face": ref.face_numbers[i], **figures})
