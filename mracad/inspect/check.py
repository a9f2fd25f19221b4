"""Layers of a check that need no kernel."""

from __future__ import annotations

from collections import defaultdict, deque
from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from mracad.inspect.crossing import unpaired
from mracad.inspect.seams import SMOOTH, SeamMeasure
from mracad.inspect.verdict import Finding, Layer
from mracad.model.brep import Model
from mracad.model.facts import Triangles, Validity

Array = np.ndarray


def turned(uses: Iterable[tuple[int, int, bool]]) -> set[int]:
    """Faces whose orientation is opposite to that of most of their neighbours.

    Parameters
    ----------
    uses : iterable of (edge, face, forward)
        Every use of an edge by a face.  Two faces have the same orientation if they use it in opposite directions.
    """
    by_edge: dict[int, list[tuple[int, bool]]] = defaultdict(list)
    for edge, face, forward in uses:
        by_edge[edge].append((face, forward))
    links: dict[int, list[tuple[int, bool]]] = defaultdict(list)
    for pair in by_edge.values():
        if len(pair) == 2 and pair[0][0] != pair[1][0]:
            (a, along_a), (b, along_b) = pair
            links[a].append((b, along_a == along_b))
            links[b].append((a, along_a == along_b))
    wrong: set[int] = set()
    side: dict[int, bool] = {}
    for start in links:
        if start in side:
            continue
        side[start] = False
        group, queue = [start], deque([start])
        while queue:
            face = queue.popleft()
            for other, against in links[face]:
                if other not in side:
                    side[other] = side[face] ^ against
                    group.append(other)
                    queue.append(other)
        back = [face for face in group if side[face]]
        wrong.update(back if 2 * len(back) <= len(group) else [face for face in group if not side[face]])
    return wrong


def brep(validity: Validity, inward: Iterable[int] = ()) -> Layer:
    """The kernel's own check, and faces that are flipped against their surface in the file (the kernel corrects
    them)."""
    findings = tuple(
        Finding(failure.status, () if failure.face is None else (failure.face,), figures={"kind": failure.kind})
        for failure in validity.failures
    )
    findings += tuple(Finding("same-sense", (face,)) for face in sorted(inward))
    text = f"{len(findings)} failures" if findings else "nothing wrong"
    return Layer("brep", "fail" if findings else "pass", text, findings)


def shells(model: Model, validity: Validity, inverted: Iterable[int]) -> Layer:
    """Whether every shell is closed, and all faces point outward."""
    free = [edge for edge in model.edges if edge.free]
    findings = [Finding("free-edge", (e.sides[0].face,), e.index, _at(e.points)) for e in free]
    findings += [Finding("flipped-face", (face,)) for face in sorted(inverted)]
    text = f"{validity.solids} solids, {validity.shells} shells, {validity.open_shells} open, {len(free)} free edges"
    figures = {
        "solids": validity.solids, "shells": validity.shells, "faces": validity.faces,
        "open_shells": validity.open_shells, "free_edges": len(free),
    }  # fmt: skip
    return Layer("shells", "fail" if findings or validity.open_shells else "pass", text, tuple(findings), figures)


