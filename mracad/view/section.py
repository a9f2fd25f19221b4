"""Curves in which planes cut a model, and their curvature as combs.

A plane n·x = d cuts a surface S along a curve with the direction T = N × n; its principal normal in the plane is
m = n × T, and by Meusnier its curvature is k = II(T, T) / (N·m).
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from mracad.bspline.vectors import components, cross, unit
from mracad.model.facets import Body, Facets, Placed
from mracad.view.fields import rounded
from mracad.view.lines import Lines, Stroke

Array = np.ndarray

STEP = 2.0
"""Distance between points of a curve, pixels."""

TEETH = 2
"""A tooth of a comb stands on every so many of them."""

CURVE = Stroke((0.78, 0.16, 0.10), 1.0, 1.0, 0.4)
COMB = Stroke((0.10, 0.32, 0.62), 0.45, 0.9, 0.4)

_STEPS = 8  # of Newton's method
_DONE, _OFF = 1e-12, 1e-9  # of the diagonal: how near to the plane a step ends, and how far off points may lie
_FINEST = 1e-4  # of the diagonal: least distance between points
_SHARE = 0.95  # of teeth that are no longer than was asked for
_CUT = 1.25  # longer teeth are cut
_STRAIGHT = 1e-9  # curvature times the size of the model below which a curve is straight
_POINT = 1e-7  # of the diagonal: shorter curves, and smaller radii, are those of points
_ALONG = 1e-3  # sine of the angle between face and plane below which a curve has no direction


@dataclass(frozen=True, eq=False)
class Curve:
    """A curve in which a plane cuts one face.

    Attributes
    ----------
    points : ndarray (n, 3)
        At even distances, as placed, mm.
    bends : ndarray (n, 3)
        Curvature vectors, 1/mm, towards the centre of curvature; not a number where the plane touches the face, and
        where the surface is degenerate.
    """

    points: Array
    bends: Array

    @property
    def teeth(self) -> Array:
        """The points on which teeth stand: every few, and the last."""
        return np.unique(np.append(np.arange(0, len(self.points), TEETH), len(self.points) - 1))


def curves(body: Body, axis: int, place: float, spacing: float) -> list[Curve]:
    """The curves in which the plane of all points with a coordinate cuts a body.

    Parameters
    ----------
    body : Body
    axis : {0, 1, 2}
    place : float
        The coordinate, mm.
    spacing : float
        Largest distance between points, mm.
    """
    spacing = max(spacing, _FINEST * body.diagonal)
    found = []
    for frame, facets in ((at, body.facets[f]) for at in body.placed for f in at.faces if f in body.facets):
        cut = _Cut(frame, facets, axis, place, body.diagonal)
        for uv in cut.chains():
            uv, jets = cut.on(uv)
            if len(uv) > 1:
                uv, jets = cut.on(_even(uv, jets[0], spacing))
            if len(uv) > 1 and np.ptp(jets[0], axis=0).max() > _POINT * body.diagonal:
                found.append(Curve(jets[0], _bend(jets, axis, _POINT * body.diagonal)))
    return found


@dataclass(frozen=True, eq=False)
class _Cut:
    """A face as placed, and the plane that cuts it."""

    at: Placed
    facets: Facets
    axis: int
    place: float
    diagonal: float

    def chains(self) -> Iterator[Array]:
        """Parameters of the points in which the plane cuts sides of triangles, one after the other."""
        height = (self.facets.points @ self.at.frame[:3, :3].T + self.at.frame[:3, 3])[:, self.axis] - self.place
        if np.abs(height).max() <= _OFF * self.diagonal:
            return  # the face lies in the plane
        above = height[self.facets.corners] > 0.0
        lone = np.where(above.sum(axis=1) == 1, above.argmax(axis=1), above.argmin(axis=1))
        mixed = np.flatnonzero(above.any(axis=1) & ~above.all(axis=1))
        tip, left, right = (self.facets.corners[mixed, (lone[mixed] + k) % 3] for k in range(3))
        sides = np.sort(np.stack([np.stack([tip, left], 1), np.stack([tip, right], 1)], 1), axis=2)
        nodes, ends = np.unique(sides.reshape(-1, 2), axis=0, return_inverse=True)
        share = height[nodes[:, 0]] / (height[nodes[:, 0]] - height[nodes[:, 1]])
        uv = self.facets.uv[nodes[:, 0]] + share[:, None] * (self.facets.uv[nodes[:, 1]] - self.facets.uv[nodes[:, 0]])
        yield from (uv[chain] for chain in _linked(ends.reshape(-1, 2).tolist()))

    def jets(self, uv: Array, order: int) -> list[Array]:
        """The surface as placed."""
        s, *slopes = (each @ self.at.frame[:3, :3].T for each in self.facets.ground.jets(uv, order))
        return [s + self.at.frame[:3, 3], *slopes]

    def on(self, uv: Array) -> tuple[Array, list[Array]]:
        """Parameters moved along the surface into the plane, without those that stay off it, and the jets there."""
        low, high = self.facets.uv.min(axis=0), self.facets.uv.max(axis=0)
        for _ in range(_STEPS):
            s, su, sv = self.jets(uv, 1)
            off = s[:, self.axis] - self.place
            if (np.abs(off) <= _DONE * self.diagonal).all():
                break
            rise = np.zeros_like(s)
            rise[:, self.axis] = 1.0
            step = components(su, sv, rise)  # the steepest way
            gain = step[:, 0] * su[:, self.axis] + step[:, 1] * sv[:, self.axis]
            uv = np.clip(uv - (off / np.where(gain > _ALONG**2, gain, np.inf))[:, None] * step, low, high)
        jets = self.jets(uv, 2)
        kept = np.abs(jets[0][:, self.axis] - self.place) <= _OFF * self.diagonal
        return uv[kept], [each[kept] for each in jets]


def _linked(pairs: Sequence[Sequence[int]]) -> Iterator[list[int]]:
    """Chains of nodes from the pairs that are linked; a closed one ends where it starts."""
    linked: dict[int, list[int]] = {}
    for a, b in pairs:
        linked.setdefault(a, []).append(b)
        linked.setdefault(b, []).append(a)
    for start in sorted(linked, key=lambda node: len(linked[node]) != 1):  # ends first
        while linked[start]:
            chain = [start]
            while linked[chain[-1]]:
                after = linked[chain[-1]].pop()
                linked[after].remove(chain[-1])
                chain.append(after)
            yield chain


def _even(uv: Array, points: Array, spacing: float) -> Array:
    """Parameters at even distances along a curve."""
    along = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1))])
    at = np.linspace(0.0, along[-1], int(np.ceil(along[-1] / spacing)) + 1)
    return np.stack([np.interp(at, along, column) for column in uv.T], axis=1)


def _bend(jets: Sequence[Array], axis: int, least: float) -> Array:
    """The curvature vector of the section at points of surfaces, ``(n, 3)``, of radii of at least ``least``."""
    _, su, sv, suu, suv, svv = jets
    normal, upright = unit(cross(su, sv)), np.eye(3)[axis]
    along = cross(normal, np.broadcast_to(upright, normal.shape))
    steep = np.linalg.norm(along, axis=1) > _ALONG
    along = unit(along)
    inward = cross(np.broadcast_to(upright, normal.shape), along)
    a, b = components(su, sv, along).T[:, :, None]
    second = ((a * a * suu + 2 * a * b * suv + b * b * svv) * normal).sum(axis=1)
    share = np.where(steep, (normal * inward).sum(axis=1), np.nan)
    bend = second / share
    return np.asarray(np.where(np.abs(bend) * least <= 1.0, bend, np.nan)[:, None] * inward)


@dataclass(frozen=True)
class Comb:
    """The scale of combs.

    Attributes
    ----------
    length : float
        Length of a tooth for a curvature of 1/mm, mm².
    unit : float
        A round curvature, 1/mm; 0 where nothing bends.
    most : float
        Larger curvatures are cut, 1/mm; infinite where there are none.
    """

    length: float
    unit: float
    most: float

    def teeth(self, bends: Array) -> Array:
        """Teeth for curvature vectors ``(n, 3)``, mm, towards the centre of curvature."""
        size = np.linalg.norm(bends, axis=1, keepdims=True)
        return np.asarray(self.length * bends * np.minimum(1.0, self.most / np.maximum(size, 1e-300)))


def combed(found: Sequence[Curve], longest: float) -> Comb:
    """A scale at which nearly all teeth are no longer than a length, mm."""
    every = np.concatenate([np.linalg.norm(curve.bends[curve.teeth], axis=1) for curve in found] or [np.empty(0)])
    reach = max((float(np.abs(curve.points).max()) for curve in found), default=0.0)
    every = np.sort(every[every * reach > _STRAIGHT])
    if not len(every):
        return Comb(0.0, 0.0, np.inf)
    usual = float(every[int(_SHARE * (len(every) - 1))])
    return Comb(longest / usual, rounded(0.5 * usual), _CUT * usual if every[-1] > _CUT * usual else np.inf)


def lines(found: Sequence[Curve], comb: Comb | None) -> list[Lines]:
    """How curves are drawn, with their combs under them."""
    drawn = [_joined(CURVE, [curve.points for curve in found])]
    if comb:
        feet = [curve.points[curve.teeth] for curve in found]
        tips = [foot - comb.teeth(curve.bends[curve.teeth]) for foot, curve in zip(feet, found, strict=True)]
        rim = _joined(COMB, tips)
        starts, ends = np.concatenate([*feet, rim.starts]), np.concatenate([*tips, rim.ends])
        drawn.insert(0, Lines(COMB, starts, ends))
    return [_finite(each) for each in drawn]


def _joined(stroke: Stroke, paths: Sequence[Array]) -> Lines:
    return Lines(stroke, *(np.concatenate([path[part] for path in paths]) for part in (slice(-1), slice(1, None))))


def _finite(drawn: Lines) -> Lines:
    kept = np.isfinite(drawn.starts).all(axis=1) & np.isfinite(drawn.ends).all(axis=1)
    return Lines(drawn.stroke, drawn.starts[kept], drawn.ends[kept])
