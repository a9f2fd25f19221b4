"""Deviation of copies of a feature from their ideal."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from mracad.brief import line
from mracad.edit.feature.detail import LOST
from mracad.edit.feature.fit import between
from mracad.edit.feature.ideal import Copies
from mracad.edit.feature.locate import told
from mracad.edit.feature.patch import Patch
from mracad.edit.feature.seams import Wanted
from mracad.errors import EditError

Array = np.ndarray

SHORT = 0.2
"""Share of its height by which a copy may deviate from the ideal if nothing is held."""

NOTED = 0.05
"""The same share beyond which a note says so."""


@dataclass(frozen=True)
class Copy:
    """The result for one copy.

    Attributes
    ----------
    place : str
    at : (float, float, float)
        Its position, mm.
    faces : tuple of int
        Faces that it touches.
    deviation, rms : float
        Largest and root mean square distance from the ideal copy, mm, constraints included.
    lost : float
        Largest part of it that constraints cut off, mm.
    short : float
        Largest part of it that the control points there cannot hold, mm.
    exact : bool
        Whether it is an exact shift of control points.
    height : float
        Its largest displacement, mm; 0 if not known.
    base : float
        Error of the surface that the feature was separated from, root mean square, in the copy, mm.
    volume : float
        Between the ideal copy and the surface under it, whatever its sign, mm³.
    taken : float
        Share of its volume, 0 to 1, that edges and holes that stay take away, or that lies beyond them.
    radius : float
        Of the feature in its size, mm.
    """

    place: str
    at: tuple[float, float, float]
    faces: tuple[int, ...]
    deviation: float
    rms: float
    lost: float
    short: float
    exact: bool
    height: float = 0.0
    base: float = 0.0
    volume: float = 0.0
    taken: float = 0.0
    radius: float = 0.0

    __repr__ = line


@dataclass(frozen=True, eq=False)
class Figures:
    """Figures at points of a copy on a patch, ``(q,)`` each: distances (mm) from the ideal, parts of them that
    constraints cut off and that control points cannot hold, and faces."""

    missed: Array
    lost: Array
    short: Array
    faces: Array

    __repr__ = line


def compared(copies: Copies, wanted: Mapping[int, Wanted], done: Mapping[int, Array], exact: Array) -> list[Copy]:
    """Every copy compared with its ideal.

    Parameters
    ----------
    copies : Copies
    wanted : mapping of int to Wanted
        By surface, the offsets of copies on it, and all others.
    done : mapping of int to ndarray (nu, nv, 3)
        The resulting offsets.
    exact : ndarray of bool (copies,)
        Whether a copy is an exact shift.
    """
    found: list[list[Figures]] = [[] for _ in copies.places]
    for i, each in wanted.items():
        if copies.on(copies.ground.patches[i]).any():
            left = done[i] - (each.offset - each.alone)
            for k, figures in _figures(copies, copies.ground.patches[i], each, left):
                found[k].append(figures)
    points, feature = copies.feet.points, copies.feature
    return [
        replace(
            copied(each.label, points[k], found[k], bool(exact[k])),
            height=feature.height * abs(each.height),
            base=feature.base * abs(each.height),
            radius=feature.radius * each.size,
        )
        for k, each in enumerate(copies.places)
    ]


def copied(place: str, at: Array, found: Sequence[Figures], exact: bool = False) -> Copy:
    """The result for a copy, from its points on all patches."""
    faces = {int(face) for each in found for face in np.unique(each.faces)} - {-1}
    worst, lost, short = (
        max((float(getattr(each, name).max()) for each in found), default=0.0) for name in ("missed", "lost", "short")
    )
    squares, count = sum(float((each.missed**2).sum()) for each in found), sum(len(each.missed) for each in found)
    rms = float(np.sqrt(squares / max(count, 1)))
    x, y, z = at.tolist()
    return Copy(place, (x, y, z), tuple(sorted(faces)), worst, rms, lost, short, exact)


def share(found: Sequence[Copy]) -> float:
    """The share of the volume of all copies that is taken, 0 to 1."""
    whole = sum(copy.volume for copy in found)
    return sum(copy.volume * copy.taken for copy in found) / whole if whole else 0.0


def _figures(copies: Copies, patch: Patch, wanted: Wanted, done: Array) -> Iterator[tuple[int, Figures]]:
    """The figures of copies on a patch with resulting offsets ``done``."""
    from scipy.spatial import cKDTree

    net = wanted.net
    both = np.concatenate([done @ patch.turn.T, wanted.alone @ patch.turn.T], axis=-1)
    chosen = np.flatnonzero(copies.on(patch))
    for uv, _ in between(copies, patch, (net.u, net.v)):
        uv = uv[patch.covers(uv, net)]
        if not len(uv):
            continue
        points, _, _, normals = patch.evaluate(uv)
        ideal, _ = copies.ideal(patch, points, normals)
        on = np.full(len(uv), patch.faces[0].index)
        if len(patch.faces) > 1:
            on = copies.ground.faces(np.full(len(uv), patch.index), uv)
        values = np.asarray(net.with_poles(both).evaluate(uv))
        now, alone = values[:, :3], values[:, 3:]
        missed, lost, short = (np.linalg.norm(x, axis=1) for x in (now - ideal, now - alone, alone - ideal))
        hits = cKDTree(points).query_ball_point(copies.charts.origin[chosen], copies.reach[chosen])
        for k, hit in zip(chosen.tolist(), hits, strict=True):
            if hit:
                yield k, Figures(missed[hit], lost[hit], short[hit], on[hit])


def lumpy(found: Sequence[Copy]) -> tuple[str, ...]:
    """A note on the copies that the ground holds badly, if there are any."""
    bad = [copy for copy in found if copy.short > NOTED * copy.height > 0.0]
    if not bad:
        return ()
    worst = max(bad, key=lambda copy: copy.short / copy.height)
    some = f"{len(bad)} of {len(found)} copies deviate" if len(found) > 1 else "the copy deviates"
    most = f"{_at(worst)} by {100 * worst.short / worst.height:.0f} %"
    return (f"{some} by more than {100 * NOTED:.0f} % of the height, because the surface is not smooth there: {most}",)


HELD_BADLY, CUT_OFF = "the faces there cannot hold a copy", "edges or holes that stay in place would cut off a copy"


class Unfit(EditError):
    """Copies that their places cannot take.

    Attributes
    ----------
    bad : dict of str to dict of int to str
        By cause (:data:`HELD_BADLY`, :data:`CUT_OFF`), their positions and names.
    """

    bad: Mapping[str, Mapping[int, str]] = {}


def refuse(found: Sequence[Copy], clip: bool) -> None:
    """Raise Unfit for copies that the ground cannot hold, or that lose too much to held control points.

    ``clip`` allows the latter.
    """
    short = {k: copy for k, copy in enumerate(found) if copy.short > SHORT * copy.height}
    lost = {k: copy for k, copy in enumerate(found) if copy.lost > LOST * copy.height and not clip}
    bad = short | lost
    if not bad:
        return
    first, *others = bad.values()
    if short:
        share = 100 * first.short / first.height
        what = f"the faces there cannot hold the copy: it would deviate by {share:.0f} % of its height"
        hint = "make it smaller with --size, or choose other places"
    else:
        share = 100 * min(first.lost / first.height, 1)
        what = f"edges or holes that stay in place cut off {share:.0f} % of the copy's height"
        hint = "move it away from them, make it smaller with --size, or allow that with --clip"
    also = f"; no better: {told([_at(copy) for copy in others])}" if others else ""
    error = Unfit(f"{_at(first)}: {what} ({_numbers(first)}){also}", hint)
    error.bad = {
        HELD_BADLY: {k: _at(c) for k, c in short.items()},
        CUT_OFF: {k: _at(lost[k]) for k in sorted(lost.keys() - short)},
    }
    raise error


def _numbers(copy: Copy) -> str:
    return " ".join(f"#{i + 1}" for i in copy.faces)


def _at(copy: Copy) -> str:
    """The name of its place, with coordinates."""
    return copy.place if "(" in copy.place else f"{copy.place} ({','.join(f'{x:.6g}' for x in copy.at)})"
