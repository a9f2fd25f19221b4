"""Whether a file, read back, is as good as the document that it was written from: facts of both, and the faults.

A fault is where the file is worse than memory.  What a bare read and write of the input in the same format does as
well (the *copy*) is the kernel's own doing and is forgiven, but never that a face is lost or is another one.
"""

from __future__ import annotations

from collections import Counter, defaultdict
from collections.abc import Collection, Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from enum import StrEnum
from functools import cached_property
from typing import TYPE_CHECKING, Protocol

import numpy as np

from mracad.audit.continuity import SeamMeasure, summary

if TYPE_CHECKING:
    from mracad.model import Model
    from mracad.occ.check import Validity

Array = np.ndarray
Pair = tuple[int, int]

SLACK = 1e-7
"""Length, mm, by which a gap or a tolerance may be larger in the file."""

MOVED = 1e-6
"""The same for the gaps of seams that moved with both faces."""

LOOSE = 1e-4
"""Gap, mm, that a seam may have which moved to the tolerance; and the tolerance of its edges."""

STEEPER = 0.01
"""Angle, degrees, by which a smooth seam may be less smooth in the file."""

SAME = 1e-6
"""Share of an area, a volume or a box by which these may differ, beyond what tolerances allow."""


class Reason(StrEnum):
    """What is worse in a file."""

    INVALID = "invalid"
    SOLIDS = "solids"
    SHELLS = "shells"
    FACES = "faces"
    FREE_EDGES = "free edges"
    LOST = "face lost"
    AREA = "area"
    VOLUME = "volume"
    BOX = "box"
    TOLERANCE = "tolerance"
    SEAM = "seam"
    GAP = "gap"
    ANGLE = "angle"
    OPEN = "open mesh"


CONTENT = frozenset({Reason.LOST, Reason.AREA, Reason.VOLUME, Reason.BOX, Reason.OPEN})
"""What is not forgiven though the kernel's own copy has it, too."""

_COUNTS = {
    Reason.SOLIDS: "solids", Reason.SHELLS: "shells", Reason.FACES: "faces", Reason.FREE_EDGES: "free_edges",
}  # fmt: skip


@dataclass(frozen=True)
class Counts:
    """How many there are, all instances counted."""

    solids: int
    shells: int
    faces: int
    free_edges: int


@dataclass(frozen=True)
class Fault:
    """One thing that is worse in the file.

    Attributes
    ----------
    reason : Reason
    faces : tuple of int
        Indices in the document of the faces that it concerns; empty where it cannot be told.
    value, was : float
        The figure in the file and in the document: a count, mm, mm², mm³ or degrees.
    status : str
        What the kernel calls it, for ``INVALID``.
    """

    reason: Reason
    faces: tuple[int, ...] = ()
    value: float = 0.0
    was: float = 0.0
    status: str = ""

    @property
    def key(self) -> tuple[Reason, tuple[int, ...], str]:
        """What identifies it in another file."""
        return self.reason, self.faces, self.status


    def __str__(self) -> str:
        where = " and ".join(f"#{face + 1}" for face in self.faces[:2]) + (" …" if len(self.faces) > 2 else "")
        return _WORDS[self.reason].format(f=self, where=where or "somewhere", share=_share(self.value, self.was))


_WORDS = {
    Reason.INVALID: "{f.status} in {where}",
    Reason.SOLIDS: "{f.value:.0f} solids (were {f.was:.0f})",
    Reason.SHELLS: "{f.value:.0f} shells (were {f.was:.0f})",
    Reason.FACES: "{f.value:.0f} faces (were {f.was:.0f})",
    Reason.FREE_EDGES: "{f.value:.0f} free edges (were {f.was:.0f})",
    Reason.LOST: "{where} is lost",
    Reason.AREA: "the area of {where} changes by {share}",
    Reason.VOLUME: "the volume changes by {share}",
    Reason.BOX: "the box changes by {f.value:.3g} mm",
    Reason.TOLERANCE: "a tolerance of {f.value:.3g} mm at {where} (largest {f.was:.3g} mm)",
    Reason.SEAM: "no seam between {where}",
    Reason.GAP: "a gap of {f.value:.3g} mm between {where} (was {f.was:.3g} mm)",
    Reason.ANGLE: "an angle of {f.value:.2g}° between {where} (was {f.was:.2g}°)",
    Reason.OPEN: "the mesh has {f.value:.0f} open edges at {where}",
}


