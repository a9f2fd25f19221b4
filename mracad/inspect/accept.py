"""Whether a file, read back, is as good as the document that it was written from: facts of both, and the faults.

A fault is a place where the file is worse than the document in memory.  A fault that a bare read and write of the input
in the same format (the *copy*) also has is caused by the kernel and is forgiven, unless a face is lost or replaced.
"""

from __future__ import annotations

from collections import Counter, defaultdict
from collections.abc import Callable, Collection, Iterator, Mapping
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from mracad.inspect.faults import Fault, FaultKind, ReadBack
from mracad.inspect.seams import SeamMeasure, seams
from mracad.model.facts import Facts, Line
from mracad.model.sampling import length

Array = np.ndarray

SLACK = 1e-7
"""Length, mm, by which a gap or a tolerance may grow in the file."""

MOVED = 1e-6
"""Length, mm, by which the gap of a seam that moved with both faces may grow in the file."""

STEEPER = 0.01
"""Angle, degrees, by which a smooth seam may be less smooth in the file."""

SAME = 1e-5
"""Share of an area or a volume by which these may differ, beyond what tolerances allow: they are measured to 1e-6."""

PLACED = 1e-6
"""Allowed difference of the box, as a share of the diagonal."""

CONTENT = frozenset({FaultKind.UNREAD, FaultKind.LOST, FaultKind.AREA, FaultKind.VOLUME, FaultKind.BOX})
"""Faults that are not forgiven even if the kernel's own copy has them too."""

_LOCAL = frozenset({FaultKind.GAP, FaultKind.ANGLE})  # faults of the faces that they name, and of nothing else
_LAID = 1e-8  # mm: an edge is the same if none of its points moved farther
_TURNED = 2e-5  # radians: and its faces turned by no more
_NEAR = 0.1  # share of the diagonal: faces that are farther apart are not the same

_COUNTS = {
    FaultKind.SOLIDS: "solids",
    FaultKind.SHELLS: "shells",
    FaultKind.FACES: "faces",
    FaultKind.FREE_EDGES: "free_edges",
}


def meshed(open_faces: Collection[int], before: Collection[int]) -> ReadBack:
    """The verdict on a mesh with open faces of closed bodies; those open ``before`` are forgiven."""
    fresh = tuple(sorted(set(open_faces) - set(before)))
    known = tuple(sorted(set(open_faces) & set(before)))
    faults, forgiven = ((Fault(FaultKind.OPEN, faces),) if faces else () for faces in (fresh, known))
    return ReadBack(not open_faces, faults, forgiven)


def read_back(file: Facts, faults: tuple[Fault, ...], forgiven: tuple[Fault, ...] = ()) -> ReadBack:
    """The figures of a file and the verdict on it."""
    measured = [f for f in (*faults, *forgiven) if f.reason in (FaultKind.GAP, FaultKind.ANGLE)]
    hull = _hull(file.spots).tolist()
    volume = next(((fault.was, fault.value) for fault in faults if fault.reason is FaultKind.VOLUME), None)
    return ReadBack(
        valid=file.probe.validity().valid and not faults,
        counts=file.counts,
        box=(tuple(hull[:3]), tuple(hull[3:])),
        volume=volume,
        tolerance=file.tolerance,
        seams=len({f.faces for f in measured}),
        gap=max((f.value for f in measured if f.reason is FaultKind.GAP), default=0.0),
        angle=max((f.value for f in measured if f.reason is FaultKind.ANGLE), default=0.0),
        faults=faults,
        forgiven=forgiven,
    )


@dataclass(frozen=True)
class Slack:
    """Allowed differences.

    Attributes
    ----------
    moved : collection of tuple of int
        Pairs of faces whose seams moved with both.
    gaps : mapping of tuple of int to float
        Allowed gaps of seams, and tolerances of their edges, between faces that moved in other ways, mm.
    parts : mapping of int to int
        Faces that were written in parts.
    """

    moved: Collection[tuple[int, ...]] = ()
    gaps: Mapping[tuple[int, ...], float] = field(default_factory=dict)
    parts: Mapping[int, int] = field(default_factory=dict)


