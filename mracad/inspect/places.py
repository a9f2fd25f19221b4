"""Roughness place by place: whether an edit made waves where a face was smooth, which no sum over the face shows.

A face is divided into places with sides of half the wavelength of the edit.  Its part beyond the base bends by
|S − S₀|² and varies by |∇H − ∇H₀|², with the shape operator S, and ₀ for the base: next to the curvature of the base,
waves that reflections show are small.  A change at one place spreads to its neighbours, so these figures (means over a
place) are compared with the largest that the place and its eight neighbours had before.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace

import numpy as np

from mracad.inspect.creases import Crossing
from mracad.inspect.curvature import Forms
from mracad.model.cells import Quadrature

Array = np.ndarray

SIDES = 2
"""Places per wavelength."""

SLOPE = 1.4e-4
"""Steepest slope of an invisible wave, radians: the amount that an edit may add to an angle between faces."""

SMALL = 0.05
"""Area over that of the largest place up to which a place at the boundary is ignored."""


@dataclass(frozen=True, eq=False)
class Placed:
    """What an edit did to the places of a face, ``(nu, nv)`` each; zero where there is no face.

    Attributes
    ----------
    spread : ndarray
        Bending or variation of the place beyond its base, over the largest around it before, less 1.
    lost : ndarray
        Share of its bending or curvature variation that the place lost, whichever is larger.
    rise : ndarray (2, nu, nv)
        Growth of bending and curvature variation of the place, over the mean growth of all places.
    curvature : ndarray
        Largest curvature after the edit, 1/mm.
    turn : ndarray
        Largest angle between normals before and after, radians.
    opened : ndarray
        Largest growth of the angle across a knot line, radians.
    unsettled : ndarray
        See :class:`mracad.inspect.roughness.Change`.
    area : ndarray
        Area, mm²; zero where a place is too small to count.
    ends : (ndarray, ndarray)
        Parameters at which places end, along u and v.
    """

    spread: Array
    lost: Array
    rise: Array
    curvature: Array
    turn: Array
    opened: Array
    unsettled: Array
    area: Array
    ends: tuple[Array, Array]

    def at(self, u: Array, v: Array) -> tuple[Array, Array]:
        """Indices of the places at parameters, along u and along v."""
        return _strip(self.ends[0], u), _strip(self.ends[1], v)


@dataclass(frozen=True, eq=False)
class Places:
    """Places of a face before an edit.

    Attributes
    ----------
    order : ndarray of int (q,)
        The points of a quadrature, place by place.
    first, filled : ndarray of int (places,)
        Position at which each place with points begins among them, and index of the place.
    shape : (int, int)
        Places along u and v.
    ends : (ndarray, ndarray)
        Parameters at which they end.
    area : ndarray (nu, nv)
        Area, mm²; zero where a place is too small.
    base : ndarray (5, q)
        Shape operator and slope of the base, zero by default.
    before : ndarray (2, nu, nv)
        Means of bending and curvature variation.
    most, around : ndarray (2, nu, nv)
        The largest of each place, its neighbours and the invisible wave: of bending and variation, and beyond the base.
    """

    order: Array
    first: Array
    filled: Array
    shape: tuple[int, int]
    ends: tuple[Array, Array]
    area: Array
    base: Array
    before: Array
    most: Array
    around: Array

    @classmethod
    def of(
        cls, rule: Quadrature, form: Forms, base: Array | None, areas: Array, wavelengths: tuple[float, float]
    ) -> Places:
        """Places of the faces of a quadrature rule, with the forms of the surface, shape operator and slope of its base
        ``(5, q)``, and areas (mm²), at its points; wavelengths (mm) along u and v."""
        (rows, u), (columns, v) = (_divided(rule, form, axis, wavelengths[axis] / SIDES) for axis in (0, 1))
        shape = len(u), len(v)
        cell = rows * shape[1] + columns
        order = np.argsort(cell, kind="stable")
        filled, first = np.unique(cell[order], return_index=True)
        bare, known = np.zeros(shape), np.zeros((5, len(areas))) if base is None else base
        places = cls(order, first, filled, shape, (u, v), bare, known, bare, bare, bare)
        (area,) = places._gathered(np.add, areas[None])
        area = np.where(area > SMALL * area.max(initial=0.0), area, 0.0)
        before, beyond = places._means(form, areas)
        k = 2 * np.pi / min(wavelengths)
        flat = np.array([SLOPE**2 * k**2 / 2, SLOPE**2 * k**4 / 8])
        return replace(places, area=area, before=before, most=_around(before, flat), around=_around(beyond, flat))

    def compared(
        self, form: Forms, areas: Array, turned: Array, unsettled: Array, opened: Iterable[tuple[Crossing, Array]]
    ) -> Placed:
        """The changes of the places.

        Parameters
        ----------
        form : Forms
            The surface after the edit.
        areas : ndarray (q,)
            Areas of points, mm²; zero for points that do not count.
        turned, unsettled : ndarray (q,)
            Turns of normals (radians), and changes of singular points.
        opened : iterable of (Crossing, ndarray)
            Growth of angles across knot lines, radians.
        """
        counts = self.area > 0
        means, beyond = self._means(form, areas)
        spread = np.where(counts, (beyond / self.around - 1).max(axis=0), 0.0)
        fell = self.before - means
        lost = np.where(counts, (fell / self.most).max(axis=0), 0.0)
        rise = np.maximum(-fell * self.area, 0.0)
        rise /= np.maximum(rise.mean(axis=(1, 2), keepdims=True), 1e-300)
        largest = form.largest * (areas > 0), turned, unsettled
        peaks, turn, singular = self._gathered(np.maximum, largest)
        return Placed(spread, lost, rise, peaks, turn, self._opened(opened), singular, self.area, self.ends)

    def _opened(self, opened: Iterable[tuple[Crossing, Array]]) -> Array:
        found = np.zeros(self.shape)
        for crossing, grew in opened:
            line, place = np.nonzero(crossing.seen)
            at = (crossing.at[line, 0], crossing.places[place])[:: 1 - 2 * crossing.axis]
            np.fmax.at(found, tuple(_strip(ends, each) for ends, each in zip(self.ends, at, strict=True)), grew)
        return found

    def _gathered(self, how: np.ufunc, values: Iterable[Array]) -> Array:
        """Several values ``(q,)``, one after another, reduced to one per place by a ufunc, ``(k, nu, nv)``."""
        found = []
        for each in values:
            found.append(np.zeros(self.shape))
            if len(self.first):
                found[-1].ravel()[self.filled] = how.reduceat(each[self.order], self.first)
        return np.array(found)

    def _squares(self, form: Forms, areas: Array) -> Iterator[Array]:
        """Areas, and bending and variation times areas, of the surface and beyond the base: one at a time, because
        points may be many."""
        yield areas
        yield form.bending * areas
        yield form.variation * areas
        for own, base, times in ((form.shape, self.base[:3], (1, 2, 1)), (form.slope, self.base[3:], (1, 1))):
            total = np.zeros_like(areas)
            for one, other, k in zip(own, base, times, strict=True):
                off = one - other
                total += k * (off * off)
            yield total * areas

    def _means(self, form: Forms, areas: Array) -> tuple[Array, Array]:
        """Means of bending and curvature variation, and of both beyond the base, ``(2, nu, nv)`` each."""
        sums = self._gathered(np.add, self._squares(form, areas))
        means = sums[1:] / np.maximum(sums[0], 1e-300)
        return means[:2], means[2:]


def _around(figures: Array, least: Array) -> Array:
    """The largest of each place and its neighbours, and no less than an invisible wave, ``(2, nu, nv)``."""
    from scipy.ndimage import maximum_filter

    most = maximum_filter(figures, (1, 3, 3), mode="nearest")
    return np.asarray(np.maximum(most, np.maximum(least, 1e-300)[:, None, None]))


def _divided(rule: Quadrature, form: Forms, axis: int, side: float) -> tuple[Array, Array]:
    """The strip across an axis, one side (mm) wide, in which each point of a rule lies, and where each strip ends."""
    column = np.nonzero(rule.mask.T)[1 - axis]
    places, weights = ((rule.u, rule.v)[axis].ravel(), (rule.wu, rule.wv)[axis].ravel())
    points = np.maximum(np.bincount(column, minlength=len(weights)), 1)
    steps = np.bincount(column, form.speeds[axis], len(weights)) / points * weights
    along = np.cumsum(steps) - steps / 2
    count = int(np.clip(np.ceil(steps.sum() / side), 1, len(weights)))
    ends = np.interp(np.arange(1, count + 1) / count * steps.sum(), along, places)
    return _strip(ends, places)[column], ends


def _strip(ends: Array, at: Array) -> Array:
    return np.asarray(np.searchsorted(ends[:-1], at))
