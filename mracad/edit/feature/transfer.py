"""The character of a surface: all its detail within a band, carried to another surface.

Points of two faces correspond when they lie at the same arc lengths from the low corners of their parameter
rectangles; where the target is larger, the source is mirrored at its borders.  The detail is carried from the frame
(S_u, N × S_u, N) of the source without the band to that of the target.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from mracad.bspline.knots import KnotVector
from mracad.bspline.surface import Net
from mracad.constraint.frozen import separate
from mracad.constraint.seam import seams
from mracad.constraint.wishes import Wishes
from mracad.edit.feature.copies import Laid, offset, over
from mracad.edit.feature.detail import taper
from mracad.edit.feature.fit import MISSED, NARROWEST, Knots, divided, split, through, weights_over
from mracad.edit.feature.patch import Patch
from mracad.edit.feature.score import Copy
from mracad.errors import EditError
from mracad.model.brep import Model
from mracad.spec.steps import Transfer
from mracad.wavelet.ladder import arc_lengths, ladder_for_scale
from mracad.wavelet.project import projection

Array = np.ndarray

STEPS, LINES = 4000, 9
"""Steps along (at least one a span), and lines across, from which arc lengths are measured."""


def at_scale(net: Net, scale: float) -> Array:
    """Control points of a net, over its own knots, without what is finer than a scale (mm)."""
    poles = net.poles
    for axis, knots in enumerate((net.u, net.v)):
        poles = projection(ladder_for_scale(knots, arc_lengths(net, axis), scale), knots).apply(poles, axis=axis)
    return poles


class Character:
    """The detail of a patch in a band (mm), and the lengths along it.

    Attributes
    ----------
    coarse : Net
        The patch without what is finer than the band's largest wavelength.
    detail : Net
        Offsets: the band.
    """

    def __init__(self, patch: Patch, band: tuple[float, float]) -> None:
        self.patch, net = patch, patch.net
        poles = at_scale(net, band[1])
        fine = at_scale(net, band[0]) if band[0] else net.poles
        self.coarse = Net(net.u, net.v, poles, net.weights)
        self.detail = Net(net.u, net.v, fine - poles, net.weights)
        uv = [trim.curve.poles for face in patch.faces for trim in face.trims]
        low, high = patch.domain
        if uv:
            every = np.concatenate(uv)
            low, high = (np.clip(x, low, high) for x in (every.min(axis=0), every.max(axis=0)))
        self.tables = [self._lengths(axis, low, high) for axis in (0, 1)]

    def _lengths(self, axis: int, low: Array, high: Array) -> tuple[Array, Array]:
        """Parameters from one end of the face to the other, and arc lengths there, in one direction."""
        kv = self.patch.knots[axis]
        inner = kv.breaks[(kv.breaks > low[axis]) & (kv.breaks < high[axis])]
        ends = np.concatenate([[low[axis]], inner, [high[axis]]])
        steps = -(-STEPS // (len(ends) - 1)) * (len(ends) - 1)
        at = np.interp(np.linspace(0, len(ends) - 1, steps + 1), np.arange(len(ends)), ends)
        across = np.linspace(low[1 - axis], high[1 - axis], LINES)
        points = np.asarray(self.coarse.grid(at, across) if axis == 0 else self.coarse.grid(across, at))
        chords = np.linalg.norm(np.diff(points, axis=axis), axis=-1).mean(axis=1 - axis)
        return at, np.append(0.0, np.cumsum(chords))

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
        _, su, sv = self.coarse.evaluate(uv, 1)
        normal = self.patch.signs(uv)[:, None] * np.cross(su, sv)
        x, n = (d / np.maximum(np.linalg.norm(d, axis=1, keepdims=True), 1e-300) for d in (su, normal))
        return np.stack([x, np.cross(n, x), n], axis=1)

    def local(self, uv: Array) -> Array:
        """The detail at parameters, in those frames."""
        return np.einsum("qij,qj->qi", self.frames(uv), np.asarray(self.detail.evaluate(uv)))


@dataclass(frozen=True, eq=False)
class Carried:
    """The detail of one patch at the places of another."""

    own: Character
    other: Character
    options: Transfer

    def __call__(self, uv: Array) -> Array:
        """The displacement ``(q, 3)`` at parameters of the target, in the part's frame."""
        options = self.options
        _, comes = options.share()
        turn, flip = np.radians(options.rotate), -1.0 if options.mirror else 1.0
        x, y = self.own.lengths(uv).T / options.size
        places = np.stack([np.cos(turn) * x + np.sin(turn) * y, flip * (np.cos(turn) * y - np.sin(turn) * x)], axis=1)
        t, s, n = self.other.local(self.other.parameters(places)).T
        s = flip * s
        moved = [
            options.size * (np.cos(turn) * t - np.sin(turn) * s),
            options.size * (np.sin(turn) * t + np.cos(turn) * s),
        ]
        return comes * np.einsum("qij,qi->qj", self.own.frames(uv), np.stack([*moved, options.height * n], axis=1))


