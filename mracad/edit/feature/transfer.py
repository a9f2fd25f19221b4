"""The character of a surface: all its detail within a band, transferred to another surface.

Points of two faces correspond when they lie at the same arc lengths from the low corners of their parameter
rectangles; where the target is larger, the source is mirrored at its borders.  The detail is carried from the frame
(S_u, N × S_u, N) of the source without the band to that of the target.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from mracad.bspline.fit import Knots, divided, middles, missing, offsets_over, spans, through
from mracad.bspline.knots import KnotVector
from mracad.bspline.surface import Net, pairs
from mracad.edit.feature.detail import taper
from mracad.edit.feature.fit import MISSED, NARROWEST
from mracad.edit.feature.ideal import Way
from mracad.edit.feature.lay import Laid
from mracad.edit.feature.patch import Patch
from mracad.edit.feature.score import Copy, Figures, copied
from mracad.errors import EditError
from mracad.model.brep import Model
from mracad.model.displacement import Offset, lifted
from mracad.seam.hold import separate
from mracad.seam.natural import seams
from mracad.seam.wishes import Wishes
from mracad.seam.zones import zoned
from mracad.spec.places import Zone
from mracad.spec.steps import Transfer
from mracad.wavelet.ladder import arc_lengths
from mracad.wavelet.project import band as band_of

Array = np.ndarray

STEPS, LINES = 4000, 9
"""Steps along (at least one per span), and lines across, to measure arc lengths."""


@dataclass(frozen=True, eq=False)
class Character:
    """The detail of a surface in a band (mm), and the lengths along it.

    Attributes
    ----------
    coarse : Patch
        The surface without detail finer than the band's largest wavelength.
    detail : Net
        Offsets: the band.
    tables : pair of (ndarray, ndarray)
        Parameters from one end of its faces to the other, and the arc lengths at them, in u and v.
    """

    coarse: Patch
    detail: Net
    tables: Sequence[tuple[Array, Array]]

    @classmethod
    def of(cls, patch: Patch, band: tuple[float, float]) -> Character:
        """The detail of a patch in a band."""
        coarse, detail = band_of(patch.net, *band)
        ends = patch.domain
        uv = [trim.curve.poles for face in patch.faces for trim in face.trims]
        if uv:
            every = np.concatenate(uv)
            ends = np.clip(every.min(axis=0), *ends), np.clip(every.max(axis=0), *ends)
        return cls(replace(patch, net=coarse), detail, [_lengths(coarse, axis, *ends) for axis in (0, 1)])

    def lengths(self, uv: Array) -> Array:
        """Arc lengths ``(q, 2)`` of parameters."""
        return np.stack([np.interp(uv[:, i], *self.tables[i]) for i in (0, 1)], axis=1)

    def parameters(self, lengths: Array) -> Array:
        """Parameters at arc lengths, mirrored at the borders of the face."""
        found = []
        for i, (at, length) in enumerate(self.tables):
            turn = np.abs((lengths[:, i] + length[-1]) % (2 * length[-1]) - length[-1])
            found.append(np.interp(turn, length, at))
        return np.stack(found, axis=1)

    def frames(self, uv: Array) -> Array:
        """Frames ``(q, 3, 3)``: rows S_u, N × S_u, N of the coarse surface."""
        _, su, _, n = self.coarse.evaluate(uv)
        x = su / np.maximum(np.linalg.norm(su, axis=1, keepdims=True), 1e-300)
        return np.stack([x, np.cross(n, x), n], axis=1)

    def local(self, uv: Array) -> Array:
        """The detail at parameters, in those frames."""
        return np.asarray(np.einsum("qij,qj->qi", self.frames(uv), np.asarray(self.detail.evaluate(uv))))


def _lengths(net: Net, axis: int, low: Array, high: Array) -> tuple[Array, Array]:
    """Parameters from one end to the other in one direction, and the arc lengths at them."""
    breaks = (net.u, net.v)[axis].breaks
    ends = np.concatenate([[low[axis]], breaks[(breaks > low[axis]) & (breaks < high[axis])], [high[axis]]])
    steps = -(-STEPS // (len(ends) - 1)) * (len(ends) - 1)
    at = np.interp(np.linspace(0, len(ends) - 1, steps + 1), np.arange(len(ends)), ends)
    across = np.linspace(low[1 - axis], high[1 - axis], LINES)
    points = np.asarray(net.grid(at, across) if axis == 0 else net.grid(across, at))
    chords = np.linalg.norm(np.diff(points, axis=axis), axis=-1).mean(axis=1 - axis)
    return at, np.append(0.0, np.cumsum(chords))


@dataclass(frozen=True, eq=False)
class Carried:
    """The detail of one surface at the places of another, multiplied by a factor."""

    own: Character
    other: Character
    way: Way
    share: float

    def __call__(self, uv: Array) -> Array:
        """The displacement ``(q, 3)`` at parameters of the target, in the part's frame."""
        there = self.other.parameters(self.way.back(self.own.lengths(uv)))
        moved = self.way.on(self.other.local(there))
        return np.asarray(self.share * np.einsum("qij,qi->qj", self.own.frames(uv), moved))


