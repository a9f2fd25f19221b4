"""What differs between two versions of a document: a layer each for geometry, structure and attributes.

A face's *deviation* is measured from points inside it to the whole surface under its partner, and back; how its
boundary moved is its *outline*.  So a wall that only grew longer with the face above it has moved in its outline alone.
"""

from __future__ import annotations

from collections import Counter, defaultdict
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Protocol

import numpy as np

from mracad.audit.continuity import SeamMeasure, seams, summary
from mracad.audit.project import distances
from mracad.audit.verdict import Finding, Layer, Verdict
from mracad.constraint.region import face_region, supported
from mracad.model import Face, Model

if TYPE_CHECKING:
    from mracad.occ.check import Validity
    from mracad.occ.contents import Contents, Placed
    from mracad.occ.measure import Mass

Array = np.ndarray
Point = tuple[float, float, float]

EQUAL = 1e-9
"""Share of the diagonal below which two lengths are the same."""
_LINES = 40  # most sample lines across a face
_STRANGE = 0.3  # farther apart in place and size, as a share of the diagonal, faces are no partners


class Gauge(Protocol):
    """Exact measures on one document; see :class:`mracad.occ.measure.Gauge`."""

    def sample(self, index: int, lines: tuple[int, int]) -> Array: ...

    def distances(self, index: int, points: Array) -> Array: ...

    def edge_distances(self, edges: Iterable[int], points: Array) -> Array: ...


@dataclass(frozen=True, eq=False)
class Subject:
    """One of the two documents, measured."""

    model: Model
    contents: Contents
    mass: Mass
    faces: list[Mass]
    validity: Validity
    gauge: Gauge


@dataclass(frozen=True)
class Limits:
    """What may differ; None for no limit.  Lengths are millimetres, angles degrees, the volume a share of itself."""

    deviation: float
    gap_growth: float | None = None
    angle_growth: float | None = None
    volume_change: float | None = None


@dataclass(frozen=True)
class Spread:
    """Distances of points of one face from the other: largest, mean, 95 % below; where the largest is."""

    largest: float = 0.0
    mean: float = 0.0
    p95: float = 0.0
    where: Point | None = None


@dataclass(frozen=True)
class FaceDeviation:
    """How far a face lies from its partner.

    Attributes
    ----------
    ref, new : int
        Indices of the two faces.
    there, back : Spread
        From the reference to the new surface, and from the new to the reference.
    bound : float or None
        Certified bound on both where the parameterisations match: the largest distance of two poles.
    outline : Spread
        Of the two boundaries from each other.
    """

    ref: int
    new: int
    there: Spread
    back: Spread
    bound: float | None
    outline: Spread

    @property
    def worst(self) -> Spread:
        return max(self.there, self.back, key=lambda s: s.largest)


def compare(ref: Subject, new: Subject, limits: Limits, ignore: Iterable[str] = ()) -> Verdict:
    """Judge a new version of a document by a reference.

    Parameters
    ----------
    ref, new : Subject
    limits : Limits
    ignore : iterable of str
        Names of layers that are left out.
    """
    partners = match(ref, new)
    makers: dict[str, Callable[[], Layer]] = {
        "faces": lambda: _faces(ref, new, partners),
        "deviation": lambda: _deviation(ref, new, partners, limits),
        "seams": lambda: _seams(ref.model, new.model, partners, limits),
        "topology": lambda: _topology(ref.validity, new.validity, len(ref.model.edges), len(new.model.edges)),
        "validity": lambda: _validity(ref.validity, new.validity),
        "size": lambda: _size(ref.mass, new.mass, limits),
        "units": lambda: _units(ref.contents.unit, new.contents.unit),
        "assembly": lambda: _assembly(ref, new),
        "names": lambda: _names(ref, new, partners),
        "colours": lambda: _colours(ref, new, partners),
        "layers": lambda: _marks("layers", ref.contents.layers, new.contents.layers, partners),
        "materials": lambda: _marks("materials", ref.contents.materials, new.contents.materials, partners),
        "annotations": lambda: _annotations(ref.contents.annotations, new.contents.annotations),
    }
    left = frozenset(ignore)
    layers = tuple(Layer(name, "skipped", "ignored") if name in left else make() for name, make in makers.items())
    return Verdict(new.model.name, layers, new.validity.valid)


LAYERS = (
    "faces", "deviation", "seams", "topology", "validity", "size", "units", "assembly", "names", "colours", "layers",
    "materials", "annotations",
)  # fmt: skip
"""Names of the layers of a comparison, in order."""


