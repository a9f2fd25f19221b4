"""Continuity along seams: gap and angle between the two faces that share an edge, measured on the snapshot.

At a sample of the edge let p_a, p_b be the two faces' points, n_a, n_b their outward unit normals and t the edge's
unit tangent.  The gap is |d − (d·t) t| with d = p_a − p_b (a difference along the edge is one of parameterisation,
not a gap); the angle is atan2(|n_a × n_b|, n_a·n_b).
"""

from __future__ import annotations

from collections import defaultdict
from dataclasses import dataclass

import numpy as np

from mracad.constraint.coincide import GAP, coinciding
from mracad.model import Edge, Face, Model, Side

Array = np.ndarray

SMOOTH = 1.0
"""Degrees: a seam whose largest angle is below this counts as smooth in summaries."""

TORN = 0.05
"""Distance, mm, within which two free edges are told to be one that was torn open."""


@dataclass(frozen=True)
class SeamMeasure:
    """Gap and angle along one seam.

    Attributes
    ----------
    edge : int
        Index in ``Model.edges``; of the shorter one for a seam of two coinciding free edges.
    faces : (int, int)
        Indices of the two faces; the same twice for a closing edge.
    gap, mean_gap : float
        Largest and mean distance between the faces, mm.
    angle, mean_angle : float
        Largest and mean angle between the normals, degrees; NaN where a normal is undefined all along.
    where : tuple of float
        Point of the largest angle, mm, in the part's frame.
    sewn : bool
        False where the two faces only coincide (free edges of an unsewn model).
    """

    edge: int
    faces: tuple[int, int]
    gap: float
    mean_gap: float
    angle: float
    mean_angle: float
    where: tuple[float, float, float]
    sewn: bool = True

    @property
    def smooth(self) -> bool:
        return self.angle < SMOOTH


@dataclass(frozen=True)
class SeamSummary:
    """Totals over seams: counts, worst gap of all and worst angle of the smooth ones."""

    seams: int
    smooth: int
    unsewn: int
    gap: float
    angle: float


def seams(model: Model, every: bool = False) -> list[SeamMeasure]:
    """Measure every seam that touches a NURBS face (or just every one), in edge order; coinciding free edges last."""
    pairs = [(edge, *edge.sides) for edge in model.edges if len(edge.sides) == 2 and not edge.degenerate]
    pairs = [pair for pair in pairs if len(pair[0].points) and (every or _nurbs(pair))]
    jets = _evaluate(model, [side for _, *sides in pairs for side in sides])
    found = [_measure(edge, True, (a, b), jets[2 * i], jets[2 * i + 1]) for i, (edge, a, b) in enumerate(pairs)]
    matched = [m for m in coinciding(model, TORN if every else GAP) if every or _nurbs((m[0], m[1], m[2]))]
    jets = _evaluate(model, [side for _, *sides in matched for side in sides])
    return found + [
        _measure(edge, False, (a, b), jets[2 * i], jets[2 * i + 1]) for i, (edge, a, b) in enumerate(matched)
    ]


def summary(measures: list[SeamMeasure], smooth: frozenset[tuple[int, tuple[int, int]]] | None = None) -> SeamSummary:
    """Totals; ``smooth`` names the seams that count as smooth (those of the input, say)."""
    chosen = [m for m in measures if (m.smooth if smooth is None else key(m) in smooth)]
    return SeamSummary(
        seams=len(measures),
        smooth=len(chosen),
        unsewn=sum(not m.sewn for m in measures),
        gap=max((m.gap for m in measures), default=0.0),
        angle=max((m.angle for m in chosen), default=0.0),
    )


def key(measure: SeamMeasure) -> tuple[int, tuple[int, int]]:
    """What identifies a seam before and after an edit."""
    return measure.edge, measure.faces


def _nurbs(pair: tuple[Edge, Side, Side]) -> bool:
    return pair[1].uv is not None or pair[2].uv is not None


def _measure(edge: Edge, sewn: bool, sides: tuple[Side, Side], a: Array, b: Array) -> SeamMeasure:
    """``a`` and ``b``: points and normals ``(2, k, 3)`` of the sides at the edge's samples."""
    apart = a[0] - b[0]
    apart -= (apart * edge.tangents).sum(axis=1, keepdims=True) * edge.tangents
    gaps = np.linalg.norm(apart, axis=1)
    angles = np.degrees(np.arctan2(np.linalg.norm(np.cross(a[1], b[1]), axis=1), (a[1] * b[1]).sum(axis=1)))
    known = ~np.isnan(angles)
    worst = int(np.nanargmax(angles)) if known.any() else 0
    return SeamMeasure(
        edge=edge.index,
        faces=(sides[0].face, sides[1].face),
        gap=float(gaps.max()),
        mean_gap=float(gaps.mean()),
        angle=float(angles[worst]),
        mean_angle=float(angles[known].mean()) if known.any() else float("nan"),
        where=tuple(float(x) for x in edge.points[worst]),  # type: ignore[arg-type]
        sewn=sewn,
    )


def _evaluate(model: Model, sides: list[Side]) -> list[Array]:
    """Points and outward normals ``(2, k, 3)`` of each side; surfaces are evaluated once for all their sides."""
    result: list[Array | None] = [None] * len(sides)
    by_surface: dict[int, list[int]] = defaultdict(list)
    for i, side in enumerate(sides):
        if side.uv is None:
            result[i] = np.stack([side.points, side.normals])  # type: ignore[list-item]
        else:
            by_surface[_surface(model.faces[side.face])].append(i)
    for surface, members in by_surface.items():
        net = model.surfaces[surface].net
        uv = np.concatenate([sides[i].uv for i in members])
        jets = np.stack([net.evaluate(uv), net.normals(uv)])
        ends = np.cumsum([len(sides[i].uv) for i in members])[:-1]  # type: ignore[arg-type]
        for i, jet in zip(members, np.split(jets, ends, axis=1), strict=True):
            face = model.faces[sides[i].face]
            turn = face.frame[:3, :3]
            result[i] = np.stack([jet[0] @ turn.T + face.frame[:3, 3], (-1 if face.reversed else 1) * jet[1] @ turn.T])
    return [jet for jet in result if jet is not None]


def _surface(face: Face) -> int:
    assert face.surface is not None
    return face.surface
