"""How far copies of a feature came out from the ideal."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from mracad.bspline.surface import Net
from mracad.edit.feature.detail import LOST
from mracad.edit.feature.fit import between
from mracad.edit.feature.ideal import Copies
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
    """What copies became on a patch.

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


class _Tally:
    """Distances from the ideal, by copy."""

    def __init__(self, count: int) -> None:
        self.worst, self.lost, self.short, self.squares, self.samples = (np.zeros(count) for _ in range(5))
        self.faces: list[set[int]] = [set() for _ in range(count)]

    def add(self, copy: int, missed: Array, lost: Array, short: Array, faces: Array) -> None:
        """Count points of a copy."""
        self.worst[copy] = max(self.worst[copy], missed.max())
        self.lost[copy] = max(self.lost[copy], lost.max())
        self.short[copy] = max(self.short[copy], short.max())
        self.squares[copy] += (missed**2).sum()
        self.samples[copy] += len(missed)
        self.faces[copy].update(faces.tolist())

    @property
    def rms(self) -> Array:
        return np.sqrt(self.squares / np.maximum(self.samples, 1))


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
    tally = _Tally(len(copies.places))
    for i, outcome in outcomes.items():
        patch = copies.ground.patches[i]
        if copies.on(patch).any():
            for copy, *found in _missed(copies, patch, outcome):
                tally.add(copy, *found)
    rms = tally.rms
    return [
        Copy(
            place.label,
            tuple(float(x) for x in copies.feet.points[k]),  # type: ignore[arg-type]
            tuple(sorted(tally.faces[k] - {-1})),
            float(tally.worst[k]),
            float(rms[k]),
            float(tally.lost[k]),
            float(tally.short[k]),
            bool(exact[k]),
        )
        for k, place in enumerate(copies.places)
    ]


def _missed(copies: Copies, patch: Patch, outcome: Outcome) -> Iterator[tuple[int, Array, Array, Array, Array]]:
    """For copies on a patch: distances from the ideal, what constraints took, what control points cannot hold, and
    faces, at points of it."""
    from scipy.spatial import cKDTree

    net, some = outcome.net, copies.on(patch)
    both = np.concatenate([outcome.done @ patch.turn.T, outcome.alone @ patch.turn.T], axis=-1)
    pair = Net(net.u, net.v, both, net.weights)
    for uv, _ in between(copies, patch, (net.u, net.v), some):
        uv = uv[patch.covers(uv, net)]
        if not len(uv):
            continue
        points, _, _, normals = patch.evaluate(uv)
        wanted, _ = copies.ideal(patch, points, normals)
        on = np.full(len(uv), patch.faces[0].index)
        if len(patch.faces) > 1:
            on = copies.ground.faces(np.full(len(uv), patch.index), uv)
        values = np.asarray(pair.evaluate(uv))
        missed = np.linalg.norm(values[:, :3] - wanted, axis=1)
        gone = np.linalg.norm(values[:, :3] - values[:, 3:], axis=1)
        short = np.linalg.norm(values[:, 3:] - wanted, axis=1)
        chosen = np.flatnonzero(some)
        hits = cKDTree(points).query_ball_point(copies.charts.origin[chosen], copies.reach[chosen])
        for k, hit in zip(chosen.tolist(), hits, strict=True):
            if hit:
                yield k, missed[hit], gone[hit], short[hit], on[hit]


def refuse_short(copies: Copies, found: Sequence[Copy]) -> None:
    """Raise EditError for a copy of which the ground cannot hold enough."""
    for copy, share in _above(copies, found, "short", SHORT):
        raise EditError(
            f"{copy.place}: the faces there cannot hold the copy: it would be off by {100 * share:.0f} % of its "
            f"height ({_numbers(copy)})",
            "make it smaller with --size, or choose another place",
        )


def refuse_clipped(copies: Copies, found: Sequence[Copy]) -> None:
    """Raise EditError for a copy that points which stay take too much of."""
    for copy, share in _above(copies, found, "lost", LOST):
        raise EditError(
            f"{copy.place}: edges or holes that do not move take {100 * min(share, 1):.0f} % of the height of "
            f"the copy there ({_numbers(copy)})",
            "move it away from them, make it smaller with --size, or let them take it with --clip",
        )


def _above(copies: Copies, found: Sequence[Copy], figure: str, most: float) -> Iterator[tuple[Copy, float]]:
    """Copies of which a figure is more than a share of their height, and that share."""
    for copy, place in zip(found, copies.places, strict=True):
        share = getattr(copy, figure) / (copies.feature.height * abs(place.height))
        if share > most:
            yield copy, share


def _numbers(copy: Copy) -> str:
    return " ".join(f"#{i + 1}" for i in copy.faces)