# Faces -----------------------------------------------------------------------------------------------------------


def match(ref: Subject, new: Subject) -> dict[int, int]:
    """Partners: new face by reference face.

    Faces with the same number that are alike in place, size, kind and product are partners; the others find theirs
    by the least total difference.
    """
    from scipy.optimize import linear_sum_assignment

    old, fresh = _features(ref), _features(new)
    scale = max(ref.model.diagonal, 1e-300)
    same = min(len(old), len(fresh))
    alike = np.linalg.norm(old[:same] - fresh[:same], axis=1) <= 1e-6 * scale
    kin = [_kin(a, b) for a, b in zip(ref.model.faces, new.model.faces, strict=False)]
    partners = {int(i): int(i) for i in np.flatnonzero(alike & np.array(kin, bool))}
    rest = [i for i in range(len(old)) if i not in partners]
    free = [j for j in range(len(fresh)) if j not in partners]
    if rest and free:
        apart = np.linalg.norm(old[rest][:, None] - fresh[free][None], axis=2) / scale
        strange = [[not _kin(ref.model.faces[i], new.model.faces[j]) for j in free] for i in rest]
        order = np.abs(np.array(rest)[:, None] - np.array(free)) / (len(old) + len(fresh))
        rows, columns = linear_sum_assignment(np.minimum(apart, 2 * _STRANGE) + 0.1 * np.array(strange) + 1e-9 * order)
        partners |= {rest[r]: free[c] for r, c in zip(rows, columns, strict=True) if apart[r, c] < _STRANGE}
    return dict(sorted(partners.items()))


def _features(subject: Subject) -> Array:
    """Centre and size of each face, mm."""
    return np.array([(*face.centre, max(face.area, 0.0) ** 0.5) for face in subject.faces]).reshape(-1, 4)


def _kin(a: Face, b: Face) -> bool:
    return a.kind == b.kind and a.product == b.product


def _faces(ref: Subject, new: Subject, partners: Mapping[int, int]) -> Layer:
    lost = [f for f in ref.model.faces if f.index not in partners]
    found = set(partners.values())
    fresh = [f for f in new.model.faces if f.index not in found]
    changed = [(i, j) for i, j in partners.items() if ref.model.faces[i].kind != new.model.faces[j].kind]
    findings = [Finding(f"#{f.index + 1} ({f.kind}) is gone", "face-lost", (f.index,)) for f in lost]
    findings += [Finding(f"#{f.index + 1} ({f.kind}) is new", "face-added", (f.index,)) for f in fresh]
    findings += [
        Finding(f"{_pair(i, j)} is {new.model.faces[j].kind}, was {ref.model.faces[i].kind}", "face-kind", (j,))
        for i, j in changed
    ]
    moved = sum(i != j for i, j in partners.items())
    text = f"{len(partners)} of {len(ref.model.faces)} matched" + (f", {moved} under another number" if moved else "")
    figures = {"matched": len(partners), "lost": len(lost), "added": len(fresh), "renumbered": moved}
    return _layer("faces", text, findings, figures)


def _pair(i: int, j: int) -> str:
    return f"#{j + 1}" if i == j else f"#{j + 1} (was #{i + 1})"


# Deviation -------------------------------------------------------------------------------------------------------


def _deviation(ref: Subject, new: Subject, partners: Mapping[int, int], limits: Limits) -> Layer:
    each = deviations(ref, new, partners)
    findings = []
    for d in each:
        for what, spread in (("deviates", d.worst), ("outline moved", d.outline)):
            if not spread.largest <= limits.deviation:
                text = f"{_pair(d.ref, d.new)} {what} by {spread.largest:.6g} mm"
                findings.append(Finding(text, what.split()[0], (d.new,), where=spread.where))
    worst = max(each, key=lambda d: d.worst.largest, default=None)
    largest = worst.worst.largest if worst else 0.0
    outline = max((d.outline.largest for d in each), default=0.0)
    where = f" on #{worst.new + 1}" if worst and largest > EQUAL * ref.model.diagonal else ""
    text = f"max {largest:.3g} mm{where}, outlines {outline:.3g} mm"
    figures = {"largest": largest, "outline": outline, "limit": limits.deviation, "each": each}
    return _layer("deviation", text, findings, figures)


