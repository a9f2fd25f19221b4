"""Denoising: remove noise at wavelengths that the noise itself determines.

The noise of every surface is measured unless it is stated: as the part that no smooth surface explains
(:mod:`mracad.inspect.noise`), or, for few control points, by likelihood (:mod:`mracad.inspect.evidence`).  Of the
estimates of the surface without noise (:mod:`mracad.edit.estimate`), that with the least risk is the target, if it is
surely better than no change.  The wavelengths of the spline, along u and v, are first searched in closed form, for
each surface alone.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np

from mracad.bspline.surface import Net
from mracad.edit.estimate import Asked, Noisy, best
from mracad.edit.result import Edit, FaceOutcome, Reason
from mracad.edit.search import FIRST, alone
from mracad.edit.target import Sheet, Wish, stiffness
from mracad.edit.tolerances import NOISY
from mracad.edit.whole import edited
from mracad.inspect.evidence import noises
from mracad.inspect.noise import Noise
from mracad.inspect.roughness import Growth
from mracad.model.brep import Face, Model
from mracad.seam.interface import Joints
from mracad.seam.ladders import Creases
from mracad.seam.solve import Problem
from mracad.seam.white import ORDER
from mracad.spec.quantity import length
from mracad.spec.select import Scope
from mracad.spec.select import scope as scope_of
from mracad.spec.steps.smooth import Denoise
from mracad.wavelet.ladder import arc_lengths

Array = np.ndarray

RARE = 3.0
"""Number of standard deviations that noise hardly exceeds."""


@dataclass(frozen=True)
class Quiet(Wish):
    """The wish of a denoising.

    Attributes
    ----------
    noise : mapping of int to Noise
        Noise of the control points by surface; surfaces without noise are left out.
    asked : Asked
    """

    noise: Mapping[int, Noise]
    asked: Asked
    fairs: ClassVar[bool] = True
    growth: ClassVar[Growth] = NOISY

    def wavelength(self, net: Net, faces: Sequence[Face], creases: Creases) -> float:
        """The mean, along u and v, of the wavelengths that the best spline of a surface alone halves, mm."""
        noise = self.noise.get(_surface(faces))
        order, found = noise.order if noise else ORDER, []
        for axis, stiff in enumerate(self._start(net, faces, creases)):
            step = float(arc_lengths(net, axis).sum()) / max(net.poles.shape[axis] - 1, 1)
            found.append(step * max(2 * np.pi * stiff ** (0.5 / order), 2.0))
        return float(np.sqrt(found[0] * found[1]))

    def _start(self, net: Net, faces: Sequence[Face], creases: Creases) -> tuple[float, float]:
        noise = self.noise.get(_surface(faces))
        if noise is None:
            return FIRST, FIRST
        if noise.precision is not None:
            along, across = (noise.size**2 * each for each in noise.precision)
            return along, across
        variance = noise.size**2

        def score(size: float, removed: float) -> float:
            return size - 2 * variance * removed if self.asked.shrink else size / max(removed, 1e-100) ** 2

        return alone(net, noise.over(net), creases, score)

    def detail(self, alone: Problem, sheet: Sheet) -> float:
        """A distance by which noise moves only few control points, mm."""
        noise = self.noise.get(sheet.index)
        return RARE * noise.size if noise else 0.0

    def target(self, problem: Problem, sheets: Mapping[int, Sheet], joined: Joints) -> Array:
        """The estimate with the least risk, ``(points, 3)``; 0 if no change has less."""
        noise = {i: self.noise[i] for i in problem.spaces if i in self.noise}
        if not noise:
            return np.zeros_like(problem.f)
        start = {i: self._start(sheets[i].origin, sheets[i].faces, sheets[i].creases) for i in problem.spaces}
        return best(Noisy(problem, sheets, noise), start, self.asked)

    def ways(self, problem: Problem, target: Array, width: float) -> Iterable[Iterable[Array]]:
        """Meet the target next to what is held, more and more smoothly, or fade out; none without a target."""
        if not target.any():
            return
        if not problem.rimmed:
            yield [target]
            return
        yield [problem.nearest(target, stiff) for stiff in (0.0, stiffness(width / 4), stiffness(width / 2))]
        faded = problem.fading(width) * target
        yield problem.nearest(faded, stiffness(width / 2)), problem.nearest(faded)


def denoise(
    model: Model,
    options: Denoise,
    *,
    scope: Scope | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> Edit:
    """Remove noise from the NURBS faces of a model; parameters and errors as for :func:`mracad.edit.whole.edited`."""
    stated = None if options.noise is None else length(options.noise, model.diagonal, "noise")
    chosen = scope or scope_of(model, options)
    faces = {each.index: [model.faces[i] for i in each.faces if i in chosen.chosen] for each in model.surfaces}
    found = noises({i: (model.surfaces[i].net, every) for i, every in faces.items() if every}, stated)
    counted = {i: replace(each, size=options.strength * each.size) for i, each in found.items() if each}
    wish = Quiet(counted, Asked(options.method == "wiener", options.outliers / 100))
    edit = edited(model, options, wish, chosen, progress)
    return replace(edit, outcomes=tuple(_said(each, model, found) for each in edit.outcomes))


def _surface(faces: Sequence[Face]) -> int:
    surface = faces[0].surface
    assert surface is not None
    return surface


def _said(outcome: FaceOutcome, model: Model, found: Mapping[int, Noise | None]) -> FaceOutcome:
    """An outcome with the noise of its face."""
    surface = model.faces[outcome.face].surface
    if surface is None or outcome.status in ("held", "unselected"):
        return outcome
    noise, reason = found[surface], outcome.reason
    if reason is Reason.FAIR:
        reason = Reason.UNSURE if noise else Reason.CLEAN
    before, after = (each.bending for each in outcome.roughness) if outcome.roughness else (0.0, 0.0)
    taken = 1 - after / before if before else 0.0
    return replace(outcome, noise=noise.size if noise else 0.0, taken=taken, reason=reason)