def _share(value: float, was: float) -> str:
    return f"{100 * abs(value - was) / abs(was):.3g} %" if was else f"{value:.3g}"


@dataclass(frozen=True)
class ReadBack:
    """What a file is, as read back.

    Attributes
    ----------
    valid : bool
        Whether it passes the kernel's check, and nothing is worse.
    counts : Counts
    box : ((float, float, float), (float, float, float))
        Lowest and highest corner of the boxes of its faces, mm; never too small.
    volume : (float, float) or None
        In the document and in the file, mm³; None where no face is another one, so that it was not measured.
    tolerance : float
        The largest, mm.
    seams, smooth : int
        Seams, and those that are smooth.
    gap, angle : float
        The largest of all, mm, and of the smooth ones, degrees.
    faults : tuple of Fault
        What is worse than in the document and than in the kernel's own copy of the input.
    forgiven : tuple of Fault
        What is worse than in the document, as it is in the kernel's own copy.
    """

    valid: bool
    counts: Counts
    box: tuple[tuple[float, ...], tuple[float, ...]]
    volume: tuple[float, float] | None
    tolerance: float
    seams: int
    smooth: int
    gap: float
    angle: float
    faults: tuple[Fault, ...]
    forgiven: tuple[Fault, ...]


def read_back(file: Facts, faults: tuple[Fault, ...], forgiven: tuple[Fault, ...] = ()) -> ReadBack:
    """The figures of a file and the verdict on it."""
    totals, validity = summary(file.seams), file.validity
    hull = _hull(file.spots).tolist()
    volume = next(((fault.was, fault.value) for fault in faults if fault.reason is Reason.VOLUME), None)
    return ReadBack(
        valid=validity.valid and not faults,
        counts=file.counts,
        box=(tuple(hull[:3]), tuple(hull[3:])),
        volume=volume,
        tolerance=max(validity.edge_tolerance, validity.vertex_tolerance),
        seams=totals.seams,
        smooth=totals.smooth,
        gap=totals.gap,
        angle=totals.angle,
        faults=faults,
        forgiven=forgiven,
    )


class Probe(Protocol):
    """Exact measures that are taken only where something differs; see :class:`mracad.occ.facts.Probe`."""

    def area(self, face: int) -> float: ...

    def volume(self) -> float: ...

    def box(self) -> Array: ...


@dataclass(frozen=True, eq=False)
class Facts:
    """What is known of a document, in memory or as read back.

    Attributes
    ----------
    model : Model
    validity : Validity
    seams : list of SeamMeasure
    spots : ndarray (p, 9)
        Where each placed face is: corners of its box, middle of its vertices, mm.
    owners : ndarray (p,)
        The face that each of them is.
    areas : ndarray (f,)
        Of the faces, mm², by a quadrature that is the same for the same face, though it may be inexact.
    vertex_tolerances : ndarray (f,)
        The largest among the vertices of each face, mm.
    counts : Counts
    probe : Probe
    """

    model: Model
    validity: Validity
    seams: list[SeamMeasure]
    spots: Array
    owners: Array
    areas: Array
    vertex_tolerances: Array
    counts: Counts
    probe: Probe

    @cached_property
    def borders(self) -> Array:
        """Area that the tolerances of each face's edges leave open, ``(f,)``, mm²."""
        found = np.zeros(len(self.areas))
        for edge in self.model.edges:
            if len(edge.points):
                length = float(np.linalg.norm(np.diff(edge.points, axis=0), axis=1).sum())
                for side in edge.sides:
                    found[side.face] += 2 * edge.tolerance * length
        return found


@dataclass(frozen=True)
class Slack:
    """Pairs of faces whose seams moved, exactly or to the tolerance: these may differ by what that allows."""

    moved: Collection[Pair] = ()
    loose: Collection[Pair] = ()


