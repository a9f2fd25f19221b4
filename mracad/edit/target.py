"""The target of an edit, and its view of surfaces before it solves anything."""

from __future__ import annotations

import math
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, fields, replace
from functools import cached_property
from typing import Any, Protocol

import numpy as np

from mracad.bspline.surface import Net
from mracad.bspline.vectors import cross
from mracad.inspect.roughness import Growth
from mracad.model.brep import Face, Model
from mracad.model.cells import quadrature
from mracad.model.congruence import CLOSE, Congruence, Figure, Figures, congruences
from mracad.seam.energy import Forms, forms
from mracad.seam.integrals import on_pattern
from mracad.seam.interface import Joints
from mracad.seam.ladders import Creases
from mracad.seam.metric import SMOOTHER, creases, seen, smoothed
from mracad.seam.solve import Problem, Space
from mracad.seam.stretch import EVEN, Limit, Stretch
from mracad.wavelet.ladder import arc_lengths
from mracad.wavelet.project import at_scale

Array = np.ndarray

DEGREE = 3
"""Least degree of a surface that moves: knots inserted into a lower one make facets."""

TREND, BASE = 2.5, 6.0
"""Waves longer than the first (in wavelengths) are shape; those longer than the second are the base for the judge."""


DETAIL = 1e-7, 1e-6
"""Least displacement that counts as detail: the tolerance of coincidence, mm, and a share of the wavelength."""

KEPT = 20_000_000
"""Largest number of entries of forms that are kept from one step to the next: 400 MB."""

SAME = 1e-7
"""Largest difference between congruent surfaces that are prepared once, relative to their size."""

ROUGHEST = 2.0
"""Bending of what a trend leaves of its surface, over that of the surface, above which it does not follow it."""


class Wish(Protocol):
    """The target of an edit, to be subclassed.

    Attributes
    ----------
    spread : float
        Number of wavelengths within which a change at a place spreads (default 1); infinite if spreading is no fault.
    fades : bool
        Whether it fades out towards regions in which nothing may move (default); if not, its target respects them.
    fairs : bool
        Whether faces that do not get fairer stay as they are.
    whole : bool
        Whether it is done in full or not at all, because part of it is not what was asked for (default: no).
    limited : bool
        Whether wavelengths are reduced where radii of curvature are too small for them (default: no).
    lean : bool
        Whether joined surfaces get more control points only if they cannot do without (default: no).
    alike : bool
        Whether it asks the same of congruent surfaces, wherever they lie (default: no).
    growth : Growth
        How much rougher it may make a face.
    """

    @property
    def spread(self) -> float:
        return 1.0

    @property
    def fades(self) -> bool:
        return True

    @property
    def fairs(self) -> bool: ...

    @property
    def whole(self) -> bool:
        return False

    @property
    def limited(self) -> bool:
        return False

    @property
    def lean(self) -> bool:
        return False

    @property
    def alike(self) -> bool:
        return False

    @property
    def growth(self) -> Growth: ...

    def wavelength(self, net: Net, faces: Sequence[Face], creases: Creases) -> float:
        """Wavelength below which it removes waves from a surface, mm; it fades within this beside what is held."""
        ...

    def stretch(self, faces: Sequence[Face]) -> Stretch:
        """Wavelengths by direction on the surface of the faces, relative to the longest; all are equal by default."""
        return EVEN

    def space(self, net: Net, faces: Sequence[Face]) -> Net:
        """The surface of faces over knots that can hold the target; by default its own."""
        return net

    def detail(self, alone: Problem, sheet: Sheet) -> float:
        """About the largest change of a control point of a surface if nothing were held, mm; that in the target by
        default."""
        return largest(self, alone, sheet)

    def target(self, problem: Problem, sheets: Mapping[int, Sheet], joined: Joints) -> Array:
        """The displacement of surfaces that seams join if no rim were held, ``(points, 3)``."""
        ...

    def ways(self, problem: Problem, target: Array, width: float) -> Iterable[Iterable[Array]]:
        """Displacements ``(points, 3)`` to choose from: the one that the judge allows nearest to the target is taken.

        They come in batches: the next is tried only if the judge scales the one before back a lot.  Beside what is
        held, they fade within ``width`` (mm).
        """
        ...