def laid_on(
    model: Model, target: Patch, source: Patch, band: tuple[float, float], options: Transfer, width: float | None
) -> Laid:
    """The detail of one patch on another, as offsets.

    Parameters
    ----------
    model : Model
        The target's.
    target, source : Patch
    band : (float, float)
        Wavelengths, mm.
    options : Transfer
    width : float or None
        Over which the detail fades towards points that stay, mm; half of the largest wavelength by default.
    """
    own, other = Character(target, band), Character(source, band)
    stays, comes = options.share()
    ideal = Carried(own, other, options)
    height = float(np.linalg.norm(other.detail.poles, axis=-1).max()) * abs(options.height)
    if height * comes <= 1e-7 and stays == 1.0:
        raise EditError(f"from: {options.from_} has no detail in the band", "give another --band")
    least = _spacing(source) * options.size
    if least < NARROWEST:
        raise EditError(f"size: {options.size:g} would need knots closer than {NARROWEST:g} mm", "give a larger --size")
    knots = divided(target.knots, lambda knots: _more(target, ideal, knots, MISSED * height, least))
    poles = _poles(target, ideal, knots)
    net = model.surfaces[target.index].net
    fine = net.over(*knots)
    faces = [model.faces[i] for i in model.surfaces[target.index].faces]
    own_faces = {face.index for face in target.faces}
    free = separate(fine, faces, own_faces, seams(model, own_faces, Wishes(options.keep)).orders).free
    if not free.any():
        raise EditError(f"to: {options.to} has no free control point", "use --keep g0")
    window = _window(fine, free, band[1] / 2 if width is None else width)
    wanted = poles + over(net, fine, (stays - 1.0) * own.detail.poles)
    copy = _compared(target, ideal, knots, poles, wanted * (window - 1.0)[..., None])
    return Laid({target.index: offset(net, fine, wanted * window[..., None] @ target.turn)}, (copy,))


def _compared(target: Patch, ideal: Carried, knots: Knots, poles: Array, gone: Array) -> Copy:
    """What became of the detail, of which control points ``gone`` are taken away."""
    uv = _middles(*knots)
    uv = uv[target.covers(uv)]
    weights = weights_over(target, knots)
    missed = np.linalg.norm(np.asarray(Net(*knots, poles, weights).evaluate(uv)) - ideal(uv), axis=1)
    lost = np.linalg.norm(np.asarray(Net(*knots, gone, weights).evaluate(uv)), axis=1)
    middle = np.asarray(target.net.evaluate(uv[len(uv) // 2][None]))[0]
    return Copy(
        f"{ideal.options.from_} on {ideal.options.to}",
        tuple(float(x) for x in middle),  # type: ignore[arg-type]
        tuple(f.index for f in target.faces),
        float(missed.max()),
        float(np.sqrt((missed**2).mean())),
        float(lost.max()),
        float(missed.max()),
        False,
    )


def _spacing(patch: Patch) -> float:
    """Median width of the spans of a patch in the denser direction, mm."""
    lengths = (arc_lengths(patch.net, axis) for axis in (0, 1))
    return min(float(np.median(each[each > 0])) for each in lengths)


def _poles(target: Patch, ideal: Carried, knots: Knots) -> Array:
    """Control points over knots of the target that hold the ideal, in the part's frame."""
    at = np.stack(np.meshgrid(*(k.greville() for k in knots), indexing="ij"), axis=-1).reshape(-1, 2)
    return through(target, knots, ideal(at).reshape(knots[0].count, knots[1].count, 3))


def _more(target: Patch, ideal: Carried, knots: Knots, limit: float, least: float) -> list[Array]:
    """Knots that divide the spans in which the target misses the ideal by more than a limit."""
    uv = _middles(*knots)
    uv = uv[target.covers(uv)]
    net = Net(*knots, _poles(target, ideal, knots), weights_over(target, knots))
    missed = np.linalg.norm(np.asarray(net.evaluate(uv)) - ideal(uv), axis=1)
    _, *tangents, _ = target.evaluate(uv)
    more = []
    for axis, kv in enumerate(knots):
        span = np.clip(np.searchsorted(kv.breaks, uv[:, axis], side="right") - 1, 0, kv.spans - 1)
        more.append(split(kv, span, missed / limit, np.linalg.norm(tangents[axis], axis=1), least))
    return more


def _middles(u: KnotVector, v: KnotVector) -> Array:
    """Parameters half-way between neighbouring Greville points of both directions."""
    lists: Sequence[Array] = [np.sort(k.greville()) for k in (u, v)]
    return np.stack(np.meshgrid(*((x[1:] + x[:-1]) / 2 for x in lists), indexing="ij"), axis=-1).reshape(-1, 2)


def _window(net: Net, free: Array, width: float) -> Array:
    """Weights of control points: 0 where they stay, up to 1 at ``width`` (mm) from there."""
    from scipy.spatial import cKDTree

    points = np.asarray(net.grid(net.u.greville(), net.v.greville())).reshape(-1, 3)
    flat = free.ravel()
    if flat.all():
        return np.ones(free.shape)
    apart = np.zeros(len(points))
    apart[flat] = cKDTree(points[~flat]).query(points[flat])[0]
    return np.where(flat, 1.0 - taper(apart / width), 0.0).reshape(free.shape)