@dataclass(frozen=True)
class _Known:
    """The facts of a file by the faces of the document that it was written from."""

    facts: Facts
    partners: dict[int, int]
    failures: Counter[tuple[str, str, int | None]] = field(default_factory=Counter)
    seams: Mapping[Pair, list[SeamMeasure]] = field(default_factory=dict)
    tolerances: Mapping[tuple[int, ...], float] = field(default_factory=dict)


def judge(memory: Facts, file: Facts, slack: Slack, copy: tuple[Facts, Facts] | None = None) -> tuple[Fault, ...]:
    """Where a file is worse than the document, and than the kernel's own copy of its input.

    Parameters
    ----------
    memory, file : Facts
        Of the document that was written, and of the file.
    slack : Slack
    copy : (Facts, Facts), optional
        Of the input and of the kernel's own copy of it: without them nothing is forgiven.
    """
    known = _known(file, memory)
    found = tuple(_faults(_known(memory, memory), known, slack))
    if copy is None:
        return found
    own = _known(copy[1], copy[0])
    again = Counter(fault.key for fault in _faults(own, known, slack, bodies=False))
    return tuple(fault for fault in found if fault.reason in CONTENT or again[fault.key])


def spoilt(faults: Iterable[Fault], edited: Collection[int], model: Model) -> set[int]:
    """The edited faces to which faults are put down: those that they name, else their neighbours, else all."""
    named = {face for fault in faults for face in fault.faces}
    own = named & set(edited)
    if own:
        return own
    beside = {
        side.face
        for edge in model.edges
        if any(side.face in named for side in edge.sides)
        for side in edge.sides
    }
    return beside & set(edited) or set(edited)


def _faults(base: _Known, file: _Known, slack: Slack, bodies: bool = True) -> Iterator[Fault]:
    """Where a file is worse than ``base``; ``bodies``: whether that has the same faces in the same places."""
    for (_, status, face), count in (file.failures - base.failures).items():
        yield Fault(Reason.INVALID, () if face is None else (face,), count, 0, status)
    for reason, name in _COUNTS.items():
        value, was = getattr(file.facts.counts, name), getattr(base.facts.counts, name)
        if value > was if reason is Reason.FREE_EDGES else value != was:
            yield Fault(reason, (), value, was)
    if bodies:
        yield from _bodies(base.facts, file)
    yield from _tolerances(base, file, slack)
    yield from _seams(base, file, slack)


def _bodies(memory: Facts, file: _Known) -> Iterator[Fault]:
    """Faces that are lost or others, and the volume and box of everything."""
    found = file.facts
    twins: dict[int, int] = {}
    for new, old in file.partners.items():
        twins.setdefault(old, new)
    lost = [face for face in range(len(memory.areas)) if face not in twins]
    yield from (Fault(Reason.LOST, (face,), 0.0, float(memory.areas[face])) for face in lost)
    others = list(_areas(memory, found, twins))
    yield from others
    if (lost or others or memory.counts != found.counts) and memory.counts.solids and found.counts.solids:
        value, was = found.probe.volume(), memory.probe.volume()
        if abs(value - was) > SAME * abs(was):
            yield Fault(Reason.VOLUME, tuple(lost) + tuple(f.faces[0] for f in others), value, was)
    size = memory.model.diagonal
    if not np.allclose(_hull(memory.spots), _hull(found.spots), rtol=0, atol=1e-9 * size):
        far = float(np.abs(memory.probe.box() - found.probe.box()).max())
        if far > SAME * size + 2 * max(memory.validity.edge_tolerance, memory.validity.vertex_tolerance):
            yield Fault(Reason.BOX, (), far, 0.0)


def _areas(memory: Facts, found: Facts, twins: Mapping[int, int]) -> Iterator[Fault]:
    """Faces whose area is another one."""
    for face, twin in twins.items():
        area = float(memory.areas[face])
        allowed = SAME * area + float(memory.borders[face])
        if abs(found.areas[twin] - area) > allowed:
            value, was = found.probe.area(twin), memory.probe.area(face)
            if abs(value - was) > allowed:
                yield Fault(Reason.AREA, (face,), value, was)


def _hull(spots: Array) -> Array:
    return np.concatenate([spots[:, :3].min(axis=0), spots[:, 3:6].max(axis=0)])


