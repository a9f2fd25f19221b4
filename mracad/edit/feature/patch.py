"""One surface of the ground that features lie on."""

from __future__ import annotations

from collections.abc import Collection, Iterable
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from mracad.bspline.knots import KnotVector
from mracad.bspline.surface import Net, pairs
from mracad.bspline.vectors import unit
from mracad.model.brep import Face, Model
from mracad.model.outline import FLAT, outline
from mracad.model.region import covered, face_region
from mracad.wavelet.ladder import arc_lengths

if TYPE_CHECKING:
    from scipy.spatial import cKDTree

Array = np.ndarray

RIM = 200
"""Points of a rim across a surface, at least."""

PARTS = 8
"""Parts of a surface in each direction with boxes of their own."""

SEEDS = 90
"""Number of parameters in each direction, at most, by spans and again by length, from which a point is projected."""


@dataclass(frozen=True, eq=False)
class Patch:
    """One surface of the ground.

    Attributes
    ----------
    index : int
        In ``Model.surfaces``.
    net : Net
        In the part's frame.
    faces : tuple of Face
        Those of its faces that belong to the ground.
    """

    index: int
    net: Net
    faces: tuple[Face, ...]

    @classmethod
    def of(cls, model: Model, surface: int, faces: Collection[int], poles: Array | None = None) -> Patch:
        """A surface with some of its faces, and with other control points (in its own frame) if there are any."""
        own = model.surfaces[surface].net
        on_it = tuple(model.faces[i] for i in model.surfaces[surface].faces if i in faces)
        poles = on_it[0].placed(own.poles if poles is None else poles)
        return cls(surface, own.with_poles(poles), on_it)

    @property
    def frame(self) -> Array:
        """From the surface's frame to the part's, as the first face has it; see :meth:`Ground.brought`."""
        return self.faces[0].frame

    @property
    def turn(self) -> Array:
        """The rotation of the frame."""
        return self.frame[:3, :3]

    @property
    def knots(self) -> tuple[KnotVector, KnotVector]:
        return self.net.u, self.net.v

    @cached_property
    def domain(self) -> tuple[Array, Array]:
        """Least and largest parameters."""
        low, high = np.array([k.domain for k in self.knots]).T
        return low, high

    @cached_property
    def periodic(self) -> Array:
        return np.array([k.periodic for k in self.knots])

    def within(self, uv: Array) -> Array:
        """Whether parameters ``(q, 2)`` lie in the domain."""
        low, high = self.domain
        return np.asarray((((uv >= low) & (uv <= high)) | self.periodic).all(axis=-1))

    def covers(self, uv: Array, net: Net | None = None) -> Array:
        """Whether parameters ``(q, 2)`` lie in cells, those of a finer net if there is one, that the faces touch."""
        net = net or self.net
        return np.asarray(self.within(uv) & touched(net, self.faces)[self._cells(uv, net)])

    @staticmethod
    def _cells(uv: Array, net: Net) -> tuple[Array, Array]:
        """Knot cells of a net at parameters ``(q, 2)``."""
        u, v = (
            np.clip(np.searchsorted(k.breaks, k.wrap(uv[:, i]), side="right") - 1, 0, k.spans - 1)
            for i, k in enumerate((net.u, net.v))
        )
        return u, v

    def signs(self, uv: Array) -> Array:
        """1.0 where S_u × S_v points outward on the face at, or nearest to, parameters ``(q, 2)``, else -1.0."""
        signs = np.array([float(face.outward) for face in self.faces])
        if (signs == signs[0]).all():
            return np.full(len(uv), signs[0])
        return np.asarray(signs[np.argmin([self._off(face, uv) for face in self.faces], axis=0)])

    def evaluate(self, uv: Array) -> tuple[Array, Array, Array, Array]:
        """Points, derivatives and unit normals (outward) at parameters ``(q, 2)``."""
        s, su, sv = self.net.evaluate(uv, 1)
        return s, su, sv, unit(self.signs(uv)[:, None] * np.cross(su, sv))

    def lattice(self, us: Array, vs: Array) -> tuple[Array, Array]:
        """Points and unit normals (outward) at all pairs of parameters, ``(m, n, 3)``."""
        points, su, sv = self.net.grid(us, vs, 1)
        return points, unit(self.signs(pairs(us, vs)).reshape(*points.shape[:2], 1) * np.cross(su, sv))

    @cached_property
    def _lines(self) -> tuple[Array, Array]:
        """Parameters of the seeds in u and v, spread evenly over the spans and over the length."""
        found = []
        for axis, k in enumerate(self.knots):
            share = np.linspace(0.0, 1.0, int(np.clip(3 * k.spans, 16, SEEDS)))
            ends = np.arange(k.spans + 1.0), np.append(0.0, np.cumsum(arc_lengths(self.net, axis)))
            found.append(np.unique(np.concatenate([np.interp(share * each[-1], each, k.breaks) for each in ends])))
        u, v = found
        return u, v

    @cached_property
    def whole(self) -> Array:
        """The box of all these boxes, ``(1, 2, 3)``."""
        return np.array([[self.boxes[:, 0].min(axis=0), self.boxes[:, 1].max(axis=0)]])

    @cached_property
    def seeds(self) -> tuple[Array, Array]:
        """Parameters distributed over the faces, and their points."""
        uv = pairs(*self._lines)
        uv = uv[self.covers(uv)]
        return uv, np.asarray(self.net.evaluate(uv))

    @cached_property
    def spots(self) -> cKDTree:
        """The points of the seeds."""
        from scipy.spatial import cKDTree

        return cKDTree(self.seeds[1])

    @cached_property
    def boxes(self) -> Array:
        """Boxes ``(m, 2, 3)`` around parts of the surface that contain the faces: those of control points."""
        fine = self.net.over(*(_many(kv) for kv in self.knots))
        cells, (u, v) = touched(fine, self.faces), (_parts(kv) for kv in (fine.u, fine.v))
        found = []
        for i, rows in u:
            for j, columns in v:
                if cells[np.ix_(i, j)].any():
                    points = fine.poles[np.ix_(rows, columns)].reshape(-1, 3)
                    found.append([points.min(axis=0), points.max(axis=0)])
        return np.array(found).reshape(-1, 2, 3)

    def beyond(self, points: Array, uv: Array) -> Array:
        """Distance (mm) of points ``(q, 3)`` from the boundaries of the faces where their feet ``uv`` lie outside all
        of them; 0 elsewhere."""
        found = np.zeros(len(uv))
        some = np.flatnonzero(self._crossed[self._cells(uv, self.net)])
        if len(some) and len(self._chords):
            out = some[np.min([self._off(face, uv[some]) for face in self.faces], axis=0) > FLAT]
            found[out] = self._rims.query(points[out])[0]
        return found

    @cached_property
    def _crossed(self) -> Array:
        """Knot cells that boundaries of the faces cross, a mask."""
        crossed = [cells for face in self.faces for cells in face_region(self.net, face).crossed]
        return np.asarray(np.logical_or.reduce(crossed)) if crossed else np.zeros([k.spans for k in self.knots], bool)

    @cached_property
    def _chords(self) -> Array:
        """Chords ``(n, 2, 2)`` of the boundaries; none where a face covers its surface."""
        own = [outline(face, self.net).chords for face in self.faces if face.trims]
        return np.concatenate([each for each in own if len(each)] or [np.empty((0, 2, 2))])

    @cached_property
    def _rims(self) -> cKDTree:
        """Points on the boundaries of the faces."""
        from scipy.spatial import cKDTree

        p, q = self._chords.swapaxes(0, 1)
        low, high = self.domain
        pieces = np.maximum(np.ceil(RIM * np.abs((q - p) / (high - low)).max(axis=1)).astype(int), 1)
        which = np.repeat(np.arange(len(p)), pieces)
        share = np.concatenate([np.arange(n) / n for n in pieces])[:, None]
        return cKDTree(np.asarray(self.net.evaluate(p[which] + share * (q - p)[which])))

    @cached_property
    def marks(self) -> Array:
        """Points within the faces and on their boundaries, ``(n, 3)``."""
        uv, points = self.seeds
        inside = points[self.beyond(points, uv) == 0]
        return np.concatenate([inside, self._rims.data]) if len(self._chords) else inside

    def around(self, uv: Array, centre: Array, reach: Array, count: int) -> tuple[Array, Array, Array]:
        """Samples around places, ``count`` in each direction.

        Returns
        -------
        points, normals : ndarray (m, q, 3)
        near : ndarray of bool (m, q)
            Samples on the faces and within the reach.
        """
        s, su, sv, _ = self.evaluate(uv)
        share = np.linspace(0.0, 1.0, count)
        lines = []
        for axis, tangent in enumerate((su, sv)):
            first, last = (uv[:, axis] + sign * self._room(uv, s, tangent, reach, axis, sign) for sign in (-1.0, 1.0))
            lines.append(first[:, None] + (last - first)[:, None] * share)
        grid = np.stack(np.broadcast_arrays(lines[0][:, :, None], lines[1][:, None, :]), axis=-1).reshape(-1, 2)
        points, _, _, normals = self.evaluate(grid)
        shape = (len(uv), count * count)
        points, normals = points.reshape(*shape, 3), normals.reshape(*shape, 3)
        near = self.covers(grid).reshape(shape)
        near &= np.linalg.norm(points - centre[:, None], axis=2) <= 1.1 * reach[:, None]
        return points, normals, near

    def _room(self, uv: Array, points: Array, tangent: Array, reach: Array, axis: int, sign: float) -> Array:
        """The distance in one direction to get a little beyond the reach, within the domain."""
        low, high = self.domain
        room = np.full(len(uv), 0.5 * (high - low)[axis])
        if not self.periodic[axis]:
            room = np.maximum(sign * (np.where(sign > 0, high[axis], low[axis]) - uv[:, axis]), 0.0)
        step = np.minimum(reach / np.maximum(np.linalg.norm(tangent, axis=1), 1e-300), room)
        for _ in range(6):
            at = uv.copy()
            at[:, axis] += sign * step
            far = np.linalg.norm(np.asarray(self.net.evaluate(at)) - points, axis=1)
            step = np.minimum(step * np.clip(reach / np.maximum(far, 1e-300), 0.4, 2.5), room)
        return np.asarray(np.minimum(1.2 * step, room))

    def inside(self, face: Face, uv: Array) -> Array:
        """Whether parameters ``(q, 2)`` lie within a face or on its boundary, by its outline."""
        region = face_region(self.net, face)
        cells = self._cells(uv, self.net)
        found = self.within(uv) & region.inside[cells]
        if region.crossed:
            some = np.flatnonzero(np.logical_or.reduce(region.crossed)[cells])
            found[some] = self._off(face, uv[some]) <= FLAT
        return np.asarray(found)

    def _off(self, face: Face, uv: Array) -> Array:
        """How far parameters ``(q, 2)`` lie outside a face, in shares of the domain; 0 within."""
        chords = outline(face, self.net).chords if face.trims else np.empty((0, 2, 2))
        if not len(chords):
            return np.zeros(len(uv))
        low, high = self.domain
        size = high - low
        p, q = ((chords[:, end] - low) / size for end in (0, 1))
        way = q - p
        length = np.maximum((way**2).sum(axis=1), 1e-300)
        slope = np.where(way[:, 1] == 0, np.inf, way[:, 1])
        off = np.full(len(uv), np.inf)
        turns = [(-1, 0, 1) if periodic else (0,) for periodic in self.periodic]
        for turn in pairs(*turns):
            for block in np.array_split(np.arange(len(uv)), max(len(uv) * len(p) >> 20, 1)):
                at = ((uv[block] - low) / size + turn)[:, None]
                t = np.clip(((at - p) * way).sum(axis=2) / length, 0, 1)
                apart = np.linalg.norm(p + t[..., None] * way - at, axis=2).min(axis=1)
                cross = (p[:, 1] > at[..., 1]) != (q[:, 1] > at[..., 1])
                x = p[:, 0] + (at[..., 1] - p[:, 1]) * way[:, 0] / slope
                within = (cross & (x > at[..., 0])).sum(axis=1) % 2 == 1
                off[block] = np.minimum(off[block], np.where(within, 0.0, apart))
        return off


