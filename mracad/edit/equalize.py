"""Gains by band of wavelength: waves of NURBS faces made weaker or stronger.

With L_c the low-pass of the solver at a wavelength c (:meth:`mracad.seam.solve.Problem.filtered`; L_0 f = f), bands
from a to b with gains g change a surface by

    δ = Σ (g − 1) (L_a − L_b) f,      gain of L_c:  H_c(Λ) = 1 / (1 + (c/Λ)¹⁶),

so that waves of wavelength Λ get the gain G(Λ) = 1 + Σ (g − 1) (H_a(Λ) − H_b(Λ)): halfway at the ends of a band, g to
1 % of the change from 4/3 times within them, and 1 to 1 % of it from 4/3 times beyond.  Surfaces that seams join are
filtered as one.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from msgspec import structs

from mracad.bspline.fit import through
from mracad.bspline.surface import Net, pairs
from mracad.edit.result import Edit
from mracad.edit.target import TREND, Sheet, Wish, stiffness
from mracad.edit.tolerances import GROWTH, TURNED
from mracad.edit.whole import edited
from mracad.inspect.roughness import Growth
from mracad.model.brep import Face, Model
from mracad.seam.interface import Joints
from mracad.seam.ladders import Creases
from mracad.seam.solve import Problem
from mracad.spec.select import Scope
from mracad.spec.steps.shape import Equalize, bands_apart
from mracad.wavelet.project import at_scale

Array = np.ndarray


@dataclass(frozen=True)
class Gains(Wish):
    """The wish of an equalization.

    Attributes
    ----------
    bands : sequence of (float, float, float)
        Smallest and largest wavelength, mm, and gain, in ascending order; bands do not overlap.
    """

    bands: Sequence[tuple[float, float, float]]
    fairs: ClassVar[bool] = False

    @property
    def smooths(self) -> bool:
        """Whether it weakens shorter waves at least as much as longer ones, and amplifies none."""
        gains = [gain for *_, gain in self.bands]
        ends = [0.0, *(high for _, high, _ in self.bands)]
        joined = all(low == end for (low, *_), end in zip(self.bands, ends, strict=False))
        return joined and gains == sorted(gains) and gains[-1] <= 1.0

    @property
    def growth(self) -> Growth:
        """Unless it smooths, it may make faces rougher, but must not fold them."""
        return GROWTH if self.smooths else TURNED

    def wavelength(self, net: Net, faces: Sequence[Face], creases: Creases) -> float:
        """The longest wavelength of a band."""
        return max(high for _, high, _ in self.bands)

    def target(self, problem: Problem, sheets: Mapping[int, Sheet], joined: Joints) -> Array:
        """Σ (g − 1) (L_a − L_b) f, if no rim were held, ``(points, 3)``."""
        shares: dict[float, float] = {}
        for low, high, gain in self.bands:
            shares[low] = shares.get(low, 0.0) + gain - 1.0
            shares[high] = shares.get(high, 0.0) + 1.0 - gain
        total = np.zeros_like(problem.f)
        for cut, share in shares.items():
            if cut and share:  # L_0 f = f adds nothing to δ, because all shares sum to 0
                above = _above(problem, sheets, TREND * cut)
                total += share * problem.filtered(stiffness(cut), problem.seen, above, order=4)
        return np.asarray(total)

    def ways(self, problem: Problem, target: Array, width: float) -> Iterable[Iterable[Array]]:
        """The displacement nearest to the target, and smoother transitions from it to what is held."""
        if not problem.rimmed:
            yield [target]
            return
        yield [problem.nearest(target, stiff) for stiff in (stiffness(width / 4), stiffness(width / 2))]
        yield [problem.nearest(problem.fading(width) * target)]


def _above(problem: Problem, sheets: Mapping[int, Sheet], scale: float) -> Array:
    """The heights of surfaces above their parts coarser than a scale (mm), as vectors along normals, ``(points, 3)``.

    The part along the surface is only parameterisation, which waves must not change.
    """
    found = []
    for i, space in problem.spaces.items():
        sheet, net, at = sheets[i], space.net, (space.net.u.greville(), space.net.v.greville())
        off = net.poles - at_scale(sheet.net, scale, sheet.creases).over(net.u, net.v).poles
        normals = sheet.metric.normals(pairs(*at)).reshape(off.shape)
        off = np.asarray(net.with_poles(off).grid(*at))
        along = (off * normals).sum(axis=-1, keepdims=True) * normals
        found.append(through(net, np.where(np.isnan(normals), off, along)).reshape(-1, 3))
    return np.concatenate(found)


def equalize(
    model: Model,
    options: Equalize,
    *,
    scope: Scope | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> Edit:
    """Weaken or amplify waves of the NURBS faces of a model; parameters and errors as for
    :func:`mracad.edit.whole.edited`."""
    bands = options.gains(model.diagonal)
    bands_apart(bands)
    more = max(options.amount, 1.0)
    wish = Gains([(low, high, 1.0 + more * (gain - 1.0)) for low, high, gain in bands])
    return edited(model, structs.replace(options, amount=min(options.amount, 1.0)), wish, scope, progress)