def _tolerances(base: _Known, file: _Known, slack: Slack) -> Iterator[Fault]:
    """Edges and vertices with a larger tolerance than any had."""
    limit = max(base.facts.validity.edge_tolerance, base.facts.validity.vertex_tolerance)
    limit = max(limit, LOOSE if slack.loose else 0.0) + SLACK
    for faces, value in file.tolerances.items():
        if value > limit:
            yield Fault(Reason.TOLERANCE, faces, value, limit - SLACK)


def _seams(base: _Known, file: _Known, slack: Slack) -> Iterator[Fault]:
    """Seams that are gone, wider or less smooth."""
    for pair, before in base.seams.items():
        found = file.seams.get(pair, [])
        if not found:
            yield Fault(Reason.SEAM, pair, 0, len(before))
            continue
        loose = pair in slack.loose
        room = MOVED if pair in slack.moved or loose else SLACK
        gap, was = _worst(found, before, "gap", room)
        if gap > max(was + room, LOOSE if loose else 0.0):
            yield Fault(Reason.GAP, pair, gap, was)
        angle, was = _worst(found, [m for m in before if m.smooth], "angle", STEEPER)
        if angle > was + STEEPER:
            yield Fault(Reason.ANGLE, pair, angle, was)


def _worst(found: list[SeamMeasure], before: list[SeamMeasure], what: str, room: float) -> tuple[float, float]:
    """The figures of the seam that grew most: the least of those found beside those before, in order of size."""
    old, new = (sorted(getattr(m, what) for m in each) for each in (before, found))
    if len(before) != len(found) and what == "gap":
        return new[-1], old[-1]
    pairs = zip(new, old, strict=False)
    return max(pairs, key=lambda p: p[0] - p[1], default=(0.0, 0.0))


def _known(facts: Facts, document: Facts) -> _Known:
    """Facts by the numbers that their faces have in a document."""
    partners = {face: face for face in range(len(facts.areas))} if facts is document else match(document, facts)
    failures = Counter(
        (f.kind, f.status, None if f.face is None else partners.get(f.face)) for f in facts.validity.failures
    )
    seams: dict[Pair, list[SeamMeasure]] = defaultdict(list)
    for measure in facts.seams:
        pair = tuple(sorted(partners.get(face, -1) for face in measure.faces))
        if pair[0] >= 0:
            seams[pair].append(measure)  # type: ignore[index]
    tolerances: dict[tuple[int, ...], float] = defaultdict(float)
    for edge in facts.model.edges:
        faces = tuple(sorted({partners[side.face] for side in edge.sides if side.face in partners}))
        tolerances[faces] = max(tolerances[faces], edge.tolerance)
    for face, value in enumerate(facts.vertex_tolerances.tolist()):
        if face in partners:
            tolerances[partners[face],] = max(tolerances[partners[face],], value)
    return _Known(facts, partners, failures, seams, tolerances)


def match(document: Facts, file: Facts) -> dict[int, int]:
    """The face of the document that each face of a file is.

    Faces of the same number in the same place are; the others are those that are nearest.
    """
    from scipy.optimize import linear_sum_assignment

    scale = max(document.model.diagonal, 1e-300)
    old, new = document.spots, file.spots
    same = min(len(old), len(new))
    alike = np.abs(old[:same] - new[:same]).max(axis=1) <= 1e-6 * scale
    found = [(int(new), int(old)) for new, old in zip(file.owners[:same][alike], document.owners[:same][alike], strict=True)]
    rest_old, rest_new = (np.concatenate([np.flatnonzero(~alike), np.arange(same, len(each))]) for each in (old, new))
    if len(rest_old) and len(rest_new):
        apart = np.abs(new[rest_new][:, None] - old[rest_old][None]).max(axis=2)
        rows, columns = linear_sum_assignment(np.minimum(apart, scale))
        near = apart[rows, columns] < 0.1 * scale
        found += zip(
            file.owners[rest_new[rows[near]]].tolist(), document.owners[rest_old[columns[near]]].tolist(), strict=True
        )
    partners: dict[int, int] = {}
    for face, twin in found:
        partners.setdefault(face, twin)
    return partners