class _File:
    """A file, with its faces matched to those of the document from which it was written."""

    def __init__(self, facts: Facts, document: Facts, parts: Collection[int] = ()) -> None:
        self.facts = facts
        self.partners = {i: i for i in range(facts.count)} if facts is document else match(document, facts, parts)
        pairs = [tuple(sorted(self.partners.get(face, -1) for face in edge.faces)) for edge in facts.edges]
        self.pairs: list[tuple[int, ...]] = pairs

    @cached_property
    def failures(self) -> Counter[tuple[str, str, int | None]]:
        return Counter(
            (f.kind, f.status, None if f.face is None else self.partners.get(f.face))
            for f in self.facts.probe.validity().failures
        )

    def seams(self, pairs: Collection[tuple[int, ...]]) -> dict[tuple[int, ...], list[SeamMeasure]]:
        """The seams between pairs of faces, measured."""
        edges = {number for number, pair in enumerate(self.pairs) if pair in pairs}
        free = {number for number, pair in enumerate(self.pairs) if len(pair) == 1}
        near = {face for pair in pairs for face in pair}
        if any(near.intersection(self.pairs[number]) for number in free):  # seams that are not sewn are found by place
            edges |= free
        found: dict[tuple[int, ...], list[SeamMeasure]] = defaultdict(list)
        for measure in seams(self.facts.probe.along(edges)) if edges else ():
            found[tuple(sorted(self.partners.get(face, -1) for face in measure.faces))].append(measure)
        return found

    def areas(self) -> Mapping[int, list[int]]:
        """The faces of the file for each face of the document, one per instance."""
        found: dict[int, list[int]] = defaultdict(list)
        for face in self.facts.owners.tolist():
            if face in self.partners:
                found[self.partners[face]].append(face)
        return found


def judge(
    memory: Facts,
    file: Facts,
    slack: Slack,
    copy: Callable[[], tuple[Facts, Facts]] | None = None,
    alike: Callable[[Collection[int]], bool] = lambda faces: False,
) -> tuple[tuple[Fault, ...], tuple[Fault, ...]]:
    """The faults of a file, and those that are forgiven because the kernel's own copy has them too.

    Parameters
    ----------
    memory, file : Facts
        Facts of the document that was written, and of the file.
    slack : Slack
    copy : callable, optional
        Gives the facts of the input and of the kernel's own copy of it, when needed; without it everything except loss
        of content is forgiven.
    alike : callable, optional
        Tells whether the file and the copy state some faces in the same way: the copy has the faults that these faces
        have between them, and need not be read.
    """
    base, new = _File(memory, memory), _File(file, memory, slack.parts)
    faults = tuple(_faults(base, new, slack))
    soft = [fault for fault in faults if fault.reason not in CONTENT]
    again: Counter[tuple[object, ...]] = Counter()
    named = {face for fault in soft for face in fault.faces}
    if soft and copy and not (all(fault.reason in _LOCAL for fault in soft) and alike(named)):
        own = _File(copy()[1], copy()[0], slack.parts)
        again = Counter(fault.key for fault in _beside(own, new, slack, {fault.faces for fault in soft}))
    left = tuple(fault for fault in faults if fault.reason in CONTENT or again[fault.key])
    return left, tuple(fault for fault in faults if fault not in left)


def _faults(memory: _File, file: _File, slack: Slack) -> Iterator[Fault]:
    """All places where a file is worse than the document."""
    yield from _bodies(memory, file)
    yield from _beside(memory, file, slack, _changed(memory, file, lambda edge: _LAID))


def _beside(base: _File, file: _File, slack: Slack, pairs: Collection[tuple[int, ...]]) -> Iterator[Fault]:
    """Places where a file is worse than ``base``; only seams between some pairs of faces are measured."""
    if file.failures:
        for (_, status, face), count in (file.failures - base.failures).items():
            yield Fault(FaultKind.INVALID, () if face is None else (face,), count, 0, status)
    more = sum(parts - 1 for parts in slack.parts.values())
    for reason, name in _COUNTS.items():
        value, was = getattr(file.facts.counts, name), getattr(base.facts.counts, name)
        if (
            value > was
            if reason is FaultKind.FREE_EDGES
            else not was <= value <= was + more * (reason is FaultKind.FACES)
        ):
            yield Fault(reason, (), value, was)
    yield from _tolerances(base, file, slack)
    yield from _seams(base, file, slack, pairs)