def deviations(ref: Subject, new: Subject, partners: Mapping[int, int]) -> list[FaceDeviation]:
    """How far every matched face lies from its partner, in the order of the reference."""
    lines = [_lines(subject.model) for subject in (ref, new)]
    floor = EQUAL * ref.model.diagonal
    found = []
    for i, j in partners.items():
        bound = _bound(ref.model, new.model, i, j)
        if bound is not None and bound <= floor:
            there = back = Spread(bound, bound, bound, _middle(ref.model.faces[i]))
        else:
            mine, theirs = ref.gauge.sample(i, _density(ref.model, i)), new.gauge.sample(j, _density(new.model, j))
            there, back = _spread(mine, _off(new, j, mine)), _spread(theirs, _off(ref, i, theirs))
        outline = _outline(ref, new, lines[0][i], lines[1][j], floor)
        found.append(FaceDeviation(i, j, there, back, bound, outline))
    return found


def _middle(face: Face) -> Point:
    x, y, z = face.box.mean(axis=0).tolist()
    return x, y, z


def _bound(ref: Model, new: Model, i: int, j: int) -> float | None:
    """Largest distance of two poles that the faces depend on; None where the parameterisations differ."""
    a, b = ref.faces[i], new.faces[j]
    if a.surface is None or b.surface is None:
        return None
    old, fresh = ref.surfaces[a.surface].net, new.surfaces[b.surface].net
    if old.poles.shape != fresh.poles.shape or (old.weights is None) != (fresh.weights is None):
        return None
    for p, q in ((old.u, fresh.u), (old.v, fresh.v)):
        if p.degree != q.degree or p.periodic != q.periodic or len(p.knots) != len(q.knots):
            return None
        if np.abs(p.knots - q.knots).max() > 1e-12 * p.period:
            return None
    if old.weights is not None and np.abs(old.weights - fresh.weights).max() > 1e-12 * old.weights.max():
        return None
    placed = [net.poles @ face.frame[:3, :3].T + face.frame[:3, 3] for net, face in ((old, a), (fresh, b))]
    seen = supported(old, face_region(old, a).inside) | supported(fresh, face_region(fresh, b).inside)
    return float(np.linalg.norm(placed[1] - placed[0], axis=-1)[seen].max(initial=0.0))


def _density(model: Model, index: int) -> tuple[int, int]:
    """Sample lines that meet every span, up to a limit."""
    surface = model.faces[index].surface
    if surface is None:
        return 0, 0
    net = model.surfaces[surface].net
    return min(2 * net.u.spans + 1, _LINES), min(2 * net.v.spans + 1, _LINES)


def _off(subject: Subject, index: int, points: Array) -> Array:
    """Distances of points from the surface under a face."""
    if not len(points):
        return np.empty(0)
    face = subject.model.faces[index]
    if face.surface is None:
        return subject.gauge.distances(index, points)
    local = (points - face.frame[:3, 3]) @ face.frame[:3, :3]
    return distances(subject.model.surfaces[face.surface].net, local)


def _spread(points: Array, off: Array) -> Spread:
    if not len(points):
        return Spread()
    worst = int(np.nanargmax(off)) if not np.isnan(off).all() else 0
    x, y, z = points[worst].tolist()
    return Spread(float(off[worst]), float(np.nanmean(off)), float(np.nanpercentile(off, 95)), (x, y, z))


def _lines(model: Model) -> dict[int, tuple[list[int], Array]]:
    """The boundary of each face: its edges, closing ones left out, and the points on them."""
    edges: dict[int, list[int]] = defaultdict(list)
    for edge in model.edges:
        if len(edge.points) and not edge.closing:
            for side in edge.sides:
                edges[side.face].append(edge.index)
    nothing = np.empty((0, 3))
    return {
        face.index: (edges[face.index], np.concatenate([nothing, *(model.edges[e].points for e in edges[face.index])]))
        for face in model.faces
    }


def _outline(
    ref: Subject, new: Subject, old: tuple[list[int], Array], fresh: tuple[list[int], Array], floor: float
) -> Spread:
    """How far two boundaries lie from each other."""
    from scipy.spatial import cKDTree

    (old_edges, a), (new_edges, b) = old, fresh
    if not len(a) or not len(b):
        return Spread() if len(a) == len(b) else Spread(float("inf"))
    near = [cKDTree(b).query(a)[0], cKDTree(a).query(b)[0]]
    if max(near[0].max(), near[1].max()) > floor:
        near = [new.gauge.edge_distances(new_edges, a), ref.gauge.edge_distances(old_edges, b)]
    return _spread(np.concatenate([a, b]), np.concatenate(near))


# Seams, counts, sizes --------------------------------------------------------------------------------------------


