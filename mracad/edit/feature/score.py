"""How far copies of a feature came out from the ideal."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from mracad.bspline.surface import Net
from mracad.edit.feature.detail import LOST
from mracad.edit.feature.fit import between
from mracad.edit.feature.ideal import Copies
from mracad.edit.feature.locate import Place
from mracad.edit.feature.patch import Patch
from mracad.errors import EditError

Array = np.ndarray

SHORT = 0.2
"""Share of its height by which a copy may be off the ideal where nothing is held."""


@dataclass(frozen=True)
class Copy:
    """What became of one copy.

    Attributes
    ----------
    place : str
    at : (float, float, float)
        Where it stands, mm.
    faces : tuple of int
        Faces that it touches.
    deviation, rms : float
        Largest and mean square distance from the ideal copy, mm, constraints included.
    lost : float
        Largest part of it that constraints took away, mm.
    short : float
        Largest part of it that the control points there cannot hold, mm.
    exact : bool
        Whether it is an exact shift of control points.
    """

    place: str
    at: tuple[float, float, float]
    faces: tuple[int, ...]
    deviation: float
    rms: float
    lost: float
    short: float
    exact: bool


@dataclass(frozen=True, eq=False)
class Outcome:
    """What copies became on a surface.

    Attributes
    ----------
    net : Net
        The surface undisplaced, in the space of the offsets.
    done : ndarray (nu, nv, 3)
        Offsets of its control points, without what is removed, in the surface's own frame, mm.
    alone : ndarray (nu, nv, 3)
        Those that the copies alone would be.
    """

    net: Net
    done: Array
    alone: Array


@dataclass(frozen=True, eq=False)
class Figures:
    """Points of a copy on a patch: distances (mm) from the ideal, what constraints took, what control points cannot
    hold, and faces, ``(q,)`` each."""

    missed: Array
    lost: Array
    short: Array
    faces: Array


def compared(copies: Copies, outcomes: Mapping[int, Outcome], exact: Array) -> list[Copy]:
    """Every copy beside its ideal.

    Parameters
    ----------
    copies : Copies
    outcomes : mapping of int to Outcome
        By surface.
    exact : ndarray of bool (copies,)
        Which are exact shifts.
    """
    found: list[list[Figures]] = [[] for _ in copies.places]
    for i, outcome in outcomes.items():
        if copies.on(copies.ground.patches[i]).any():
            for k, figures in _figures(copies, copies.ground.patches[i], outcome):
                found[k].append(figures)
    points = copies.feet.points
    return [copied(place.label, points[k], found[k], bool(exact[k])) for k, place in enumerate(copies.places)]


def copied(place: str, at: Array, found: Sequence[Figures], exact: bool = False) -> Copy:
    """What became of a copy, from its points on all patches."""
    faces = {int(face) for each in found for face in np.unique(each.faces)} - {-1}
    worst, lost, short = (
        max((float(getattr(each, name).max()) for each in found), default=0.0) for name in ("missed", "lost", "short")
    )
    squares, count = sum(float((each.missed**2).sum()) for each in found), sum(len(each.missed) for each in found)
    rms = float(np.sqrt(squares / max(count, 1)))
    x, y, z = at.tolist()
    return Copy(place, (x, y, z), tuple(sorted(faces)), worst, rms, lost, short, exact)


def _figures(copies: Copies, patch: Patch, outcome: Outcome) -> Iterator[tuple[int, Figures]]:
    """The figures of copies on a patch."""
    from scipy.spatial import cKDTree

    net = outcome.net
    both = np.concatenate([outcome.done @ patch.turn.T, outcome.alone @ patch.turn.T], axis=-1)
    chosen = np.flatnonzero(copies.on(patch))
    for uv, _ in between(copies, patch, (net.u, net.v)):
        uv = uv[patch.covers(uv, net)]
        if not len(uv):
            continue
        points, _, _, normals = patch.evaluate(uv)
        wanted, _ = copies.ideal(patch, points, normals)
        on = np.full(len(uv), patch.faces[0].index)
        if len(patch.faces) > 1:
            on = copies.ground.faces(np.full(len(uv), patch.index), uv)
        values = np.asarray(net.with_poles(both).evaluate(uv))
        done, alone = values[:, :3], values[:, 3:]
        missed, lost, short = (np.linalg.norm(x, axis=1) for x in (done - wanted, done - alone, alone - wanted))
        hits = cKDTree(points).query_ball_point(copies.charts.origin[chosen], copies.reach[chosen])
        for k, hit in zip(chosen.tolist(), hits, strict=True):
            if hit:
                yield k, Figures(missed[hit], lost[hit], short[hit], on[hit])


def refuse(copies: Copies, found: Sequence[Copy], clip: bool) -> None:
    """Raise EditError for a copy of which the ground cannot hold enough, or points that stay take too much.

    ``clip`` lets them take it.
    """
    for copy, place in zip(found, copies.places, strict=True):
        share = _share(copies, place, copy.short)
        if share > SHORT:
            raise EditError(
                f"{copy.place}: the faces there cannot hold the copy: it would be off by {100 * share:.0f} % of its "
                f"height ({_numbers(copy)})",
                "make it smaller with --size, or choose another place",
            )
    for copy, place in zip(found, copies.places, strict=True):
        share = _share(copies, place, copy.lost)
        if share > LOST and not clip:
            raise EditError(
                f"{copy.place}: edges or holes that do not move take {100 * min(share, 1):.0f} % of the height of "
                f"the copy there ({_numbers(copy)})",
                "move it away from them, make it smaller with --size, or let them take it with --clip",
            )


def _share(copies: Copies, place: Place, figure: float) -> float:
    """A length as a share of the height of a copy."""
    return figure / (copies.feature.height * abs(place.height))


def _numbers(copy: Copy) -> str:
    return " ".join(f"#{i + 1}" for i in copy.faces)
