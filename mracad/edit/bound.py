"""The largest scale at which smoothing stays within a bound of the deviation.

The deviation grows with the scale.  Filters of the control points of each surface alone, whose modes are known, tell
how fast.  Solving the problem of joined surfaces at one or two scales, without judging it, gives the factor between the
two.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import replace

import numpy as np

from mracad.bspline.surface import Net
from mracad.edit.driver import groups
from mracad.edit.fair import Filter
from mracad.edit.modes import Axis, inside, modes, outside
from mracad.edit.pose import Scene, pose
from mracad.edit.result import Edit
from mracad.edit.target import TREND, sheets, stiffness
from mracad.edit.tolerances import Tolerances
from mracad.edit.trial import heights
from mracad.model.brep import Model
from mracad.seam.interface import joints
from mracad.seam.wishes import Wishes
from mracad.wavelet.project import at_scale

Array = np.ndarray

LOOKS = 2
"""Largest number of scales at which the problem is solved."""

NEAR, AIM = 0.95, 0.98
"""Least share of the bound that a result must reach, and the share that is aimed at."""

CLOSE = 0.97
"""Least share that is near enough before the result is judged."""

POINTS = 8
"""Steps from one Greville point to the next at which deviations are measured."""

STEPS, BEYOND = 8, 4.0
"""Number of scales per octave at which control points are filtered, and the largest deviation over the bound."""


def widest(
    model: Model,
    movable: Collection[int],
    limited: bool,
    wishes: Wishes,
    allowed: Tolerances,
    edit: Callable[[float], Edit],
) -> Edit:
    """The edit at the largest scale at which no face deviates by more than allowed.

    Where the judge scales it back so far that it stays well below the bound, one larger scale is tried.

    Parameters
    ----------
    model : Model
    movable : collection of int
        Faces on NURBS surfaces.
    limited : bool
        Whether wavelengths follow the radii of curvature.
    wishes : Wishes
    allowed : Tolerances
        Its ``deviation`` is the bound, mm.
    edit : callable
        The edit at a scale, mm.
    """
    bound, curve = allowed.deviation, _curve(model, movable, allowed.deviation)
    known: dict[float, float] = {}
    scale = _at(curve, bound, known)
    for _ in range(LOOKS):
        found = known[scale] = _deviation(model, movable, Filter(scale, limited=limited), wishes, allowed)
        if (scale >= model.diagonal or found >= CLOSE * bound) and found <= bound:
            break
        scale = _at(curve, AIM * bound, known)
    first = replace(edit(scale), scale=scale)
    far = known[scale] = reached(model, first)
    larger = _at(curve, AIM * bound, known)
    if far >= NEAR * bound or larger <= scale:
        return first
    other = replace(edit(larger), scale=larger)
    return other if reached(model, other) > far else first


def reached(model: Model, edit: Edit) -> float:
    """The largest deviation along the normal that an edit makes, mm."""
    most = 0.0
    for i, offset in edit.displacement.offsets.items():
        net = offset.over(model.surfaces[i].net)
        most = max(most, float(heights(net, offset.poles, POINTS).max()))
    return most


def _curve(model: Model, movable: Collection[int], bound: float) -> Array:
    """Scales, and the deviations that filtering the control points of each surface alone makes, mm, ``(2, n)``."""
    surfaces = {surface for i in movable if (surface := model.faces[i].surface) is not None}
    nets = [model.surfaces[i].net for i in sorted(surfaces)]
    every = [[modes(net, axis) for axis in (0, 1)] for net in nets]
    scale, found = min((2 * axis.step for axes in every for axis in axes), default=model.diagonal) / 4, [(0.0, 0.0)]
    while scale < model.diagonal and found[-1][1] < BEYOND * bound:
        both = zip(nets, every, strict=True)
        found.append((scale, max([found[-1][1], *(_filtered(net, axes, scale) for net, axes in both)])))
        scale *= 2 ** (1 / STEPS)
    return np.array([*found, (model.diagonal, max(found[-1][1], 1e-300))]).T


def _filtered(net: Net, axes: Sequence[Axis], scale: float) -> float:
    """The largest deviation that filtering control points makes inside a surface, mm."""
    bent = stiffness(scale) * np.add.outer(axes[0].squares, axes[1].squares) ** 2
    above = net.poles - at_scale(net, TREND * scale).poles
    gone = inside(axes, above) * (bent**2 / (1 + bent**2))[..., None]
    return float(heights(net, outside(axes, gone, net.poles.shape))[1:-1, 1:-1].max(initial=0.0))


def _at(curve: Array, deviation: float, known: Mapping[float, float]) -> float:
    """The scale at which a curve reaches a deviation, or its last scale; ``known`` deviations by scale correct it."""
    scales, deviations = curve
    if known:
        places = sorted(known)
        shares = [known[scale] / max(np.interp(scale, scales, deviations), 1e-300) for scale in places]
        deviations = np.maximum.accumulate(deviations * np.interp(scales, places, shares))
    if deviations[-1] < deviation:
        return float(scales[-1])
    k = int(np.searchsorted(deviations, deviation))
    share = (deviation - deviations[k - 1]) / max(deviations[k] - deviations[k - 1], 1e-300)
    return float(scales[k - 1] + share * (scales[k] - scales[k - 1]))


def _deviation(model: Model, movable: Collection[int], wish: Filter, wishes: Wishes, allowed: Tolerances) -> float:
    """Largest deviation along the normal that smoothing at a scale would make, mm."""
    every = sheets(model, movable, wish)
    joined = joints(model, {face for each in every.values() for face in each.movable}, wishes)
    scene, most = Scene(model, every, joined, allowed), 0.0
    for group in groups(every, joined):
        members, within = {i: every[i] for i in group}, joined.among(group)
        problem = pose(scene, members, within, wish.scale, max(s.detail for s in members.values())).problem
        if problem.free.any():
            delta = problem.nearest(wish.target(problem, members, within))
            parts = zip(problem.spaces.values(), problem.split(delta).values(), strict=True)
            most = max([most, *(float(heights(space.net, part, POINTS)[space.seen].max()) for space, part in parts)])
    return most
