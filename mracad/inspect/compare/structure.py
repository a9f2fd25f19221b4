"""Faces, seams, shells, validity and sizes of two documents."""

from __future__ import annotations

from collections import Counter, defaultdict
from collections.abc import Collection, Sequence
from dataclasses import dataclass, replace

import numpy as np

from mracad.inspect.compare.subject import Array, CompareLimits, Match, Subject, layer, paired
from mracad.inspect.seams import SMOOTH, SeamMeasure, key, summary
from mracad.inspect.seams import seams as measured
from mracad.inspect.verdict import Finding, Layer
from mracad.model.brep import Model
from mracad.model.facts import Mass
from mracad.model.sampling import length

STEEPER = 0.01
"""Growth of the angle of a smooth seam, degrees, beyond which it is no longer smooth: readers rebuild curves."""

_ALONG = 0.1  # share of its length by which a piece of a seam may lie beside that seam
_SAME_LENGTH = 1e-3  # relative: free edges of the same total length are the same, in however many pieces


# Faces -----------------------------------------------------------------------------------------------------------


def faces(ref: Subject, new: Subject, groups: Sequence[Match]) -> Layer:
    """Faces that are gone or new; faces that changed their kind or were split or merged are noted."""
    known = {i for group in groups for i in group.ref}
    found = {j for group in groups for j in group.new}
    lost = [f for f in ref.model.faces if f.index not in known]
    fresh = [f for f in new.model.faces if f.index not in found]
    findings = [Finding("face-lost", ref.named([f.index]), figures={"kind": f.kind}) for f in lost]
    findings += [Finding("face-added", new.named([f.index]), figures={"kind": f.kind}) for f in fresh]
    notes = []
    for group in groups:
        if len(group.new) > 1:
            figures = {"was_face": ref.face_numbers[group.ref[0]]}
            notes.append(Finding("face-split", new.named(group.new), figures=figures))
        elif len(group.ref) > 1:
            notes.append(Finding("face-merged", new.named(group.new), figures={"was": len(group.ref)}))
        for i, j in group.pairs():
            was, now = ref.model.faces[i].kind, new.model.faces[j].kind
            if was != now:
                notes.append(paired(ref, new, i, j, "face-kind", was=was, now=now))
    moved = sum(ref.face_numbers[group.ref[0]] != new.face_numbers[group.new[0]] for group in groups)
    count = len(ref.model.faces)
    text = f"{len(known)} of {count} matched" + (f", {moved} under another number" if moved else "")
    figures = {"matched": len(known), "lost": len(lost), "added": len(fresh), "renumbered": moved}
    return layer("faces", text, findings, figures, notes)


# Seams -----------------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class _Strand:
    """Seams of the reference and those of the new document that run along the same line; either may be in pieces."""

    old: list[SeamMeasure]
    new: list[SeamMeasure]

    def worst(self, what: str) -> tuple[float, float]:
        """The largest gap or angle before and after."""
        was, now = (max((_known(getattr(m, what)) for m in each), default=0.0) for each in (self.old, self.new))
        return was, now

    @property
    def smooth(self) -> bool:
        """Whether it was smooth."""
        return all(m.smooth for m in self.old)


def _known(value: float) -> float:
    return value if value == value else 0.0


def seams(
    ref: Subject, new: Subject, groups: Sequence[Match], limits: CompareLimits, unchanged: Collection[int]
) -> Layer:
    """Seams that are gone, new, wider, steeper, or no longer smooth.

    A seam between ``unchanged`` faces of the new model cannot break: if its angle differs, its curves have moved on the
    faces, within the tolerance, which is noted.
    """
    before = measured(ref.model, every=True)
    known = {key(m): m for m in before if m.sewn and all(face in new.same for face in m.faces)}
    after = measured(new.model, every=True, known=known)
    if not (ref.validity.shells and new.validity.shells):
        before, after = _either_way(before), _either_way(after)
    findings: list[Finding] = []
    notes: list[Finding] = []
    growth = {"gap": 0.0, "angle": 0.0}
    smooth = [0.0, 0.0]
    broken = 0
    for strand in _strands(ref.model, new.model, before, after, groups, limits.deviation):
        if not (strand.old and strand.new):
            (notes if _closes(strand) else findings).append(_alone(ref, new, strand))
            continue
        worst = max(strand.new, key=lambda m: _known(m.angle))
        if len(strand.old) != len(strand.new):
            notes.append(_finding(new, worst, "seam-pieces", was=len(strand.old), now=len(strand.new)))
        was, now = strand.worst("angle")
        if strand.smooth:
            smooth = [max(smooth[0], was), max(smooth[1], now)]
            if now >= SMOOTH and now > was + STEEPER:
                laid = all(face in unchanged for m in strand.new for face in m.faces)
                broken += not laid
                (notes if laid else findings).append(
                    _finding(new, worst, "seam-laid-anew" if laid else "crease", was=was, now=now)
                )
        for what, limit in (("gap", limits.gap_growth), ("angle", limits.angle_growth)):
            was, now = strand.worst(what)
            growth[what] = max(growth[what], now - was)
            if limit is not None and now - was > limit:
                widest = max(strand.new, key=lambda m: _known(getattr(m, what)))
                findings.append(_finding(new, widest, f"{what}-growth", was=was, now=now))
    old, fresh = summary(before), summary(after)
    text = f"{fresh.seams} (were {old.seams}), gap ≤ {fresh.gap:.3g} mm (was {old.gap:.3g} mm)"
    text += f", those that were smooth within {smooth[1]:.2g}° (was {smooth[0]:.2g}°)"
    figures = {"before": old, "after": fresh, "growth": growth, "no_longer_smooth": broken}
    return layer("seams", text, findings, figures, notes)


