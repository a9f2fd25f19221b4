"""The loop of every edit: solve, judge, give something up, solve again.

An edit states its target for surfaces that seams join (a :class:`mracad.edit.target.Wish`); the solver finds the
nearest displacement under the conditions of seams and rims; the judge decides how much of it is allowed.  A surface
that may hardly move is left, and its neighbours are solved again without it: first each surface alone, then together
with those that seams join to it.  If the first few succeed alone and then all together, the others are not tried alone.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from dataclasses import replace

import numpy as np

from mracad.bspline.surface import Net
from mracad.edit.congruent import Congruent
from mracad.edit.moved import Moved, Result, closely
from mracad.edit.pose import Scene, beside_rims
from mracad.edit.target import Sheet, Wish
from mracad.edit.tolerances import Tolerances
from mracad.edit.trial import ENOUGH, WHOLE, Trial, Verdict, rank
from mracad.edit.watch import Tried, Watch
from mracad.seam.cause import Cause, Still
from mracad.seam.interface import Joints
from mracad.seam.natural import Seam
from mracad.seam.trimmed import TrimmedSeam

Array = np.ndarray

ROUNDS = 4
"""Largest number of times that a group is solved."""

LEAST = 0.25
"""A surface with a smaller allowed amount is left, so that the others can do more."""

LASTING = 20_000
"""Largest number of control points of joined surfaces for which close measurements are kept: some kilobytes each."""

FIRST = 2
"""Number of surfaces in a group that succeed alone before all are tried together, ahead of the rest alone."""

PRICE = 0.05
"""Share of the wanted change that doubling the control points of a surface must add to be worth it."""

MOST = 9.0, 2000
"""Largest factor by which the control points of a surface alone are multiplied, beyond a number that is small."""

CANDIDATES = 3
"""Largest number of displacements that are judged closely after a first look."""

BLENDS, NEARER = 2, 1.05
"""How often the best displacements of joined surfaces are combined at most, and the factor by which the combination, or
the result of each alone, has to come nearer to the target."""


def drive(scene: Scene, wish: Wish, progress: Callable[[int, int], None] | None = None) -> Result:
    """Carry out a wish as far as the judge allows; ``progress`` gets the surfaces done and the surfaces in all."""
    tell = progress or (lambda done, total: None)
    result: dict[int, Moved] = {}
    exact: list[Seam] = []
    loose: list[TrimmedSeam] = []
    congruent = Congruent(scene, wish)
    for group in groups(scene.sheets, scene.joints):
        tell(len(result), len(scene.sheets))
        alone, tried = _alone(scene, wish, group, congruent)
        result |= alone
        able = [i for i in group if i not in alone or alone[i].amount >= LEAST or alone[i].held_back]
        for members in groups(able, scene.joints.among(able)):
            for part, joined in _together(scene, wish, members, alone, tried):
                exact += [seam for seam in joined.exact if seam.a.surface != seam.b.surface]
                loose += joined.loose
                result |= part
        result |= {i: _by_itself(scene, wish, i, congruent) for i in group if i not in result}
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
    scene: Scene, wish: Wish, group: Sequence[int], congruent: Congruent
) -> tuple[dict[int, Moved], dict[tuple[int, ...], dict[int, Moved]]]:
    """Results for joined surfaces, each edited alone; only for the first few if all succeed together.

    There are none if surfaces need not get fairer: between held neighbours they could hardly move at all.
    """
    if not scene.tolerances.fairer:
        return {}, {}
    alone: dict[int, Moved] = {}
    tried: dict[tuple[int, ...], dict[int, Moved]] = {}
    for i in group:
        if len(alone) == FIRST and _through(alone):
            whole = tried[tuple(group)] = _attempt(
                scene, wish, group, scene.joints.among(group), _finer(scene, group, alone)
            )
            if _through(whole) and not _less(whole, alone):
                break
        alone[i] = _by_itself(scene, wish, i, congruent)
    return alone, tried


def _finer(scene: Scene, group: Iterable[int], alone: Mapping[int, Moved]) -> set[int]:
    """Surfaces for which more control points pay, as far as known.  Surfaces not yet tried are included if that holds
    for any other, or if none was tried."""
    known = {i for i, moved in alone.items() if moved.finer}
    more = scene.refine and (known or not alone)
    return {i for i in group if i in known or (more and i not in alone)}


def _through(moved: Mapping[int, Moved]) -> bool:
    """Whether all surfaces are allowed the whole wanted change."""
    return all(each.amount > ENOUGH for each in moved.values())


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
        plain = _attempt(scene, wish, part, joined)
        if _through(plain):
            return plain
    return _attempt(scene, wish, part, joined, finer)


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


def _by_itself(scene: Scene, wish: Wish, i: int, congruent: Congruent) -> Moved:
    """The best result for a surface alone; that of a congruent one if it was tried before."""
    moved = congruent.result(i) or _searched(scene, wish, i)
    congruent.keep(moved)
    return moved


def _searched(scene: Scene, wish: Wish, i: int) -> Moved:
    """The best result for a surface alone, with more control points beside its rims where they pay."""
    joined, sheet = scene.joints.among({i}), scene.sheets[i]
    plain = _attempt(scene, wish, [i], joined)[i]
    count = _points(beside_rims(sheet, joined) if scene.refine else sheet.net)
    size = count / _points(sheet.net)
    least = plain.share + PRICE * (size - 1.0)
    if size == 1.0 or (size > MOST[0] and count > MOST[1]) or least >= 1.0:
        return plain
    finer = _attempt(scene, wish, [i], joined, {i}, least)[i]
    if finer.share > least:
        return finer
    return plain if plain.amount else finer.undone()


def _points(net: Net) -> int:
    return net.u.count * net.v.count


def _attempt(
    scene: Scene,
    wish: Wish,
    surfaces: Iterable[int],
    joined: Joints,
    finer: Collection[int] = (),
    least: float = 0.0,
) -> dict[int, Moved]:
    """The best result for surfaces that move together, some with more control points; amounts may differ.

    They stay if that is less than a given share of the wanted change.  Where sliding edges keep them from moving in
    full, these edges are held if that is better.
    """
    group = list(surfaces)
    found = _tried(scene, wish, group, joined, finer, least)
    if _through(found) or not any(slide.trace.surface in group for slide in joined.slides):
        return found
    return max(found, _tried(scene, wish, group, joined.firm(), finer, least), key=_done)


def _done(found: Mapping[int, Moved]) -> tuple[float, float]:
    """How much of the wanted change is made, as a key by which results are compared."""
    share = next(iter(found.values())).share
    return share * (WHOLE if _through(found) else 1.0), sum(each.amount for each in found.values())


def _tried(
    scene: Scene, wish: Wish, surfaces: Sequence[int], joined: Joints, finer: Collection[int], least: float
) -> dict[int, Moved]:
    """The best result with edges joined as given."""
    members = {i: scene.sheets[i] for i in surfaces}
    trial = Trial(scene, members, joined, finer)
    target = wish.target(trial.problem, members, joined)
    if wish.fades and trial.pose.share is not None:
        target = trial.pose.share * target
    wished = float(trial.gains(target, target).of(1.0).sum())
    found = _ways(trial, wish, target, trial.nothing(least * wished))
    if len(members) > 1:
        _blend(trial, target, found)
    return _explained(trial, _confirmed(trial, members, found, target), target)


def _ways(trial: Trial, wish: Wish, target: Array, nothing: Verdict) -> list[Verdict]:
    """Verdicts on the ways to a target, after that on no change, until one is allowed."""
    found, most = [nothing], trial.most(target)
    for batch in wish.ways(trial.problem, target, trial.width) if most > nothing.gain else ():
        first = len(found)
        for wanted in batch:
            found.append(trial.judged(trial.pose.faded(wanted) if wish.fades else wanted, target, found))
            if found[-1].least == 1.0 and NEARER * found[-1].gain >= most:
                return found
        if max(found, key=rank).least <= ENOUGH:
            for each in found[first:]:
                found.append(trial.eased(each, target, found))
        if max(found, key=rank).least > ENOUGH:
            break
    return found


def _blend(trial: Trial, target: Array, found: list[Verdict]) -> None:
    """Add verdicts on combinations of the displacements that are best for each surface."""
    for _ in range(BLENDS if len(found) > 1 else 0):
        chosen = [(max(found, key=lambda each: each.gains[i]), i) for i in range(len(trial.nets))]
        now = max(found, key=rank)
        if sum(each.gains[i] for each, i in chosen) <= NEARER * now.gain:
            break
        found.append(trial.blended(chosen, target, found))
        if max(found, key=rank) is now:
            break


def _explained(trial: Trial, moved: dict[int, Moved], target: Array) -> dict[int, Moved]:
    """Results, with what prevents more."""
    if len(moved) == 1 and target.any():
        moved = {
            i: replace(each, held_back=each.amount < LEAST and trial.allowed_unheld(target))
            for i, each in moved.items()
        }
    if any(each.amount for each in moved.values()) or not trial.tolerances.fairer:
        return moved
    fairer = trial.fairer(target)
    return {i: replace(each, rough=fair) for (i, each), fair in zip(moved.items(), fairer, strict=True)}


def _confirmed(trial: Trial, members: Mapping[int, Sheet], found: Sequence[Verdict], target: Array) -> dict[int, Moved]:
    """The result that is worth most when judged closely."""
    trial.problem.forget()
    best: dict[int, Moved] = {}
    most, wanted = (-1.0, 0.0), float(trial.gains(target, target).of(1.0).sum())
    nets = {i: space.net for i, space in trial.problem.spaces.items()}
    lasting = trial.problem.free.size <= LASTING
    looks = [closely(members[i], net) for i, net in nets.items()]
    for verdict in sorted(found, key=rank, reverse=True)[:CANDIDATES]:
        if rank(verdict) <= most:
            break
        verdict = trial.settled(verdict)
        moved = []
        fresh = (closely(members[i], net) for i, net in nets.items())
        for each in _moved(trial, members, verdict, looks if lasting else fresh):
            each = each.confirmed(trial.tolerances)
            moved.append(each if lasting else each.done())
        verdict = trial.left(verdict, [each.amount for each in moved])
        if rank(verdict) > most:
            most = rank(verdict)
            best = {each.sheet.index: replace(each, gain=verdict.gain, wanted=wanted) for each in moved}
    return best


def _moved(trial: Trial, members: Mapping[int, Sheet], verdict: Verdict, looks: Iterable[Watch]) -> Iterable[Moved]:
    """The displacement that a verdict allows, by surface."""
    figures = zip(verdict.parts, looks, verdict.amounts, verdict.changes, verdict.limits, strict=True)
    for (i, space), (part, look, amount, changes, limits) in zip(trial.problem.spaces.items(), figures, strict=True):
        tried, free, slides = Tried(look, [space.net], [part]), int(space.free.sum()), trial.pose.led is not None
        yield Moved(members[i], tried, amount, changes, limits, free, sliding=slides)
