"""Faces measured before an edit, at points of every knot span inside their trims; see :mod:`mracad.inspect.ramp`."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import zip_longest

import numpy as np

from mracad.bspline.knots import KnotVector
from mracad.bspline.surface import Net
from mracad.inspect.creases import CLUSTER, Crossing, Tangents, crossings
from mracad.inspect.curvature import Forms
from mracad.inspect.places import SIDES, Places, strips
from mracad.inspect.roughness import Roughness
from mracad.inspect.tally import Marks, Sight, Tally
from mracad.model.brep import Face
from mracad.model.cells import Quadrature, quadrature

Array = np.ndarray

POINTS, FEWEST = 5, 24
"""Points per span, including its ends, and least number along a face, in each direction: curvature peaks at knots."""

RIPPLE = 1e-8
"""Amplitude, mm, of a negligible ripple one mean span long: a tenth of a point of the kernel."""

ROUNDING = 16 * float(np.finfo(float).eps)
"""Error of a point of a surface relative to its largest coordinate, taken as a ripple as long as the span there."""


@dataclass(frozen=True, eq=False)
class Crossed:
    """Places where tangents may jump, with the tangents there and the angles between normals, radians."""

    crossing: Crossing
    tangents: Tangents
    angles: Array


@dataclass(frozen=True, eq=False)
class Survey:
    """Faces of a surface before an edit, with everything needed to compare later states.

    Attributes
    ----------
    net : Net
    faces : tuple of Face
    rule : Quadrature
    sight : Sight
        Its points.
    along : ndarray
        Derivatives along u of the curves of control points.
    marks : Marks
        What is known there: curvature counts where the surface is neither degenerate nor singular and knots lie apart.
    sharp : ndarray (q,)
        Curvature at singular points, 1/mm; 0 elsewhere.
    tally : Tally
        The figures of the places of the points.
    crossed : list of Crossed
    roughness, noise : Roughness
    places : Places or None
        The places of the faces, if they are measured place by place.
    """

    net: Net
    faces: tuple[Face, ...]
    rule: Quadrature
    sight: Sight
    along: Array
    marks: Marks
    sharp: Array
    tally: Tally
    crossed: Sequence[Crossed]
    roughness: Roughness
    noise: Roughness
    places: Places | None

    @cached_property
    def singular(self) -> bool:
        """Whether there are singular points."""
        return bool(self.sharp.any())


def surveys(
    surfaces: Iterable[tuple[Net, Sequence[Face]]],
    points: int = POINTS,
    singular: float = np.inf,
    reaches: Sequence[tuple[float, float]] = (),
    bases: Sequence[Net] = (),
) -> list[Survey]:
    """Measure surfaces before an edit.

    Parameters
    ----------
    surfaces : iterable of (Net, sequence of Face)
        The surface, over the knots that it will have afterwards, and the faces on it that are measured as one.
    points : int
        Points per span, in each direction.
    singular : float
        Curvature, 1/mm, above which a point is singular: figures there depend on the places of grid points.
    reaches : sequence of (float, float)
        Distances along u and v within which the edit spreads a change, mm, for each surface; if given, faces are also
        measured place by place.
    bases : sequence of Net
        Smooth copies of the surfaces, against which waves are measured; planes by default.
    """
    every = zip_longest(surfaces, reaches, bases)
    return [_survey(net, tuple(faces), points, singular, reach, base) for (net, faces), reach, base in every]


def _survey(
    net: Net,
    faces: tuple[Face, ...],
    points: int,
    singular: float,
    reach: tuple[float, float] | None,
    base: Net | None,
) -> Survey:
    rule = quadrature(net, faces, points, FEWEST, ends=True)
    sight = Sight.of(net, rule)
    along = sight.along(net)
    form = sight.forms(along)
    sides = form.speeds * _spans(rule, (net.u, net.v))
    least = max(CLUSTER[0], CLUSTER[1] * float(np.linalg.norm(np.ptp(net.poles, axis=(0, 1)))))
    regular = form.regular & (sides.min(axis=0) >= least)
    sharp = np.where(regular & (form.largest > singular), form.largest, 0.0)
    regular &= sharp == 0
    sides = np.maximum(sides, least)
    rounding = ROUNDING * float(np.abs(net.poles).max()) * _wavenumber(sides.min(axis=0)) ** 2
    across, ends = _divided(rule, form, reach)
    bent = np.zeros((5, len(sharp))) if base is None else sight.over(base, rule).bent(base)
    marks = Marks(
        regular.astype(np.uint8), rounding.astype(np.float32), bent, form.normal.astype(np.float32), across,
        len(ends[0]) * len(ends[1]),
    )  # fmt: skip
    areas = sight.pairs(*sight.weights, np.multiply) * form.density * regular
    tally, crossed = sight.tally(along, marks), _crossed(net, faces, rule)
    return Survey(
        net, faces, rule, sight, along, marks, sharp, tally, crossed,
        roughness(tally, largest(each.angles for each in crossed)), _noise(areas, sides, rounding),
        Places.of(ends, tally, reach, [each.crossing for each in crossed]) if reach else None,
    )  # fmt: skip


def _divided(
    rule: Quadrature, form: Forms, reach: tuple[float, float] | None
) -> tuple[tuple[Array, Array], tuple[Array, Array]]:
    """Numbers along u and v whose sum is the place of each pair of parameters of a rule, and where places end; one
    place if there are no reaches."""
    lines = np.nonzero(rule.mask.T)[::-1]
    both = [strips(rule, lines[k], form.speeds[k], k, (reach[k] if reach else np.inf) / SIDES) for k in (0, 1)]
    (u, u_ends), (v, v_ends) = both
    return (u * len(v_ends), v), (u_ends, v_ends)


def _spans(rule: Quadrature, knots: tuple[KnotVector, KnotVector]) -> Array:
    """Length in parameters of the knot spans about each point of a rule, along u and v, ``(2, q)``."""
    sizes = []
    for kv, x in zip(knots, (rule.u, rule.v), strict=True):
        span, _ = kv.locate((x[:, 0] + x[:, -1]) / 2)  # the ends of a row are on knots, perhaps of a shorter span
        sizes.append(np.repeat(kv.knots[span + 1] - kv.knots[span], x.shape[1]))
    grid = np.broadcast_arrays(sizes[0], sizes[1][:, None])
    return np.stack([each[rule.mask.T] for each in grid])


def _crossed(net: Net, faces: Sequence[Face], rule: Quadrature) -> list[Crossed]:
    """Places where tangents of faces may jump."""
    every = [crossings(net, faces, axis, at.ravel()) for axis, at in ((0, rule.v), (1, rule.u))]
    both = [(each, each.tangents(net)) for each in every if each]
    return [Crossed(each, tangents, each.angles(net, tangents)) for each, tangents in both]


def largest(angles: Iterable[Array]) -> float:
    """The largest of all angles that are not NaN, or 0."""
    return max((float(np.nanmax(each, initial=0.0)) for each in angles), default=0.0)


def roughness(tally: Tally, kink: float) -> Roughness:
    """The figures of faces from those of their places."""
    area, _, bending, variation, *_ = tally.sums.sum(axis=1).tolist()
    return Roughness(area, bending, variation, float(tally.tops[1].max(initial=0.0)), float(np.degrees(kink)))


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
