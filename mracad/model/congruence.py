"""Surfaces that are the same but moved or mirrored, as in patterns and in symmetric parts.

Parameters may be exchanged, reversed and scaled, and space is turned by an orthogonal map.
"""

from __future__ import annotations

from collections import Counter, defaultdict
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import product
from typing import Generic, TypeVar

import numpy as np

from mracad.bspline.knots import KnotVector
from mracad.bspline.surface import Net
from mracad.model.brep import Face

Array = np.ndarray
Known = TypeVar("Known")

CLOSE = 1e-5
"""Largest difference between congruent surfaces once one is moved onto the other, relative to size or domain."""

MARKS = np.array([0.0, 0.5, 1.0])
"""Where trims are compared, as shares of their domains."""


@dataclass(frozen=True, eq=False)
class Figure:
    """A surface and all faces on it, to be compared with others."""

    net: Net
    faces: tuple[Face, ...]

    @cached_property
    def centre(self) -> Array:
        """Mean of the control points, ``(3,)``."""
        return np.asarray(self.net.poles.mean(axis=(0, 1)))

    @cached_property
    def points(self) -> Array:
        """Control points about their mean, ``(nu, nv, 3)``."""
        return np.asarray(self.net.poles - self.centre)

    @cached_property
    def square(self) -> float:
        """Sum of their squares, mm²."""
        return float(np.vdot(self.points, self.points))

    @cached_property
    def kind(self) -> tuple[object, ...]:
        """What all congruent figures have in common, in a form that can be looked up."""
        axes = sorted((each.degree, each.count, each.periodic) for each in (self.net.u, self.net.v))
        trims = tuple(len(face.trims) for face in self.faces)
        return (*axes, self.net.weights is None, trims)


@dataclass(frozen=True, eq=False)
class Congruence:
    """How the parameters and the space of a surface become those of one congruent to it.

    Attributes
    ----------
    figures : (Figure, Figure)
        The first surface and the other.
    swapped : bool
        Whether u and v are exchanged.
    flipped : (bool, bool)
        Whether u and v of the other then run the opposite way.
    turn : ndarray (3, 3)
        An orthogonal matrix: rows times it are those of the other.
    off : float
        Largest distance between their control points, over the size.
    """

    figures: tuple[Figure, Figure]
    swapped: bool
    flipped: tuple[bool, bool]
    turn: Array
    off: float

    def arranged(self, values: Array) -> Array:
        """Values at the control points of the first, ``(nu, nv, …)``, in the order of the other."""
        return _arranged(values, self.swapped, self.flipped)

    def offset(self, offset: Array) -> Array:
        """The displacement of the other, for one of the first."""
        return np.asarray(self.arranged(offset) @ self.turn)

    def moved(self, points: Array) -> Array:
        """Control points for the other, for some of the first."""
        first, other = self.figures
        return np.asarray(self.offset(points - first.centre) + other.centre)

    def parameters(self, axis: int, x: Array) -> Array:
        """Parameters along an axis of the other, for those along the axis that it has in the first."""
        first, other = self.figures
        theirs, own = _knots(first.net, axis, self.swapped), _knots(other.net, axis, False)
        share = (x - theirs.domain[0]) / theirs.period
        return np.asarray(own.domain[0] + own.period * (1.0 - share if self.flipped[axis] else share))

    def places(self, uv: Array) -> Array:
        """Parameters ``(…, 2)`` of the other, for those of the first."""
        both = uv[..., ::-1] if self.swapped else uv
        return np.stack([self.parameters(axis, both[..., axis]) for axis in (0, 1)], axis=-1)

    def finer(self, net: Net, fine: Net) -> Net:
        """The other, ``net``, with the knots that ``fine``, a refinement of the first, has more."""
        more = []
        for axis in (0, 1):
            base, knots = (_knots(each, axis, self.swapped) for each in (self.figures[0].net, fine))
            counts = Counter(knots.knots.tolist())
            counts.subtract(base.knots.tolist())
            low, high = knots.domain
            new = [x for x, count in counts.items() for _ in range(count) if low < x < high]
            more.append(np.sort(self.parameters(axis, np.array(new))))
        return net.refined(*more)

    def edges(self) -> list[tuple[int, int]] | None:
        """The edge of each trim of the first with that of the other; None if a trim has no match."""
        first, other = self.figures
        size = np.array([knots.period for knots in (other.net.u, other.net.v)])
        found = []
        for one, face in zip(first.faces, other.faces, strict=True):
            theirs, own = self.places(_marks(one)), _marks(face)
            for trim, marks in zip(one.trims, theirs, strict=True):
                off = [np.abs((each - marks) / size).max(axis=(1, 2)) for each in (own, own[:, ::-1])]
                nearest = int(np.minimum(*off).argmin())
                if min(each[nearest] for each in off) > CLOSE:
                    return None
                found.append((trim.edge, face.trims[nearest].edge))
        return found


