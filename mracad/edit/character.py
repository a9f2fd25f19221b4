"""The character of a surface: its detail in bands of wavelength, as other surfaces can take it.

Points of two surfaces correspond when they lie at the same arc lengths from the low corners of the parameter rectangles
of their faces, where a source that ends is mirrored; or when one is nearest to the other.  Detail is carried from the
frame of the source without the detail to that of the target without its own.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from mracad.bspline.fit import Knots, divided, middles, missing, offsets_over, spans, through
from mracad.bspline.surface import Net, pairs
from mracad.bspline.vectors import cross
from mracad.edit.carry import Laid
from mracad.edit.feature.fit import MOST, NARROWEST
from mracad.edit.feature.ground import Ground
from mracad.edit.feature.ideal import Way
from mracad.edit.feature.patch import Patch
from mracad.errors import EditError
from mracad.model.displacement import lifted
from mracad.seam.zones import faded
from mracad.wavelet.ladder import arc_lengths
from mracad.wavelet.project import at_scale

Array = np.ndarray

NOTHING = 1e-7
"""Height up to which there is no detail, mm."""

NONE = 0.03
"""Share of the allowed error up to which a displacement is none: rounding of nearest points."""

STEPS, LINES = 4000, 9
"""Steps along (at least one per span), and lines across, to measure arc lengths."""


@dataclass(frozen=True, eq=False)
class Character:
    """The detail of a surface, and the lengths along it.

    Attributes
    ----------
    coarse : Patch
        The surface without detail.
    detail : Net
        Offsets in the part's frame.
    tables : pair of (ndarray, ndarray)
        Parameters, and the arc lengths at them from the low corner of its faces, mm, in u and v.
    sizes : pair of float
        Lengths of its faces in u and v, mm.
    """

    coarse: Patch
    detail: Net
    tables: Sequence[tuple[Array, Array]]
    sizes: tuple[float, float]

    @classmethod
    def of(cls, patch: Patch, bands: Sequence[tuple[float, float, float]]) -> Character:
        """The sum of the detail of a patch in some bands (least and largest wavelength, mm), each with a factor."""
        net = patch.net
        found = np.zeros_like(net.poles)
        for low, high, factor in bands:
            if factor:
                fine = at_scale(net, low) if low else net
                found += factor * (fine.poles - at_scale(net, high).poles)
        return cls.above(patch, at_scale(net, max(high for _, high, _ in bands)), net.with_poles(found))

    @classmethod
    def above(cls, patch: Patch, coarse: Net, detail: Net) -> Character:
        """Given detail of a patch above a coarse surface."""
        low, high = patch.domain
        uv = [trim.curve.poles for face in patch.faces for trim in face.trims]
        if uv:
            every = np.concatenate(uv)
            low, high = np.clip(every.min(axis=0), low, high), np.clip(every.max(axis=0), low, high)
        tables = [_lengths(coarse, axis, low, high) for axis in (0, 1)]
        first, last = (float(np.interp(high[axis], *tables[axis])) for axis in (0, 1))
        return cls(replace(patch, net=coarse), detail, tables, (first, last))

    def lengths(self, uv: Array) -> Array:
        """Arc lengths ``(q, 2)`` of parameters, mm."""
        return np.stack([np.interp(uv[:, i], *self.tables[i]) for i in (0, 1)], axis=1)

    def parameters(self, lengths: Array) -> Array:
        """Parameters at arc lengths, mirrored at the borders of the faces."""
        found = []
        for i, ((at, length), size) in enumerate(zip(self.tables, self.sizes, strict=True)):
            turn = np.abs((lengths[:, i] + size) % (2 * size) - size)
            found.append(np.interp(turn, length, at))
        return np.stack(found, axis=1)

    def frames(self, uv: Array) -> Array:
        """Frames ``(q, 3, 3)``: rows S_u, N × S_u, N of the coarse surface."""
        _, su, _, n = self.coarse.evaluate(uv)
        x = su / np.maximum(np.linalg.norm(su, axis=1, keepdims=True), 1e-300)
        return np.stack([x, np.cross(n, x), n], axis=1)

    def local(self, uv: Array) -> Array:
        """The detail at parameters, in those frames, mm."""
        return np.asarray(np.einsum("qij,qj->qi", self.frames(uv), np.asarray(self.detail.evaluate(uv))))

    @property
    def height(self) -> float:
        """The largest offset of a control point, mm."""
        return float(np.linalg.norm(self.detail.poles, axis=-1).max())

    @property
    def spacing(self) -> float:
        """Median width of the knot spans in the denser direction, mm."""
        lengths = (arc_lengths(self.coarse.net, axis) for axis in (0, 1))
        return min(float(np.median(each[each > 0])) for each in lengths)


def _lengths(net: Net, axis: int, low: Array, high: Array) -> tuple[Array, Array]:
    """Parameters over the domain in one direction, and the arc lengths at them from ``low``, as the mean of lines
    between ``low`` and ``high``."""
    knots = (net.u, net.v)[axis]
    ends = np.unique(np.concatenate([knots.breaks, [low[axis], high[axis]]]))
    steps = -(-STEPS // (len(ends) - 1)) * (len(ends) - 1)
    at = np.interp(np.linspace(0, len(ends) - 1, steps + 1), np.arange(len(ends)), ends)
    across = np.linspace(low[1 - axis], high[1 - axis], LINES)
    points = np.asarray(net.grid(at, across) if axis == 0 else net.grid(across, at))
    chords = np.linalg.norm(np.diff(points, axis=axis), axis=-1).mean(axis=1 - axis)
    total = np.append(0.0, np.cumsum(chords))
    return at, total - np.interp(low[axis], at, total)


@dataclass(frozen=True, eq=False)
class Along:
    """The detail of one surface at the same arc lengths of another."""

    own: Character
    other: Character
    way: Way

    def __call__(self, uv: Array) -> Array:
        """The displacement ``(q, 3)`` at parameters of the target, in the part's frame."""
        there = self.other.parameters(self.way.back(self.own.lengths(uv)))
        return np.asarray(np.einsum("qij,qi->qj", self.own.frames(uv), self.way.on(self.other.local(there))))