def _seams(ref: Model, new: Model, partners: Mapping[int, int], limits: Limits) -> Layer:
    before, after = seams(ref), seams(new)
    old = _by_faces(before, partners)
    fresh = _by_faces(after, {j: j for j in partners.values()})
    findings = []
    growth = {"gap": 0.0, "angle": 0.0}
    for faces, found in fresh.items():
        known = old.get(faces, [])
        names = " and ".join(f"#{face + 1}" for face in faces)
        if len(known) != len(found):
            findings.append(Finding(f"{len(found)} seams between {names}, were {len(known)}", "seam-count", faces))
            continue
        for what, limit, unit in (("gap", limits.gap_growth, " mm"), ("angle", limits.angle_growth, "°")):
            worst, was = (max(np.nan_to_num(getattr(m, what)) for m in each) for each in (found, known))
            growth[what] = max(growth[what], worst - was)
            if limit is not None and worst - was > limit:
                text = f"{what} between {names} is {worst:.4g}{unit}, was {was:.4g}{unit}"
                findings.append(Finding(text, f"{what}-growth", faces, where=found[0].where))
    findings += [
        Finding("no seam any more between " + " and ".join(f"#{face + 1}" for face in faces), "seam-count", faces)
        for faces in old.keys() - fresh.keys()
    ]
    was, now = summary(before), summary(after)
    text = f"{now.seams} (were {was.seams}), gap ≤ {now.gap:.3g} mm (was {was.gap:.3g} mm)"
    text += f", smooth within {now.angle:.2g}° (was {was.angle:.2g}°)"
    return _layer("seams", text, findings, {"before": was, "after": now, "growth": growth})


def _by_faces(measures: list[SeamMeasure], names: Mapping[int, int]) -> dict[tuple[int, ...], list[SeamMeasure]]:
    """Seams by the faces that they join, faces by their name in the new document; those of unmatched faces left out."""
    found: dict[tuple[int, ...], list[SeamMeasure]] = defaultdict(list)
    for measure in measures:
        if all(face in names for face in measure.faces):
            found[tuple(sorted(names[face] for face in measure.faces))].append(measure)
    return found


def _topology(ref: Validity, new: Validity, old_edges: int, new_edges: int) -> Layer:
    names = ("solids", "shells", "faces", "open_shells", "free_edges")
    counts = {name: (getattr(ref, name), getattr(new, name)) for name in names} | {"edges": (old_edges, new_edges)}
    findings = [
        Finding(f"{now} {name.replace('_', ' ')}, were {was}", name.replace("_", "-"))
        for name, (was, now) in counts.items()
        if was != now
    ]
    text = ", ".join(f"{now} {name.replace('_', ' ')}" for name, (_, now) in counts.items())
    return _layer("topology", text, findings, {name: {"ref": a, "new": b} for name, (a, b) in counts.items()})


def _validity(ref: Validity, new: Validity) -> Layer:
    known = Counter(failure.status for failure in ref.failures)
    fresh = Counter(failure.status for failure in new.failures)
    findings = [
        Finding(str(failure), failure.status, () if failure.face is None else (failure.face,))
        for failure in new.failures
        if fresh[failure.status] > known[failure.status]
    ]
    text = f"valid: {'yes' if new.valid else 'no'} (was {'yes' if ref.valid else 'no'})"
    return _layer("validity", text, findings, {"ref": ref.valid, "new": new.valid})


def _size(ref: Mass, new: Mass, limits: Limits) -> Layer:
    change = abs(new.volume - ref.volume) / abs(ref.volume) if ref.volume else float(new.volume != 0)
    shift = float(np.linalg.norm(np.subtract(new.centre, ref.centre)))
    text = f"volume {new.volume:.6g} mm³ ({_percent(new.volume, ref.volume)}), "
    text += f"area {new.area:.6g} mm² ({_percent(new.area, ref.area)}), centre moved by {shift:.3g} mm"
    findings = []
    if limits.volume_change is not None and change > limits.volume_change:
        findings.append(Finding(f"volume {new.volume:.9g} mm³, was {ref.volume:.9g} mm³", "volume-change"))
    return _layer("size", text, findings, {"ref": ref, "new": new, "volume_change": change, "centre_shift": shift})


def _percent(new: float, ref: float) -> str:
    return f"{100 * (new - ref) / ref:+.2g} %" if ref and abs(new - ref) > 1e-9 * abs(ref) else "unchanged"


