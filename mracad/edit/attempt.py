"""One attempt of an edit on surfaces that move together: several ways to the target, the best of which is confirmed."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import replace

import numpy as np

from mracad.edit.moved import Moved, closely
from mracad.edit.pose import Scene
from mracad.edit.target import Sheet, Wish
from mracad.edit.trial import ENOUGH, WHOLE, Trial, Verdict, rank
from mracad.edit.watch import Tried, Watch
from mracad.seam.interface import Joints

Array = np.ndarray

LEAST = 0.25
"""A surface with a smaller allowed amount is left, so that the others can do more."""

LASTING = 20_000
"""Largest number of control points of joined surfaces for which close measurements are kept: some kilobytes each."""

CANDIDATES = 3
"""Largest number of displacements that are judged closely after a first look."""

BLENDS, NEARER = 2, 1.05
"""How often the best displacements of joined surfaces are combined at most, and the factor by which the combination, or
the result of each alone, has to come nearer to the target."""


def attempt(
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
    if through(found) or not any(slide.trace.surface in group for slide in joined.slides):
        return found
    return max(found, _tried(scene, wish, group, joined.firm(), finer, least), key=_done)


def through(moved: Mapping[int, Moved]) -> bool:
    """Whether all surfaces are allowed the whole wanted change."""
    return all(each.amount > ENOUGH for each in moved.values())


def _done(found: Mapping[int, Moved]) -> tuple[float, float]:
    """How much of the wanted change is made, as a key by which results are compared."""
    share = next(iter(found.values())).share
    return share * (WHOLE if through(found) else 1.0), sum(each.amount for each in found.values())


def _tried(
    scene: Scene, wish: Wish, surfaces: Sequence[int], joined: Joints, finer: Collection[int], least: float
) -> dict[int, Moved]:
    """The best result with edges joined as given."""
    members = {i: scene.sheets[i] for i in surfaces}
    trial = Trial(scene, members, joined, finer)
    target = wish.target(trial.problem, members, joined)
    if wish.fades and trial.pose.share is not None:
        target = trial.pose.share * target
    if trial.tolerances.whole and np.isfinite(trial.tolerances.growth.bending):
        trial.watch = replace(trial.watch, targets=list(trial.problem.split(target).values()))
    wished = float(trial.gains(target, target).of(1.0).sum())
    found, left = _ways(trial, wish, target, trial.nothing(least * wished))
    moved = _best(trial, members, found, target)
    if left and not through(moved):
        _judge(trial, left, found)
        moved = _best(trial, members, found, target)
    if trial.tolerances.whole:
        moved = _limited(moved, found)
    return _explained(trial, moved, target)


def _limited(moved: Mapping[int, Moved], found: Sequence[Verdict]) -> dict[int, Moved]:
    """Results, with what the judge said against the displacements of surfaces that stay."""
    every = zip(*(each.limits for each in found), strict=True)
    said = (next(filter(None, limits), ()) for limits in every)
    both = zip(moved.items(), said, strict=True)
    return {i: each if each.amount else replace(each, limits=each.limits or limits) for (i, each), limits in both}


def _best(trial: Trial, members: Mapping[int, Sheet], found: list[Verdict], target: Array) -> dict[int, Moved]:
    """The best result after verdicts, to which those on combinations are added."""
    if len(members) > 1 and not trial.tolerances.whole:
        _blend(trial, target, found)
    return _confirmed(trial, members, found, target)


def _ways(trial: Trial, wish: Wish, target: Array, nothing: Verdict) -> tuple[list[Verdict], list[Verdict]]:
    """Verdicts on the ways to a target, after that on no change, until one is allowed.

    If one is allowed in full for several surfaces, those before it are returned apart, without amounts.
    """
    found, most, several = [nothing], trial.most(target), len(trial.nets) > 1
    for batch in wish.ways(trial.problem, target, trial.width) if most > nothing.gain else ():
        first = len(found)
        left: list[Verdict] = []
        for wanted in batch:
            delta = trial.pose.faded(wanted) if wish.fades else wanted
            verdict = trial.judged(delta, target, found, wholly=several)
            (left if several else found).append(verdict)
            if verdict.least == 1.0 and NEARER * verdict.gain >= most:
                return ([*found, verdict], left[:-1]) if several else (found, [])
        _judge(trial, left, found)
        if max(found, key=rank).least <= ENOUGH and not trial.tolerances.whole:
            for each in found[first:]:
                found.append(trial.eased(each, target, found))
        if max(found, key=rank).least > ENOUGH:
            break
    return found, []


def _judge(trial: Trial, left: Sequence[Verdict], found: list[Verdict]) -> None:
    """Add verdicts with amounts."""
    for each in left:
        found.append(trial.shared(each, found))


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
    unheld = trial.unheld(target)
    if len(moved) == 1 and target.any():
        moved = {
            i: replace(
                each,
                held_back=each.amount < LEAST and unheld.allowed,
                gaining=each.amount > 0 or unheld.gaining[0],
            )
            for i, each in moved.items()
        }
    if any(each.amount for each in moved.values()) or not trial.tolerances.fairer:
        return moved
    return {i: replace(each, rough=fair) for (i, each), fair in zip(moved.items(), unheld.fairer, strict=True)}


def _confirmed(trial: Trial, members: Mapping[int, Sheet], found: Sequence[Verdict], target: Array) -> dict[int, Moved]:
    """The result that is worth most when judged closely."""
    trial.problem.forget()
    best: dict[int, Moved] = {}
    most, wanted = (-1.0, 0.0), float(trial.gains(target, target).of(1.0).sum())
    nets = {i: space.net for i, space in trial.problem.spaces.items()}
    targets = trial.watch.targets
    own = [[each] for each in targets] if targets else [[] for _ in nets]
    both = list(zip(nets.items(), own, strict=True))
    lasting = trial.problem.free.size <= LASTING
    looks = [closely(members[i], net, targets) for (i, net), targets in both]
    for verdict in sorted(found, key=rank, reverse=True)[:CANDIDATES]:
        if rank(verdict) <= most:
            break
        verdict = trial.settled(verdict)
        moved = []
        fresh = (closely(members[i], net, targets) for (i, net), targets in both)
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
