"""Faces measured before and after an edit, at the same points of every knot span inside their trims."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from itertools import chain, zip_longest

import numpy as np

from mracad.bspline.jets import blocks
from mracad.bspline.knots import KnotVector
from mracad.bspline.surface import Net
from mracad.inspect.creases import CLUSTER, Crossing, crossings
from mracad.inspect.curvature import Forms, forms
from mracad.inspect.places import Places
from mracad.inspect.roughness import Change, Roughness
from mracad.model.brep import Face
from mracad.model.cells import Quadrature, quadrature

Array = np.ndarray

POINTS, FEWEST = 5, 24
"""Points per span, including its ends, and least number along a face, in each direction: curvature peaks at knots."""

RIPPLE = 1e-8
"""Amplitude, mm, of a negligible ripple one mean span long: a tenth of a point of the kernel."""

ROUNDING = 16 * float(np.finfo(float).eps)
"""Error of a point of a surface relative to its largest coordinate, taken as a ripple as long as the span there."""

NOISY, STEEP = 1.0, 20.0
"""If normals turn by more than the first in the median, degrees, noise is being removed; those that turn by more than
the second are then also compared with those around."""

STEADY = 0.05
"""Weight of a turn of the normal at a singular point, per radian, against a relative change of its curvature."""

_BLOCK = 50_000

_ENOUGH = 4096
"""Number of points that are processed together."""


@dataclass(frozen=True, eq=False)
class Survey:
    """Faces of a surface before an edit, with everything needed to compare later states.

    Attributes
    ----------
    net : Net
    faces : tuple of Face
    rule : Quadrature
    centre : ndarray (3,)
        Origin of ``points``.
    points, normals : ndarray (3, q)
        Points and normals at the points of the rule; normals in single precision.
    regular : ndarray of bool (q,)
        Where the surface is neither degenerate nor singular and knots lie apart: curvature counts only there.
    sharp : ndarray (q,)
        Curvature at singular points, 1/mm; 0 elsewhere.
    rounding : ndarray (q,)
        Curvature that rounding can cause, 1/mm.
    crossed : list of (Crossing, ndarray)
        Places where tangents may jump, and the angles there.
    roughness, noise : Roughness
    places : Places or None
        The places of the faces, if they are measured place by place.
    """

    net: Net
    faces: tuple[Face, ...]
    rule: Quadrature
    centre: Array
    points: Array
    normals: Array
    regular: Array
    sharp: Array
    rounding: Array
    crossed: Sequence[tuple[Crossing, Array]]
    roughness: Roughness
    noise: Roughness
    places: Places | None


def surveys(
    surfaces: Iterable[tuple[Net, Sequence[Face], KnotVector, KnotVector]],
    points: int = POINTS,
    singular: float = np.inf,
    reaches: Sequence[tuple[float, float]] = (),
    bases: Sequence[Net] = (),
) -> list[Survey]:
    """Measure surfaces before an edit.

    Parameters
    ----------
    surfaces : iterable of (Net, sequence of Face, KnotVector, KnotVector)
        The surface, the faces on it that are measured as one, and the knots that it will have afterwards.
    points : int
        Points per span of those knots, in each direction.
    singular : float
        Curvature, 1/mm, above which a point is singular: figures there depend on the places of grid points.
    reaches : sequence of (float, float)
        Distances along u and v within which the edit spreads a change, mm, for each surface; if given, faces are also
        measured place by place.
    bases : sequence of Net
        Smooth copies of the surfaces, against which waves are measured; planes by default.
    """
    ready = [
        (net, tuple(faces), _rule(faces, u, v, points), (u, v), net.poles.mean(axis=(0, 1)))
        for net, faces, u, v in surfaces
    ]
    found = []
    seen = _seen([(net, rule, centre) for net, _, rule, _, centre in ready])
    shapes = _seen([(net, rule, centre) for net, (_, _, rule, _, centre) in zip(bases, ready, strict=False)])
    for (net, faces, rule, knots, centre), (at, form), reach in zip_longest(ready, seen, reaches):
        _, base = next(shapes, (None, None))
        sides = form.speeds * _spans(rule, knots)
        least = max(CLUSTER[0], CLUSTER[1] * float(np.linalg.norm(np.ptp(net.poles, axis=(0, 1)))))
        regular = form.regular & (sides.min(axis=0) >= least)
        sharp = np.where(regular & (form.largest > singular), form.largest, 0.0)
        regular &= sharp == 0
        sides = np.maximum(sides, least)
        areas = _areas(rule, form)
        rounding = ROUNDING * float(np.abs(net.poles).max()) * _wavenumber(sides.min(axis=0)) ** 2
        crossed = _crossed(net, faces, rule)
        kink = _largest(angles for _, angles in crossed)
        found.append(
            Survey(
                net, faces, rule, centre, at, form.normal.astype(np.float32), regular, sharp, rounding, crossed,
                _roughness(areas, form, regular, rounding, kink), _noise(areas * regular, sides, rounding),
                Places.of(rule, form, base, areas * regular, reach) if reach else None,
            )
        )  # fmt: skip
    return found


def changes(surveyed: Sequence[Survey], nets: Sequence[Net]) -> list[Change]:
    """The changes of surveyed surfaces.

    Parameters
    ----------
    surveyed : sequence of Survey
    nets : sequence of Net
        Each surface as it is now, over the same domain.
    """
    found = []
    seen = _seen([(net, survey.rule, survey.centre) for survey, net in zip(surveyed, nets, strict=True)])
    for survey, net, (at, form) in zip(surveyed, nets, seen, strict=True):
        motion = at - survey.points
        both = form.regular & survey.regular
        turned = 2 * np.arcsin(np.minimum(_turned(survey, form.normal.astype(np.float32), both) / 2, 1.0))
        now = [(crossing, crossing.angles(net), before) for crossing, before in survey.crossed]
        opened = [(crossing, new - old) for crossing, new, old in now]
        kink, unsettled = _largest(new for _, new, _ in now), _unsettled(survey, form)
        areas, places = _areas(survey.rule, form), survey.places
        found.append(
            Change(
                survey.roughness,
                _roughness(areas, form, survey.regular, survey.rounding, kink),
                survey.noise,
                np.degrees(_largest(grew for _, grew in opened)).item(),
                np.degrees(turned.max(initial=0.0)).item(),
                float(np.abs((motion * survey.normals).sum(axis=0)).max(initial=0.0)),
                float(np.linalg.norm(motion, axis=0).max(initial=0.0)),
                float(unsettled.max(initial=0.0)),
                places.compared(form, areas * survey.regular, turned, unsettled, opened) if places else None,
            )
        )
    return found


def _unsettled(survey: Survey, form: Forms) -> Array:
    """Relative change of curvature, or turn of normals, at points that stay singular; 0 elsewhere, ``(q,)``."""
    found, those = np.zeros(len(survey.sharp)), survey.sharp > 0
    if those.any():
        before, after = survey.sharp[those], form.largest[those]
        change = np.where(after > before.min(), np.abs(after / before - 1), 0.0)
        turned = np.linalg.norm(form.normal[:, those].astype(np.float32) - survey.normals[:, those], axis=0)
        found[those] = np.maximum(change, STEADY * turned)
    return found


def _turned(survey: Survey, normals: Array, counted: Array) -> Array:
    """Distances of normals ``(3, q)`` from those before, as chords, ``(q,)``.

    If noise is removed all over the face, large turns are measured to the nearest normal within one span: removing
    noise turns a normal towards its neighbours, whereas a fold turns it over.
    """
    off = np.where(counted, np.linalg.norm(normals - survey.normals, axis=0), 0.0)
    rule, (noisy, most) = survey.rule, 2 * np.sin(np.radians([NOISY / 2, STEEP / 2]))
    if (off > most).any() and np.median(off[counted]) > noisy:
        reach, mask = (rule.v.shape[1], rule.u.shape[1]), rule.mask.T
        place = np.full(mask.shape, -1)
        place[mask] = np.where(survey.regular, np.arange(len(off)), -1)
        place = np.pad(place, [(r, r) for r in reach], constant_values=-1)
        row, column = np.nonzero(mask)
        steps = np.ndindex(2 * reach[0] + 1, 2 * reach[1] + 1)
        for down, right in sorted(steps, key=lambda step: float(np.abs(np.subtract(step, reach)).sum())):
            those = np.flatnonzero(off > most)
            beside = place[row[those] + down, column[those] + right]
            near = np.linalg.norm(normals[:, those] - survey.normals[:, beside], axis=0)
            off[those] = np.where(beside < 0, off[those], np.minimum(off[those], near))
    return off


def _rule(faces: Sequence[Face], u: KnotVector, v: KnotVector, points: int) -> Quadrature:
    return quadrature(Net(u, v, np.empty((u.count, v.count, 0))), faces, points, FEWEST, ends=True)


def _seen(surfaces: Sequence[tuple[Net, Quadrature, Array]]) -> Iterator[tuple[Array, Forms]]:
    """Points and forms of each surface at the points of its rule; small surfaces are processed together."""
    sizes = np.array([int(rule.mask.sum()) for _, rule, _ in surfaces])
    block = (sizes.cumsum() - sizes) // _BLOCK
    for number in np.unique(block):
        members = np.flatnonzero(block == number).tolist()
        parts = chain.from_iterable(
            blocks(net, rule.u, rule.v, rule.mask, centre) for net, rule, centre in (surfaces[i] for i in members)
        )
        points, found = zip(*((part[0], forms(part)) for part in _gathered(parts)), strict=True)
        at, form = np.concatenate(points, axis=1), Forms.joined(found)
        ends = sizes[members].cumsum()
        for begin, end in zip(ends - sizes[members], ends, strict=True):
            yield at[:, begin:end], form.part(slice(begin, end))


def _gathered(parts: Iterable[Array]) -> Iterator[Array]:
    """Parts, with small ones concatenated."""
    waiting: list[Array] = []
    for part in parts:
        waiting.append(part)
        if sum(each.shape[-1] for each in waiting) >= _ENOUGH:
            yield waiting[0] if len(waiting) == 1 else np.concatenate(waiting, axis=-1)
            waiting = []
    if waiting:
        yield waiting[0] if len(waiting) == 1 else np.concatenate(waiting, axis=-1)


def _areas(rule: Quadrature, form: Forms) -> Array:
    """Area of each point of a rule, mm²."""
    return np.asarray(rule.weights.T[rule.mask.T] * form.density)


def _spans(rule: Quadrature, knots: tuple[KnotVector, KnotVector]) -> Array:
    """Length in parameters of the knot spans about each point of a rule, along u and v, ``(2, q)``."""
    sizes = []
    for kv, x in zip(knots, (rule.u, rule.v), strict=True):
        span, _ = kv.locate((x[:, 0] + x[:, -1]) / 2)  # the ends of a row are on knots, perhaps of a shorter span
        sizes.append(np.repeat(kv.knots[span + 1] - kv.knots[span], x.shape[1]))
    grid = np.broadcast_arrays(sizes[0], sizes[1][:, None])
    return np.stack([each[rule.mask.T] for each in grid])


def _crossed(net: Net, faces: Sequence[Face], rule: Quadrature) -> list[tuple[Crossing, Array]]:
    """Places where tangents of faces may jump, and the angles there."""
    every = [crossings(net, faces, axis, at.ravel()) for axis, at in ((0, rule.v), (1, rule.u))]
    return [(each, each.angles(net)) for each in every if each]


def _largest(angles: Iterable[Array]) -> float:
    return max((float(np.nanmax(each, initial=0.0)) for each in angles), default=0.0)


def _roughness(areas: Array, form: Forms, counts: Array, rounding: Array, kink: float) -> Roughness:
    counted = areas * counts
    return Roughness(
        float(areas.sum()),
        float(counted @ form.bending),
        float(counted @ form.variation),
        float(((form.largest - rounding) * counts).max(initial=0.0)),
        float(np.degrees(kink)),
    )


def _noise(areas: Array, sides: Array, rounding: Array) -> Roughness:
    """Figures of a ripple z = a sin kx: ½ a² k⁴, ⅛ a² k⁶, a k² and slope a k, by :data:`RIPPLE` and rounding.

    k is that of the mean span; where spans are shorter, only the effect of rounding on a span is added.
    """
    total = float(areas.sum())
    if not total:
        return Roughness()
    k = float(_wavenumber((sides @ areas).min() / total))
    own = _wavenumber(sides.min(axis=0))
    return Roughness(
        total,
        RIPPLE**2 * k**4 / 2 * total + float(areas @ rounding**2) / 2,
        RIPPLE**2 * k**6 / 8 * total + float(areas @ (rounding * own) ** 2) / 8,
        RIPPLE * k**2,
        float(np.degrees(2 * RIPPLE * k)),
    )


def _wavenumber(length: Array) -> Array:
    """2π over the length."""
    return 2 * np.pi / length
