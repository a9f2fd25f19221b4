"""Details put on surfaces: the wish that composing and transfers share.

Where details come from, and to which points they go, is told by a *source* for each surface.  The solver then finds the
nearest admissible displacement, because details on the two sides of a seam differ a little.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import ClassVar, Protocol

import numpy as np

from mracad.bspline.knots import KnotVector
from mracad.bspline.surface import Net
from mracad.edit.carry import Laid, Way
from mracad.edit.result import Edit, Reason
from mracad.edit.target import Sheet, Wish, largest, stiffness
from mracad.edit.tolerances import COARSE, RESTORED
from mracad.edit.whole import edited
from mracad.inspect.roughness import Growth
from mracad.model.brep import Face, Model
from mracad.seam.interface import Joints
from mracad.seam.ladders import Creases
from mracad.seam.solve import Problem
from mracad.spec.select import Scope
from mracad.spec.steps import Fitting

Array = np.ndarray


class Source(Protocol):
    """Where the details of one surface come from."""

    @property
    def wavelength(self) -> float:
        """Approximate length of their longest waves, mm."""
        ...

    def over(self, net: Net) -> Net:
        """The surface over knots that can hold them."""
        ...

    def laid(self, net: Net) -> Laid:
        """The details on the surface, over its knots."""
        ...


@dataclass(frozen=True, eq=False)
class Detailed(Wish):
    """The wish that surfaces get details.

    Attributes
    ----------
    pieces : mapping of int to Source
        Details by surface.
    refine : bool
        Whether knots of the details are inserted where a surface lacks them.
    restores : bool
        Whether all details are put back where they were.
    taper : float, optional
        Width over which details fade out towards what is held, mm; by default they go up to it, and the solver finds
        the nearest displacement.
    laid : dict
        Results so far, by surface and knots.
    """

    pieces: Mapping[int, Source]
    refine: bool = True
    restores: bool = False
    taper: float | None = None
    laid: dict[tuple[int, KnotVector, KnotVector], Laid] = field(default_factory=dict)
    spread: ClassVar[float] = np.inf
    fairs: ClassVar[bool] = False
    lean: ClassVar[bool] = True

    @property
    def whole(self) -> bool:
        """Part of a shape with its details is not one; what fades is not all of it anyway."""
        return self.taper is None

    @property
    def growth(self) -> Growth:
        """Details must not fold a face, unless it was folded before."""
        return RESTORED if self.restores else COARSE

    def wavelength(self, net: Net, faces: Sequence[Face], creases: Creases) -> float:
        """The wavelength of the details, mm."""
        return self._piece(faces).wavelength

    def space(self, net: Net, faces: Sequence[Face]) -> Net:
        """The surface over its knots and those of the details."""
        return self._piece(faces).over(net) if self.refine else net

    def detail(self, alone: Problem, sheet: Sheet) -> float:
        """The largest change in the target; even the smallest details count."""
        found = largest(self, alone, sheet)
        return max(found, 2 * sheet.least) if found else 0.0

    def target(self, problem: Problem, sheets: Mapping[int, Sheet], joined: Joints) -> Array:
        """The details as carried by the surfaces, ``(points, 3)``."""
        return np.concatenate([self._on(i, space.net).offset.reshape(-1, 3) for i, space in problem.spaces.items()])

    def ways(self, problem: Problem, target: Array, width: float) -> Iterable[Iterable[Array]]:
        """The details as they are, if they are put back; else the nearest displacement that seams allow, and smoother
        transitions to what is held."""
        if self.restores:
            yield [target]
            return
        if self.taper is not None:  # a step beside a seam whose sides differ would show
            faded = problem.fading(self.taper) * target if problem.rimmed else target
            yield [problem.nearest(faded, stiffness(width / 4))]
            return
        yield [problem.nearest(target, stiff) for stiff in ((0.0, stiffness(width / 4)) if problem.rimmed else (0.0,))]
        if problem.rimmed:
            yield problem.nearest(target, stiffness(width / 2)), problem.nearest(problem.fading(width) * target)

    def way(self, surface: int, net: Net) -> Way | None:
        """How the details were placed on a surface over the knots of a net."""
        return self._on(surface, net).way

    def _piece(self, faces: Sequence[Face]) -> Source:
        surface = faces[0].surface
        assert surface is not None
        return self.pieces[surface]

    def _on(self, surface: int, net: Net) -> Laid:
        key = surface, net.u, net.v
        if key not in self.laid:
            self.laid[key] = self.pieces[surface].laid(net)
        return self.laid[key]


def detailed(
    model: Model,
    options: Fitting,
    wish: Detailed,
    scope: Scope,
    progress: Callable[[int, int], None] | None,
    bare: Iterable[int],
) -> Edit:
    """Put details on the faces of a model, except on ``bare`` ones, for which there are none; parameters as for
    :func:`mracad.edit.whole.edited`."""
    without = frozenset(bare)
    chosen = replace(scope, faces=scope.faces - without)
    edit = edited(model, options, wish, chosen, progress, restored=wish.restores)
    left = without & scope.chosen
    outcomes = tuple(
        replace(each, status="unchanged", reason=Reason.NO_DETAIL) if each.face in left else each
        for each in edit.outcomes
    )
    return replace(edit, outcomes=outcomes)
