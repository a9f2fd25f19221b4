"""The character of a surface: all its detail within a band, carried to another surface.

Points of two faces correspond when they lie at the same arc lengths from the low corners of their parameter
rectangles; where the target is larger, the source is mirrored at its borders.  The detail is carried from the frame
(S_u, N × S_u, N) of the source without the band to that of the target.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from mracad.bspline.interpolate import interpolated
from mracad.bspline.knots import KnotVector
from mracad.bspline.net import Net
from mracad.constraint.frozen import separate
from mracad.errors import EditError
from mracad.feature.copies import (
    MISSED,
    NARROWEST,
    PIECES,
    ROUNDS,
    SPARE,
    Copy,
    Laid,
    divided,
    refined_offset,
    weights_over,
)
from mracad.feature.detail import taper
from mracad.feature.ground import Sheet
from mracad.model import Model, Offset
from mracad.options import Transfer
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
    """The detail of a sheet in a band (mm), and the lengths along it.

    Attributes
    ----------
    coarse : Net
        The sheet without what is finer than the band's largest wavelength.
    detail : Net
        Offsets: the band.
    """

    def __init__(self, sheet: Sheet, band: tuple[float, float]) -> None:
        self.sheet, net = sheet, sheet.net
        poles = at_scale(net, band[1])
        fine = at_scale(net, band[0]) if band[0] else net.poles
        self.coarse = Net(net.u, net.v, poles, net.weights)
        self.detail = Net(net.u, net.v, fine - poles, net.weights)
        uv = [trim.curve.poles for face in sheet.faces for trim in face.trims]
        low, high = sheet.domain
        if uv:
            every = np.concatenate(uv)
            low, high = (np.clip(x, low, high) for x in (every.min(axis=0), every.max(axis=0)))
        self.tables = [self._lengths(axis, low, high) for axis in (0, 1)]

    def _lengths(self, axis: int, low: Array, high: Array) -> tuple[Array, Array]:
        """Parameters from one end of the face to the other, and arc lengths there, in one direction."""
        kv = self.sheet.knots[axis]
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
        normal = self.sheet.signs(uv)[:, None] * np.cross(su, sv)
        x, n = (d / np.maximum(np.linalg.norm(d, axis=1, keepdims=True), 1e-300) for d in (su, normal))
        return np.stack([x, np.cross(n, x), n], axis=1)

    def local(self, uv: Array) -> Array:
        """The detail at parameters, in those frames."""
        return np.einsum("qij,qj->qi", self.frames(uv), np.asarray(self.detail.evaluate(uv)))


def laid_on(
    model: Model, target: Sheet, source: Sheet, band: tuple[float, float], options: Transfer, width: float | None
) -> Laid:
    """The detail of one sheet on another, as offsets.

    Parameters
    ----------
    model : Model
        The target's.
    target, source : Sheet
    band : (float, float)
        Wavelengths, mm.
    options : Transfer
    width : float or None
        Over which the detail fades towards points that stay, mm; half of the largest wavelength by default.
    """
    own, other = Character(target, band), Character(source, band)
    stays, comes = options.share()
    turn = np.radians(options.rotate)
    flip = -1.0 if options.mirror else 1.0

    def ideal(uv: Array) -> Array:
        x, y = own.lengths(uv).T / options.size
        places = np.stack([np.cos(turn) * x + np.sin(turn) * y, flip * (np.cos(turn) * y - np.sin(turn) * x)], axis=1)
        t, s, n = other.local(other.parameters(places)).T
        s = flip * s
        moved = [
            options.size * (np.cos(turn) * t - np.sin(turn) * s),
            options.size * (np.sin(turn) * t + np.cos(turn) * s),
        ]
        return comes * np.einsum("qij,qi->qj", own.frames(uv), np.stack([*moved, options.height * n], axis=1))

    height = float(np.linalg.norm(other.detail.poles, axis=-1).max()) * abs(options.height)
    if height * comes <= 1e-7 and stays == 1.0:
        raise EditError(f"from: {options.from_} has no detail in the band", "give another --band")
    least = [float(np.median(arc_lengths(source.net, axis)[arc_lengths(source.net, axis) > 0])) for axis in (0, 1)]
    if min(least) * options.size < NARROWEST:
        raise EditError(f"size: {options.size:g} would need knots closer than {NARROWEST:g} mm", "give a larger --size")
    extra, poles = _held(target, own, ideal, MISSED * height, min(least) * options.size)
    net = model.surfaces[target.index].net
    fine = net.refined(*extra)
    removed = refined_offset(net, fine, (stays - 1.0) * own.detail.poles)
    faces = [model.faces[i] for i in model.surfaces[target.index].faces]
    free = separate(fine, faces, [f.index for f in target.faces], options.keep).free
    if not free.any():
        raise EditError(f"to: {options.to} has no free control point", "use --keep g0")
    window = _window(fine, free, band[1] / 2 if width is None else width)
    wanted = poles + removed
    offset = wanted * window[..., None] @ target.turn
    uv = _middles(fine.u, fine.v)
    uv = uv[target.covers(uv)]
    fit = np.asarray(Net(fine.u, fine.v, poles, fine.weights).evaluate(uv)) - ideal(uv)
    gone = np.asarray(Net(fine.u, fine.v, wanted * (window - 1.0)[..., None], fine.weights).evaluate(uv))
    missed = np.linalg.norm(fit, axis=1)
    middle = np.asarray(target.net.evaluate(uv[len(uv) // 2][None]))[0]
    copy = Copy(
        f"{options.from_} on {options.to}",
        tuple(float(x) for x in middle),  # type: ignore[arg-type]
        tuple(f.index for f in target.faces),
        float(missed.max()),
        float(np.sqrt((missed**2).mean())),
        float(np.linalg.norm(gone, axis=1).max()),
        False,
    )
    return Laid({target.index: Offset(offset, *extra)}, (copy,), {}, frozenset())


def _held(
    target: Sheet, own: Character, ideal: object, limit: float, least: float
) -> tuple[tuple[Array, Array], Array]:
    """Knots that the target needs, and control points (part's frame) that hold the ideal over them."""
    assert callable(ideal)
    extra: tuple[Array, Array] = (np.empty(0), np.empty(0))
    for last in (*[False] * ROUNDS, True):
        knots = target.net.u.refined(extra[0]), target.net.v.refined(extra[1])
        at = np.stack(np.meshgrid(*(k.greville() for k in knots), indexing="ij"), axis=-1).reshape(-1, 2)
        values = ideal(at).reshape(knots[0].count, knots[1].count, 3)
        weights = weights_over(target, *knots)
        if weights is not None:
            values = values * np.asarray(Net(*knots, weights[..., None]).grid(knots[0].greville(), knots[1].greville()))
        poles = interpolated(*knots, values)
        poles = poles if weights is None else poles / weights[..., None]
        if last:
            break
        uv = _middles(*knots)
        uv = uv[target.covers(uv)]
        missed = np.linalg.norm(np.asarray(Net(*knots, poles, weights).evaluate(uv)) - ideal(uv), axis=1)
        more = []
        for axis, kv in enumerate(knots):
            worst, speed = np.zeros(kv.spans), np.zeros(kv.spans)
            span = np.clip(np.searchsorted(kv.breaks, uv[:, axis], side="right") - 1, 0, kv.spans - 1)
            np.maximum.at(worst, span, missed)
            np.maximum.at(speed, span, np.linalg.norm(target.evaluate(uv)[1 + axis], axis=1))
            wide = speed * np.diff(kv.breaks)
            pieces = np.clip(np.ceil((worst / limit) ** (1 / (kv.degree + 1))), 1, PIECES)
            pieces = np.where(wide > SPARE * least, np.minimum(pieces, np.ceil(wide / least)), 1).astype(int)
            more.append(divided(kv, pieces))
        if not any(map(len, more)):
            break
        extra = np.sort(np.r_[extra[0], more[0]]), np.sort(np.r_[extra[1], more[1]])
    return extra, poles


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
