"""Smoothing: remove detail finer than a scale, or a number of levels, from NURBS faces.

On one surface with control points f (Euclidean ones; weights are kept):

    target   S f, the L2 projection onto the coarse tensor-product space of the knots that the scale leaves
    result   x, the fairing solve towards S f with the frozen points exact (:mod:`mracad.constraint.fairing`)
    edit     δ = amount · (x − f) on the free points, 0 elsewhere
"""

from __future__ import annotations

import math
from collections.abc import Callable, Collection
from dataclasses import dataclass

import numpy as np

from mracad.bspline.knots import KnotVector
from mracad.bspline.net import Net
from mracad.constraint.crease import crease_lines
from mracad.constraint.fairing import Fairing, border_noise
from mracad.constraint.frozen import REFINED_SHARE, Separation, halvings, reached, separate
from mracad.edit.bound import OVERSHOOT, bounded, deviation
from mracad.edit.group import Moved, Setting
from mracad.edit.result import Edit, FaceOutcome, Status
from mracad.edit.together import Together
from mracad.model import Displacement, Face, Model, Offset, Surface
from mracad.options import Smooth, length
from mracad.select import Scope
from mracad.select import scope as scope_of
from mracad.wavelet.ladder import arc_lengths, finest_scale, ladder_for_scale, rungs_by_level
from mracad.wavelet.project import projection

Array = np.ndarray

DETAIL = 1e-7
"""Least change of a control point, mm, that counts as detail: the kernel's coincidence tolerance."""


