"""The loop of every edit: solve, judge, give something up, solve again.

An edit states its target for surfaces that seams join (a :class:`mracad.edit.target.Wish`); the solver finds the
nearest displacement under the conditions of seams and rims; the judge decides how much of it is allowed.  A surface
that may hardly move is left, and its neighbours are solved again without it: first each surface alone, then together
with those that seams join to it.  If the first few succeed alone and then all together, the others are not tried alone.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from dataclasses import replace

from mracad.edit.alone import Alone
from mracad.edit.attempt import LEAST, NEARER, attempt, through
from mracad.edit.moved import Moved, Result
from mracad.edit.pose import Scene
from mracad.edit.target import Wish
from mracad.edit.tolerances import Tolerances
from mracad.seam.cause import Cause, Still
from mracad.seam.interface import Joints
from mracad.seam.natural import Seam
from mracad.seam.trimmed import TrimmedSeam

ROUNDS = 4
"""Largest number of times that a group is solved."""

FIRST = 2
"""Number of surfaces in a group that succeed alone before all are tried together, ahead of the rest alone."""


def drive(scene: Scene, wish: Wish, progress: Callable[[int, int], None] | None = None) -> Result:
    """Carry out a wish as far as the judge allows; ``progress`` gets the surfaces done and the surfaces in all."""
    tell = progress or (lambda done, total: None)
    result: dict[int, Moved] = {}
    exact: list[Seam] = []
    loose: list[TrimmedSeam] = []
    every = groups(scene.sheets, scene.joints)
    with Alone(scene, wish) as by_itself:
        few = FIRST if scene.tolerances.fairer else 0
        by_itself.expect(i for group in every for i in (group[:few] if len(group) > 1 else group))
        for group in every:
            tell(len(result), len(scene.sheets))
            alone, tried = _alone(scene, wish, group, by_itself)
            result |= alone
            able = [i for i in group if i not in alone or alone[i].amount >= LEAST or alone[i].held_back]
            for members in groups(able, scene.joints.among(able)):
                for part, joined in _together(scene, wish, members, alone, tried):
                    exact += [seam for seam in joined.exact if seam.a.surface != seam.b.surface]
                    loose += joined.loose
                    result |= part
            left = [i for i in group if i not in result]
            by_itself.expect(left)
            result |= {i: by_itself(i) for i in left}
    result = {i: result[i].done() for i in scene.sheets}
    moving = {i for i, moved in result.items() if moved.amount > 0}
    exact += [seam for seam in scene.joints.exact if seam.a.surface == seam.b.surface and seam.a.surface in moving]
    closing = {edge: pair for edge, pair in scene.joints.closing.items() if pair[0].surface in moving}
    sliding = {i for i, moved in result.items() if moved.sliding and moved.amount > 0}
    used = replace(scene.joints.firm(sliding), exact=tuple(exact), loose=tuple(loose), closing=closing)
    return Result(result, replace(used, frozen={**used.frozen, **_dropped(scene.joints, used, result)}))


def _dropped(wanted: Joints, used: Joints, result: Mapping[int, Moved]) -> dict[int, Cause]:
    """Edges that could have moved and did not, and why."""
    dropped: dict[int, Cause] = {}
    every: list[Seam | TrimmedSeam] = [*wanted.exact, *wanted.loose]
    for seam in every:
        if seam.edge not in used.moving:
            both = all(side.surface in result and result[side.surface].amount > 0 for side in (seam.a, seam.b))
            dropped |= dict.fromkeys((seam.edge, seam.twin), Cause(Still.APART if both else Still.STAYS))
    return dropped


def _alone(
    scene: Scene, wish: Wish, group: Sequence[int], by_itself: Alone
) -> tuple[dict[int, Moved], dict[tuple[int, ...], dict[int, Moved]]]:
    """Results for joined surfaces, each edited alone; only for the first few if all succeed together.

    There are none if surfaces need not get fairer: between held neighbours they could hardly move at all.
    """
    if not scene.tolerances.fairer:
        return {}, {}
    alone: dict[int, Moved] = {}
    tried: dict[tuple[int, ...], dict[int, Moved]] = {}
    for i in group:
        if len(alone) == FIRST and through(alone):
            whole = tried[tuple(group)] = attempt(
                scene, wish, group, scene.joints.among(group), _finer(scene, group, alone)
            )
            if through(whole) and not _less(whole, alone):
                break
        if len(alone) == FIRST:
            by_itself.expect(group)
        alone[i] = by_itself(i)
    return alone, tried


def _finer(scene: Scene, group: Iterable[int], alone: Mapping[int, Moved]) -> set[int]:
    """Surfaces for which more control points pay, as far as known.  Surfaces not yet tried are included if that holds
    for any other, or if none was tried."""
    known = {i for i, moved in alone.items() if moved.finer}
    more = scene.refine and (known or not alone)
    return {i for i in group if i in known or (more and i not in alone)}


def _less(together: Mapping[int, Moved], alone: Mapping[int, Moved]) -> bool:
    """Whether surfaces come clearly less near to the target together than alone, as far as that is known.

    Shares are compared, because their target together may differ from their targets alone.
    """
    every = next(iter(together.values()))
    gain, wanted = (sum(getattr(alone[i], name) for i in together if i in alone) for name in ("gain", "wanted"))
    return bool(NEARER * every.gain * wanted < gain * every.wanted)


def _together(
    scene: Scene,
    wish: Wish,
    group: Sequence[int],
    alone: Mapping[int, Moved],
    tried: Mapping[tuple[int, ...], dict[int, Moved]],
) -> Iterable[tuple[dict[int, Moved], Joints]]:
    """Results for joined surfaces, in the parts in which they move together."""
    waiting = [(list(group), ROUNDS)]
    while waiting:
        part, rounds = waiting.pop()
        joined = scene.joints.among(part)
        if len(part) < 2 or not rounds:
            continue
        found = tried.get(tuple(part)) or _joined(scene, wish, part, joined, _finer(scene, part, alone))
        good = [i for i, moved in found.items() if moved.amount >= LEAST]
        if len(good) < len(part):
            waiting += [(each, rounds - 1) for each in groups(good, scene.joints.among(good))]
            continue
        if _less(found, alone):
            continue
        found = _alike(found, scene.tolerances)
        good = [i for i, moved in found.items() if moved.amount]
        if len(good) < len(part):
            waiting += [(each, rounds - 1) for each in groups(good, scene.joints.among(good))]
            continue
        yield found, joined


def _joined(scene: Scene, wish: Wish, part: Sequence[int], joined: Joints, finer: Collection[int]) -> dict[int, Moved]:
    """The best result for joined surfaces; a lean wish gets more control points only where it needs them."""
    if wish.lean and finer:
        plain = attempt(scene, wish, part, joined)
        if through(plain):
            return plain
    return attempt(scene, wish, part, joined, finer)


def _alike(found: Mapping[int, Moved], tolerances: Tolerances) -> dict[int, Moved]:
    """The same amount for all surfaces, each judged closely: less of a displacement may be rougher than more of it.

    If that does not settle, or surfaces gain nothing from it, they stay.
    """
    for _ in range(ROUNDS):
        least = min(moved.amount for moved in found.values())
        if not least or all(moved.amount == least for moved in found.values()):
            return dict(found)
        found = {i: moved.scaled(least).confirmed(tolerances) for i, moved in found.items()}
    return {i: moved.undone() for i, moved in found.items()}


def groups(surfaces: Iterable[int], joined: Joints) -> list[list[int]]:
    """Surfaces that seams join, directly or through others."""
    leader = {i: i for i in surfaces}

    def root(i: int) -> int:
        while leader[i] != i:
            leader[i] = leader[leader[i]]
            i = leader[i]
        return i

    for a, b in joined.pairs():
        if a in leader and b in leader:
            leader[max(root(a), root(b))] = min(root(a), root(b))
    found: dict[int, list[int]] = {}
    for i in leader:
        found.setdefault(root(i), []).append(i)
    return list(found.values())
