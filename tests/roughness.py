"""An evaluator of the tests' own: did an edit make faces rougher, as two STEP files that are read back say?

Usage: python -m tests.roughness BEFORE.step AFTER.step [--scale MM]

Nothing of what the product judges with is used: control points come from the kernel, derivatives from scipy, insides
from the kernel's classifier, and curvature from determinants.  At least four points a span of the later surface are
looked at in either direction, its ends among them; where a figure seems to have grown, four times as many, because sums
over steep curvature have not settled yet.  A figure grew if it is above ``GROWTH`` times what it
was by more than a ripple of 1e-7 mm, a mean span long, makes on a flat face: ½ a² k⁴ A, ⅛ a² k⁶ A, a k².
Spans below ``SHORT`` have no curvature that the digits of a file could tell.

The share of sub-scale detail that was removed, with ``--scale``: D = ∫ ((f − S f)·n)² dA inside the trims, S the least
squares projection onto the splines over the knots that the scale leaves of the earlier net (the ladder is the
product's), n the earlier normal; of a face 1 − D(after) / D(before), kept in [0, 1]; of a file the mean over its faces
weighted by D(before).  Rational faces are projected as points, so that what splines over the coarse knots cannot follow
counts as detail.
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import lru_cache
from pathlib import Path

import numpy as np
from OCP.BRep import BRep_Tool
from OCP.TopAbs import TopAbs_VERTEX
from OCP.TopExp import TopExp_Explorer
from OCP.TopoDS import TopoDS, TopoDS_Face
from scipy.optimize import linear_sum_assignment

from mracad.bspline.crease import crease_lines
from mracad.bspline.knots import KnotVector
from mracad.bspline.surface import Net
from mracad.occ.document import Document
from mracad.occ.settings import quiet
from mracad.occ.step import read_step
from mracad.wavelet.ladder import arc_lengths, ladder_for_scale
from tests.sheet import Looked, Sheet, basis, grid, look

Array = np.ndarray

GROWTH = 1.02
RIPPLE = 1e-7
SHORT = 1e-4, 1e-6
"""Length of a span, mm and as a fraction of the surface, below which curvature is not looked at."""

FOLD = 30.0
MOVED = 1e-7
POINTS, FEWEST = 4, 24
"""Steps a span, and at least along a face."""

AGAIN = 4
"""Factor on both for a second look."""


@dataclass(frozen=True)
class Figures:
    """∫ κ₁² + κ₂² dA, ∫ |∇H|² dA and the largest |κ|."""

    bending: float
    variation: float
    largest: float


@dataclass(frozen=True)
class Face:
    """One face before and after."""

    index: int
    before: Figures
    after: Figures
    floor: Figures
    turn: float
    motion: float
    detail: tuple[float, float]
    grew: tuple[str, ...] = field(init=False)

    def __post_init__(self) -> None:
        grew = [
            name
            for name in ("bending", "variation", "largest")
            if getattr(self.after, name) > GROWTH * getattr(self.before, name) + getattr(self.floor, name)
        ]
        object.__setattr__(self, "grew", (*grew, *(("fold",) if self.turn > FOLD else ())))

    @property
    def moved(self) -> bool:
        return self.motion > MOVED

    @property
    def removed(self) -> float:
        """Share of the detail that is gone."""
        before, after = self.detail
        return 1 - min(after / before, 1.0) if before > 0 else 0.0


@lru_cache(maxsize=2)
def opened(path: Path, changed: int) -> Document:
    """A file as read; ``changed`` is when it was written."""
    with quiet():
        return read_step(path)


def faces(path: Path) -> list[TopoDS_Face]:
    """All faces of a file, as read."""
    return list(opened(path, path.stat().st_mtime_ns).faces)


def matched(before: Sequence[TopoDS_Face], after: Sequence[TopoDS_Face]) -> list[tuple[int, int]]:
    """Pairs of faces of two files: those with the same number, as a rule; always those whose vertices are nearest.

    Boxes of faces would not do: the kernel's grow and shrink with control points where nets are refined.
    """
    one, two = (np.array([_extent(face) for face in each]) for each in (before, after))
    apart = np.abs(one[:, None] - two).max(axis=2)
    apart += 1e-9 * np.ptp(one) * (np.arange(len(one))[:, None] != np.arange(len(two)))
    rows, columns = linear_sum_assignment(apart)
    return list(zip(rows.tolist(), columns.tolist(), strict=True))


def _extent(face: TopoDS_Face) -> list[float]:
    """The box and the mean of its vertices."""
    found, explorer = [], TopExp_Explorer(face, TopAbs_VERTEX)
    while explorer.More():
        point = BRep_Tool.Pnt_s(TopoDS.Vertex_s(explorer.Current()))
        found.append((point.X(), point.Y(), point.Z()))
        explorer.Next()
    places = np.array(found or [(0.0, 0.0, 0.0)])
    return [*places.min(axis=0), *places.max(axis=0), *places.mean(axis=0)]


def compared(before: Path, after: Path, scale: float | None = None) -> list[Face]:
    """All B-spline faces of two files."""
    one, two = faces(before), faces(after)
    found = []
    for i, j in matched(one, two):
        pair = Sheet.of(one[i]), Sheet.of(two[j])
        if pair[0] is not None and pair[1] is not None:
            face = _face(i, pair[0], pair[1], scale)
            found.append(_face(i, pair[0], pair[1], scale, AGAIN) if face.grew else face)
    return found


def _face(index: int, old: Sheet, new: Sheet, scale: float | None, more: int = 1) -> Face:
    (u, wu, du), (v, wv, dv) = (grid(new, more * POINTS, more * FEWEST, axis) for axis in (0, 1))
    on = old.inside(u, v) & new.inside(u, v)
    first, last = look(old, u, v), look(new, u, v)
    sides = np.stack([last.speeds[0] * du[:, None], last.speeds[1] * dv])
    size = float(np.linalg.norm(np.ptp(old.poles, axis=(0, 1))))
    counted = on & (sides.min(axis=0) > max(SHORT[0], SHORT[1] * size))
    weights = wu[:, None] * wv * counted
    regular = (first.normals.any(axis=2) & last.normals.any(axis=2)) & counted
    cosine = (first.normals * last.normals).sum(axis=2)[regular]
    motion = np.linalg.norm(last.points - first.points, axis=2)[on]
    areas = weights * last.density
    area = float(areas.sum())
    k = 2 * np.pi / float((sides * areas).sum(axis=(1, 2)).min() / area) if area else 0.0
    floor = Figures(RIPPLE**2 * k**4 / 2 * area, RIPPLE**2 * k**6 / 8 * area, RIPPLE * k**2)
    turn = float(np.degrees(np.arccos(np.clip(cosine.min(initial=1.0), -1, 1))))
    detail = (0.0, 0.0) if scale is None else _details(old, new, scale)
    return Face(
        index, _figures(first, weights), _figures(last, weights), floor, turn, float(motion.max(initial=0.0)), detail
    )


def _figures(seen: Looked, weights: Array) -> Figures:
    areas = weights * seen.density
    return Figures(
        float((areas * seen.bending).sum()),
        float((areas * seen.variation).sum()),
        float(seen.largest[weights > 0].max(initial=0.0)),
    )


def _details(old: Sheet, new: Sheet, scale: float) -> tuple[float, float]:
    """D of a face, before and after."""
    axes = KnotVector(old.knots[0], old.degrees[0]), KnotVector(old.knots[1], old.degrees[1])
    net = Net(*axes, old.poles, old.weights)
    every = np.ones(old.weights.shape, dtype=bool)
    coarse = [
        ladder_for_scale(kv, arc_lengths(net, axis), scale, keep=crease_lines(net, axis, every))
        for axis, kv in enumerate(axes)
    ]
    if coarse == list(axes):
        return 0.0, 0.0
    (u, wu, _), (v, wv, _) = (grid(new, max(new.degrees[a] + 1, POINTS), 1, a, whole=True) for a in (0, 1))
    q = [
        np.linalg.qr(np.sqrt(w)[:, None] * basis(kv.knots, kv.degree, x))[0]
        for kv, x, w in zip(coarse, (u, v), (wu, wv), strict=True)
    ]
    low, high = old.bounds
    near = [(x >= a) & (x <= b) for x, a, b in zip((u, v), low, high, strict=True)]
    if (low < old.domain[0]).any() or (high > old.domain[1]).any():
        near = [np.ones(len(u), bool), np.ones(len(v), bool)]
    on = np.zeros((len(u), len(v)), dtype=bool)
    on[np.ix_(*near)] = old.inside(u[near[0]], v[near[1]])
    s = old.derivatives(u, v, 1)
    cross = np.cross(s[1, 0], s[0, 1])
    density = np.linalg.norm(cross, axis=2)
    normals = cross / np.maximum(density, 1e-300)[..., None]
    half = np.sqrt(wu)[:, None] * np.sqrt(wv)
    found = []
    for points in (s[0, 0], new.derivatives(u, v, 0)[0, 0]):
        lifted = half[..., None] * (points - points.mean(axis=(0, 1)))
        smooth = np.einsum("ui,vj,ijk->uvk", *q, np.einsum("ui,vj,uvk->ijk", *q, lifted, optimize=True), optimize=True)
        rest = ((lifted - smooth) * normals).sum(axis=2)
        found.append(float((rest**2 * density * on).sum()))
    return found[0], found[1]


def report(changes: Sequence[Face]) -> str:
    """The faces that got worse, and the share of detail removed."""
    lines = [f"{len(changes)} faces, {sum(each.moved for each in changes)} moved"]
    for each in changes:
        if each.grew:
            figures = "  ".join(
                f"{name} {getattr(each.before, name):.4g} → {getattr(each.after, name):.4g}"
                for name in ("bending", "variation", "largest")
            )
            lines.append(f"#{each.index + 1}: {', '.join(each.grew)}: {figures}  turn {each.turn:.3g}°")
    lines.append(f"detail removed {removed(changes):.3f}, on faces that did not get worse {removed(changes, True):.3f}")
    return "\n".join(lines)


def removed(changes: Sequence[Face], fair: bool = False) -> float:
    """Mean share of detail removed, weighted by detail; with ``fair``, nothing on faces that got worse."""
    total = sum(each.detail[0] for each in changes)
    return sum(each.detail[0] * each.removed for each in changes if not (fair and each.grew)) / total if total else 0.0


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("before", type=Path)
    parser.add_argument("after", type=Path)
    parser.add_argument("--scale", type=float, help="mm; without it no detail is measured")
    given = parser.parse_args()
    print(report(compared(given.before, given.after, given.scale)))
