"""Layers of a check that need no kernel."""

from __future__ import annotations

from collections import defaultdict, deque
from collections.abc import Iterable
from typing import TYPE_CHECKING

import numpy as np

from mracad.audit.continuity import SeamMeasure
from mracad.audit.crossing import unpaired
from mracad.audit.verdict import Finding, Layer
from mracad.model import Model

if TYPE_CHECKING:
    from mracad.occ.check import Validity
    from mracad.occ.triangles import Triangles

Array = np.ndarray


def turned(uses: Iterable[tuple[int, int, bool]]) -> set[int]:
    """Faces that look the other way than most of their neighbours.

    Parameters
    ----------
    uses : iterable of (edge, face, forward)
        Every use of an edge by a face.  Two faces look the same way when they use their edge in opposite directions.
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
    """The kernel's own check, and faces of the file that look against their surface, which it turned on reading."""
    findings = tuple(
        Finding(str(failure), failure.status, () if failure.face is None else (failure.face,))
        for failure in validity.failures
    )
    findings += tuple(
        Finding(f"the same_sense of #{face + 1} in the file is wrong", "same-sense", (face,)) for face in sorted(inward)
    )
    text = f"{len(findings)} failures" if findings else "nothing wrong"
    return Layer("brep", "fail" if findings else "pass", text, findings)


def shells(model: Model, validity: Validity, inverted: Iterable[int]) -> Layer:
    """Whether every shell is closed, and all faces look outward."""
    free = [edge for edge in model.edges if edge.free]
    findings = [
        Finding(
            f"edge#{e.index + 1} of #{e.sides[0].face + 1} is free",
            "free-edge",
            (e.sides[0].face,),
            e.index,
            _at(e.points),
        )
        for e in free
    ]
    findings += [
        Finding(f"#{face + 1} looks the other way than its neighbours", "flipped-face", (face,))
        for face in sorted(inverted)
    ]
    text = f"{validity.solids} solids, {validity.shells} shells, {validity.open_shells} open, {len(free)} free edges"
    figures = {
        "solids": validity.solids, "shells": validity.shells, "faces": validity.faces,
        "open_shells": validity.open_shells, "free_edges": len(free),
    }  # fmt: skip
    return Layer("shells", "fail" if findings or validity.open_shells else "pass", text, tuple(findings), figures)


def _at(points: Array) -> tuple[float, float, float]:
    x, y, z = points[len(points) // 2].tolist()
    return x, y, z


def seams(measures: list[SeamMeasure], kink: float, max_gap: float | None, max_angle: float | None, text: str) -> Layer:
    """Gaps and angles along the seams, and seams that are not sewn."""
    findings = []
    for m in measures:
        names = f"#{m.faces[0] + 1} and #{m.faces[1] + 1}"
        edge = m.edge if m.sewn else None
        if not m.sewn:
            findings.append(Finding(f"{names} are not sewn, gap {m.gap:.3g} mm", "unsewn", m.faces, edge, m.where))
        if max_gap is not None and m.gap > max_gap:
            findings.append(Finding(f"gap {m.gap:.3g} mm between {names}", "gap", m.faces, edge, m.where))
        if max_angle is not None and max_angle < m.angle < kink:
            findings.append(Finding(f"angle {m.angle:.2g}° between {names}", "angle", m.faces, edge, m.where))
    figures = {"each": measures}
    return Layer("seams", "fail" if findings else "pass", text, tuple(findings), figures)


def tolerances(model: Model, validity: Validity, limit: float | None) -> Layer:
    """The largest tolerances, and the edges beyond a limit."""
    over = [edge for edge in model.edges if limit is not None and edge.tolerance > limit]
    findings = [
        Finding(
            f"edge#{e.index + 1} has a tolerance of {e.tolerance:.3g} mm", "edge-tolerance",
            tuple(side.face for side in e.sides), e.index,
        )
        for e in over
    ]  # fmt: skip
    if limit is not None and validity.vertex_tolerance > limit:
        findings.append(Finding(f"a vertex has a tolerance of {validity.vertex_tolerance:.3g} mm", "vertex-tolerance"))
    text = f"edges {validity.edge_tolerance:.3g} mm, vertices {validity.vertex_tolerance:.3g} mm"
    figures = {"edge": validity.edge_tolerance, "vertex": validity.vertex_tolerance, "limit": limit}
    return Layer("tolerances", "fail" if findings else "pass", text, tuple(findings), figures)


def mesh(found: Triangles, open_faces: set[int]) -> Layer:
    """Whether the mesh of what is closed is watertight."""
    findings = [Finding(f"#{face + 1} cannot be meshed", "no-mesh", (face,)) for face in found.missing]
    sides = unpaired(found.corners)
    faces = np.repeat(found.faces, 3)
    ends = np.sort(
        np.concatenate([found.corners[:, [i, (i + 1) % 3]] for i in range(3)], axis=1).reshape(-1, 2), axis=1
    )
    lookup: dict[tuple[int, int], set[int]] = defaultdict(set)
    for (a, b), face in zip(ends.tolist(), faces.tolist(), strict=True):
        lookup[a, b].add(face)
    holes: dict[tuple[int, ...], tuple[float, float, float]] = {}
    for a, b in np.sort(sides, axis=1).tolist():
        owners = lookup[a, b]
        if not owners <= open_faces:
            x, y, z = found.points[[a, b]].mean(axis=0).tolist()
            holes.setdefault(tuple(sorted(owners)), (x, y, z))
    findings += [
        Finding("hole at " + " ".join(f"#{face + 1}" for face in owners), "hole", owners, where=where)
        for owners, where in sorted(holes.items())
    ]
    return Layer("mesh", "fail" if findings else "pass", f"{len(found.corners)} triangles", tuple(findings))