def _closes(strand: _Strand) -> bool:
    """Whether smooth seams close faces on themselves: the place where such a face is cut is only representation."""
    return all(m.smooth and m.faces[0] == m.faces[1] for m in (*strand.old, *strand.new))


def _alone(ref: Subject, new: Subject, strand: _Strand) -> Finding:
    """A seam that only one document has."""
    if strand.new:
        return _finding(new, max(strand.new, key=lambda m: _known(m.angle)), "seam-added")
    return _finding(ref, strand.old[0], "seam-lost")


def _either_way(measures: list[SeamMeasure]) -> list[SeamMeasure]:
    """Seams measured regardless of orientation, because without a shell the outer side is unknown."""
    return [replace(m, angle=min(m.angle, 180.0 - m.angle)) for m in measures]


def _finding(subject: Subject, seam: SeamMeasure, rule: str, **figures: float) -> Finding:
    edge = int(subject.edge_numbers[seam.edge]) if seam.sewn else None
    return Finding(rule, subject.named(seam.faces), edge, seam.where, figures)


def _strands(
    ref: Model, new: Model, before: list[SeamMeasure], after: list[SeamMeasure], groups: Sequence[Match], slack: float
) -> list[_Strand]:
    """The seams of both documents between matched faces, grouped if they run along the same line.

    Seams between the parts of one face are left out unless that face closes on itself there.
    """
    old = _by_faces(before, {i: n for n, group in enumerate(groups) for i in group.ref})
    fresh = _by_faces(after, {j: n for n, group in enumerate(groups) for j in group.new})
    strands = []
    for faces in dict.fromkeys([*fresh, *old]):
        found = _together(ref, new, old.get(faces, []), fresh.get(faces, []), slack)
        inside = faces[0] == faces[1] and max(len(groups[faces[0]].ref), len(groups[faces[0]].new)) > 1
        strands += [strand for strand in found if (strand.old and strand.new) or not inside]
    return strands


def _by_faces(measures: list[SeamMeasure], names: dict[int, int]) -> dict[tuple[int, int], list[SeamMeasure]]:
    """Seams by the names of the faces that they join, without those of unmatched faces."""
    found: dict[tuple[int, int], list[SeamMeasure]] = defaultdict(list)
    for measure in measures:
        if all(face in names for face in measure.faces):
            a, b = sorted(names[face] for face in measure.faces)
            found[a, b].append(measure)
    return found


def _together(ref: Model, new: Model, old: list[SeamMeasure], fresh: list[SeamMeasure], slack: float) -> list[_Strand]:
    """Seams between the same faces, grouped if the middle of one lies on the other."""
    from scipy.sparse import coo_matrix
    from scipy.sparse.csgraph import connected_components

    if len(old) == len(fresh) == 1:
        return [_Strand(old, fresh)]
    lines = [ref.edges[m.edge].points for m in old] + [new.edges[m.edge].points for m in fresh]
    pairs = [
        (i, len(old) + j)
        for i in range(len(old))
        for j in range(len(fresh))
        if _along(lines[i], lines[len(old) + j], slack) or _along(lines[len(old) + j], lines[i], slack)
    ]
    links = np.array(pairs, int).reshape(-1, 2)
    size = len(lines)
    graph = coo_matrix((np.ones(len(links)), (links[:, 0], links[:, 1])), (size, size))
    _, label = connected_components(graph, directed=False)
    return [
        _Strand(
            [m for m, of in zip(old, label[: len(old)], strict=True) if of == strand],
            [m for m, of in zip(fresh, label[len(old) :], strict=True) if of == strand],
        )
        for strand in range(int(label.max(initial=-1)) + 1)
    ]


