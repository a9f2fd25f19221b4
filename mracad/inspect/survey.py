"""Faces measured before an edit, at points of every knot span inside their trims; see :mod:`mracad.inspect.ramp`."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from itertools import chain, zip_longest

import numpy as np

from mracad.bspline.jets import blocks
from mracad.bspline.knots import KnotVector
from mracad.bspline.surface import Net
from mracad.inspect.creases import CLUSTER, Crossing, Tangents, crossings
from mracad.inspect.curvature import Forms, forms
from mracad.inspect.places import Places
from mracad.inspect.roughness import Roughness
from mracad.model.brep import Face
from mracad.model.cells import Quadrature, quadrature

Array = np.ndarray

POINTS, FEWEST = 5, 24
"""Points per span, including its ends, and least number along a face, in each direction: curvature peaks at knots."""

RIPPLE = 1e-8
"""Amplitude, mm, of a negligible ripple one mean span long: a tenth of a point of the kernel."""

ROUNDING = 16 * float(np.finfo(float).eps)
"""Error of a point of a surface relative to its largest coordinate, taken as a ripple as long as the span there."""

KEPT = 100_000
"""Largest number of points whose derivatives are kept, in all: 240 bytes each."""


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
    weights : ndarray (q,)
        Those of its points.
    jet : ndarray (10, 3, q) or None
        Derivatives at the points, see :func:`mracad.bspline.jets.jets`; None for many points.
    normals : ndarray (3, q)
        In single precision.
    regular : ndarray of bool (q,)
        Where the surface is neither degenerate nor singular and knots lie apart: curvature counts only there.
    sharp : ndarray (q,)
        Curvature at singular points, 1/mm; 0 elsewhere.
    rounding : ndarray (q,)
        Curvature that rounding can cause, 1/mm.
    crossed : list of Crossed
    roughness, noise : Roughness
    places : Places or None
        The places of the faces, if they are measured place by place.
    """

    net: Net
    faces: tuple[Face, ...]
    rule: Quadrature
    weights: Array
    jet: Array | None
    normals: Array
    regular: Array
    sharp: Array
    rounding: Array
    crossed: Sequence[Crossed]
    roughness: Roughness
    noise: Roughness
    places: Places | None

    @property
    def centre(self) -> Array:
        """Origin of the points, ``(3,)``."""
        return np.asarray(self.net.poles.mean(axis=(0, 1)))


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
    ready = [(net, tuple(faces), quadrature(net, faces, points, FEWEST, ends=True)) for net, faces in surfaces]
    found = []
    seen = _seen([(net, rule) for net, _, rule in ready])
    shapes = _seen([(net, rule) for net, (_, _, rule) in zip(bases, ready, strict=False)])
    bent = (np.concatenate([form.shape, form.slope]) for _, form in shapes)
    for (net, faces, rule), reach in zip_longest(ready, reaches):
        base, (jet, form) = next(bent, None), next(seen)
        sides = form.speeds * _spans(rule, (net.u, net.v))
        least = max(CLUSTER[0], CLUSTER[1] * float(np.linalg.norm(np.ptp(net.poles, axis=(0, 1)))))
        regular = form.regular & (sides.min(axis=0) >= least)
        sharp = np.where(regular & (form.largest > singular), form.largest, 0.0)
        regular &= sharp == 0
        sides = np.maximum(sides, least)
        weights = rule.weights.T[rule.mask.T]
        areas = weights * form.density
        rounding = ROUNDING * float(np.abs(net.poles).max()) * _wavenumber(sides.min(axis=0)) ** 2
        crossed = _crossed(net, faces, rule)
        kink = largest(each.angles for each in crossed)
        found.append(
            Survey(
                net, faces, rule, weights, jet, form.normal.astype(np.float32), regular, sharp, rounding, crossed,
                roughness(areas, form, regular, rounding, kink), _noise(areas * regular, sides, rounding),
                Places.of(rule, form, base, areas * regular, reach) if reach else None,
            )
        )  # fmt: skip
    return found


def _seen(surfaces: Sequence[tuple[Net, Quadrature]]) -> Iterator[tuple[Array | None, Forms]]:
    """Derivatives, unless they are many, and forms of each surface at the points of its rule; small surfaces are
    processed together."""
    sizes = np.array([int(rule.mask.sum()) for _, rule in surfaces])
    group, kept = (sizes.cumsum() - sizes) // KEPT, 0
    for number in np.unique(group):
        members = np.flatnonzero(group == number).tolist()
        parts = chain.from_iterable(
            blocks(net, rule.u, rule.v, rule.mask, net.poles.mean(axis=(0, 1)))
            for net, rule in (surfaces[i] for i in members)
        )
        count = int(sizes[members].sum())
        few = kept + count <= KEPT
        kept += count if few else 0
        jet = np.concatenate(list(parts), axis=2) if few else None
        form = forms(jet) if jet is not None else Forms.joined((forms(part) for part in parts), count)
        ends = sizes[members].cumsum()
        for begin, end in zip(ends - sizes[members], ends, strict=True):
            own = None if jet is None else np.ascontiguousarray(jet[:, :, begin:end])
            yield own, form.part(slice(begin, end))


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


def roughness(areas: Array, form: Forms, counts: Array, rounding: Array, kink: float) -> Roughness:
    """The figures of faces from the areas of points, their forms, and which of them count."""
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