def _changed(memory: _File, file: _File, room: Callable[[Line], float]) -> set[tuple[int, ...]]:
    """The faces of edges that differ in the file by more than a distance."""
    same: set[int] = set()
    left: dict[tuple[int, ...], list[int]] = defaultdict(list)
    for number, pair in enumerate(memory.pairs):
        if number < len(file.pairs) and _same(memory, number, file, number, room):
            same.add(number)
        else:
            left[pair].append(number)
    changed = set()
    for number, pair in enumerate(file.pairs):
        if number in same:
            continue
        twin = next((other for other in left[pair] if _same(memory, other, file, number, room)), None)
        if twin is None:
            changed.add(pair)
        else:
            left[pair].remove(twin)
    return changed | {pair for pair, numbers in left.items() if numbers}


def _same(memory: _File, one: int, file: _File, other: int, room: Callable[[Line], float]) -> bool:
    a, b = memory.facts.edges[one], file.facts.edges[other]
    if a.points.shape != b.points.shape:
        return False
    order = [b.faces.index(face) for face in sorted(set(b.faces), key=lambda face: file.partners.get(face, -1))]
    if memory.pairs[one] != file.pairs[other]:
        return False
    sides = b.points if len(order) < len(b.faces) else b.points[[0, *(1 + i for i in order)]]
    mine = a.points if len(order) < len(b.faces) else a.points[[0, *(1 + i for i in np.argsort(a.faces))]]
    off = np.abs(mine - sides)
    turned = np.abs(np.abs(mine[..., 3:]) - np.abs(sides[..., 3:])).max(initial=0.0)
    return float(off[..., :3].max(initial=0.0)) <= room(a) and (room(a) > _LAID or float(turned) <= _TURNED)


def _bodies(memory: _File, file: _File) -> Iterator[Fault]:
    """Faces that are lost or replaced, and the volume and box of everything.

    A face is the same if no edge moved farther than its tolerance and the edges tell on which side of them it is.
    """
    old, new = memory.facts, file.facts
    changed = {face for pair in _changed(memory, file, lambda edge: max(edge.tolerance, SLACK)) for face in pair}
    before, after = memory.areas(), file.areas()
    lost = [face for face in range(old.count) if face not in after]
    yield from (Fault(FaultKind.LOST, (face,), 0.0, old.probe.area(face, False)) for face in lost)
    borders = _borders(old)
    others = []
    for face in sorted((old.closing | changed) & after.keys()):
        allowed = borders[face] * len(before[face])
        for exact in (False, True):
            value = sum(new.probe.area(twin, exact) for twin in after[face])
            was = old.probe.area(face, exact) * len(before[face])
            if abs(value - was) <= allowed + SAME * was:
                break
        else:
            others.append(Fault(FaultKind.AREA, (face,), value, was))
    yield from others
    solids = old.counts.solids and new.counts.solids
    if solids and (lost or old.counts.solids != new.counts.solids):  # exact volumes are slow, and not needed otherwise
        value, was = new.probe.volume(), old.probe.volume()
        if abs(value - was) > SAME * abs(was):
            yield Fault(FaultKind.VOLUME, tuple(lost), value, was)
    room = PLACED * old.diagonal + 2 * old.tolerance
    if np.abs(_hull(old.spots) - _hull(new.spots)).max() > room:
        far = float(np.abs(old.probe.box() - new.probe.box()).max())
        if far > room:
            yield Fault(FaultKind.BOX, (), far, 0.0)


def _borders(facts: Facts) -> Array:
    """Uncertainty of each face's area by the tolerances of its edges, ``(f,)``, mm²."""
    found = np.zeros(facts.count)
    for edge in facts.edges:
        uncertain = 2 * max(edge.tolerance, SLACK) * length(edge.points[0, :, :3])
        for face in edge.faces:
            found[face] += uncertain
    return found