def congruences(first: Figure, other: Figure) -> Iterator[Congruence]:
    """The ways in which a surface is congruent to another: several if it is symmetric itself."""
    shape, points = first.net.poles.shape, other.points.reshape(-1, 3)
    size = float(np.linalg.norm(points, axis=1).max())
    for swapped, *flipped in product((False, True), repeat=3):
        if not all(_same(first.net, other.net, axis, swapped, flipped[axis]) for axis in (0, 1)):
            continue
        moved = _arranged(first.points.reshape(shape), swapped, flipped).reshape(-1, 3)
        left, _, right = np.linalg.svd(moved.T @ points)
        turn = left @ right
        off = float(np.abs(moved @ turn - points).max())
        found = Congruence((first, other), swapped, (flipped[0], flipped[1]), turn, off / max(size, 1e-300))
        if off <= CLOSE * size and _weighted_alike(found):
            yield found


class Figures(Generic[Known]):
    """What is known of some figures, to be found for those that may be congruent to them."""

    def __init__(self) -> None:
        self._known: dict[tuple[object, ...], list[tuple[float, Known]]] = defaultdict(list)

    def keep(self, figure: Figure, known: Known) -> None:
        """Remember what is known of a figure."""
        self._known[figure.kind].append((figure.square, known))

    def near(self, figure: Figure) -> Iterator[Known]:
        """What is known of figures of the same kind and size."""
        for square, known in self._known[figure.kind]:
            if abs(square - figure.square) <= CLOSE * figure.square:
                yield known


def _same(first: Net, net: Net, axis: int, swapped: bool, flipped: bool) -> bool:
    """Whether an axis of a net has the knots of the first, but for scale and direction."""
    theirs, own = _knots(first, axis, swapped), _knots(net, axis, False)
    if (theirs.degree, theirs.count, theirs.periodic) != (own.degree, own.count, own.periodic):
        return False
    if theirs.periodic and (flipped or swapped):
        return False
    one, other = ((each.knots - each.domain[0]) / each.period for each in (theirs, own))
    return bool(np.abs((1.0 - one[::-1] if flipped else one) - other).max() <= CLOSE)


def _weighted_alike(between: Congruence) -> bool:
    one, other = (figure.net.weights for figure in between.figures)
    if one is None or other is None:
        return one is other
    return bool(np.allclose(between.arranged(one), other, rtol=CLOSE))


def _knots(net: Net, axis: int, swapped: bool) -> KnotVector:
    return (net.u, net.v)[1 - axis if swapped else axis]


def _arranged(values: Array, swapped: bool, flipped: Sequence[bool]) -> Array:
    values = values.swapaxes(0, 1) if swapped else values
    return values[:: -1 if flipped[0] else 1, :: -1 if flipped[1] else 1]


def _marks(face: Face) -> Array:
    """Points of each trim of a face, from its beginning to its end, in parameters, ``(trims, marks, 2)``."""
    found = []
    for trim in face.trims:
        low, high = trim.curve.knots.domain
        found.append(trim.curve.evaluate(low + (high - low) * MARKS))
    return np.array(found).reshape(-1, len(MARKS), 2)