def smooth(
    model: Model,
    options: Smooth,
    *,
    scope: Scope | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> Edit:
    """Smooth the NURBS faces of a model.

    Parameters
    ----------
    model : Model
    options : Smooth
    scope : Scope, optional
        Faces to smooth, faces and edges to hold; by default those that the options name.
    progress : callable, optional
        Called with surfaces done and surfaces in all.

    Raises
    ------
    UsageError
        For options that this model does not have or that need the document.
    """
    scope = scope or scope_of(model, options)
    bound = None if options.max_deviation is None else length(options.max_deviation, model.diagonal, "max-deviation")
    scale = None if options.scale is None else length(options.scale, model.diagonal, "scale")
    movable = {i for i in scope.chosen if model.faces[i].surface is not None}
    works = [_SurfaceSmoothing(model, surface, movable, options) for surface in model.surfaces]
    coarser = {work.index for work in works if work.coarser_knots(scale)}
    spans, creases = {w.index: w.spans for w in works}, {w.index: w.creases for w in works}
    together = Together(Setting(model, movable, options, spans, creases, scope.edges), coarser)
    moved = together.smoothed(scale, bound)
    outcomes: dict[int, FaceOutcome] = {}
    offsets: dict[int, Offset] = {}
    for done, work in enumerate(works):
        if progress:
            progress(done, len(works))
        if work.index in moved:
            work.take(moved[work.index])
        else:
            work.solve(scale, bound, together.moving)
        if work.offset is not None:
            offsets[work.index] = work.offset
        for face in work.faces:
            outcomes[face.index] = work.outcome(face, face.index in movable, face.index in scope.held)
    for face in model.faces:
        if face.index not in outcomes:
            outcomes[face.index] = FaceOutcome(face.index, "analytic", f"{face.kind}, not a NURBS face")
    return Edit(Displacement(offsets), tuple(outcomes[i] for i in range(len(model.faces))), edges=together.treatments())


@dataclass(frozen=True, eq=False)
class _Target:
    """The smoothed net S f and what the fairing solve wants to know about it."""

    poles: Array
    along_u: Array
    along_v: Array
    scale: float


class _SurfaceSmoothing:
    """Smoothing of one surface: everything that the outcome of its faces tells."""

    def __init__(self, model: Model, surface: Surface, movable: Collection[int], options: Smooth) -> None:
        self.index, self.net, self.options = surface.index, surface.net, options
        self.faces = [model.faces[i] for i in surface.faces]
        self.edited = [i for i in surface.faces if i in movable]
        self.spans = (arc_lengths(self.net, 0), arc_lengths(self.net, 1))
        self.reach = reached(self.net, self.faces)
        inside = np.logical_or.reduce(list(self.reach.values()))
        self.creases = (crease_lines(self.net, 0, inside), crease_lines(self.net, 1, inside))
        least = [finest_scale(*each) for each in zip(_pair(self.net), self.spans, self.creases, strict=True)]
        self.finest = min(filter(None, least), default=0.0)
        self.fairing, self.inserted, self.coarser, self.entangled = 0.0, 0, False, False
        self.offset: Offset | None = None

    def take(self, moved: Moved) -> None:
        """Let the surface move with its neighbours."""
        self.net, self.separation, self.reach = moved.net, moved.separation, moved.separation.reach
        self.change, self.moved, self.coarser = moved.change, moved.offset, True
        self.inserted = sum(map(len, moved.inserted))
        if np.any(self.moved):
            self.offset = Offset(self.moved, *moved.inserted)

    def solve(self, scale: float | None, bound: float | None, moving: Collection[int]) -> None:
        """Smooth the surface by itself; all its edges stay but the ``moving`` ones, which its own knots keep smooth."""
        net, faces, options = self.net, self.faces, self.options
        self.moving = moving
        self.separation = separate(net, faces, self.edited, options.keep, moving)
        self.change = self.moved = np.zeros(net.poles.shape)
        target = self._target(scale)
        self.coarser = target is not None
        if target is None:
            return
        self.change = target.poles - net.poles
        if not self.edited or not self._detail(self.separation.visible) or options.amount == 0:
            return
        if self._detail(self.separation.free):
            moved = self._solve(net, self.spans, self.separation, target)
            extra_u = extra_v = np.empty(0)
        elif options.refine:
            refined = self._refine(faces, self.edited, target)
            if refined is None:
                return
            moved, extra_u, extra_v = refined
            self.inserted = len(extra_u) + len(extra_v)
        else:
            return
        most = OVERSHOOT * deviation(net, self.change)
        if self.fairing and not self.inserted and deviation(net, moved) > most:
            moved, self.fairing = np.where(self.separation.free[..., None], self.change, 0.0), 0.0
        if deviation(net.refined(extra_u, extra_v), moved) > most:
            self.fairing, self.inserted, self.entangled = 0.0, 0, True
            return
        moved = options.amount * moved
        if bound is not None:
            moved = bounded(moved, bound)
        if np.any(moved):
            self.moved = moved
            self.offset = Offset(moved, extra_u, extra_v)

    def outcome(self, face: Face, edited: bool, held: bool) -> FaceOutcome:
        """What became of one face."""
        reach = self.separation.reach[face.index]
        detail = _largest(self.change, reach)
        free = int((reach & self.separation.free).sum())
        moved = _largest(self.moved, reach) if self.moved.shape == self.net.poles.shape else _largest(self.moved)
        creases = sum(len(c) for c in self.creases)
        status: Status
        if held or not edited:
            status, reason = ("held", "held") if held else ("unselected", "not selected")
        elif self.offset is not None and moved > 0.0:
            status, reason = "edited", ""
        elif not self.coarser:
            status, reason = (
                "unchanged",
                "crease lines only" if creases and not self.finest else "no span finer than the scale",
            )
        elif detail <= DETAIL:
            status, reason = "unchanged", "no detail"
        elif self.options.amount == 0:
            status, reason = "unchanged", "amount 0"
        else:
            status, reason = "stuck", "no free control points" + (" where the detail is" if free else "")
            if self.entangled:
                reason = "its control points cannot move one by one"
        return FaceOutcome(
            face.index,
            status,
            reason,
            detail=detail,
            moved=moved if edited else 0.0,
            free=free,
            points=int(reach.sum()),
            spans=(float(min(s.min() for s in self.spans)), float(max(s.max() for s in self.spans))),
            scale=self.finest,
            creases=creases,
            fairing=self.fairing if status == "edited" else 0.0,
            inserted=self.inserted,
        )

    def _detail(self, points: Array) -> bool:
        return _largest(self.change, points) > DETAIL

    def coarser_knots(self, scale: float | None) -> list[list[KnotVector]]:
        """Ladders in u and v, of one rung where a scale is given; empty where the knots allow no coarser space."""
        ladders = [
            rungs_by_level(k, keep=c, lengths=s) if scale is None else [ladder_for_scale(k, s, scale, keep=c)]
            for k, s, c in zip(_pair(self.net), self.spans, self.creases, strict=True)
        ]
        return [] if all(r[-1] == k for r, k in zip(ladders, _pair(self.net), strict=True)) else ladders

    def _target(self, scale: float | None) -> _Target | None:
        """S f at the scale or level asked for; None where the knots allow no coarser space."""
        ladders = self.coarser_knots(scale)
        if not ladders:
            return None
        if scale is not None:
            return self._projected((ladders[0][0], ladders[1][0]), scale)
        assert self.options.level is not None
        whole, part = int(self.options.level), self.options.level % 1.0
        levels = [self._rung(ladders, whole)] + ([self._rung(ladders, whole + 1)] if part else [])
        weights = [1.0 - part, part][: len(levels)]
        return _Target(
            *(
                sum(w * getattr(t, name) for w, t in zip(weights, levels, strict=True))
                for name in ("poles", "along_u", "along_v", "scale")
            )
        )

    def _rung(self, ladders: list[list[KnotVector]], level: int) -> _Target:
        coarse = tuple(rungs[min(level, len(rungs) - 1)] for rungs in ladders)
        spacing = [s.sum() / max(len(k.breaks) - 1, 1) for s, k in zip(self.spans, coarse, strict=True)]
        changed = [s for s, k, fine in zip(spacing, coarse, _pair(self.net), strict=True) if k != fine]
        return self._projected(coarse, math.sqrt(2) * float(min(changed, default=0.0)))

    def _projected(self, coarse: tuple[KnotVector, ...], scale: float) -> _Target:
        poles = self.net.poles
        in_u = projection(coarse[0], self.net.u).apply(poles, axis=0)
        in_v = projection(coarse[1], self.net.v).apply(poles, axis=1)
        both = projection(coarse[1], self.net.v).apply(in_u, axis=1)
        return _Target(both, poles - in_u, poles - in_v, scale)

    def _solve(self, net: Net, spans: tuple[Array, Array], separation: Separation, target: _Target) -> Array:
        """x − f on the free points of ``net``, which is the surface's own net or a refinement of it."""
        free, f = separation.free, net.poles
        noise = border_noise(target.along_u, target.along_v, separation.visible & separation.frozen, free)
        x = target.poles
        if noise < 1.0:
            try:
                fairing = Fairing(net.u, net.v, spans, target.scale, noise)
            except ValueError:
                pass
            else:
                x, self.fairing = fairing.solve(target.poles, f, free), fairing.length
        return np.where(free[..., None], x - f, 0.0)

    def _refine(self, faces: list[Face], edited: Collection[int], target: _Target) -> tuple[Array, Array, Array] | None:
        """Halve knot spans, the longer ones first, until enough of the visible points are free."""
        best = None
        for net, u_knots, v_knots in halvings(self.net):
            separation = separate(net, faces, edited, self.options.keep, self.moving)
            fine = [
                Net(self.net.u, self.net.v, self.net.poles + part, self.net.weights).refined(u_knots, v_knots).poles
                - net.poles
                for part in (self.change, target.along_u, target.along_v)
            ]
            if _largest(fine[0], separation.free) <= DETAIL:
                continue
            spans = arc_lengths(net, 0), arc_lengths(net, 1)
            best = net, spans, separation, _Target(net.poles + fine[0], fine[1], fine[2], target.scale)
            extra = u_knots, v_knots
            if separation.free.sum() >= REFINED_SHARE * separation.visible.sum():
                break
        if best is None:
            return None
        return self._solve(*best), *extra


def _pair(net: Net) -> tuple[KnotVector, KnotVector]:
    return net.u, net.v


def _largest(change: Array, points: Array | None = None) -> float:
    """Length of the longest vector of ``change`` (nu, nv, 3), mm, among ``points``."""
    vectors = change.reshape(-1, 3) if points is None else change[points]
    return float(np.sqrt((vectors**2).sum(axis=-1).max(initial=0.0)))