def laid_on(
    model: Model,
    target: Patch,
    source: Patch,
    band: tuple[float, float],
    options: Transfer,
    width: float | None,
    zones: Sequence[Zone] = (),
) -> Laid:
    """The detail of one patch on another, as offsets.

    Parameters
    ----------
    model : Model
        Model of the target.
    target, source : Patch
    band : (float, float)
        Wavelengths, mm.
    options : Transfer
    width : float or None
        Width over which the detail fades towards held control points, mm; by default half the largest wavelength.
    zones : sequence of Zone
        Regions in which nothing may move.
    """
    own, other = Character.of(target, band), Character.of(source, band)
    stays, comes = options.share()
    ideal = Carried(own, other, Way(np.radians(options.rotate), options.size, options.height, options.mirror), comes)
    height = float(np.linalg.norm(other.detail.poles, axis=-1).max()) * abs(options.height)
    if height * comes <= 1e-7 and stays == 1.0:
        raise EditError(f"from: {options.from_} has no detail in the band", "give another --band")
    least = _spacing(source) * options.size
    if least < NARROWEST:
        raise EditError(f"size: {options.size:g} would need knots closer than {NARROWEST:g} mm", "give a larger --size")

    def more(knots: Knots) -> Sequence[Array]:
        uv = _middles(target, *knots)
        sites = [(uv, spans(kv, uv[:, axis])) for axis, kv in enumerate(knots)]
        delta = offsets_over(target.net, knots, _poles(target, ideal, knots))
        return missing(target.net, delta, sites, ideal, MISSED * height, (least, least))

    knots = divided(target.knots, more)
    poles, net = _poles(target, ideal, knots), model.surfaces[target.index].net
    fine = net.over(*knots)
    faces, movable = [model.faces[i] for i in model.surfaces[target.index].faces], {face.index for face in target.faces}
    free = separate(fine, faces, movable, seams(model, movable, Wishes(options.keep)).orders).free
    free &= ~zoned(fine, faces, zones)
    if not free.any():
        raise EditError(f"to: {options.to} has no free control point", "use --keep g0")
    window = _window(fine, free, band[1] / 2 if width is None else width)
    wanted = poles + lifted(net, fine, (stays - 1.0) * own.detail.poles)
    gone = wanted * (window - 1.0)[..., None]
    copy = _compared(target, ideal, offsets_over(target.net, knots, poles), offsets_over(target.net, knots, gone))
    copy = replace(copy, place=f"{options.from_} on {options.to}")
    return Laid({target.index: Offset.of(net, fine, wanted * window[..., None] @ target.turn)}, (copy,))


def _compared(target: Patch, ideal: Carried, delta: Net, gone: Net) -> Copy:
    """The figures of the detail after constraints, as of a copy."""
    uv = _middles(target, delta.u, delta.v)
    missed = np.linalg.norm(np.asarray(delta.evaluate(uv)) - ideal(uv), axis=1)
    lost = np.linalg.norm(np.asarray(gone.evaluate(uv)), axis=1)
    middle = np.asarray(target.net.evaluate(uv[len(uv) // 2][None]))[0]
    return copied("", middle, [Figures(missed, lost, missed, np.array([f.index for f in target.faces]))])


def _spacing(patch: Patch) -> float:
    """Median width of the spans of a patch in the denser direction, mm."""
    lengths = (arc_lengths(patch.net, axis) for axis in (0, 1))
    return min(float(np.median(each[each > 0])) for each in lengths)


def _poles(target: Patch, ideal: Carried, knots: Knots) -> Array:
    """Control points over knots of the target that hold the ideal, in the part's frame."""
    values = ideal(pairs(*(k.greville() for k in knots)))
    return through(target.net.over(*knots), values.reshape(knots[0].count, knots[1].count, 3))


def _middles(target: Patch, u: KnotVector, v: KnotVector) -> Array:
    """Parameters on the faces of a patch, halfway between Greville points."""
    uv = middles(u, v)
    return np.asarray(uv[target.covers(uv)])


def _window(net: Net, free: Array, width: float) -> Array:
    """Weights of control points ``(nu, nv)``: 0 where held, rising to 1 at a distance of ``width`` (mm)."""
    from scipy.spatial import cKDTree

    points, flat = np.asarray(net.grid(net.u.greville(), net.v.greville())).reshape(-1, 3), free.ravel()
    apart = np.zeros(len(points))
    apart[flat] = cKDTree(points[~flat]).query(points[flat])[0] if not flat.all() else np.inf
    return np.where(flat, 1.0 - taper(apart / width), 0.0).reshape(free.shape)
