"""Seams that can only move to a tolerance: along trim curves, or where the parameters of the two sides have no law.

On such a seam no two spline spaces match.  Its conditions on a displacement δ (:mod:`mracad.seam.contact`) hold at
corresponding points of the two curves in the parameter planes:

    G0   δ_b = δ_a,      G1   D_c δ_b = D_c δ_a,      G2   D_c² δ_b + D_z δ_b = D_c² δ_a,

with D_c the derivative in the direction of the conormal c of the input (the unit vector in the tangent plane of side a,
across the edge), z the direction in which the second derivatives of the input differ only along the normal.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from mracad.bspline.surface import curvature
from mracad.bspline.vectors import across, between
from mracad.model.brep import Edge, Model
from mracad.seam.cause import Cause, Still
from mracad.seam.natural import Seam, runs_back
from mracad.seam.trace import EVENLY, LOOKS, Trace, along, pieces, trace_of
from mracad.seam.wishes import Wishes

Array = np.ndarray

GAUSS = 4
"""Conditions in each piece of a seam between crossings."""

NEWTON, SETTLED = 6, 1e-13
"""Newton steps to find corresponding fractions of two edges, and the change of these after which no more follow."""


@dataclass(frozen=True, eq=False)
class TrimmedSeam:
    """Two traces that meet.

    Attributes
    ----------
    edge, twin : int
        The edge, twice; or the two free edges that coincide in an unsewn model.
    order : {0, 1, 2}
        Cross derivatives that the seam keeps.
    opening : ndarray (3,)
        Largest gap, angle and curvature jump of the input, as :func:`parted` measures them.
    close, fit : bool
        Whether the gap and the angle of the input are to be closed instead of kept.
    since : {0, 1, 2}
        The lowest of the derivatives that are kept to the tolerance; an exact seam keeps those below.
    """

    edge: int
    twin: int
    a: Trace
    b: Trace
    order: int
    opening: Array
    close: bool
    fit: bool
    since: int = 0

    def excess(
        self, before: Model, after: Model, allowed: Sequence[float], more: Sequence[float]
    ) -> tuple[Array, Array]:
        """Opening after an edit over the allowed one, the worst of everything that the seam keeps.

        The worst of the input is allowed; for the gap, that at the same place plus the tolerance.

        Parameters
        ----------
        before, after : Model
        allowed, more : sequence of float
            Gap (mm), angle and curvature jump (1/mm) that are always allowed, and the allowed growth of each.

        Returns
        -------
        share, excess : ndarray (q,)
            Fractions of the edge, and the excess there.
        """
        share = judged(after, (self.a, self.b))
        old, now = (parted(model, self.a, self.b, share) for model in (before, after))
        worst = np.fmax(self.opening, np.fmax.reduce(old, axis=1))  # finer nets have more places
        limit = np.repeat(np.maximum(allowed, worst + more)[:, None], len(share), axis=1)
        limit[0] = np.minimum(limit[0], old[0] + allowed[0] + more[0])
        return share, (now / limit)[: self.order + 1].max(axis=0)


def trimmed(model: Model, edge: Edge, twin: Edge, wishes: Wishes, part: bool = False) -> TrimmedSeam | Cause:
    """The seam of an edge between two NURBS faces along their trim curves, or why it cannot move.

    Parameters
    ----------
    model : Model
    edge, twin : Edge
        The edge, twice; or the two free edges that coincide in an unsewn model.
    wishes : Wishes
    part : bool
        Whether it coincides with only a part of its twin.
    """
    faces = [model.faces[i] for i in (edge.sides[0].face, twin.sides[-1].face)]
    if not np.allclose(faces[0].frame, faces[1].frame, rtol=0, atol=1e-12):
        return Cause(Still.PLACED)
    if faces[0] is faces[1]:
        return Cause(Still.ITSELF)
    a, b = (trace_of(model, face, face.trim(each.index)) for face, each in zip(faces, (edge, twin), strict=True))
    if edge is not twin:
        fractions = (
            _nearest(model, a, b, _first(model, a, b))
            if part
            else _followed(model, a, b, runs_back(edge.points, twin.points))
        )
        if (np.diff(fractions) * (fractions[-1] - fractions[0]) <= 0).any():
            return Cause(Still.UNEVEN)
        b = replace(b, law=(EVENLY, fractions))
    return _judged(model, edge.index, twin.index, (a, b), wishes)


def _first(model: Model, a: Trace, b: Trace) -> Array:
    """The even fractions of b whose points are nearest to those at even fractions of a."""
    from scipy.spatial import cKDTree

    one, two = (np.asarray(model.surfaces[trace.surface].net.evaluate(trace.evenly)) for trace in (a, b))
    return np.asarray(EVENLY[cKDTree(two).query(one)[1]])


def _followed(model: Model, a: Trace, b: Trace, back: bool) -> Array:
    """Fractions of the curve of b nearest to points at even fractions of a; its ends correspond to those of a."""
    fractions = _nearest(model, a, b, EVENLY[::-1] if back else EVENLY)
    ends = [1.0, 0.0] if back else [0.0, 1.0]
    return np.concatenate([ends[:1], fractions[1:-1], ends[1:]])


def _nearest(model: Model, a: Trace, b: Trace, fractions: Array) -> Array:
    """Fractions of the curve of b nearest to points at even fractions of a, by Newton steps from given ones."""
    points = model.surfaces[a.surface].net.evaluate(a.evenly)
    net = model.surfaces[b.surface].net
    for _ in range(NEWTON):
        s, su, sv = net.evaluate(b.places(fractions), 1)
        way = b.way(fractions)
        along = su * way[:, :1] + sv * way[:, 1:]
        step = ((points - s) * along).sum(axis=1) / np.maximum((along**2).sum(axis=1), 1e-300)
        last, fractions = fractions, np.clip(fractions + step, 0.0, 1.0)
        if np.abs(fractions - last).max() <= SETTLED:
            break
    return np.asarray(fractions)


def followed(model: Model, seam: TrimmedSeam) -> TrimmedSeam:
    """The seam with its nearest points as corresponding ones, instead of those at equal fractions of both curves.

    Where these lie apart along the seam, a displacement that tilts it, equal at both, would open it.
    """
    if seam.since or seam.edge != seam.twin:
        return seam
    fractions = _nearest(model, seam.a, seam.b, EVENLY)
    return replace(seam, b=replace(seam.b, law=(EVENLY, fractions))) if (np.diff(fractions) >= 0).all() else seam


def beside(model: Model, seam: Seam, wishes: Wishes, wholly: bool = False) -> TrimmedSeam | Cause:
    """The seam that keeps, to the tolerance, the continuity that the joint of an exact seam does not keep, or all."""
    found = _judged(model, seam.edge, seam.twin, (along(seam.a), along(seam.b)), wishes)
    if wholly or isinstance(found, Cause) or not seam.joint.order:
        return found
    return replace(found, since=seam.joint.order + 1)


def _judged(model: Model, edge: int, twin: int, traces: tuple[Trace, Trace], wishes: Wishes) -> TrimmedSeam | Cause:
    apart, angles, bends = _opened(model, traces, judged(model, traces))
    opening = np.array([apart.max(), angles.max(), np.abs(bends[0] - bends[1]).max()])
    angle = opening[1]
    if not np.isfinite(angle):
        return Cause(Still.DEGENERATE)
    order = wishes.order(angles, *bends)
    if order == 2 and not np.isfinite(opening[2]):
        return Cause(Still.FLAT)
    close, fit = wishes.close_gaps, order > 0 and bool(angle <= wishes.fit)
    return TrimmedSeam(edge, twin, *traces, order, opening, close, fit)


def judged(model: Model, traces: tuple[Trace, Trace]) -> Array:
    """Fractions of an edge at which a seam is judged: those of the report, and the Gauss points of all spans."""
    nets = {trace.surface: model.surfaces[trace.surface].net for trace in traces}
    return np.sort(np.concatenate([LOOKS, pieces(traces, nets, GAUSS)[0]]))


def parted(model: Model, a: Trace, b: Trace, share: Array) -> Array:
    """Gap (mm, without its part along the seam), angle between outward normals, curvature jump (1/mm): ``(3, q)``."""
    apart, angles, bends = _opened(model, (a, b), share)
    return np.stack([apart, angles, np.abs(bends[0] - bends[1])])


def _opened(model: Model, traces: tuple[Trace, Trace], share: Array) -> tuple[Array, Array, list[Array]]:
    """Gap (mm) and angle between outward normals at fractions of a seam, and the curvatures of both sides across it."""
    points, normals, bends = [], [], []
    for trace in traces:
        face, net = model.faces[trace.face], model.surfaces[trace.surface].net
        s, *derivatives = (face.turned(x) for x in trace.on(net, share, 2))
        way = trace.way(share)
        along = derivatives[0] * way[:, :1] + derivatives[1] * way[:, 1:]
        points.append(s + face.frame[:3, 3])
        normals.append(face.outward * np.cross(derivatives[0], derivatives[1]))
        bends.append(face.outward * curvature(tuple(derivatives), np.cross(normals[-1], along)))
    apart = across(points[0] - points[1], along)
    angle = between(*normals)
    angle[np.minimum(*(np.linalg.norm(n, axis=1) for n in normals)) == 0.0] = np.nan
    return np.linalg.norm(apart, axis=1), angle, bends