@dataclass(frozen=True, eq=False)
class Asked:
    """A surface, and what an edit asks of it.

    Attributes
    ----------
    index : int
        In ``Model.surfaces``.
    origin, net : Net
        The original, and the same surface, of degree 3 at least, over knots that can hold the target.
    all_faces, faces : tuple of Face
        All faces on it, and those that may move.
    creases : pair of frozenset of float
        Crease lines in u and v.
    wavelength : float
        Wavelength below which the edit removes waves, mm.
    stretch : Stretch
        Wavelengths by direction, relative to ``wavelength``.
    reach : (float, float)
        Distance within which a change spreads along u and v, mm.
    """

    index: int
    origin: Net
    net: Net
    all_faces: tuple[Face, ...]
    faces: tuple[Face, ...]
    creases: Creases
    wavelength: float
    stretch: Stretch
    reach: tuple[float, float]

    @property
    def movable(self) -> frozenset[int]:
        """Indices of the faces that may move."""
        return frozenset(face.index for face in self.faces)

    @property
    def least(self) -> float:
        """Least displacement that counts, mm."""
        return max(DETAIL[0], DETAIL[1] * self.wavelength)

    @cached_property
    def figure(self) -> Figure:
        """The surface, to be compared with others."""
        return Figure(self.net, self.all_faces)

    def congruences(self, first: Asked) -> Iterator[Congruence]:
        """The ways in which the surface is congruent to another of which the same is asked."""
        moving = [[face.index in each.movable for face in each.all_faces] for each in (first, self)]
        near = abs(self.wavelength - first.wavelength) <= CLOSE * self.wavelength
        if near and self.stretch.even and first.stretch.even and moving[0] == moving[1]:
            yield from congruences(first.figure, self.figure)


@dataclass(frozen=True, eq=False)
class Sheet(Asked):
    """A surface that an edit may move, prepared for it.

    Attributes
    ----------
    metric : Net
        The surface on which displacements are measured.
    trend, base : Net
        The surface projected on the splines of a few wavelengths, which is shape, and of more, for the judge: a trend
        that oscillates around a mark would hide new waves there.
    detail : float
        Largest displacement of a control point if nothing were held, mm.
    form : Forms, optional
        Mass and bending of displacements of ``net``, if kept.
    depends : ndarray of bool (nu, nv), optional
        The control points of ``net`` that reach into its faces, if known.
    """

    metric: Net
    trend: Net
    base: Net
    detail: float = 0.0
    form: Forms | None = None
    depends: Array | None = None

    def measured(self, net: Net) -> Forms:
        """Mass and bending of displacements of the surface over the knots of a net."""
        if net is self.net and self.form is not None:
            return self.form
        return forms(net, self.metric, quadrature(net, self.faces), self.creases, self.stretch)

    def seen(self, net: Net, form: Forms) -> Array:
        """The control points of a net of the surface that reach into its faces, given its forms, ``(nu, nv)``."""
        return self.depends if net is self.net and self.depends is not None else seen(net, form)


def stiffness(wavelength: float) -> float:
    """ℓ⁴, mm⁴, of a wavelength 2πℓ."""
    return (wavelength / (2 * math.pi)) ** 4


def sheets(model: Model, movable: Collection[int], wish: Wish) -> dict[int, Sheet]:
    """The surfaces with faces (``movable``) that an edit may move, by index."""
    found: dict[int, Sheet] = {}
    known: Figures[Sheet] = Figures()
    kept = 0
    for surface in model.surfaces:
        every = tuple(model.faces[i] for i in surface.faces)
        faces = tuple(face for face in every if face.index in movable)
        if faces:
            asked = _asked(surface.index, surface.net, every, faces, wish)
            sheet = (_shared(asked, known) if wish.alike else None) or _sheet(asked, wish)
            kept += sheet.form.mass.nnz if sheet.form else 0
            found[surface.index] = sheet if kept <= KEPT else replace(sheet, form=None)
            known.keep(sheet.figure, found[surface.index])
    return found


def _asked(index: int, origin: Net, every: tuple[Face, ...], faces: tuple[Face, ...], wish: Wish) -> Asked:
    net = wish.space(origin.over(origin.u.elevated(DEGREE), origin.v.elevated(DEGREE)), faces)
    sharp = creases(net, np.ones(net.poles.shape[:2], bool))
    wavelength = wish.wavelength(origin, faces, sharp)
    stretch = wish.stretch(faces)
    if wish.limited:
        stretch = replace(stretch, limit=Limit.of(net, stretch.times(wavelength), sharp))
    reach = stretch.times(wish.spread * wavelength)
    return Asked(index, origin, net, every, faces, sharp, wavelength, stretch, reach)


