"""What is seen through every pixel: the surface itself, evaluated there, not the triangles that led to it."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from mracad.model.facets import Body, Facets, Placed, carried
from mracad.view.camera import Camera
from mracad.view.raster import Triangles, rasterised
from mracad.view.runs import groups
from mracad.view.spots import Spots, bends, cross, dot, shape, steady, unit

Array = np.ndarray

FINE = 2
"""Samples per pixel along each axis."""

_OFF = 2.0  # pixels: depths that differ by more within a pixel are two places of a face
_TURN = 0.9  # cosine of the angle of a normal by which it turns when moved, beyond which the place is not moved
_CLOSE, _STEP, _NEAR = 0.25, 8.0, 2.0  # pixels: nearer and farther places are not sought again; length of a step
_ROUNDS = 4


@dataclass(frozen=True, eq=False)
class Stage:
    """All faces of a body as a camera sees them.

    Attributes
    ----------
    body : Body
    camera : Camera
    entries : sequence of (Placed, int, Facets)
        Each face of each instance: the instance, the position of the face in it, and its triangles.
    triangles : Triangles
        In samples, of all entries.
    entry : ndarray of int (m,)
        The entry of each triangle.
    points : ndarray (n, 3)
        All points projected to samples and depth.
    first : ndarray of int
        The first point of each entry.
    bounds : ndarray (2, entries, 2)
        Least and largest parameters of each entry.
    """

    body: Body
    camera: Camera
    entries: Sequence[tuple[Placed, int, Facets]]
    triangles: Triangles
    entry: Array
    points: Array
    first: Array
    bounds: Array

    @classmethod
    def of(cls, body: Body, camera: Camera) -> Stage:
        """Project a body."""
        entries = [
            (place, k, body.facets[face])
            for place in body.placed
            for k, face in enumerate(place.faces)
            if face in body.facets
        ]
        points = [
            camera.project(facets.points @ place.frame[:3, :3].T + place.frame[:3, 3]) for place, _, facets in entries
        ]
        first = np.cumsum([0, *map(len, points)])
        mirrored = [np.linalg.det(place.frame[:3, :3]) < 0 for place, _, _ in entries]
        corners = np.concatenate(
            [
                (facets.corners[:, ::-1] if turned else facets.corners) + begin
                for (_, _, facets), turned, begin in zip(entries, mirrored, first, strict=False)
            ]
        )
        every = np.concatenate(points)
        every[:, :2] *= FINE
        kind = np.uint16 if len(entries) < 1 << 16 else np.int64  # short numbers are sorted faster
        entry = np.repeat(np.arange(len(entries), dtype=kind), [len(facets.corners) for _, _, facets in entries])
        uv = np.concatenate([facets.uv for _, _, facets in entries])
        triangles = Triangles.of(every[corners, :2], np.column_stack([every[:, 2], uv])[corners])
        bounds = np.stack([[f(facets.uv, axis=0) for _, _, facets in entries] for f in (np.min, np.max)])
        return cls(body, camera, entries, triangles, entry, every, first, bounds)


@dataclass(frozen=True, eq=False)
class Seen(Spots):
    """Places that are seen, each in one pixel.

    Attributes
    ----------
    pixel : ndarray of int (q,)
        Number of the pixel, row by row.
    weight : ndarray (q,)
        Share of the pixel.
    entry : ndarray of int (q,)
    turning : ndarray (2, 3, q)
        How the normal turns from a pixel to the next, to the right and up.
    front : ndarray of bool (q,)
        Whether the outer side is seen.
    """

    pixel: Array
    weight: Array
    entry: Array
    turning: Array
    front: Array

    @cached_property
    def facing(self) -> Array:
        """Normals of the side that is seen."""
        return np.asarray(np.where(self.front, 1.0, -1.0) * self.normal)


def layers(
    stage: Stage, rows: tuple[int, int], clear: Callable[[Placed, int], bool]
) -> tuple[Array, Array, Array, Array]:
    """The nearest opaque triangles in some rows of pixels, the nearest transparent ones before them, and depths."""
    width, lines = stage.camera.size[0] * FINE, (rows[0] * FINE, rows[1] * FINE)
    see_through = np.array([clear(place, k) for place, k, _ in stage.entries])
    if not see_through.any():
        solid, depth = rasterised(stage.triangles, lines, width)
        return solid, depth, np.full_like(solid, -1), depth
    opaque, glass = (np.flatnonzero(see_through[stage.entry] == which) for which in (False, True))
    solid, depth = rasterised(stage.triangles.some(opaque), lines, width)
    before, near = rasterised(stage.triangles.some(glass), lines, width, depth)
    return named(solid, opaque), depth, named(before, glass), near


def named(nearest: Array, names: Array) -> Array:
    """Numbers of chosen triangles as numbers of all."""
    return np.where(nearest < 0, -1, names[nearest] if len(names) else -1)


def seen(stage: Stage, nearest: Array, depth: Array, rows: tuple[int, int], order: int) -> Seen:
    """What is seen in some rows of pixels.

    Where all samples of a pixel show one place of a face, that is evaluated in the middle of the pixel; elsewhere every
    sample is.  ``order`` is the highest order of derivatives: with 2 curvatures are known, and places are moved into
    the middle of their pixels.
    """
    width = stage.camera.size[0]
    four = _grouped(nearest, width)
    entry = stage.entry[four]
    x, y = _centres(rows, width)
    whole = (four >= 0).all(axis=1) & (entry == entry[:, :1]).all(axis=1)
    lead = np.flatnonzero(whole)
    own, deep = four[lead, 0], _grouped(depth, width)[lead]
    deep -= stage.triangles.at(0, own, x[lead], y[lead])[:, None]
    deep -= stage.triangles.planes[0, 1:, own] @ np.transpose(_OFFSETS)
    apart = np.abs(deep).max(axis=1, initial=0.0) > _OFF * stage.camera.pixel
    whole[lead[apart]] = False
    lead = np.flatnonzero(whole)
    mixed, which = np.nonzero((four >= 0) & ~whole[:, None])
    shift = np.array(_OFFSETS)[which]
    pixel = np.concatenate([lead, mixed])
    at = np.column_stack([x[pixel], y[pixel]])
    at[len(lead) :] += shift
    weight = np.repeat([1.0, 1.0 / FINE**2], [len(lead), len(mixed)])
    chosen = np.concatenate([four[lead, 0], four[mixed, which]])
    return _evaluated(stage, chosen, at, pixel + rows[0] * width, weight, order)


_OFFSETS = tuple((dx, dy) for dy in (-0.5, 0.5) for dx in (-0.5, 0.5))  # of samples from the middle of their pixel


def _grouped(samples: Array, width: int) -> Array:
    """Samples by pixel, ``(pixels, 4)``."""
    return samples.reshape(-1, FINE, width, FINE).swapaxes(1, 2).reshape(-1, FINE**2)


def _centres(rows: tuple[int, int], width: int) -> tuple[Array, Array]:
    """Middles of pixels, in samples."""
    y, x = np.mgrid[rows[0] : rows[1], 0:width]
    return FINE * (x.ravel() + 0.5), FINE * (y.ravel() + 0.5)


def _evaluated(stage: Stage, which: Array, at: Array, pixel: Array, weight: Array, order: int) -> Seen:
    """The surface at places of triangles."""
    sorting = np.argsort(stage.entry[which], kind="stable")
    which, at, pixel, weight = which[sorting], at[sorting], pixel[sorting], weight[sorting]
    entry = stage.entry[which]
    uv = np.stack([stage.triangles.at(plane, which, *at.T) for plane in (1, 2)], axis=1)
    np.clip(uv, *stage.bounds[:, entry], out=uv)
    outward, face = np.array([(facets.outward, facets.face) for _, _, facets in stage.entries])[entry].T
    jets = _jets(stage, which, uv, order)
    shown = pixel, weight, entry
    if order == 1:
        s, su, sv = jets
        nothing = np.zeros((2, 3, 0))  # no curvatures are known
        return Seen(
            face, uv, s, outward * unit(cross(su, sv)), nothing[:, 0], *shown, nothing, stage.triangles.front[which]
        )
    at = at.T / FINE
    far = np.arange(len(entry))
    for _ in range(_ROUNDS):
        step, off = _aim(stage.camera, jets[:3, :, far], at[:, far])[:2]
        wrong = (off > _CLOSE) & (off < _STEP)
        far = far[wrong]
        if not len(far):
            break
        uv[far] = np.clip(uv[far] + step.T[wrong], *stage.bounds[:, entry[far]])
        jets[..., far] = _jets(stage, which[far], uv[far], order)
    point, normal, turning, curved = _bent(stage.camera, jets, outward, at)
    return Seen(face, uv, point, normal, curved, *shown, turning, stage.triangles.front[which])


def _jets(stage: Stage, which: Array, uv: Array, order: int) -> Array:
    """The jets at places of triangles, sorted by entry, as placed: ``(orders, 3, q)``."""
    jets = np.empty((1 + order * (order + 3) // 2, 3, len(which)))
    entry = stage.entry[which]
    for own in groups(entry):
        jets[..., own] = _jet(stage, stage.entries[entry[own.start]], which[own], uv[own], order)
    return jets


def _jet(stage: Stage, entry: tuple[Placed, int, Facets], which: Array, uv: Array, order: int) -> Array:
    """The jet of a face as placed, ``(orders, 3, q)``; a little inside its triangles where it is degenerate."""
    place, _, facets = entry

    def inner(some: Array) -> Array:
        middle = stage.triangles.corners[which[some]].mean(axis=1).T
        return np.stack([stage.triangles.at(plane, which[some], *middle) for plane in (1, 2)], axis=1)

    jet = carried(tuple(steady(facets.ground, uv, order, inner)), place.frame)
    return np.asarray(jet).swapaxes(1, 2)


def _bent(camera: Camera, jets: Array, outward: Array, at: Array) -> tuple[Array, Array, Array, Array]:
    """Points, outward normals, their turning from pixel to pixel, and curvatures, moved into their pixels."""
    s, su, sv, suu, suv, svv = jets
    ee, ff, gg = dot(su, su), dot(su, sv), dot(sv, sv)
    normal, curved = shape(jets)
    cut = cross(su, sv)
    area2 = np.maximum(dot(cut, cut), 1e-300)
    e, f, g = dot(normal, suu), dot(normal, suv), dot(normal, svv)
    nu = (f * ff - e * gg) / area2 * su + (e * ff - f * ee) / area2 * sv  # Weingarten
    nv = (g * ff - f * gg) / area2 * su + (f * ff - g * ee) / area2 * sv
    (du, dv), _, (right, up) = _aim(camera, jets[:3], at)
    turning = np.stack([each[0] * nu + each[1] * nv for each in (right, up)])
    near = unit(normal + du * nu + dv * nv)
    moved = s + du * su + dv * sv + 0.5 * du * du * suu + du * dv * suv + 0.5 * dv * dv * svv
    sane = dot(near, normal) > _TURN
    return (
        np.where(sane, moved, s), outward * np.where(sane, near, normal), outward * turning, bends(curved, outward)
    )  # fmt: skip


def _aim(camera: Camera, jets: Array, at: Array) -> tuple[Array, Array, tuple[Array, Array]]:
    """Steps of u and v that bring places into the middle of their pixels, how many pixels they are off, and the steps
    for a pixel to the right and up."""
    s, su, sv = jets
    a, b = (camera.axes[:2] @ each / camera.pixel for each in (su, sv))  # steps on the picture
    determinant = a[0] * b[1] - a[1] * b[0]
    least = 1e-9 * np.sqrt(dot(a, a) * dot(b, b))
    inverse = 1.0 / np.where(np.abs(determinant) > least, determinant, np.inf)
    right, up = np.stack([b[1], -a[1]]) * inverse, np.stack([-b[0], a[0]]) * inverse
    off = (at - camera.project(s.T).T[:2]) * [[1.0], [-1.0]]
    length = np.hypot(*off)
    off *= np.minimum(1.0, _NEAR / np.maximum(length, 1e-300))
    return right * off[0] + up * off[1], length, (right, up)
