"""Offsets: faces moved along their outward normals by a length, with the seams between them.

The wish is δ = d n at the Greville points; free edges and poles move along, and it fades beside what is held.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np

from mracad.bspline.fit import Knots, divided, middles, missing, offsets_over, spans, through
from mracad.bspline.surface import Net, pairs
from mracad.edit.result import Edit, Reason
from mracad.edit.target import Sheet, Wish, stiffness
from mracad.edit.tolerances import RESHAPED
from mracad.edit.whole import edited
from mracad.inspect.roughness import Growth
from mracad.model.brep import Face, Model
from mracad.model.cells import quadrature
from mracad.seam.interface import Joints
from mracad.seam.ladders import Creases
from mracad.seam.solve import Problem
from mracad.seam.space import MOST_POINTS
from mracad.spec.quantity import length
from mracad.spec.select import Scope
from mracad.spec.select import scope as scope_of
from mracad.spec.steps.smooth import OffsetFaces

Array = np.ndarray

MISSED, LEAST = 1e-4, 0.25
"""Shares of the distance: the allowed error of splines, and the shortest spans into which they are divided."""

REACHED = 0.5
"""Share of the distance that must be reached somewhere: nearer to what is held on all sides, faces are left."""

RIM = 64
"""Points of each edge at which faces are asked how tightly they bend, besides those of quadrature."""

POLE = 1e-8
"""Square of the area element, over the largest, below which a point is a pole, which tells no curvature."""

FADE = 8.0
"""Number of distances within which an offset fades beside what is held: it tilts faces by at most 13° there."""


@dataclass(frozen=True)
class Outward(Wish):
    """The wish of an offset.

    Attributes
    ----------
    distance : float
        Distance along outward normals, mm.
    refine : bool
        Whether knots may be inserted where splines through d n need them.
    """

    distance: float
    refine: bool = True
    spread: ClassVar[float] = math.inf
    fairs: ClassVar[bool] = False
    whole: ClassVar[bool] = True
    growth: ClassVar[Growth] = RESHAPED

    def wavelength(self, net: Net, faces: Sequence[Face], creases: Creases) -> float:
        """The width within which it fades, mm."""
        return FADE * abs(self.distance)

    def space(self, net: Net, faces: Sequence[Face]) -> Net:
        """The surface with spans divided until splines can hold d n."""

        def more(knots: Knots) -> Sequence[Array]:
            uv, fine = middles(*knots), net.over(*knots)
            delta = offsets_over(net, knots, through(fine, self._offsets(fine)))
            sites = [(uv, spans(kv, uv[:, axis])) for axis, kv in enumerate(knots)]
            size = abs(self.distance)
            extra = missing(net, delta, sites, lambda at: self._moved(net, at), MISSED * size, (LEAST * size,) * 2)
            points = math.prod(kv.count + len(each) for kv, each in zip(knots, extra, strict=True))
            return extra if points <= MOST_POINTS else ()

        return net.over(*divided((net.u, net.v), more)) if self.refine else net

    def target(self, problem: Problem, sheets: Mapping[int, Sheet], joined: Joints) -> Array:
        """d n, ``(points, 3)``."""
        found = []
        for i, space in problem.spaces.items():
            sign = -1.0 if sheets[i].faces[0].reversed else 1.0
            found.append(sign * through(space.net, self._offsets(space.net)).reshape(-1, 3))
        return np.concatenate(found)

    def _offsets(self, net: Net) -> Array:
        """d n at the Greville points, ``(nu, nv, 3)``; 0 where there is no normal."""
        return self._moved(net, pairs(net.u.greville(), net.v.greville())).reshape(net.poles.shape)

    def _moved(self, net: Net, uv: Array) -> Array:
        return np.asarray(self.distance * np.nan_to_num(net.normals(uv)))

    def ways(self, problem: Problem, target: Array, width: float) -> Iterable[Iterable[Array]]:
        """The nearest displacement that seams allow; it fades beside what is held."""
        if problem.rimmed:
            share = problem.fading(width)
            if share.max() < REACHED:
                return
            target = share * target
        yield [problem.nearest(target, stiff, beyond=True) for stiff in (0.0, stiffness(width / 8))]


def offset(
    model: Model,
    options: OffsetFaces,
    *,
    scope: Scope | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> Edit:
    """Move the NURBS faces of a model along their normals; parameters and errors as for
    :func:`mracad.edit.whole.edited`."""
    assert options.distance is not None
    distance = length(options.distance, model.diagonal, "distance")
    wish = Outward(-distance if options.inward else distance, options.refine == "auto")
    scope = scope or scope_of(model, options)
    tight = {i: _tightest(model, model.faces[i], wish.distance) for i in scope.movable(model)}
    folded = {i: radius for i, radius in tight.items() if radius <= distance}
    edit = edited(model, options, wish, replace(scope, faces=scope.faces - folded.keys()), progress)
    outcomes = list(edit.outcomes)
    said = f"bends with radii down to {min(folded.values(), default=0.0):.3g} mm"
    for i in folded:
        outcomes[i] = replace(outcomes[i], status="left", reason=Reason.FOLDED, said=said)
    return replace(edit, outcomes=tuple(outcomes))


def _tightest(model: Model, face: Face, distance: float) -> float:
    """The least radius with which a face bends towards the side to which it is offset, mm: an offset by more folds.

    S + d n has the area element (1 − d κ₁) (1 − d κ₂) |S_u × S_v|.
    """
    assert face.surface is not None
    net = model.surfaces[face.surface].net
    rule = quadrature(net, [face])
    rims = [trim.curve.evaluate(np.linspace(*trim.curve.knots.domain, RIM))[0] for trim in face.trims]
    uv = np.concatenate([pairs(rule.u.ravel(), rule.v.ravel())[rule.mask.ravel()], *rims])
    _, su, sv, suu, suv, svv = net.evaluate(uv, 2)
    e, f, g = ((a * b).sum(axis=1) for a, b in ((su, su), (su, sv), (sv, sv)))
    area = e * g - f * f
    sound = area > POLE * area.max()
    normals = net.normals(uv) * math.copysign(1.0, -distance if face.reversed else distance)
    ll, mm, nn = ((each * normals).sum(axis=1) for each in (suu, suv, svv))
    mean, total = ((each[sound] / area[sound]) for each in ((e * nn - 2 * f * mm + g * ll) / 2, ll * nn - mm * mm))
    bends = mean + np.sqrt(np.maximum(mean * mean - total, 0.0))
    most = float(np.nanmax(bends, initial=0.0))
    return 1 / most if most > 0.0 else math.inf
