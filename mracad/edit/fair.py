"""Fairing: remove waves shorter than a scale from NURBS faces that seams join, never making one rougher.

Every face x is the one nearest to the input f that bends like its part coarser than the scale:

    x = argmin ‖x − f‖²_M + ℓ⁸ |x − g|²,   ℓ = scale / 2π

under the conditions of seams and rims (:mod:`mracad.seam.solve`).  |·| is the energy of the filter with gain
1 / (1 + (2πℓ/Λ)⁸), g the face projected on the splines of a few scales, which is shape (or 0 where g does not follow
the face).  Waves of half the scale keep 0.4 %, those of three scales all but 2e-4.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import ClassVar

import numpy as np

from mracad.bspline.jets import jets
from mracad.bspline.surface import Net
from mracad.edit.driver import drive
from mracad.edit.mend import Mended, mended
from mracad.edit.moved import Result
from mracad.edit.pose import Scene
from mracad.edit.target import Sheet, Wish, eased, sheets, stiffness
from mracad.edit.tolerances import GROWTH, Tolerances
from mracad.inspect.curvature import FORMS, Forms, shapes
from mracad.inspect.roughness import Growth
from mracad.model.brep import Face, Model
from mracad.seam.interface import Joints, joints
from mracad.seam.ladders import Creases
from mracad.seam.solve import Problem
from mracad.seam.stretch import EVEN, Stretch
from mracad.seam.wishes import Wishes

Array = np.ndarray

SHARP = 0.2, 0.5
"""Curvatures times ℓ above which less is done, and above which nothing is: there the filter would remove shape."""


@dataclass(frozen=True)
class Filter(Wish):
    """The wish of a smoothing by scale.

    Attributes
    ----------
    scale : float
        mm.
    across : float, optional
        Scale across the lines of the leading parameter, mm.
    leads : mapping of int to int
        Which parameter leads, by surface: 0 for u, 1 for v.
    limited : bool
        Whether wavelengths are reduced where radii of curvature are too small for them.
    """

    scale: float
    across: float | None = None
    leads: Mapping[int, int] = field(default_factory=dict)
    limited: bool = False
    fairs: ClassVar[bool] = True
    alike: ClassVar[bool] = True
    growth: ClassVar[Growth] = GROWTH

    def wavelength(self, net: Net, faces: Sequence[Face], creases: Creases) -> float:
        """The scale of every surface, mm: the larger of the two."""
        return self.scale if self.across is None else max(self.scale, self.across)

    def stretch(self, faces: Sequence[Face]) -> Stretch:
        """Both scales over the larger one."""
        surface = faces[0].surface
        if self.across is None or surface is None:
            return EVEN
        longest, lead = max(self.scale, self.across), self.leads[surface]
        both = self.scale / longest, self.across / longest
        return Stretch((both[lead], both[1 - lead]), lead)

    def target(self, problem: Problem, sheets: Mapping[int, Sheet], joined: Joints) -> Array:
        """The displacement by smoothing if no rim were held, ``(points, 3)``."""
        width = max(sheet.wavelength for sheet in sheets.values())
        return problem.filtered(stiffness(width), problem.seen)

    def ways(self, problem: Problem, target: Array, width: float) -> Iterable[Iterable[Array]]:
        """See :func:`ways`."""
        return ways(problem, target, width)


def ways(problem: Problem, target: Array, width: float) -> Iterable[Iterable[Array]]:
    """Meet the target next to what is held, ever more smoothly; filter with that held; or fade out in a wavelength."""
    if not problem.rimmed:
        yield [target]
        return
    smooth = stiffness(width / 2)
    yield (problem.nearest(target, stiff) for stiff in (0.0, stiffness(width / 4), smooth))
    yield problem.filtered(stiffness(width)), problem.nearest(target, stiffness(width / 8))
    faded = problem.fading(width) * target
    yield problem.nearest(faded, smooth), problem.nearest(faded)
    yield [problem.nearest(calm(problem, target, width) * faded)]


def calm(problem: Problem, target: Array, width: float) -> Array:
    """1 where surfaces have no shape finer than a width (mm), 0 at noses and fillets, smooth between, ``(points, 1)``.

    They are measured after the whole target, so that ripples do not count as shape.
    """
    found = []
    for space, part in zip(problem.spaces.values(), problem.split(target).values(), strict=True):
        net = space.net.with_poles(space.net.poles + part)
        us, vs = (knots.greville()[:, None] for knots in (net.u, net.v))
        jet = jets(net, us, vs, np.ones(net.poles.shape[:2], bool), np.zeros(3))
        bent = Forms(shapes([jet], FORMS)).largest.reshape(len(vs), len(us)).T * width / (2 * np.pi)
        share = np.clip((SHARP[1] - bent) / (SHARP[1] - SHARP[0]), 0.0, 1.0)
        found.append(eased(net, share, (width, width)).ravel())
    return np.concatenate(found)[:, None]


def faired(
    model: Model,
    movable: Collection[int],
    wish: Wish,
    wishes: Wishes,
    tolerances: Tolerances,
    *,
    refine: bool = True,
    progress: Callable[[int, int], None] | None = None,
) -> Result:
    """Fair faces of a model as far as none of them gets rougher.

    Parameters
    ----------
    model : Model
    movable : collection of int
        Faces on NURBS surfaces; those without detail stay.
    wish : Wish
        The target, :class:`Filter` for example.
    wishes : Wishes
        What seams keep.
    tolerances : Tolerances
    refine : bool
        Whether control points may be added beside rims.
    progress : callable, optional
        Called with surfaces done and surfaces in all.
    """
    every = sheets(model, movable, wish)
    width = max((each.wavelength for each in every.values()), default=1.0)
    wishes = replace(wishes, bend=tolerances.jump / width)
    mends = Mended(model)
    if wishes.close_gaps or wishes.fit > 0.0:
        mends = mended(Scene(model, every, joints(model, _faces(every), wishes), tolerances, refine))
    if mends.moved:
        wishes = replace(wishes, fit=0.0, close_gaps=False)
    now = sheets(mends.model, movable, wish) if mends.moved else every
    rough = {i: each for i, each in now.items() if each.detail > each.least}
    joined = joints(mends.model, _faces(rough), wishes)
    result = drive(Scene(mends.model, rough, joined, tolerances, refine), wish, progress)
    return replace(mends.before(result, every), sheets=every)


def _faces(members: Mapping[int, Sheet]) -> set[int]:
    return {face for each in members.values() for face in each.movable}