def _along(piece: Array, line: Array, slack: float) -> bool:
    """Whether the middle of one sampled line lies on another."""
    middle, start, chord = piece[len(piece) // 2], line[:-1], np.diff(line, axis=0)
    square = np.maximum((chord**2).sum(axis=1), np.finfo(float).tiny)
    share = np.clip(((middle - start) * chord).sum(axis=1) / square, 0.0, 1.0)
    apart = np.linalg.norm(start + share[:, None] * chord - middle, axis=1).min()
    return bool(apart <= max(_ALONG * length(piece), 2.0 * slack))


# Counts and sizes ------------------------------------------------------------------------------------------------


def topology(ref: Subject, new: Subject, unsewn: str) -> Layer:
    """Solids, shells and free edges; their numbers of faces and edges are noted.

    An open shell of one face counts as that face alone.

    Parameters
    ----------
    ref, new : Subject
    unsewn : str
        The format that may lack shells and solids; ``""`` if both formats have them.
    """
    names = ("solids", "shells", "faces", "open_shells", "free_edges")
    counts = {name: (getattr(ref.validity, name), getattr(new.validity, name)) for name in names}
    counts["edges"] = len(ref.model.edges), len(new.model.edges)
    written = {"faces", "edges"}
    for name in ("shells", "open_shells"):
        if counts[name][0] - ref.lone_faces == counts[name][1] - new.lone_faces:
            written.add(name)
    if unsewn:
        written |= counts.keys()
    elif abs(_free(new.model) - _free(ref.model)) <= _SAME_LENGTH * _free(ref.model):
        written.add("free_edges")
    different = {
        name: Finding(name.replace("_", "-"), figures={"was": was, "now": now})
        for name, (was, now) in counts.items()
        if was != now
    }
    text = ", ".join(f"{now} {name.replace('_', ' ')}" for name, (_, now) in counts.items())
    findings = [found for name, found in different.items() if name not in written]
    notes = [found for name, found in different.items() if name in written]
    figures = {name: {"ref": a, "new": b} for name, (a, b) in counts.items()}
    return layer("topology", text, findings, figures, notes)


def _free(model: Model) -> float:
    """The length of all free edges, mm."""
    return sum(length(edge.points) for edge in model.edges if edge.free and len(edge.points))


def validity(ref: Subject, new: Subject) -> Layer:
    """Failures of the kernel's check in the new document that the reference does not have."""
    known = Counter(failure.status for failure in ref.validity.failures)
    fresh = Counter(failure.status for failure in new.validity.failures)
    findings = [
        Finding(
            failure.status, () if failure.face is None else new.named([failure.face]), figures={"kind": failure.kind}
        )
        for failure in new.validity.failures
        if fresh[failure.status] > known[failure.status]
    ]
    was, now = ref.validity.valid, new.validity.valid
    text = f"valid: {'yes' if now else 'no'} (was {'yes' if was else 'no'})"
    return layer("validity", text, findings, {"ref": was, "new": now})


def size(ref: Mass, new: Mass, limits: CompareLimits, unsewn: str) -> Layer:
    """Volume, area and centre; the volume only if both have solids, where a format (``unsewn``) may lack them."""
    solids = bool(ref.volume and new.volume) or not unsewn
    change = abs(new.volume - ref.volume) / abs(ref.volume) if ref.volume else float(new.volume != 0)
    shift = float(np.linalg.norm(np.subtract(new.centre, ref.centre)))
    text = f"volume {new.volume:.6g} mm³ ({_percent(new.volume, ref.volume)}), "
    text += f"area {new.area:.6g} mm² ({_percent(new.area, ref.area)}), centre moved by {shift:.3g} mm"
    findings, notes = [], []
    if not solids and ref.volume != new.volume:
        notes.append(Finding("not-held", figures={"format": unsewn, "what": "solids: the volume is not compared"}))
    elif limits.volume_change is not None and change > limits.volume_change:
        findings.append(Finding("volume-change", figures={"was": ref.volume, "now": new.volume}))
    figures = {"ref": ref, "new": new, "volume_change": change, "centre_shift": shift}
    return layer("size", text, findings, figures, notes)


def _percent(new: float, ref: float) -> str:
    return f"{100 * (new - ref) / ref:+.2g} %" if ref and abs(new - ref) > 1e-9 * abs(ref) else "unchanged"
