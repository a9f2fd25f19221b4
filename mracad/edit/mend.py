"""Mending: close gaps and angles along seams by the smoothest least displacement, before anything else is done.

    δ = argmin ‖δ‖²_M + ℓ⁴ |δ|²_K    subject to    L δ = r,    ℓ = width / 2π

with r the defects of the joints.  It fades within the width.  The edit that follows is judged against the mended
surfaces, because mending was asked for.  Ends of seams on free edges are closed too: free edges give way near there.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from mracad.edit.driver import groups
from mracad.edit.moved import Moved, Result
from mracad.edit.pose import Pose, Scene, pose
from mracad.edit.target import Sheet, stiffness
from mracad.edit.tolerances import Tolerances
from mracad.model.brep import Model
from mracad.model.displacement import lifted
from mracad.seam.interface import Joints
from mracad.seam.trace import along
from mracad.seam.trimmed import TrimmedSeam

Array = np.ndarray

HALVINGS = 4
"""How often spans beside a trim curve are halved at most until its seam holds."""

PAYS = 0.5
"""Share to which halving must bring what a mending leaves open: ends that stay hold seams open with any spans."""

PASSES = 4
"""How often the remainder of a mending is mended again."""

DETAIL = 3.0
"""Size of the displacements along trim curves, over the widest gap there."""


@dataclass(frozen=True, eq=False)
class Mended:
    """The result of mending a model.

    Attributes
    ----------
    model : Model
    moved : mapping of int to Moved
        The surfaces that it moved.
    edges : frozenset of int
        The edges that were mended.
    """

    model: Model
    moved: Mapping[int, Moved] = field(default_factory=dict)
    edges: frozenset[int] = frozenset()

    def before(self, result: Result, sheets: Mapping[int, Sheet]) -> Result:
        """The whole change to a model, mending first; ``sheets`` are those of the original model."""
        moved = dict(result.moved)
        for i, each in self.moved.items():
            moved[i] = _both(each, moved[i], sheets[i]) if i in moved else each
        joined = result.joints
        frozen = {edge: why for edge, why in joined.frozen.items() if edge not in self.edges}
        return replace(result, moved=moved, joints=replace(joined, frozen=frozen), mended=self.edges)


def mended(scene: Scene) -> Mended:
    """Close the gaps and angles that the joints of a scene mark for mending."""
    moved: dict[int, Moved] = {}
    edges: set[int] = set()
    for group in groups(scene.sheets, scene.joints):
        joined = scene.joints.among(group)
        wide, bent = _widest(joined)
        if wide <= scene.tolerances.gap and bent <= scene.tolerances.angle:
            continue
        members = {i: scene.sheets[i] for i in group}
        parts = _moved(members, *_shut(scene, members, _yielding(joined, scene.tolerances), max(wide, bent)))
        turned = max(change.turn for each in parts.values() for change in each.changes.values())
        if turned <= scene.tolerances.growth.fold:
            moved |= parts
            edges |= {edge for seam in joined.mended for edge in (seam.edge, seam.twin)}
    result = Result(moved, scene.joints)
    return Mended(result.displacement().applied(scene.model), moved, frozenset(edges))


def _widest(joined: Joints) -> tuple[float, float]:
    """The largest gap (mm) and the largest angle (radians) that are to be mended."""
    exact = [(s.joint.close * s.gap, s.joint.fit * s.angle) for s in joined.exact]
    loose = [(s.close * s.opening[0], s.fit * s.opening[1]) for s in joined.loose]
    wide, bent = np.max([(0.0, 0.0), *exact, *loose], axis=0)
    return float(wide), float(bent)


def _yielding(joined: Joints, tolerances: Tolerances) -> Joints:
    """The joints; those to be mended keep their position exactly and the rest to the tolerance, and those along trim
    curves that are within it stay as they are.

    Where four patches meet, the slopes of closed gaps constrain the angles, and the other way round.
    """
    exact, loose = [], []
    for each in joined.loose:
        gap, angle = each.close and each.opening[0] > tolerances.gap, each.fit and each.opening[1] > tolerances.angle
        loose.append(replace(each, close=bool(gap), fit=bool(angle)))
    for seam in joined.exact:
        joint = seam.joint
        if joint.order and (joint.close or joint.fit):
            sides, opening = (along(seam.a), along(seam.b)), np.array([seam.gap, seam.angle, 0.0])
            loose.append(TrimmedSeam(seam.edge, seam.twin, *sides, joint.order, opening, False, joint.fit, since=1))
            seam = replace(seam, joint=replace(joint, order=0))
        exact.append(seam)
    return replace(joined, exact=tuple(exact), loose=tuple(loose))


def _shut(scene: Scene, members: Mapping[int, Sheet], joined: Joints, wide: float) -> tuple[Pose, Array]:
    """The problem of surfaces, and the displacement that closes their joints."""
    width = max(sheet.wavelength for sheet in members.values())
    spans: dict[int, float] = {}
    best, least = None, np.inf
    for halving in range(HALVINGS + 1):
        found = pose(scene, members, joined, width, DETAIL * wide, finer=members if scene.refine else (), spans=spans)
        delta = found.problem.nearest(np.zeros_like(found.problem.f), stiffness(width))
        for _ in range(PASSES):  # rows that depend on each other leave something of what they ask
            delta = found.problem.settled(delta, stiffness(width))
        opened, share = found.open(delta)
        if best and share > PAYS * least:
            break
        best, least = (found, delta), share
        if not scene.refine or not opened:
            break
        seams = (joined.loose[k] for k in opened)
        spans |= {edge: width / 2 ** (halving + 3) for seam in seams for edge in (seam.edge, seam.twin)}
    assert best
    return best


def _moved(members: Mapping[int, Sheet], found: Pose, delta: Array) -> dict[int, Moved]:
    result = {}
    for (i, space), part in zip(found.problem.spaces.items(), found.problem.split(delta).values(), strict=True):
        result[i] = Moved.whole(members[i], space.net, part, int(space.free.sum()))
    return result


def _both(first: Moved, then: Moved, sheet: Sheet) -> Moved:
    """One displacement after another."""
    net = sheet.origin.over(then.net.u, then.net.v)
    offset = lifted(first.net, then.net, first.offset) + then.offset
    whole = Moved.whole(sheet, net, offset, then.free, then.amount or 1.0)
    return replace(whole, limits=then.limits, gain=then.gain, wanted=then.wanted, rough=then.rough)