def _hull(spots: Array) -> Array:
    return np.concatenate([spots[:, :3].min(axis=0), spots[:, 3:6].max(axis=0)])


def _tolerances(base: _File, file: _File, slack: Slack) -> Iterator[Fault]:
    """Edges and vertices with a larger tolerance than any had."""
    limit = max([base.facts.tolerance, *slack.gaps.values()])
    found: dict[tuple[int, ...], float] = defaultdict(float)
    for pair, edge in zip(file.pairs, file.facts.edges, strict=True):
        found[pair] = max(found[pair], edge.tolerance)
    for face, value in enumerate(file.facts.vertices.tolist()):
        own = (file.partners.get(face, -1),)
        found[own] = max(found[own], value)
    for faces, value in found.items():
        if value > limit + SLACK:
            yield Fault(FaultKind.TOLERANCE, tuple(face for face in faces if face >= 0), value, limit)


def _seams(base: _File, file: _File, slack: Slack, pairs: Collection[tuple[int, ...]]) -> Iterator[Fault]:
    """Seams that are gone, wider or less smooth."""
    new = file.seams(pairs)
    for pair, before in base.seams(pairs).items():
        if pair[0] < 0:
            continue
        found = new.get(pair, [])
        if not found:
            yield Fault(FaultKind.SEAM, pair, 0, len(before))
            continue
        room = MOVED if pair in slack.moved else SLACK
        gap, was = _worst(found, before, "gap", room)
        if gap > max(was + room, slack.gaps.get(pair, 0.0)):
            yield Fault(FaultKind.GAP, pair, gap, was)
        angle, was = _worst(found, [m for m in before if m.smooth], "angle", STEEPER)
        if angle > was + STEEPER:
            yield Fault(FaultKind.ANGLE, pair, angle, was)


def _worst(found: list[SeamMeasure], before: list[SeamMeasure], what: str, room: float) -> tuple[float, float]:
    """The figure of the seam that grew most, now and before; seams are compared in order of size."""
    old, new = (sorted(getattr(m, what) for m in each) for each in (before, found))
    if len(before) != len(found) and what == "gap":
        return new[-1], old[-1]
    pairs = zip(new, old, strict=False)
    return max(pairs, key=lambda p: p[0] - p[1], default=(0.0, 0.0))


def match(document: Facts, file: Facts, parts: Collection[int] = ()) -> dict[int, int]:
    """The face of the document for each face of a file.

    Faces with the same number in the same place match; others match the nearest; a remaining face that lies within one
    of the ``parts`` is a part of that.
    """
    scale = max(document.diagonal, 1e-300)
    old, new = document.spots, file.spots
    same = min(len(old), len(new))
    alike = np.abs(old[:same] - new[:same]).max(axis=1) <= 1e-6 * scale
    found = [*zip(file.owners[:same][alike].tolist(), document.owners[:same][alike].tolist(), strict=True)]
    rest_old, rest_new = (np.concatenate([np.flatnonzero(~alike), np.arange(same, len(each))]) for each in (old, new))
    if len(rest_old) and len(rest_new):
        from scipy.optimize import linear_sum_assignment  # takes tenths of a second, which most files need not spend

        apart = np.abs(new[rest_new][:, None] - old[rest_old][None]).max(axis=2)
        rows, columns = linear_sum_assignment(np.minimum(apart, scale))
        near = apart[rows, columns] < _NEAR * scale
        found += zip(
            file.owners[rest_new[rows[near]]].tolist(), document.owners[rest_old[columns[near]]].tolist(), strict=True
        )
    partners: dict[int, int] = {}
    for face, twin in found:
        partners.setdefault(face, twin)
    whole = [(document.spots[place], face) for place, face in enumerate(document.owners.tolist()) if face in parts]
    for place, face in enumerate(file.owners.tolist()):
        if face not in partners:
            spot, room = new[place], 1e-6 * scale
            inside = [f for w, f in whole if (spot[:3] >= w[:3] - room).all() and (spot[3:6] <= w[3:6] + room).all()]
            partners |= {face: inside[0]} if inside else {}
    return partners
