"""Levels: the coarse shape of NURBS faces, without the detail between rungs of their knot ladders, or below a scale.

On one surface, level j is the L2 projection on the splines over the knots left after j rungs, as in the wavelet
transform; for a scale, over those that :func:`mracad.wavelet.ladder.ladder_for_scale` leaves.  A level of patches that
seams join is a level of the surface that they form: with P the refinement from coarse spaces whose ladders the patches
share (:mod:`mracad.seam.ladders`) and L the conditions of their seams, as smooth as these are,

    y = argmin ‖P y − f‖_G   subject to   L (P y − f) = r,      δ = P y − f,

with conditions at as many places as the coarse splines along a seam have functions: exact where the joint has constant
coefficients, and never more than the coarse spaces can meet where they vary.  G is the Gram matrix of the transform on
each surface, by its area.  In y the conditions have weight 1 / ``LOOSE``; the solver, which also handles rims, keeps
them exactly.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np

from mracad.bspline.gram import gram
from mracad.bspline.knots import KnotVector
from mracad.bspline.refine import refinement
from mracad.bspline.surface import Net
from mracad.edit.result import Edit
from mracad.edit.target import Sheet, Wish, stiffness
from mracad.edit.tolerances import CALM, GROWTH
from mracad.edit.whole import edited
from mracad.inspect.roughness import Growth
from mracad.model.brep import Face, Model
from mracad.seam.conditions import rows
from mracad.seam.constrained import Constrained
from mracad.seam.interface import Joints
from mracad.seam.joint import Joint
from mracad.seam.ladders import Creases, ladders
from mracad.seam.natural import Seam
from mracad.seam.solve import Problem
from mracad.spec.quantity import length
from mracad.spec.select import Scope
from mracad.spec.steps import Level
from mracad.wavelet.ladder import arc_lengths
from mracad.wavelet.project import projection

Array = np.ndarray
Coarse = Mapping[int, tuple[KnotVector, KnotVector]]
"""Coarse knots in u and v, by surface."""

LOOSE = 1e-4
"""Relative weight of fitting against the conditions of seams on coarse splines: where joints are imperfect, conditions
contradict each other a little at vertices, and should not be met exactly."""


@dataclass(frozen=True)
class Coarser(Wish):
    """The wish of a level.

    Attributes
    ----------
    level : float
        How many rungs to go down; a fraction blends two of them linearly.
    scale : float, optional
        Instead: a wavelength, mm.
    fairs : bool
        Whether faces must get fairer; otherwise the coarse shape itself is wanted.
    """

    level: float = 0.0
    scale: float | None = None
    fairs: bool = True
    alike: ClassVar[bool] = True
    spread: ClassVar[float] = math.inf  # waves beside what goes are part of a projection

    @property
    def whole(self) -> bool:
        """Part of the way to a coarse shape is not one."""
        return not self.fairs

    @property
    def lean(self) -> bool:
        """A coarse shape needs few control points."""
        return not self.fairs

    @property
    def growth(self) -> Growth:
        """What is held must not make a coarse shape rougher."""
        return GROWTH if self.fairs else CALM

    def wavelength(self, net: Net, faces: Sequence[Face], creases: Creases) -> float:
        """The scale, or √2 spacings of the coarse knots, in the direction that gets coarser where they are closest."""
        if self.scale is not None:
            return self.scale
        own, found = (net.u, net.v), ladders({0: net}, {0: creases}, ())
        lengths = [float(arc_lengths(net, axis).sum()) for axis in (0, 1)]
        total = 0.0
        for weight, level in self._steps():
            coarse = [found[0, axis].coarse((0, axis), level, own[axis]) for axis in (0, 1)]
            spacing = [length / each.spans for length, each in zip(lengths, coarse, strict=True)]
            changed = [s for s, each, knots in zip(spacing, coarse, own, strict=True) if each != knots]
            total += weight * math.sqrt(2) * min(changed or spacing)
        return total

    def target(self, problem: Problem, sheets: Mapping[int, Sheet], joined: Joints) -> Array:
        """The level of the surface that the sheets form, less that surface, ``(points, 3)``."""
        found = ladders(
            {i: sheet.origin for i, sheet in sheets.items()},
            {i: sheet.creases for i, sheet in sheets.items()},
            joined.exact,
            self.scale,
        )
        smooth = [replace(seam, joint=_of_coarse(seam.joint)) for seam in joined.exact]
        total = np.zeros_like(problem.f)
        for weight, level in self._steps():
            if level:
                coarse = {
                    i: (found[i, 0].coarse((i, 0), level, s.net.u), found[i, 1].coarse((i, 1), level, s.net.v))
                    for i, s in problem.spaces.items()
                }
                total += weight * projected(problem, coarse, smooth)
        return np.asarray(total)

    def ways(self, problem: Problem, target: Array, width: float) -> Iterable[Iterable[Array]]:
        """The displacement nearest to the target, and smoother transitions from it to what is held."""
        yield [problem.nearest(target, stiff) for stiff in ((0.0, stiffness(width / 4)) if problem.rimmed else (0.0,))]
        if problem.rimmed:
            smooth = stiffness(width / 2)
            yield problem.nearest(target, smooth), problem.nearest(target, stiffness(width))
            yield [problem.nearest(problem.fading(share * width) * target, smooth) for share in (0.25, 0.5, 1.0)]
            yield [problem.nearest(problem.fading(width) * target)]

    def _steps(self) -> list[tuple[float, int]]:
        """Weights and levels to blend."""
        if self.scale is not None:
            return [(1.0, 1)]
        whole, part = int(self.level), self.level % 1.0
        return [(1.0 - part, whole), (part, whole + 1)] if part else [(1.0, whole)]


def _of_coarse(joint: Joint) -> Joint:
    """The joint of coarse surfaces: as smooth as that of the surfaces themselves, except for second derivatives that
    jump only because parameters run unevenly: coarse splines would have to jump over far longer spans."""
    best = joint.smoother or joint
    return replace(best, order=1, bend=0.0, shear=0.0) if best.order == 2 and (best.bend or best.shear) else best


def projected(problem: Problem, coarse: Coarse, seams: Sequence[Seam]) -> Array:
    """δ to the coarse splines nearest to the surfaces of a problem that seams join, ``(points, 3)``."""
    f, found = problem.split(problem.f), []
    for i, space in problem.spaces.items():
        level = f[i]
        for axis, pair in enumerate(zip(coarse[i], (space.net.u, space.net.v), strict=True)):
            level = projection(*pair).apply(level, axis)
        found.append(level.reshape(-1, 3))
    delta = np.concatenate(found) - problem.f
    return np.asarray(delta + _joined(problem, coarse, seams, delta) if seams else delta)


def _joined(problem: Problem, coarse: Coarse, seams: Sequence[Seam], change: Array) -> Array:
    """The least correction, in the Gram matrix, by coarse splines that meets the conditions of seams, of a
    displacement, both ``(points, 3)``."""
    from scipy.sparse import block_diag, kron

    refinements, grams = [], []
    for i, space in problem.spaces.items():
        net = space.net
        pairs = list(zip(coarse[i], (net.u, net.v), strict=True))
        refinements.append(kron(*(refinement(*pair).tocsr() for pair in pairs)))
        area = math.prod(float(arc_lengths(net, axis).sum()) / fine.period for axis, (_, fine) in enumerate(pairs))
        grams.append(area * kron(*(gram(each).tocsr() for each, _ in pairs)))
    p, form = block_diag(refinements, format="csr"), block_diag(grams, format="csr")
    nets = {i: space.net for i, space in problem.spaces.items()}
    conditions, mended = rows(nets, seams, coarse=coarse)
    lacking = conditions @ change + np.where(mended[:, None], conditions @ problem.f, 0.0)
    solve = Constrained(form, conditions @ p, np.ones(p.shape[1], dtype=bool), LOOSE)
    return np.asarray(p @ solve(np.zeros((p.shape[1], 3)), goal=-lacking, exactly=False))


def level(
    model: Model,
    options: Level,
    *,
    scope: Scope | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> Edit:
    """Bring the NURBS faces of a model to a level; parameters and errors as for :func:`mracad.edit.whole.edited`."""
    if options.level is not None:
        return edited(model, options, Coarser(options.level, fairs=False), scope, progress)
    assert options.scale is not None
    scale = length(options.scale, model.diagonal, "scale")
    return edited(model, options, Coarser(scale=scale, fairs=False), scope, progress)
