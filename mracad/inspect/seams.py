"""Continuity along seams: gap and angle between the two faces that share an edge, measured on the snapshot.

At a sample of the edge let p_a, p_b be the two faces' points, n_a, n_b their outward unit normals and t the edge's unit
tangent.  The gap is |d − (d·t) t| with d = p_a − p_b (a difference along the edge is one of parameterisation, not a
gap).  The angle is atan2(|n_a × n_b|, n_a·n_b).  With κ_a, κ_b the normal curvatures across the edge, in the direction
n × t, the curvature jump is |κ_a − κ_b|; the relative jump is divided by max(|κ_a|, |κ_b|).
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np

from mracad.brief import line
from mracad.bspline.vectors import between
from mracad.model.adjacency import GAP, TORN, coinciding
from mracad.model.brep import Edge, Model, Side
from mracad.seam.sides import views

Array = np.ndarray
_Pair = tuple[Edge, bool, tuple[Side, Side]]
_Key = tuple[int, tuple[int, int]]

SMOOTH = 1.0
"""A seam whose largest angle is below this counts as smooth in summaries, degrees."""

FLAT = 1e-9
"""Curvature below which a face counts as flat, 1/mm: jumps are not divided by less."""


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
    bend, mean_bend : float
        Largest and mean jump of the normal curvature across the seam, 1/mm; NaN where it is undefined all along.
    relative_bend : float
        Largest jump relative to the larger of the two curvatures there.
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
    bend: float
    mean_bend: float
    relative_bend: float
    where: tuple[float, float, float]
    sewn: bool = True

    __repr__ = line

    @property
    def smooth(self) -> bool:
        return self.angle < SMOOTH


@dataclass(frozen=True)
class SeamSummary:
    """Totals over seams: counts, worst gap (mm) of all, worst angle (degrees) and curvature jump (1/mm) of the smooth
    ones."""

    seams: int
    smooth: int
    unsewn: int
    gap: float
    angle: float
    bend: float


def seams(
    model: Model, every: bool = False, known: Mapping[_Key, SeamMeasure] = MappingProxyType({})
) -> list[SeamMeasure]:
    """Measure all seams of NURBS faces, or with ``every`` all seams, in edge order; coinciding free edges come last.

    Sewn seams whose :func:`key` is in ``known`` are taken from there.
    """
    pairs = _pairs(model, every)
    kept = [known.get((edge.index, (one.face, two.face))) if sewn else None for edge, sewn, (one, two) in pairs]
    fresh = iter(_measured(model, [pair for pair, old in zip(pairs, kept, strict=True) if old is None]))
    return [next(fresh) if old is None else old for old in kept]


def remeasured(old: Model, model: Model, before: list[SeamMeasure], moved: Collection[int]) -> list[SeamMeasure]:
    """The result of :func:`seams` after some surfaces of an ``old`` model ``moved``, given that of ``before``.

    Free edges that coincided then are measured at the same places now.
    """
    pairs = _pairs(model, matched=old)
    touched = [any(model.faces[side.face].surface in moved for side in sides) for _, _, sides in pairs]
    fresh = iter(_measured(model, [pair for pair, new in zip(pairs, touched, strict=True) if new]))
    return [next(fresh) if new else old for old, new in zip(before, touched, strict=True)]


def summary(measures: list[SeamMeasure], smooth: frozenset[tuple[int, tuple[int, int]]] | None = None) -> SeamSummary:
    """Totals over seams; ``smooth`` are the keys of those that count as smooth, by default by their angle."""
    chosen = [m for m in measures if (m.smooth if smooth is None else key(m) in smooth)]
    return SeamSummary(
        seams=len(measures),
        smooth=len(chosen),
        unsewn=sum(not m.sewn for m in measures),
        gap=max((m.gap for m in measures), default=0.0),
        angle=max((m.angle for m in chosen), default=0.0),
        bend=max((m.bend for m in chosen if not np.isnan(m.bend)), default=0.0),
    )


def key(measure: SeamMeasure) -> _Key:
    """The key that identifies a seam before and after an edit."""
    return measure.edge, measure.faces


def _pairs(model: Model, every: bool = False, matched: Model | None = None) -> list[_Pair]:
    """The edges of :func:`seams`, whether they are sewn, and the two faces' views of them; free edges that coincide
    may be those of another state of the model."""
    sewn: list[_Pair] = [
        (e, True, (e.sides[0], e.sides[1])) for e in model.edges if len(e.sides) == 2 and len(e.points)
    ]
    found = coinciding(model if matched is None else matched, TORN if every else GAP)
    unsewn: list[_Pair] = [(e, False, pair) for e, _, pair in found]
    return [pair for pair in sewn + unsewn if every or any(side.uv is not None for side in pair[2])]


def _measured(model: Model, pairs: list[_Pair]) -> list[SeamMeasure]:
    jets = views(model, [(edge, side) for edge, _, sides in pairs for side in sides])
    return [_measure(*pair, *jets[2 * i : 2 * i + 2]) for i, pair in enumerate(pairs)]


def _measure(edge: Edge, sewn: bool, sides: tuple[Side, Side], a: Array, b: Array) -> SeamMeasure:
    """``a`` and ``b``: points, normals and curvatures of the sides at the edge's samples, ``(k, 7)``."""
    apart = a[:, :3] - b[:, :3]
    apart -= (apart * edge.tangents).sum(axis=1, keepdims=True) * edge.tangents
    gaps = np.linalg.norm(apart, axis=1)
    one, two = a[:, 3:6], b[:, 3:6]
    angles = np.degrees(between(one, two))
    jumps = np.abs(a[:, 6] - b[:, 6])
    bent = ~np.isnan(jumps)
    size = np.maximum(np.maximum(np.abs(a[:, 6]), np.abs(b[:, 6])), FLAT)[bent]
    jumps = jumps[bent] if bent.any() else np.array([np.nan])
    known = ~np.isnan(angles)
    worst = int(np.nanargmax(angles)) if known.any() else 0
    return SeamMeasure(
        edge=edge.index,
        faces=(sides[0].face, sides[1].face),
        gap=float(gaps.max()),
        mean_gap=float(gaps.mean()),
        angle=float(angles[worst]),
        mean_angle=float(angles[known].mean()) if known.any() else float("nan"),
        bend=float(jumps.max()),
        mean_bend=float(jumps.mean()),
        relative_bend=float((jumps / size).max()) if bent.any() else float("nan"),
        where=tuple(float(x) for x in edge.points[worst]),  # type: ignore[arg-type]
        sewn=sewn,
    )
