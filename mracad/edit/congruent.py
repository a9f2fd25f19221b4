"""Surfaces congruent to others, which are the same but moved or mirrored, as in patterns and in symmetric parts.

The problem of such a surface alone is that of the other in other coordinates: parameters exchanged, reversed and
scaled, space turned by an orthogonal map.  So what was found for the first is moved likewise, and only judged.
"""

from __future__ import annotations

from collections import Counter, defaultdict
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace
from itertools import product

import numpy as np

from mracad.bspline.knots import KnotVector
from mracad.bspline.surface import Net
from mracad.edit.jumps import Jumps
from mracad.edit.moved import Moved, closely
from mracad.edit.pose import Scene
from mracad.edit.target import Sheet, Wish
from mracad.edit.watch import Tried, displaced
from mracad.model.brep import Face
from mracad.seam.interface import Joints

Array = np.ndarray

CLOSE = 1e-5
"""Largest difference between congruent surfaces once one is moved onto the other, relative to size or domain."""

ENOUGH = 0.95
"""Least share of the amount of the first surface that the judge must allow."""


@dataclass(frozen=True, eq=False)
class Congruence:
    """How the parameters and the space of a surface become those of one congruent to it.

    Attributes
    ----------
    nets : (Net, Net)
        The first surface and the other.
    swapped : bool
        Whether u and v are exchanged.
    flipped : (bool, bool)
        Whether u and v of the other then run the opposite way.
    turn : ndarray (3, 3)
        An orthogonal matrix: rows times it are those of the other.
    """

    nets: tuple[Net, Net]
    swapped: bool
    flipped: tuple[bool, bool]
    turn: Array

    def arranged(self, values: Array) -> Array:
        """Values at the control points of the first, ``(nu, nv, …)``, in the order of the other."""
        return _arranged(values, self.swapped, self.flipped)

    def offset(self, offset: Array) -> Array:
        """The displacement of the other, for one of the first."""
        return np.asarray(self.arranged(offset) @ self.turn)

    def parameters(self, axis: int, x: Array) -> Array:
        """Parameters along an axis of the other, for those along the axis that it has in the first."""
        theirs, own = _knots(self.nets[0], axis, self.swapped), _knots(self.nets[1], axis, False)
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
            base, knots = (_knots(each, axis, self.swapped) for each in (self.nets[0], fine))
            counts = Counter(knots.knots.tolist())
            counts.subtract(base.knots.tolist())
            low, high = knots.domain
            new = [x for x, count in counts.items() for _ in range(count) if low < x < high]
            more.append(np.sort(self.parameters(axis, np.array(new))))
        return net.refined(*more)


def congruences(first: Sheet, sheet: Sheet) -> Iterator[Congruence]:
    """The ways in which a surface is congruent to another: several if it is symmetric itself."""
    nets = first.net, sheet.net
    if not (first.stretch.even and sheet.stretch.even and _near(first.wavelength, sheet.wavelength)):
        return
    points = [net.poles.reshape(-1, 3) - net.poles.mean(axis=(0, 1)) for net in nets]
    size = float(np.linalg.norm(points[1], axis=1).max())
    if not _near(float((points[0] ** 2).sum()), float((points[1] ** 2).sum())):
        return
    for swapped, *flipped in product((False, True), repeat=3):
        if not all(_same(*nets, axis, swapped, flipped[axis]) for axis in (0, 1)):
            continue
        moved = _arranged(points[0].reshape(nets[0].poles.shape), swapped, flipped).reshape(-1, 3)
        left, _, right = np.linalg.svd(moved.T @ points[1])
        turn = left @ right
        if np.abs(moved @ turn - points[1]).max() > CLOSE * size:
            continue
        found = Congruence(nets, swapped, (flipped[0], flipped[1]), turn)
        if _weighted_alike(found):
            yield found


def _near(a: float, b: float) -> bool:
    return abs(a - b) <= CLOSE * abs(b)


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
    one, other = (net.weights for net in between.nets)
    if one is None or other is None:
        return one is other
    return bool(np.allclose(between.arranged(one), other, rtol=CLOSE))


def _knots(net: Net, axis: int, swapped: bool) -> KnotVector:
    return (net.u, net.v)[1 - axis if swapped else axis]


def _arranged(values: Array, swapped: bool, flipped: tuple[bool, ...] | list[bool]) -> Array:
    values = values.swapaxes(0, 1) if swapped else values
    return values[:: -1 if flipped[0] else 1, :: -1 if flipped[1] else 1]