def _shared(asked: Asked, known: Figures[Sheet]) -> Sheet | None:
    """What was prepared for a surface congruent to this one, moved to it."""
    for first in known.near(asked.figure):
        for between in asked.congruences(first):
            if between.off <= SAME and between.edges() is not None:
                nets = first.metric, first.trend, first.base
                metric, trend, base = (asked.net.with_poles(between.moved(each.poles)) for each in nets)
                if not first.trend.poles.any():
                    trend = asked.net.with_poles(first.trend.poles)
                form = first.form and _arranged(first.form, between)
                return _prepared(asked, metric, trend, base, detail=first.detail, form=form)
    return None


def _arranged(form: Forms, between: Congruence) -> Forms:
    """Forms of a surface in the order of the control points of one congruent to it."""
    from scipy.sparse import csr_array

    if not (between.swapped or any(between.flipped)):
        return form
    shape = between.figures[0].net.poles.shape[:2]
    order = between.arranged(np.arange(form.mass.shape[0]).reshape(shape)).ravel()

    def arranged(matrix: Any) -> Any:
        return csr_array(matrix[order][:, order])

    mass = arranged(form.mass)
    return Forms(mass, on_pattern(arranged(form.bending), mass), arranged(form.creases))


def _prepared(asked: Asked, metric: Net, trend: Net, base: Net, **other: Any) -> Sheet:
    given = {each.name: getattr(asked, each.name) for each in fields(Asked)}
    return Sheet(**given, metric=metric, trend=trend, base=base, **other)


def _sheet(asked: Asked, wish: Wish) -> Sheet:
    net, sharp, stretch, wavelength = asked.net, asked.creases, asked.stretch, asked.wavelength
    points = quadrature(net, asked.faces)
    metric = smoothed(net, points, SMOOTHER**4 * stiffness(wavelength), stretch)
    form = forms(net, metric, points, sharp, stretch)
    depends = seen(net, form)
    trend, base = (
        at_scale(net, lengths, sharp, stretch.limit.finer(net, lengths) if stretch.limit else None)
        for lengths in (stretch.times(TREND * wavelength), stretch.times(BASE * wavelength))
    )
    if not _follows(trend, net, metric, form):
        trend = net.with_poles(np.zeros_like(net.poles))
    sheet = _prepared(asked, metric, trend, base, form=form, depends=depends)
    alone = Problem({asked.index: Space(net, form, depends, depends, trend.poles)})
    return replace(sheet, detail=wish.detail(alone, sheet))


def _follows(trend: Net, net: Net, metric: Net, form: Forms) -> bool:
    """Whether a trend follows its surface: elsewhere what is left, along the normals, bends more than the surface."""
    us, vs = net.u.greville(), net.v.greville()
    normals = cross(metric.tangents(us, vs, 0), metric.tangents(us, vs, 1))
    normals /= np.maximum(np.linalg.norm(normals, axis=-1, keepdims=True), 1e-300)
    left = ((net.poles - trend.poles) * normals).sum(axis=-1).ravel()
    points = (net.poles - net.poles.mean(axis=(0, 1))).reshape(-1, 3)
    bends = [
        sum(float((each * (stiff @ each)).sum()) for stiff in (form.bending, form.creases) if stiff.nnz)
        for each in (left, points)
    ]
    return bends[0] <= ROUGHEST * bends[1]


def largest(wish: Wish, alone: Problem, sheet: Sheet) -> float:
    """The largest change of a control point in the target for a surface alone, mm."""
    change = wish.target(alone, {sheet.index: sheet}, Joints())
    return float(np.linalg.norm(change[alone.seen], axis=1).max(initial=0.0))


def eased(net: Net, share: Array, widths: tuple[float, float]) -> Array:
    """Shares ``(nu, nv)`` of control points made smooth, and nowhere larger than before.

    The mean, over a window of widths along u and v (mm), of the least over the same window.
    """
    from scipy.ndimage import minimum_filter, uniform_filter

    spacing = (arc_lengths(net, axis).sum() / net.poles.shape[axis] for axis in (0, 1))
    sizes = zip(widths, spacing, share.shape, strict=True)
    window = tuple(2 * int(min(width / 2 / step, count)) + 1 for width, step, count in sizes)
    least = minimum_filter(share, window, mode="nearest")
    return np.asarray(np.minimum(share, uniform_filter(least, window, mode="nearest")))
