"""Copies of a feature as offsets of control points: the ideal displacement, as far as seams, edges and holes allow.

Where copies lie over a seam between two faces that move, it moves with them: exactly if both sides end there along
parameter lines, to a tolerance along trim curves.  A seam that would open or lose its smoothness stays, and cuts off
its part of the copies.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from mracad import note
from mracad.bspline.surface import Net
from mracad.edit.feature.exact import Shifts, shifted
from mracad.edit.feature.fit import MISSED, holding, over_knots
from mracad.edit.feature.ground import Ground
from mracad.edit.feature.ideal import Copies
from mracad.edit.feature.score import Copy, compared, refuse
from mracad.edit.feature.seams import Crossing, Size, Wanted, crossing, held, refined, trace
from mracad.edit.feature.taken import clipped
from mracad.edit.pose import WITHIN
from mracad.model.brep import Model
from mracad.model.displacement import Displacement, Offset, lifted
from mracad.seam.cause import Cause, Still
from mracad.seam.hold import separate
from mracad.seam.interface import Joints, joints
from mracad.seam.junction import pieced
from mracad.seam.natural import Seam
from mracad.seam.trace import Trace, along
from mracad.seam.trimmed import TrimmedSeam, followed, judged, parted
from mracad.seam.wishes import Wishes
from mracad.seam.zones import zoned

Array = np.ndarray

WIDER = 1e-7
"""Allowed growth of the gap of an exact seam, mm; its angle may grow as much as that of others.  Otherwise it stays."""

MOVED = 1e-7
"""A seam moves where a copy displaces it by more than this share of its height."""

HALVINGS, LARGEST = 3, 400_000
"""How often the spans under a seam are halved at most, and the largest net, in control points, for which."""

BETTER = 0.7
"""Share of its last excess below which the curvature of a seam must come so that its spans are halved again."""

_EVENLY = np.linspace(0, 1, 401)


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
    """Copies to be made.

    Attributes
    ----------
    copies : Copies
        All copies that are not exact shifts.
    known, removed : mapping of int to ndarray (nu, nv, 3)
        By surface, offsets over its own net: exact shifts and removed features; and the latter alone.
    nets : dict of int to Net
        The surfaces with the knots that hold the copies.
    poles : dict of int to ndarray (nu, nv, 3)
        Offsets of the copies over these.
    joints : Joints
        Joints of the faces under them.
    size : Size
    """

    copies: Copies
    known: Mapping[int, Array]
    removed: Mapping[int, Array]
    nets: dict[int, Net]
    poles: dict[int, Array]
    joints: Joints
    size: Size

    @property
    def model(self) -> Model:
        return self.copies.ground.model


@dataclass(frozen=True, eq=False)
class _Attempt:
    """The result of moving some seams: by surface, the wanted offsets, those that obey the seams, and what moves."""

    wanted: dict[int, Wanted]
    done: dict[int, Array]
    offsets: dict[int, Offset]


def laid(copies: Copies, wishes: Wishes, coupled: bool, clip: bool, removed: Mapping[int, Array]) -> Laid:
    """Copies as offsets.

    Parameters
    ----------
    copies : Copies
    wishes : Wishes
    coupled : bool
        Whether edges between faces of the ground may move.
    clip : bool
        Whether edges that stay may cut off more than a little of a copy.
    removed : mapping of int to ndarray (nu, nv, 3)
        Offsets over the surfaces' own nets to be added: those that remove the source's feature.

    Raises
    ------
    Unfit
        If control points cannot hold a copy, or held ones cut off too much of it.
    """
    shifts = shifted(copies)
    task = _task(copies, shifts, wishes, removed)
    crossed = _crossings(task, copies) if coupled else []
    if crossed:  # what control points cannot hold is known before seams are fitted, which takes longest
        bare = _attempt(task, ())
        refuse(compared(copies, bare.wanted, bare.done, shifts.matched), clip=True)
    note.doing("fitting seams under copies")
    attempt, moving, given_up = _settled(task, crossed)
    note.doing("comparing copies with the feature")
    found = compared(copies, attempt.wanted, attempt.done, shifts.matched)
    refuse(found, clip)
    exact, loose = (
        frozenset(edge for each in moving if isinstance(each.seam, kind) for edge in each.edges)
        for kind in (Seam, TrimmedSeam)
    )
    frozen = {**task.joints.frozen, **given_up}
    note.doing("measuring what edges take of copies")
    found = clipped(copies, found, attempt.wanted, attempt.done, frozen)
    return Laid(attempt.offsets, tuple(found), frozen, exact - loose, loose)


def _task(copies: Copies, shifts: Shifts, wishes: Wishes, removed: Mapping[int, Array]) -> _Task:
    ground, rest = copies.ground, copies.only(~shifts.matched)
    known, nets, poles = {}, {}, {}
    for i, patch in ground.patches.items():
        if i in removed or copies.on(patch).any():
            own = ground.model.surfaces[i].net
            known[i] = removed.get(i, np.zeros(own.poles.shape)) + shifts.offsets.get(i, 0.0)
            nets[i], poles[i] = own, np.zeros(own.poles.shape)
            if rest.on(patch).any():
                knots, laid = holding(rest, patch)
                nets[i], poles[i] = own.over(*knots), laid @ patch.turn
    under = {face.index for i in nets for face in ground.patches[i].faces}
    bend = copies.feature.curvature * float((np.abs(copies.heights) / copies.sizes**2).min())
    size = Size(MISSED * copies.height, float(copies.reach.max()), bend)
    joined = pieced(ground.model, joints(ground.model, under, wishes), under, wishes)
    joined = replace(joined, loose=tuple(followed(ground.model, seam) for seam in joined.loose))
    return _Task(rest, known, removed, nets, poles, _explained(ground, under, joined), size)


def _explained(ground: Ground, under: Collection[int], joined: Joints) -> Joints:
    """Joints with the cause for edges whose other face could move if a copy lay there too."""
    apart = ground.chosen - set(under)
    bare = Cause(Still.BARE)
    sides = {e: {side.face for side in ground.model.edges[e].sides} for e in joined.frozen}
    return replace(joined, frozen={e: bare if sides[e] & apart else why for e, why in joined.frozen.items()})


def _crossings(task: _Task, copies: Copies) -> list[Crossing]:
    """The seams that copies or removed features displace."""
    every: tuple[Seam | TrimmedSeam, ...] = task.joints.exact + task.joints.loose
    found = [seam for seam in every if any(_reached(copies, trace(x), task.removed) for x in (seam.a, seam.b))]
    moved = {i: np.any(_wanted(task, i, net)[0], axis=2) for i, net in task.nets.items()} if found else {}
    return [crossing(seam, task.nets, moved) for seam in found]


def _reached(copies: Copies, side: Trace, removed: Mapping[int, Array]) -> bool:
    """Whether copies or removed features (offsets by surface over its own net) displace one side of a seam."""
    patch, uv = copies.ground.patches[side.surface], side.places(_EVENLY)
    moved = [copies.at(patch, uv)]
    if side.surface in removed:
        moved.append(np.asarray(Net(*patch.knots, removed[side.surface], patch.net.weights).evaluate(uv)))
    return bool(max(np.linalg.norm(each, axis=1).max() for each in moved) > MOVED * copies.height)


def _wanted(task: _Task, index: int, net: Net) -> tuple[Array, Array]:
    """Offsets over a net of a surface, ``(nu, nv, 3)``: all that are wanted, and those of the copies alone."""
    own, patch, poles = task.model.surfaces[index].net, task.copies.ground.patches[index], task.poles[index]
    every = alone = lifted(own, net, task.known[index])
    if index in task.removed:
        alone = every - lifted(own, net, task.removed[index])
    if (net.u, net.v) != (task.nets[index].u, task.nets[index].v):
        poles = over_knots(task.copies, patch, (net.u, net.v)) @ patch.turn
    return every + poles, alone + poles


def _settled(task: _Task, found: Sequence[Crossing]) -> tuple[_Attempt, Sequence[Crossing], dict[int, Cause]]:
    """The copies with the seams that can move, these seams, and why others do not.

    The spans under a seam that opens are halved a few times, where that helps, before it is given up.  If that would be
    only for its curvature, the seam is not asked to keep it.
    """
    given_up: dict[int, Cause] = {}
    while True:
        attempt = _attempt(task, found)
        after = Displacement(attempt.offsets).applied(task.model)
        every = [(each, _excess(task, each, after)) for each in found]
        failed = [(each, excess) for each, excess in every if excess > 1.0]
        if not failed:
            return attempt, found, given_up
        lost = [(each, excess) for each, excess in failed if not _finer(each, attempt, excess)]
        finer = {each.seam.edge for each, _ in failed} - {each.seam.edge for each, _ in lost}
        dropped = [each for each, _ in lost if each.bent]
        for each, _ in lost:
            if each not in dropped:
                why = Still.BROKEN if isinstance(each.seam, Seam) else Still.OPEN
                given_up |= dict.fromkeys(each.edges, Cause(why))
        found = [
            replace(each, halvings=each.halvings + (each.seam.edge in finer), excess=excess)
            for each, excess in every
            if each not in dropped and each.edges.isdisjoint(given_up)
        ]


def _attempt(task: _Task, found: Sequence[Crossing]) -> _Attempt:
    """The copies with some seams moved by them."""
    moving = set(task.joints.closing) | {edge for each in found for edge in each.edges}
    wanted = {}
    for i, net in refined(task.nets, found).items():
        on_it = [task.model.faces[f] for f in task.model.surfaces[i].faces]
        faces = task.copies.ground.patches[i].faces
        free = separate(net, on_it, [face.index for face in faces], task.joints.orders, moving).free
        free &= ~zoned(net, on_it, task.joints.zones)
        wanted[i] = Wanted(net, *_wanted(task, i, net), free, faces[0])
    done = held(wanted, found, task.size)
    offsets = {i: Offset.of(task.model.surfaces[i].net, wanted[i].net, each) for i, each in done.items() if each.any()}
    return _Attempt(wanted, done, offsets)


def _excess(task: _Task, each: Crossing, after: Model) -> float:
    """The opening of a seam after an edit over the allowed one; it is within its tolerances up to 1."""
    seam = each.seam
    gap, angle, bend = task.size.allowed
    if isinstance(seam, TrimmedSeam):
        more = WIDER, WITHIN * angle, bend
        return float(seam.excess(task.model, after, (gap, 0.0, 0.0), more)[1].max())
    traces = along(seam.a), along(seam.b)
    share = judged(after, traces)
    old, new = (parted(model, *traces, share).max(axis=1) for model in (task.model, after))
    opened, turned = float(new[0] - old[0]) / WIDER, float(new[1] - old[1]) / angle
    return max(opened, turned) if seam.joint.order else opened


def _finer(each: Crossing, attempt: _Attempt, excess: float) -> bool:
    """Whether halving the spans under a seam is possible and can help."""
    nets = (attempt.wanted[i].net for i in each.surfaces)
    small = all(net.u.count * net.v.count <= LARGEST for net in nets)
    able = each.seam.joint.pieces > 0 if isinstance(each.seam, Seam) else not each.bent or excess < BETTER * each.excess
    return small and able and each.halvings < HALVINGS
