"""How the surfaces that an edit may move are joined and held.

Edges between two faces that both move are exact seams, where both sides end along parameter lines related by a law, or
contacts along trim curves; every other edge is a rim.  A seam keeps the continuity that it has, or that is asked for.
"""

from __future__ import annotations

from bisect import bisect_left
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from mracad.bspline.surface import Net, pairs
from mracad.model.brep import Face, Model, Trim
from mracad.seam.border import Border
from mracad.seam.cause import Cause, Still
from mracad.seam.contact import Contact
from mracad.seam.cost import costly
from mracad.seam.guide import Slide
from mracad.seam.hold import CONTINUITY, meeting, reached
from mracad.seam.natural import Meeting, Seam, seams
from mracad.seam.slide import slides
from mracad.seam.space import end
from mracad.seam.stretch import EVEN, Stretch
from mracad.seam.trace import trace_of
from mracad.seam.trimmed import TrimmedSeam, beside, trimmed
from mracad.seam.wishes import CREASE, Wishes
from mracad.spec.places import Zone
from mracad.wavelet.ladder import arc_lengths

Array = np.ndarray

RIM_POINTS = 65
"""Number of points of a boundary curve from which distances are measured."""

POLE = 2
"""Derivatives kept at a pole, where a side of a surface is one point: any motion there would make a cone."""

LOOSE = Still.TRIMMED, Still.UNEVEN
"""Causes for which seams can only move to a tolerance: not a parameter line of both sides, or a joint without a law."""


@dataclass(frozen=True, eq=False)
class Joints:
    """The edges of the faces that an edit may move.

    Attributes
    ----------
    exact : tuple of Seam
    loose : tuple of TrimmedSeam
        Seams that are kept to a tolerance.
    closing : mapping of int to (Border, Border)
        Closing edges that a periodic space keeps smooth anyway.
    frozen : mapping of int to Cause
        Edges that stay, and why.
    meetings : mapping of int to Meeting
        How edges meet their other side, which they keep where they stay.
    jumps : bool
        Whether jumps of curvature along them must not grow.
    open : frozenset of int
        Free edges and poles that move with their faces.
    cornered : bool
        Whether the corners between two of them stay.
    zones : tuple of Zone
        Regions in which nothing may move.
    slides : tuple of Slide
        Edges that slide along a neighbour that stays.
    """

    exact: tuple[Seam, ...] = ()
    loose: tuple[TrimmedSeam, ...] = ()
    closing: Mapping[int, tuple[Border, Border]] = field(default_factory=dict)
    frozen: Mapping[int, Cause] = field(default_factory=dict)
    meetings: Mapping[int, Meeting] = field(default_factory=dict)
    jumps: bool = False
    open: frozenset[int] = frozenset()
    cornered: bool = False
    zones: tuple[Zone, ...] = ()
    slides: tuple[Slide, ...] = ()

    @cached_property
    def moving(self) -> frozenset[int]:
        """Edges that move."""
        exact = (edge for seam in self.exact for edge in (seam.edge, seam.twin))
        loose = (edge for seam in self.loose for edge in (seam.edge, seam.twin))
        return self.open.union(self.closing, exact, loose, (slide.edge for slide in self.slides))

    @cached_property
    def orders(self) -> dict[int, int]:
        """Derivatives that edges keep with their other side, where they stay."""
        return {edge: meeting.order for edge, meeting in self.meetings.items()}

    @cached_property
    def mended(self) -> tuple[Seam | TrimmedSeam, ...]:
        """Seams whose gap or angle is mended."""
        exact = (seam for seam in self.exact if seam.joint.close or seam.joint.fit)
        return (*exact, *(seam for seam in self.loose if seam.close or seam.fit))

    def pairs(self) -> Iterator[tuple[int, int]]:
        """Surfaces that a seam joins."""
        yield from ((seam.a.surface, seam.b.surface) for seam in self.exact)
        yield from ((seam.a.surface, seam.b.surface) for seam in self.loose)

    def firm(self, sliding: Collection[int] = ()) -> Joints:
        """The same joints, with sliding edges only on some surfaces, by default on none."""
        slides = tuple(slide for slide in self.slides if slide.trace.surface in sliding)
        still = {slide.edge: slide.cause for slide in self.slides if slide.trace.surface not in sliding}
        return replace(self, slides=slides, frozen={**self.frozen, **still})

    def among(self, surfaces: Collection[int]) -> Joints:
        """The joints between some surfaces; edges to all others are rims."""
        members, count = frozenset(surfaces), len(self.exact)
        kept = sorted({k for i in members for k, other in self._beside.get(i, ()) if other in members})
        first = bisect_left(kept, count)
        exact, loose = (self.exact[k] for k in kept[:first]), (self.loose[k - count] for k in kept[first:])
        return replace(self, exact=tuple(exact), loose=tuple(loose))

    @cached_property
    def _beside(self) -> dict[int, list[tuple[int, int]]]:
        """The place of each seam of a surface among all, and the surface beyond it."""
        found: dict[int, list[tuple[int, int]]] = {}
        for k, (a, b) in enumerate(self.pairs()):
            found.setdefault(a, []).append((k, b))
            found.setdefault(b, []).append((k, a))
        return found


