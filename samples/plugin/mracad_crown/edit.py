"""The edit: δ = 16 h u (1 - u) v (1 - v) n, with u and v from 0 to 1 over each surface, and n its outward normal."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from mracad.bspline.fit import through
from mracad.bspline.surface import Net, pairs
from mracad.edit.result import Edit
from mracad.edit.target import Sheet, Wish
from mracad.edit.tolerances import RESHAPED
from mracad.edit.whole import edited
from mracad.inspect.roughness import Growth
from mracad.model.brep import Face, Model
from mracad.seam.interface import Joints
from mracad.seam.ladders import Creases
from mracad.seam.solve import Problem
from mracad.spec.quantity import length
from mracad.spec.select import Scope
from mracad_crown.options import Crown


@dataclass(frozen=True)
class Crowned(Wish):
    """What the edit wants; held edges, seams and the judgement are mracad's."""

    height: float
    spread: ClassVar[float] = math.inf
    fairs: ClassVar[bool] = False
    whole: ClassVar[bool] = True
    growth: ClassVar[Growth] = RESHAPED

    def wavelength(self, net: Net, faces: Sequence[Face], creases: Creases) -> float:
        return 8 * self.height

    def target(self, problem: Problem, sheets: Mapping[int, Sheet], joined: Joints) -> np.ndarray:
        found = [self.raised(space.net, sheets[i].faces[0].reversed) for i, space in problem.spaces.items()]
        return np.concatenate(found)

    def raised(self, net: Net, reversed: bool) -> np.ndarray:
        places = pairs(net.u.greville(), net.v.greville())
        low, high = places.min(axis=0), places.max(axis=0)
        u, v = ((places - low) / (high - low)).T
        far = (-1 if reversed else 1) * 16 * self.height * u * (1 - u) * v * (1 - v)
        return through(net, (far[:, None] * net.normals(places)).reshape(net.poles.shape)).reshape(-1, 3)

    def ways(self, problem: Problem, target: np.ndarray, width: float) -> Iterable[Iterable[np.ndarray]]:
        yield [problem.nearest(target, 0.0, beyond=True)]


def crown(
    model: Model,
    options: Crown,
    *,
    scope: Scope | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> Edit:
    """Raise NURBS faces towards their middles."""
    return edited(model, options, Crowned(length(options.height, model.diagonal, "height")), scope, progress)