def _units(ref: str, new: str) -> Layer:
    return Layer("units", "pass", new if ref == new else f"{new}, was {ref}", figures={"ref": ref, "new": new})


# Attributes ------------------------------------------------------------------------------------------------------


def _assembly(ref: Subject, new: Subject) -> Layer:
    before = {(p.path, p.product, k): p.frame for p, k in _numbered(ref.contents)}
    after = {(p.path, p.product, k): p.frame for p, k in _numbered(new.contents)}
    findings = _differences("assembly", (_spelled(x) for x in before), (_spelled(x) for x in after))
    slack = EQUAL * max(ref.model.diagonal, 1.0)
    for place in before.keys() & after.keys():
        shift = np.abs(np.subtract(before[place], after[place])).max()
        if shift > slack:
            findings.append(Finding(f"{_spelled(place)} stands elsewhere", "placement"))
    usages = ref.contents.usages, new.contents.usages
    if usages[0] != usages[1]:
        findings.append(Finding(f"{usages[1]} usages, were {usages[0]}", "usages"))
    text = f"{len(new.contents.products)} products, {usages[1]} usages, {len(new.contents.tree)} placed"
    return _layer("assembly", text, sorted(findings, key=lambda f: f.text), {"ref": usages[0], "new": usages[1]})


def _numbered(contents: Contents) -> Iterator[tuple[Placed, int]]:
    """Everything placed, and how many of the same path and product came before it."""
    seen: Counter = Counter()
    for placed in contents.tree:
        yield placed, seen[placed.path, placed.product]
        seen[placed.path, placed.product] += 1


def _spelled(place: tuple) -> str:
    path, product, _ = place
    return "/".join(name or "(no name)" for name in path) + (f" ({product})" if product != path[-1] else "")


def _names(ref: Subject, new: Subject, partners: Mapping[int, int]) -> Layer:
    findings = _differences("product", ref.contents.products, new.contents.products)
    for i, j in partners.items():
        a, b = ref.model.faces[i], new.model.faces[j]
        if a.name != b.name:
            text = f"{_pair(i, j)} is named '{b.name}', was '{a.name}'"
            findings.append(Finding(text, "face-name", (j,)))
    named = sum(bool(face.name) for face in new.model.faces)
    text = f"{len(new.contents.products)} products, {named} named faces"
    return _layer("names", text, findings, {"products": list(new.contents.products)})


def _colours(ref: Subject, new: Subject, partners: Mapping[int, int]) -> Layer:
    layer = _marks("colours", ref.contents.colours, new.contents.colours, partners)
    findings = list(layer.findings)
    for i, j in partners.items():
        a, b = ref.model.faces[i].colour, new.model.faces[j].colour
        if a != b:
            text = f"{_pair(i, j)} is {b or 'without colour'}, was {a or 'without colour'}"
            findings.append(Finding(text, "face-colour", (j,)))
    return _layer("colours", layer.text, findings, {})


def _marks(name: str, ref: Iterable[tuple], new: Iterable[tuple], partners: Mapping[int, int]) -> Layer:
    """Attributes of products, instances and faces; a face is known by its number in the new document."""

    def place(word: object) -> object:
        head, _, number = str(word).rpartition(" #")
        if not head or not number.isdigit():
            return word
        face = int(number) - 1
        return f"{head} #{partners[face] + 1}" if face in partners else f"{word} before"

    old = [" ".join(str(place(word)) for word in mark) for mark in ref]
    fresh = [" ".join(map(str, mark)) for mark in new]
    return _layer(name, f"{len(fresh)}", _differences(name, old, fresh), {})


def _annotations(ref: Mapping[str, int], new: Mapping[str, int]) -> Layer:
    findings = [Finding(f"{new[kind]} {kind}, were {count}", kind) for kind, count in ref.items() if new[kind] != count]
    text = ", ".join(f"{count} {kind}" for kind, count in new.items())
    return _layer("annotations", text, findings, {"ref": dict(ref), "new": dict(new)})


def _differences(rule: str, ref: Iterable[str], new: Iterable[str]) -> list[Finding]:
    """What only one of two lists has."""
    old, fresh = Counter(ref), Counter(new)
    found = [Finding(f"lost: {item}", rule) for item in sorted((old - fresh).elements())]
    return found + [Finding(f"new: {item}", rule) for item in sorted((fresh - old).elements())]


def _layer(name: str, text: str, findings: list[Finding], figures: Mapping[str, object]) -> Layer:
    return Layer(name, "fail" if findings else "pass", text, tuple(findings), figures)