@dataclass(frozen=True, eq=False)
class Nearest:
    """The detail of some surfaces at the points nearest to those of another.

    Attributes
    ----------
    own : Character
    others : dict of int to Character
        By surface.
    ground : Ground
        Those without their detail.
    height : float
        Factor.
    reach, width : float
        Distance (mm) up to which surfaces lie over each other, and width within which detail fades beyond it, and
        beyond the ends of the others.
    """

    own: Character
    others: dict[int, Character]
    ground: Ground
    height: float
    reach: float
    width: float

    def __call__(self, uv: Array) -> Array:
        """The displacement ``(q, 3)`` at parameters of the target, in the part's frame."""
        points, _, _, normals = self.own.coarse.evaluate(uv)
        feet = self.ground.feet(points)
        found = np.zeros((len(uv), 3))
        for index, other in self.others.items():
            here = (feet.surface == index) & np.isfinite(feet.apart)
            if here.any():
                found[here] = np.asarray(other.detail.evaluate(feet.uv[here]))
        same = np.sign((normals * feet.normals).sum(axis=1, keepdims=True))
        share = 1.0 - faded(np.maximum(feet.apart - self.reach, 0.0) + feet.beside(points), self.width)
        share = np.where(np.isfinite(feet.apart), share, 0.0)[:, None]
        return np.asarray(self.height * share * _turned(found, same * feet.normals, normals))


def _turned(vectors: Array, before: Array, after: Array) -> Array:
    """Vectors turned by the least rotations that take unit vectors to others, ``(q, 3)`` each."""
    axis, cosine = cross(before, after), (before * after).sum(axis=1, keepdims=True)
    once = cross(axis, vectors)
    return np.asarray(vectors + once + cross(axis, once) / (1.0 + cosine))


@dataclass(frozen=True, eq=False)
class Carried:
    """What comes to a surface, in place of what goes.

    Attributes
    ----------
    target : Patch
        The surface with its own detail.
    ideal : callable
        The displacement ``(q, 3)`` at its parameters, in the part's frame, mm.
    own : Net
        Offsets that its own detail gets, in the part's frame.
    missed : float
        Allowed error of the displacement, mm; 0 if there is none.
    least : float
        Width of the knot spans that hold it, mm.
    wavelength : float
        Of its longest waves, mm.
    """

    target: Patch
    ideal: Callable[[Array], Array]
    own: Net
    missed: float
    least: float
    wavelength: float

    def over(self, net: Net) -> Net:
        """The surface, with knots where it cannot hold the displacement."""

        def more(knots: Knots) -> Sequence[Array]:
            _refuse_large(self.target, knots)
            uv = middles(*knots)
            uv = uv[self.target.covers(uv)]
            sites = [(uv, spans(kv, uv[:, axis])) for axis, kv in enumerate(knots)]
            delta = offsets_over(self.target.net, knots, self._through(self.target.net.over(*knots)))
            wanted = self.ideal(uv)
            return missing(self.target.net, delta, sites, lambda _: wanted, self.missed, (self.least, self.least))

        return net.over(*divided((net.u, net.v), more)) if self.missed else net

    def laid(self, net: Net) -> Laid:
        """The displacement as offsets over the knots of a net of the surface."""
        offset = self._through(net) + lifted(self.target.net, net, self.own.poles)
        if np.abs(offset).max() <= max(NOTHING, NONE * self.missed):
            offset = np.zeros_like(offset)
        return Laid(offset @ self.target.turn, "carried")

    def _through(self, net: Net) -> Array:
        """Control points, in the part's frame, of the displacement interpolated at the Greville points of a net."""
        values = self.ideal(pairs(net.u.greville(), net.v.greville()))
        return through(net, values.reshape(net.u.count, net.v.count, 3))


def _refuse_large(target: Patch, knots: Knots) -> None:
    """Raise EditError if a surface would get too many control points."""
    if knots[0].count * knots[1].count > MOST:
        face, (u, v) = target.faces[0].index + 1, (each.count for each in knots)
        raise EditError(
            f"the detail needs {u} × {v} control points on #{face}", "use a larger --size, or --refine never"
        )


def wide_enough(width: float, size: float) -> float:
    """The width of knot spans (mm) for detail scaled by a factor; raises EditError for one that is too small."""
    if width * size < NARROWEST:
        raise EditError(f"size: {size:g} would need knots closer than {NARROWEST:g} mm", "give a larger --size")
    return width * size
