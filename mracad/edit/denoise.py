"""Denoising: remove noise at a wavelength that the noise itself determines.

The filter is that of smoothing (:mod:`mracad.edit.fair`).  For δ = −D y, with y the control points and σ their noise,
the expected squared distance to the truth is, up to a constant,

    Cp = ‖δ‖² − 2 · 3 σ² tr D

(C. L. Mallows, Some comments on Cp, Technometrics 15, 1973; 0 for no change).  The wavelength with the least Cp is
taken, and none if that is not below 0.  It is first searched in closed form, with the filter of the control points of
each surface along both axes, then near there with the filter itself, on all surfaces that seams join; the trace is
estimated with random ±1 (M. F. Hutchinson, Commun. Stat. Simul. Comput. 18, 1989).
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np

from mracad.bspline.surface import Net
from mracad.edit.fair import ways
from mracad.edit.modes import inside, modes
from mracad.edit.result import Edit, FaceOutcome, Reason
from mracad.edit.target import Sheet, stiffness
from mracad.edit.whole import edited
from mracad.inspect.noise import noise
from mracad.model.brep import Face, Model
from mracad.seam.hold import separate
from mracad.seam.interface import Joints
from mracad.seam.ladders import Creases
from mracad.seam.solve import Problem
from mracad.seam.stretch import EVEN, Stretch
from mracad.spec.quantity import length
from mracad.spec.select import Scope
from mracad.spec.select import scope as scope_of
from mracad.spec.steps.smooth import Denoise

Array = np.ndarray

STEPS = 4
"""Wavelengths that are tried in every octave."""

LONGEST = 0.5
"""Longest wavelength over the size of a surface."""

BESIDE = 2.0**-0.5, 1.0, 2.0**0.5
"""Wavelengths that are tried with the filter itself, over the best for control points alone."""


@dataclass(frozen=True)
class Quiet:
    """The wish of a denoising.

    Attributes
    ----------
    noise : mapping of int to float
        Standard deviation of each coordinate of control points, mm, by surface; 0 where there is none.
    """

    noise: Mapping[int, float]
    spread: ClassVar[float] = 1.0
    fairs: ClassVar[bool] = True
    limited: ClassVar[bool] = False

    def wavelength(self, net: Net, faces: Sequence[Face], creases: Creases) -> float:
        """The wavelength with the least Cp for a surface alone, mm."""
        axes = [modes(net, axis) for axis in (0, 1)]
        power = (inside(axes, net.poles) ** 2).sum(axis=2)
        bent = np.add.outer(axes[0].squares, axes[1].squares) ** 2
        shortest, longest = min(a.step for a in axes), LONGEST * max(a.step * len(a.squares) for a in axes)
        count = 1 + int(STEPS * max(np.log2(longest / (2 * shortest)), 0.0))
        every = 2 * shortest * 2.0 ** (np.arange(count) / STEPS)
        size = 6 * self.noise[_surface(faces)] ** 2
        taken = [(stiffness(w) * bent) ** 2 / (1 + (stiffness(w) * bent) ** 2) for w in every.tolist()]
        return float(every[np.argmin([float((power * d**2).sum() - size * d.sum()) for d in taken])])

    def stretch(self, faces: Sequence[Face]) -> Stretch:
        """The same in every direction."""
        return EVEN

    def space(self, net: Net) -> Net:
        """The surface over its own knots."""
        return net

    def target(self, problem: Problem, sheets: Mapping[int, Sheet], joined: Joints) -> Array:
        """What the filter with the least Cp would do if no rim were held, ``(points, 3)``; 0 if no Cp is below 0."""
        sizes = [np.full((space.free.size, 1), self.noise[i]) for i, space in problem.spaces.items()]
        noise = np.concatenate(sizes)
        if not noise.any():
            return np.zeros_like(problem.f)
        width = max(sheet.wavelength for sheet in sheets.values())
        every = [stiffness(scale * width) for scale in BESIDE]
        best: Array = np.zeros(problem.f.shape)
        least = 0.0
        for stiff in every:
            delta = problem.filtered(stiff, problem.seen)
            cp = _risk(problem, stiff, delta, noise)
            if cp < least:
                best, least = delta, cp
        return best

    def ways(self, problem: Problem, target: Array, width: float) -> Iterable[Iterable[Array]]:
        """As for smoothing; none if there is nothing to do."""
        return ways(problem, target, width) if target.any() else ()


def _risk(problem: Problem, stiff: float, delta: Array, noise: Array) -> float:
    """Cp of a displacement, over σ² (mm, ``(points, 1)``) at each point that has noise."""
    signs = np.random.default_rng(0).choice([-1.0, 1.0], delta.shape) * problem.seen[:, None]
    removed = -signs * problem.filtered(stiff, problem.seen, of=noise * signs)
    noisy = noise[:, 0] > 0
    return float(((delta[noisy] / noise[noisy]) ** 2 - 2 * removed[noisy] / noise[noisy]).sum())


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
    found = {}
    for surface in model.surfaces:
        faces = [model.faces[i] for i in surface.faces if i in chosen.chosen]
        found[surface.index] = stated if stated is not None else _noise(surface.net, faces)
    wish = Quiet({i: options.strength * each for i, each in found.items()})
    edit = edited(model, options, wish, chosen, progress)
    return replace(edit, outcomes=tuple(_said(each, model, found) for each in edit.outcomes))


def _noise(net: Net, faces: Sequence[Face]) -> float:
    """The noise of a surface, mm, from control points inside its faces: those beyond their edges may be anything."""
    if not faces:
        return 0.0
    return noise(net, separate(net, faces, [face.index for face in faces], "g0").free) or 0.0


def _surface(faces: Sequence[Face]) -> int:
    surface = faces[0].surface
    assert surface is not None
    return surface


def _said(outcome: FaceOutcome, model: Model, noises: Mapping[int, float]) -> FaceOutcome:
    """An outcome with the noise of its face; a fair face has none."""
    surface = model.faces[outcome.face].surface
    if surface is None or outcome.status in ("held", "unselected"):
        return outcome
    reason = Reason.CLEAN if outcome.reason is Reason.FAIR else outcome.reason
    return replace(outcome, noise=noises[surface], reason=reason)