def joints(model: Model, movable: Collection[int], wishes: Wishes) -> Joints:
    """The joints of faces that may move."""
    known = seams(model, movable, wishes)
    exact, frozen, loose = list(known.found), dict(known.frozen), []
    for index, cause in known.frozen.items():
        edge = model.edges[index]
        twin = model.edges[known.twins.get(index, index)]
        if cause.still in LOOSE and len({edge.index, twin.index}) + len(edge.sides) == 3:
            found = trimmed(model, edge, twin, wishes)
            if isinstance(found, TrimmedSeam):
                loose.append(found)
                frozen.pop(index)
                frozen.pop(twin.index, None)
            else:
                frozen[index] = found
    apart = costly([surface.net for surface in model.surfaces], exact)
    for seam in [seam for seam in exact if seam.loose or seam.edge in apart]:
        rest = beside(model, seam, wishes, wholly=seam.edge in apart)
        if isinstance(rest, TrimmedSeam):
            loose.append(rest)
        elif seam.edge in apart or not seam.joint.order:
            frozen |= dict.fromkeys((seam.edge, seam.twin), rest)
        if seam.edge in apart or seam.edge in frozen:
            exact.remove(seam)
    jumps = wishes.jumps and wishes.keep not in CONTINUITY
    joined = Joints(tuple(exact), tuple(loose), known.closing, frozen, known.meetings, jumps, zones=wishes.zones)
    if wishes.free:
        joined = replace(_freed(joined), cornered=not wishes.corners)
    return _opened(joined) if wishes.open else _sliding(model, joined, movable, wishes.slide)


def _sliding(model: Model, joined: Joints, movable: Collection[int], able: Collection[int]) -> Joints:
    """The same joints, with edges that slide along neighbours that stay."""
    if not able:
        return joined
    seams: list[Seam | TrimmedSeam] = [*joined.exact, *joined.loose]
    pairs = [(edge, each.a.surface, each.b.surface) for each in seams for edge in {each.edge, each.twin}]
    pairs += [(edge, a.surface, b.surface) for edge, (a, b) in joined.closing.items()]
    for edge in joined.open:
        surface = next((model.faces[side.face].surface for side in model.edges[edge].sides), None)
        pairs += [] if surface is None else [(edge, surface, surface)]
    found = slides(model, {edge: joined.frozen[edge] for edge in joined.frozen if edge in able}, pairs, movable)
    gone = {slide.edge for slide in found}
    return replace(joined, slides=found, frozen={e: why for e, why in joined.frozen.items() if e not in gone})


def _freed(joined: Joints) -> Joints:
    """The same joints, with free edges that move with their faces."""
    ends = frozenset(edge for edge, why in joined.frozen.items() if why.still is Still.FREE)
    frozen = {edge: why for edge, why in joined.frozen.items() if edge not in ends}
    return replace(joined, frozen=frozen, open=ends)


def _opened(joined: Joints) -> Joints:
    """Joints of faces that change shape: free edges and poles move with them, and sharp edges stay."""
    angles = [
        *((s.edge, s.twin, s.angle) for s in joined.exact),
        *((s.edge, s.twin, s.opening[1]) for s in joined.loose),
    ]
    sharp = {edge for *edges, angle in angles if angle > CREASE for edge in edges}
    ends = frozenset(edge for edge, why in joined.frozen.items() if why.still in (Still.FREE, Still.POLE))
    frozen = {edge: why for edge, why in joined.frozen.items() if edge not in ends}
    return replace(
        joined,
        exact=tuple(seam for seam in joined.exact if seam.edge not in sharp),
        loose=tuple(seam for seam in joined.loose if seam.edge not in sharp),
        frozen=frozen | dict.fromkeys(sharp, Cause(Still.SHARP)),
        open=ends,
    )


def contact(seam: TrimmedSeam) -> Contact:
    """The contact of a seam kept to a tolerance."""
    return Contact(seam.a, seam.b, seam.order, seam.close, seam.fit, seam.since, seam.edge)


