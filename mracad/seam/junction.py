"""T-junctions of unsewn models: free edges that shorter ones cover together, each a seam with a part of it."""

from __future__ import annotations

from collections.abc import Collection, Iterable
from dataclasses import replace

from mracad.model.adjacency import coinciding
from mracad.model.brep import Model
from mracad.seam.cause import Still
from mracad.seam.interface import Joints
from mracad.seam.trimmed import TrimmedSeam, trimmed
from mracad.seam.wishes import Wishes

COVERED = 1e-3
"""Fraction of an edge that may lie between parts that cover it."""


def pieced(model: Model, joined: Joints, movable: Collection[int], wishes: Wishes) -> Joints:
    """The same joints, with the seams between edges of faces that may move and parts of longer ones."""
    if not any(why.still is Still.PART for why in joined.frozen.values()):
        return joined
    groups: dict[int, list[TrimmedSeam]] = {}
    for edge, other, sides in coinciding(model):
        able = other.index in joined.frozen and all(model.faces[side.face].surface is not None for side in sides)
        found = trimmed(model, edge, other, wishes, part=True) if able else None
        if isinstance(found, TrimmedSeam):
            groups.setdefault(other.index, []).append(found)
    loose = [
        seam
        for group in groups.values()
        if len(group) > 1 and _covered(group)
        for seam in group
        if {seam.a.face, seam.b.face} <= set(movable) and wishes.hold.isdisjoint((seam.edge, seam.twin))
    ]
    moving = {edge for seam in loose for edge in (seam.edge, seam.twin)}
    frozen = {edge: why for edge, why in joined.frozen.items() if edge not in moving}
    return replace(joined, loose=(*joined.loose, *loose), frozen=frozen)


def _covered(group: Iterable[TrimmedSeam]) -> bool:
    """Whether parts cover all of an edge."""
    parts = sorted(sorted(seam.b.law[1][[0, -1]].tolist()) for seam in group if seam.b.law)
    ends = [0.0, *(x for part in parts for x in part), 1.0]
    return all(abs(low - high) <= COVERED for low, high in zip(ends[::2], ends[1::2], strict=True))