def touched(net: Net, faces: Iterable[Face]) -> Array:
    """Knot cells of a net that faces touch, a mask."""
    return np.asarray(np.logical_or.reduce([covered(net, face) for face in faces]))


def _many(kv: KnotVector) -> KnotVector:
    """A knot vector with at least :data:`PARTS` spans."""
    pieces = -(-PARTS // kv.spans)
    share = np.arange(1, pieces) / pieces
    return kv.refined((kv.breaks[:-1, None] + np.diff(kv.breaks)[:, None] * share).ravel())


def _parts(kv: KnotVector) -> list[tuple[Array, Array]]:
    """Groups of neighbouring knot spans, and the control points on which they depend."""
    groups = np.array_split(np.arange(kv.spans), PARTS)
    first = kv.span_index - kv.degree
    return [(own, np.arange(first[own[0]], first[own[-1]] + kv.degree + 1) % kv.count) for own in groups]


def from_boxes(points: Array, boxes: Array) -> Array:
    """Distance of points ``(n, 3)`` from the nearest of some boxes ``(m, 2, 3)``, mm, 0 within."""
    off = np.maximum(np.maximum(boxes[:, 0] - points[:, None], points[:, None] - boxes[:, 1]), 0.0)
    return np.asarray(np.sqrt(np.square(off).sum(axis=2).min(axis=1, initial=np.inf)))
