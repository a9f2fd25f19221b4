"""Copies of a feature as offsets of control points: the ideal displacement as far as seams, edges and holes allow it.

Where copies lie over a seam between two faces that move, it moves with them (:mod:`.joined`): exactly
where both sides end there along parameter lines, to a tolerance along trim curves.  A seam that would not hold stays,
and takes its part of the copies.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from mracad.bspline.surface import Net
from mracad.constraint.border import opening
from mracad.constraint.cause import Cause, Still
from mracad.constraint.frozen import separate
from mracad.constraint.seam import Seam
from mracad.constraint.trimmed import TrimmedSeam
from mracad.constraint.wishes import Wishes
from mracad.edit.feature.crossing import Crossing, crossing, reached, refined
from mracad.edit.feature.exact import Shifts, shifted
from mracad.edit.feature.fit import MISSED, Fit
from mracad.edit.feature.ground import Ground
from mracad.edit.feature.ideal import Copies
from mracad.edit.feature.joined import Softness, Wanted, held
from mracad.edit.feature.score import Copy, Outcome, compared, refuse_clipped, refuse_short
from mracad.model.brep import Model
from mracad.model.displacement import Displacement, Offset
from mracad.seam.interface import Joints, joints

Array = np.ndarray

WIDER, STEEPER = 1e-7, math.radians(0.01)
"""An exact seam may end up with so much more of a gap (mm) and of an angle; otherwise it stays."""

GAP, TURNED, BENT = 1e-4, math.radians(0.008), 1e-3
"""A seam along trim curves may end up with so wide a gap (mm), so much more of an angle, and, over the reach of a copy,
so much more of a curvature jump; otherwise it stays."""

TIGHT = 0.3
"""Share of these at which the solver aims."""

HALVINGS, LARGEST = 3, 100_000
"""Most times that the spans under a trimmed seam are halved, and most control points of a net for which they are."""


@dataclass(frozen=True, eq=False)
class Laid:
    """Copies as offsets of control points.

    Attributes
    ----------
    offsets : dict of int to Offset
        By surface, in its own frame.
    copies : tuple of Copy
    frozen : dict of int to Cause
        Edges of the faces under copies that do not move, and why.
    moving, loose : frozenset of int
        Edges that moved with both faces, exactly and to a tolerance.
    """

    offsets: dict[int, Offset]
    copies: tuple[Copy, ...]
    frozen: Mapping[int, Cause] = field(default_factory=dict)
    moving: frozenset[int] = frozenset()
    loose: frozenset[int] = frozenset()


@dataclass(frozen=True, eq=False)
class _Task:
    """Copies that are to be laid.

    Attributes
    ----------
    nets : dict of int to Net
        The surfaces under them with the knots that hold them.
    joints : Joints
        Of the faces under them.
    softness : Softness
    """

    copies: Copies
    fit: Fit
    shifts: Shifts
    removed: Mapping[int, Array]
    nets: dict[int, Net]
    joints: Joints
    softness: Softness

    @property
    def model(self) -> Model:
        return self.copies.ground.model


@dataclass(frozen=True, eq=False)
class _Attempt:
    """What comes of moving some seams: by surface, its net, offsets that obey them, and those of the copies alone."""

    nets: dict[int, Net]
    done: dict[int, Array]
    alone: dict[int, Array]

    def offsets(self, model: Model) -> dict[int, Offset]:
        """What moves."""
        return {i: offset(model.surfaces[i].net, self.nets[i], done) for i, done in self.done.items() if done.any()}


def laid(copies: Copies, wishes: Wishes, coupled: bool, clip: bool, removed: Mapping[int, Array]) -> Laid:
    """Copies as offsets.

    Parameters
    ----------
    copies : Copies
    wishes : Wishes
    coupled : bool
        Whether edges between faces of the ground may move.
    clip : bool
        Whether what stays may take more than a little of a copy.
    removed : mapping of int to ndarray (nu, nv, 3)
        Offsets over the surfaces' own nets to be added: those that take the source's feature away.

    Raises
    ------
    EditError
        For a copy that points which stay take too much of.
    """
    task = _task(copies, wishes, removed)
    crossings = _crossings(task) if coupled else []
    frozen, halvings = dict(task.joints.frozen), dict.fromkeys((each.seam.edge for each in crossings), 0)
    while True:
        attempt = _attempt(task, crossings, halvings)
        after = Displacement(attempt.offsets(task.model)).applied(task.model)
        failed = [each for each in crossings if not _holds(task, each, after)]
        if not failed:
            break
        for each in failed:
            if _finer(each, attempt.nets, halvings):
                halvings[each.seam.edge] += 1
            else:
                crossings = [other for other in crossings if not other.edges & each.edges]
                why = Still.BROKEN if isinstance(each.seam, Seam) else Still.OPEN
                frozen |= dict.fromkeys(each.edges, Cause(why))
    taken = {i: over(task.model.surfaces[i].net, attempt.nets[i], each) for i, each in removed.items()}
    outcomes = {i: Outcome(attempt.nets[i], d - taken.get(i, 0.0), attempt.alone[i]) for i, d in attempt.done.items()}
    found = compared(copies, outcomes, task.shifts.matched)
    refuse_short(copies, found)
    if not clip:
        refuse_clipped(copies, found)
    moving, loose = (
        frozenset(edge for each in crossings if isinstance(each.seam, kind) for edge in each.edges)
        for kind in (Seam, TrimmedSeam)
    )
    return Laid(attempt.offsets(task.model), tuple(found), frozen, moving - loose, loose)


def _task(copies: Copies, wishes: Wishes, removed: Mapping[int, Array]) -> _Task:
    ground = copies.ground
    shifts = shifted(copies)
    fit = Fit(copies, ~shifts.matched)
    patches = [patch for i, patch in ground.patches.items() if i in removed or copies.on(patch).any()]
    nets = {patch.index: ground.model.surfaces[patch.index].net.over(*fit.knots(patch)) for patch in patches}
    under = {face.index for patch in patches for face in patch.faces}
    joined = _told(ground, under, _sewn(joints(ground.model, under, wishes)))
    reach = float(copies.reach.max())
    tolerances = TIGHT * GAP, TIGHT * TURNED, TIGHT * BENT / reach
    softness = Softness(tolerances, (MISSED * copies.height) ** 2 * reach)
    return _Task(copies, fit, shifts, removed, nets, joined, softness)


def _sewn(joined: Joints) -> Joints:
    """Joints without the trimmed seams between edges that only coincide: which of their points belong together is not
    known to the tolerance of a copy."""
    loose = tuple(seam for seam in joined.loose if seam.edge == seam.twin)
    apart = {edge: Cause(Still.UNSEWN) for seam in joined.loose if seam not in loose for edge in (seam.edge, seam.twin)}
    exact = tuple(seam for seam in joined.exact if seam.edge not in apart)
    return replace(joined, exact=exact, loose=loose, frozen={**joined.frozen, **apart})


def _told(ground: Ground, under: Collection[int], joined: Joints) -> Joints:
    """Joints with what is to be said of edges beyond which a face could move if a copy lay there, too."""
    apart = ground.chosen - set(under)
    bare = Cause(Still.BARE)
    sides = {e: {side.face for side in ground.model.edges[e].sides} for e in joined.frozen}
    return replace(joined, frozen={e: bare if sides[e] & apart else why for e, why in joined.frozen.items()})


def _crossings(task: _Task) -> list[Crossing]:
    """The seams that copies, or what is removed, displace."""
    every: tuple[Seam | TrimmedSeam, ...] = task.joints.exact + task.joints.loose
    found = [seam for seam in every if reached(task.copies, seam, task.removed)]
    moved = {i: np.any(_wanted(task, i, net)[0], axis=2) for i, net in task.nets.items()} if found else {}
    return [crossing(seam, task.nets, moved) for seam in found]


def _wanted(task: _Task, index: int, net: Net) -> tuple[Array, Array]:
    """Offsets over a net of a surface, ``(nu, nv, 3)``: of all that is wanted, and of the copies alone."""
    patch, own = task.copies.ground.patches[index], task.model.surfaces[index].net
    laid = task.removed.get(index, np.zeros(own.poles.shape)) + task.shifts.offsets.get(index, 0.0)
    every = over(own, net, laid)
    alone = every - (over(own, net, task.removed[index]) if index in task.removed else 0.0)
    if task.fit.on(patch).any():
        laid = task.fit.poles(patch, (net.u, net.v)) @ patch.turn
        every, alone = every + laid, alone + laid
    return every, alone


def _attempt(task: _Task, crossings: Sequence[Crossing], halvings: Mapping[int, int]) -> _Attempt:
    """The copies with some seams moved by them."""
    nets = refined(task.nets, crossings, halvings)
    moving = set(task.joints.closing) | {edge for each in crossings for edge in each.edges}
    wanted, alone = {}, {}
    for i, net in nets.items():
        every, alone[i] = _wanted(task, i, net)
        on_it = [task.model.faces[f] for f in task.model.surfaces[i].faces]
        faces = task.copies.ground.patches[i].faces
        free = separate(net, on_it, [face.index for face in faces], task.joints.orders, moving).free
        wanted[i] = Wanted(net, every, free, faces[0])
    return _Attempt(nets, held(wanted, crossings, task.softness), alone)


def _holds(task: _Task, each: Crossing, after: Model) -> bool:
    """Whether a seam is no worse than it may be after an edit."""
    seam = each.seam
    if isinstance(seam, TrimmedSeam):
        bend = BENT / float(task.copies.reach.max())
        return bool(seam.excess(task.model, after, (GAP, 0.0, 0.0), (WIDER, TURNED, bend))[1].max() <= 1.0)
    for stretch in each.stretches:
        part = seam.part(*stretch)
        old, new = (opening(model, part.a, part.b) for model in (task.model, after))
        if new[0] > old[0] + WIDER or (seam.joint.order and new[1] > old[1] + STEEPER):
            return False
    return True


def _finer(each: Crossing, nets: Mapping[int, Net], halvings: Mapping[int, int]) -> bool:
    """Whether the spans under a seam can be halved, and that can be of use."""
    small = all(nets[i].u.count * nets[i].v.count <= LARGEST for i in each.surfaces)
    return small and isinstance(each.seam, TrimmedSeam) and halvings[each.seam.edge] < HALVINGS


def offset(own: Net, fine: Net, poles: Array) -> Offset:
    """Offsets of the control points of a finer net of a surface."""
    degrees = (fine.u.degree, fine.v.degree)
    u, v = (
        kv.beyond(old.elevated(degree))
        for kv, old, degree in zip((fine.u, fine.v), (own.u, own.v), degrees, strict=True)
    )
    return Offset(poles, u, v, degrees)


def over(own: Net, net: Net, offset: Array) -> Array:
    """Offsets over a net's own knots as offsets over finer ones."""
    if net is own:
        return offset
    return Net(own.u, own.v, offset, own.weights).over(net.u, net.v).poles