def _at(points: Array) -> tuple[float, float, float]:
    x, y, z = points[len(points) // 2].tolist()
    return x, y, z


@dataclass(frozen=True)
class Smoothness:
    """The number of smooth seams, and the angle of the next one.

    Attributes
    ----------
    seams, smooth : int
    next : float or None
        Smallest angle of the others, degrees; None if all are smooth.
    """

    seams: int
    smooth: int
    next: float | None


@dataclass(frozen=True)
class SeamLimits:
    """What seams must keep; None for no limit.

    Attributes
    ----------
    kink : float
        A seam with a smaller angle should be smooth, degrees.
    gap, angle : float or None
        Largest gap, mm; largest angle of seams that should be smooth, degrees.
    expected : int or None
        Number of seams that should be smooth.
    freeform : bool
        Whether only seams of NURBS faces are counted for that.
    """

    kink: float = SMOOTH
    gap: float | None = None
    angle: float | None = None
    expected: int | None = None
    freeform: bool = False


def seams(model: Model, measures: list[SeamMeasure], limits: SeamLimits) -> Layer:
    """Gaps and angles along the seams, those that are not sewn, and how many are smooth."""
    findings = []
    for m in measures:
        edge = m.edge if m.sewn else None
        if not m.sewn:
            findings.append(Finding("unsewn", m.faces, edge, m.where, {"gap": m.gap}))
        if limits.gap is not None and m.gap > limits.gap:
            findings.append(Finding("gap", m.faces, edge, m.where, {"gap": m.gap}))
        if limits.angle is not None and limits.angle < m.angle < limits.kink:
            findings.append(Finding("angle", m.faces, edge, m.where, {"angle": m.angle}))
    findings += _missing(model, measures, limits)
    smooth = [m for m in measures if m.angle < limits.kink]
    bent = [m.angle for m in measures if m.angle >= limits.kink]
    count = Smoothness(len(measures), len(smooth), min(bent, default=None))
    text = f"{count.smooth} smooth of {count.seams} seams of all faces"
    text += f"; the next at {count.next:.2g}°" if count.next is not None else ""
    angle, gap = max((m.angle for m in smooth), default=0.0), max((m.gap for m in measures), default=0.0)
    unsewn = sum(not m.sewn for m in measures)
    text += f"; angle ≤ {angle:.2g}°, gap ≤ {gap:.3g} mm" + (f", {unsewn} not sewn" if unsewn else "")
    figures = {"smooth": count.smooth, "seams": count.seams, "next": count.next, "each": measures}
    return Layer("seams", "fail" if findings else "pass", text, tuple(findings), figures)


def _missing(model: Model, measures: list[SeamMeasure], limits: SeamLimits) -> list[Finding]:
    """Findings if fewer seams are smooth than expected, with the nearest ones."""
    if limits.expected is None:
        return []
    nurbs = {face.index for face in model.faces if face.surface is not None}
    counted = [m for m in measures if not limits.freeform or nurbs.intersection(m.faces)]
    smooth = sum(m.angle < limits.kink for m in counted)
    if smooth >= limits.expected:
        return []
    bent = sorted((m for m in counted if m.angle >= limits.kink), key=lambda m: m.angle)
    found = [Finding("smooth-seams", figures={"now": smooth, "expected": limits.expected})]
    return found + [
        Finding("not-smooth", m.faces, m.edge if m.sewn else None, m.where, {"angle": m.angle})
        for m in bent[: limits.expected - smooth]
    ]


def tolerances(model: Model, validity: Validity, limit: float | None) -> Layer:
    """The largest tolerances, and the edges beyond a limit."""
    over = [edge for edge in model.edges if limit is not None and edge.tolerance > limit]
    findings = [
        Finding("edge-tolerance", tuple(side.face for side in e.sides), e.index, figures={"tolerance": e.tolerance})
        for e in over
    ]
    if limit is not None and validity.vertex_tolerance > limit:
        findings.append(Finding("vertex-tolerance", figures={"tolerance": validity.vertex_tolerance}))
    text = f"edges {validity.edge_tolerance:.3g} mm, vertices {validity.vertex_tolerance:.3g} mm"
    figures = {"edge": validity.edge_tolerance, "vertex": validity.vertex_tolerance, "limit": limit}
    return Layer("tolerances", "fail" if findings else "pass", text, tuple(findings), figures)


def mesh(found: Triangles, open_faces: set[int]) -> Layer:
    """Whether the mesh of closed bodies is watertight."""
    findings = [Finding("no-mesh", (face,)) for face in found.missing]
    open_sides = np.sort(unpaired(found.sides), axis=1)
    beside = np.flatnonzero(np.isin(found.sides, open_sides).all(axis=1))
    lookup: dict[tuple[int, int], set[int]] = defaultdict(set)
    for (a, b), face in zip(
        np.sort(found.sides[beside], axis=1).tolist(), found.faces[beside // 3].tolist(), strict=True
    ):
        lookup[a, b].add(face)
    holes: dict[tuple[int, ...], tuple[float, float, float]] = {}
    for a, b in open_sides.tolist():
        owners = lookup[a, b]
        if not owners <= open_faces:
            x, y, z = found.points[[a, b]].mean(axis=0).tolist()
            holes.setdefault(tuple(sorted(owners)), (x, y, z))
    findings += [Finding("hole", owners, where=where) for owners, where in sorted(holes.items())]
    return Layer("mesh", "fail" if findings else "pass", f"{len(found.corners)} triangles", tuple(findings))
