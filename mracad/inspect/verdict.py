"""Verdicts as data: named layers in order, each with a status and the evidence for it."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass, field, replace
from typing import Literal

from mracad.brief import line

Status = Literal["pass", "noted", "fail", "time limit", "skipped"]
Figure = float | int | str | bool | None


@dataclass(frozen=True)
class Finding:
    """One piece of evidence; see :func:`mracad.job.words.of_finding` for its wording.

    Attributes
    ----------
    rule : str
        Its kind, such as ``"SelfIntersectingWire"`` or ``"deviates"``.
    faces : tuple of int
        Indices of the faces that it concerns.
    edge : int or None
        Index of the edge that it concerns.
    where : tuple of float or None
        A point, mm, in the part's frame.
    figures : mapping
        Measurements by name; lengths in millimetres, angles in degrees, faces of another document by index.
    """

    rule: str
    faces: tuple[int, ...] = ()
    edge: int | None = None
    where: tuple[float, float, float] | None = None
    figures: Mapping[str, Figure] = field(default_factory=dict)

    __repr__ = line


@dataclass(frozen=True)
class Layer:
    """One layer of a verdict.

    Attributes
    ----------
    name : str
    status : {"pass", "noted", "fail", "time limit", "skipped"}
        ``"noted"`` where something was found that a check was not asked to fail for.
    text : str
        The measurement, or why there is none, in one line.
    findings : tuple of Finding
    figures : mapping
        Measurements by name; lengths in millimetres, angles in degrees.
    notes : tuple of Finding
        Remarks that fail nothing.
    """

    name: str
    status: Status
    text: str = ""
    findings: tuple[Finding, ...] = ()
    figures: Mapping[str, object] = field(default_factory=dict)
    notes: tuple[Finding, ...] = ()

    __repr__ = line


@dataclass(frozen=True)
class Verdict:
    """The layers of a check or a comparison, in order.

    Attributes
    ----------
    subject : str
        Name of the file.
    layers : tuple of Layer
    valid : bool or None
        None if unknown: a check that decides it was not completed.
    """

    subject: str
    layers: tuple[Layer, ...]
    valid: bool | None

    __repr__ = line

    def failed(self, *names: str) -> tuple[Layer, ...]:
        """The layers that failed: of those named, or of all."""
        return tuple(x for x in self.layers if x.status == "fail" and (not names or x.name in names))

    def noting(self, failed: Collection[Layer] = ()) -> Verdict:
        """The same verdict, where layers that found something are noted unless they are among those that ``failed``."""
        layers = (replace(x, status="noted") if x.status == "fail" and x not in failed else x for x in self.layers)
        return replace(self, layers=tuple(layers))