class Congruent:
    """The surfaces of a scene for which a result was found alone, and those congruent to them.

    Parameters
    ----------
    scene : Scene
    wish : Wish
    """

    def __init__(self, scene: Scene, wish: Wish) -> None:
        joints = scene.joints
        self.scene = scene
        self.able = wish.alike and not joints.zones
        mended = {side.surface for seam in joints.mended for side in (seam.a, seam.b)}
        self.others = mended | {slide.trace.surface for slide in joints.slides}
        self.found: dict[tuple[object, ...], list[Moved]] = defaultdict(list)
        self.first: dict[tuple[object, ...], list[int]] = defaultdict(list)
        self.known: dict[tuple[int, int], Congruence | None] = {}

    def firsts(self, surfaces: Iterable[int]) -> list[int]:
        """Those of some surfaces that are congruent to none before them, of these and of earlier calls."""
        found = []
        for i in surfaces:
            like = self.first[_kind(self.scene.sheets[i])]
            if not self._takes_part(i):
                found.append(i)
            elif not any(self._between(k, i) for k in like):
                like.append(i)
                found.append(i)
        return found

    def keep(self, moved: Moved) -> None:
        """Remember a result."""
        if self._takes_part(moved.sheet.index):
            self.found[_kind(moved.sheet)].append(moved.done())

    def result(self, i: int) -> Moved | None:
        """The result for a surface, if it is congruent to one for which it is known."""
        sheet = self.scene.sheets[i]
        if self._takes_part(i):
            for known in self.found[_kind(sheet)]:
                between = self._between(known.sheet.index, i)
                moved = self._moved(known, sheet, between) if between else None
                if moved is not None:
                    return moved
        return None

    def _takes_part(self, i: int) -> bool:
        return self.able and i not in self.others

    def _between(self, k: int, i: int) -> Congruence | None:
        """How a surface is congruent to another with edges held alike, if it is."""
        if (k, i) not in self.known:
            first, sheet = self.scene.sheets[k], self.scene.sheets[i]
            ways = congruences(first, sheet)
            self.known[k, i] = next((way for way in ways if self._joined_alike(first, sheet, way)), None)
        return self.known[k, i]

    def _moved(self, known: Moved, sheet: Sheet, between: Congruence) -> Moved | None:
        """The known result, moved to a congruent surface; None where the judge allows clearly less of it there."""
        net = between.finer(sheet.net, known.net)
        if net.poles.shape != between.arranged(known.net.poles).shape:
            return None
        tried = Tried(closely(sheet, net), [net], [between.offset(known.tried.parts[0])])
        if not known.amount:
            return replace(known, sheet=sheet, tried=tried, changes=tried.watch.still()[0])
        moved = replace(known, sheet=sheet, tried=tried).confirmed(self.scene.tolerances)
        jumps = Jumps(self.scene, {sheet.index: net}, self.scene.joints.among({sheet.index}), sheet.wavelength)
        room = jumps.room({sheet.index: displaced(net, moved.offset)})
        return moved if moved.amount >= ENOUGH * known.amount and not room else None

    def _joined_alike(self, first: Sheet, sheet: Sheet, between: Congruence) -> bool:
        """Whether all edges of a surface are held as those of the first."""
        both = [self.scene.joints.among({each.index}) for each in (first, sheet)]
        moving = [each.moving for each in both]
        faces = zip(first.all_faces, sheet.all_faces, strict=True)
        pairs = [pair for old, new in faces for pair in _edges(old, new, between)]
        return None not in pairs and all(self._held_alike(both, moving, pair) for pair in pairs if pair)

    def _held_alike(self, joined: list[Joints], moving: list[frozenset[int]], edges: tuple[int, int]) -> bool:
        said = []
        for joint, movable, edge in zip(joined, moving, edges, strict=True):
            meeting = joint.meetings.get(edge)
            beside = () if meeting is None else meeting.faces
            movers = sum(self.scene.model.faces[face].surface in self.scene.sheets for face in beside)
            said.append((edge in movable, str(joint.frozen.get(edge)), meeting and meeting.order, movers))
        if said[0] != said[1]:
            return False
        meetings = [joint.meetings.get(edge) for joint, edge in zip(joined, edges, strict=True)]
        room = [
            self.scene.tolerances.wider(self.scene.model.edges[edge], meeting.gap if meeting else 0.0)
            for edge, meeting in zip(edges, meetings, strict=True)
        ]
        return room[1] >= ENOUGH * room[0]


def _kind(sheet: Sheet) -> tuple[object, ...]:
    """What congruent surfaces have in common, in a form that can be looked up."""
    axes = sorted((each.degree, each.count, each.periodic) for each in (sheet.net.u, sheet.net.v))
    trims = tuple(len(face.trims) for face in sheet.all_faces)
    return (*axes, sheet.net.weights is None, trims, len(sheet.faces))


def _edges(first: Face, face: Face, between: Congruence) -> Iterator[tuple[int, int] | None]:
    """Each edge of a face of the first surface with that of the other; None where there is none."""
    size = np.array([knots.period for knots in (between.nets[1].u, between.nets[1].v)])
    theirs, own = between.places(_marks(first)), _marks(face)
    for trim, marks in zip(first.trims, theirs, strict=True):
        off = [np.abs((each - marks) / size).max(axis=(1, 2)) for each in (own, own[:, ::-1])]
        nearest = int(np.minimum(*off).argmin())
        yield (trim.edge, face.trims[nearest].edge) if min(each[nearest] for each in off) <= CLOSE else None


def _marks(face: Face) -> Array:
    """Both ends and the middle of each trim of a face, in parameters, ``(trims, 3, 2)``."""
    found = []
    for trim in face.trims:
        low, high = trim.curve.knots.domain
        found.append(trim.curve.evaluate(np.array([low, (low + high) / 2, high])))
    return np.array(found).reshape(-1, 3, 2)