def rims(
    model: Model,
    net: Net,
    faces: Iterable[Face],
    movable: Collection[int],
    joined: Joints,
    given: Collection[int] = (),
) -> tuple[Array, list[Contact]]:
    """How a surface is held: held control points, and contacts with faces that stay.

    Parameters
    ----------
    model : Model
    net : Net
        The surface in the space of its displacement.
    faces : iterable of Face
        All faces on it.
    movable : collection of int
        Faces that may move.
    joined : Joints
        The edges that move with these faces, and what the others keep.
    given : collection of int
        Edges that hold nothing.

    Returns
    -------
    held : ndarray of bool (nu, nv)
    contacts : list of Contact
    """
    held, contacts, moving = np.zeros(net.poles.shape[:2], bool), [], joined.moving
    if joined.cornered:
        held |= _corners(
            net, [t for face in faces if face.index in movable for t in face.trims if t.edge in joined.open]
        )
    for face in faces:
        if face.index not in movable:
            held |= reached(net, [face])[face.index]
            continue
        for trim in face.trims:
            edge = model.edges[trim.edge]
            if edge.index in moving or edge.index in given:
                continue
            meeting = joined.meetings.get(edge.index)
            order = POLE if edge.degenerate else meeting.order if meeting else 0
            found = end(net, trim)
            if found is not None:
                held |= _rows(net, trim, *found, order)
            elif not edge.degenerate:
                contacts.append(Contact(trace_of(model, face, trim), None, order, edge=edge.index))
    return held, contacts


def twists(held: Array) -> Array:
    """Control points on which the twist depends where two held sides of a surface meet, both ``(nu, nv)``.

    The rest of the curvature there is given by the sides; the smoothest surface between two rough sides twists there.
    """
    found = np.zeros_like(held)
    for u, v in ((1, 1), (1, -1), (-1, 1), (-1, -1)):
        corner = held[::u, ::v]
        found[::u, ::v][1:2, 1:2] |= corner[:1, :1] & corner[:1, 1:2] & corner[1:2, :1]
    return found


def mended_ends(
    model: Model, net: Net, surface: int, faces: Sequence[Face], movable: Collection[int], joined: Joints, within: float
) -> Array:
    """Control points ``(nu, nv)`` held only by free edges, near the ends of seams that are to be mended.

    Parameters
    ----------
    model : Model
    net : Net
        The surface, in the space of its displacement.
    surface : int
    faces, movable, joined
        As for :func:`rims`.
    within : float
        mm.
    """
    from scipy.spatial import KDTree

    ends = [
        net.evaluate(side.places(np.array([0.0, 1.0])))
        for seam in joined.mended
        for side in (seam.a, seam.b)
        if side.surface == surface
    ]
    if not ends:
        return np.zeros(net.poles.shape[:2], bool)
    free = {trim.edge for face in faces for trim in face.trims if model.edges[trim.edge].free} - joined.meetings.keys()
    firm, _ = rims(model, net, faces, movable, joined, free)
    points = np.asarray(net.grid(net.u.greville(), net.v.greville())).reshape(-1, 3)
    near = KDTree(np.concatenate(ends)).query(points)[0] <= within
    return np.asarray(~firm & near.reshape(firm.shape))


def away(net: Net, faces: Iterable[Face], moving: Collection[int], stretch: Stretch = EVEN) -> Array:
    """Distance of a surface from the edges of its faces that do not move, longer where wavelengths are shorter.

    Returns
    -------
    ndarray (nu, nv)
        Distance at the Greville points, mm; infinite where nothing is held.
    """
    from scipy.spatial import KDTree

    trims = [trim for face in faces for trim in face.trims if trim.edge not in moving]
    if not trims:
        return np.full(net.poles.shape[:2], np.inf)
    curves = [trim.curve.evaluate(np.linspace(*trim.curve.knots.domain, RIM_POINTS))[0] for trim in trims]
    rim, us, vs = np.concatenate(curves), net.u.greville(), net.v.greville()
    if stretch.even:
        points, rim = np.asarray(net.grid(us, vs)).reshape(-1, 3), np.asarray(net.evaluate(rim))
    else:
        points, rim = (_laid(net, uv, stretch) for uv in (pairs(us, vs), rim))
    return np.asarray(KDTree(rim).query(points)[0]).reshape(net.poles.shape[:2])


def _laid(net: Net, uv: Array, stretch: Stretch) -> Array:
    """Points of a surface on a plane scaled so that wavelengths that differ by direction become equal."""
    lengths = [np.concatenate([[0.0], np.cumsum(arc_lengths(net, axis))]) for axis in (0, 1)]
    both = zip((net.u, net.v), uv.T, lengths, stretch.lengths, strict=True)
    return np.stack([np.interp(at, knots.breaks, along) / short for knots, at, along, short in both], axis=1)


def _corners(net: Net, trims: Iterable[Trim]) -> Array:
    """The corners of a net whose two sides both lie on trims."""
    sides = {end(net, trim) for trim in trims}
    held = np.zeros(net.poles.shape[:2], bool)
    for i in (0, -1):
        for j in (0, -1):
            held[i, j] = (0, i) in sides and (1, j) in sides
    return held


def _rows(net: Net, trim: Trim, axis: int, place: int, order: int) -> Array:
    """Control points on which the derivatives up to an order along a boundary curve at an end depend."""
    across = np.zeros(net.poles.shape[axis], bool)
    across[: order + 1] = place == 0
    across[len(across) - order - 1 :] |= place == -1
    along = trim.curve.poles[:, 1 - axis]
    columns = meeting((net.u, net.v)[1 - axis], float(along.min()), float(along.max()))
    return across[:, None] & columns if axis == 0 else columns[:, None] & across
