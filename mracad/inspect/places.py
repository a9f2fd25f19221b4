"""Roughness place by place: whether an edit made waves where a face was smooth, which no sum over the face shows.

A face is divided into places with sides of half the wavelength of the edit.  Its part beyond the base bends by
|S − S₀|² and varies by |∇H − ∇H₀|², with the shape operator S, and ₀ for the base: next to the curvature of the base,
waves that reflections show are small.  A change at one place spreads to its neighbours, so these figures (means over a
place) are compared with the largest that the place and its eight neighbours had before.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from mracad.compiled import pointer
from mracad.inspect.creases import Crossing
from mracad.inspect.spread import COMPARE
from mracad.inspect.tally import Tally
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
    figures : ndarray (8, nu, nv)
        All that depends on the amount of a displacement.
    area : ndarray
        Area, mm²; zero where a place is too small to count.
    ends : (ndarray, ndarray)
        Parameters at which places end, along u and v.
    """

    figures: Array
    area: Array
    ends: tuple[Array, Array]

    @property
    def spread(self) -> Array:
        """Bending or variation of the place beyond its base, over the largest around it before, less 1."""
        return np.asarray(self.figures[0])

    @property
    def lost(self) -> Array:
        """Share of its bending or curvature variation that the place lost, whichever is larger."""
        return np.asarray(self.figures[1])

    @property
    def curvature(self) -> Array:
        """Largest curvature after the edit, 1/mm."""
        return np.asarray(self.figures[2])

    @property
    def turn(self) -> Array:
        """Largest angle between normals before and after, radians."""
        return np.asarray(self.figures[3])

    @property
    def opened(self) -> Array:
        """Largest growth of the angle across a knot line, radians."""
        return np.asarray(self.figures[4])

    @property
    def unsettled(self) -> Array:
        """See :class:`mracad.inspect.roughness.Change`."""
        return np.asarray(self.figures[5])

    @property
    def rise(self) -> Array:
        """Growth of bending and curvature variation of the place, over the mean growth of all, ``(2, nu, nv)``."""
        return np.asarray(self.figures[6:])

    def at(self, u: Array, v: Array) -> tuple[Array, Array]:
        """Indices of the places at parameters, along u and along v."""
        return _strip(self.ends[0], u), _strip(self.ends[1], v)


@dataclass(frozen=True, eq=False)
class Places:
    """Places of a face before an edit.

    Attributes
    ----------
    ends : (ndarray, ndarray)
        Parameters at which they end, along u and v.
    area : ndarray (nu, nv)
        Area, mm²; zero where a place is too small.
    before : ndarray (2, nu, nv)
        Means of bending and curvature variation.
    most, around : ndarray (2, nu, nv)
        The largest of each place, its neighbours and the invisible wave: of bending and variation, and beyond the base.
    crossed : sequence of (ndarray, ndarray)
        Places of the points where tangents may jump, along u and v, for each :class:`Crossing`.
    """

    ends: tuple[Array, Array]
    area: Array
    before: Array
    most: Array
    around: Array
    crossed: Sequence[tuple[Array, Array]]

    @classmethod
    def of(
        cls, ends: tuple[Array, Array], tally: Tally, wavelengths: tuple[float, float], crossed: Iterable[Crossing]
    ) -> Places:
        """Places that end at parameters along u and v, with their figures; wavelengths (mm) along u and v, and points
        where tangents may jump."""
        shape = len(ends[0]), len(ends[1])
        area = tally.sums[1].reshape(shape)
        area = np.where(area > SMALL * area.max(initial=0.0), area, 0.0)
        before, beyond = _means(tally, shape)
        k = 2 * np.pi / min(wavelengths)
        flat = np.array([SLOPE**2 * k**2 / 2, SLOPE**2 * k**4 / 8])
        at = [_met(each, ends) for each in crossed]
        return cls(ends, area, before, _around(before, flat), _around(beyond, flat), at)

    def compared(self, tally: Tally, turned: Array, unsettled: Array, opened: Iterable[Array]) -> Placed:
        """The changes of the places.

        Parameters
        ----------
        tally : Tally
            Figures after the edit.
        turned, unsettled : ndarray (places,)
            Largest turns of normals (radians), and changes of singular points.
        opened : iterable of ndarray
            Growth of angles at the points where tangents may jump, radians.
        """
        found = np.zeros((8, *self.area.shape))
        if COMPARE.pays(self.area.size):
            COMPARE(self.area.size, pointer(tally.sums), *self._pointers, pointer(found))
        else:
            self._compare(tally, found)
        found[2], found[3], found[5] = (each.reshape(self.area.shape) for each in (tally.tops[0], turned, unsettled))
        for at, each in zip(self.crossed, opened, strict=True):
            np.fmax.at(found[4], at, each)
        return Placed(found, self.area, self.ends)

    def _compare(self, tally: Tally, found: Array) -> None:
        """All that depends on sums, by arrays."""
        shape, counts = self.area.shape, self.area > 0
        means, beyond = _means(tally, shape)
        fell = self.before - means
        for figure, (bending, variation) in zip(found, (beyond / self.around - 1, fell / self.most), strict=False):
            np.maximum(bending, variation, out=figure)
        found[:2, ~counts] = 0.0
        rise = np.maximum(-fell * self.area, 0.0, out=found[6:])
        totals = np.cumsum(rise.reshape(2, -1), axis=1)[:, -1]  # one after another, as compiled code adds up
        rise /= np.maximum(totals / self.area.size, 1e-300)[:, None, None]

    @cached_property
    def _pointers(self) -> tuple[int, ...]:
        return tuple(map(pointer, (self.area, self.before, self.most, self.around)))


def strips(rule: Quadrature, column: Array, speeds: Array, axis: int, side: float) -> tuple[Array, Array]:
    """The strip across an axis, one side (mm) wide, in which each parameter of a rule along it lies, and where each
    strip ends; for points with their indices along the axis, and the speeds there, mm."""
    places, weights = (rule.u, rule.v)[axis].ravel(), (rule.wu, rule.wv)[axis].ravel()
    points = np.maximum(np.bincount(column, minlength=len(weights)), 1)
    steps = np.bincount(column, speeds, len(weights)) / points * weights
    along = np.cumsum(steps) - steps / 2
    count = int(np.clip(np.ceil(steps.sum() / side), 1, len(weights)))
    ends = np.interp(np.arange(1, count + 1) / count * steps.sum(), along, places)
    return _strip(ends, places), ends


def _met(crossing: Crossing, ends: tuple[Array, Array]) -> tuple[Array, Array]:
    """The places of the points of a crossing."""
    line, place = np.nonzero(crossing.seen)
    at = (crossing.at[line, 0], crossing.places[place])[:: 1 - 2 * crossing.axis]
    return _strip(ends[0], at[0]), _strip(ends[1], at[1])


def _means(tally: Tally, shape: tuple[int, int]) -> tuple[Array, Array]:
    """Means of bending and curvature variation, and of both beyond the base, ``(2, nu, nv)`` each."""
    means = (tally.sums[2:6] / np.maximum(tally.sums[1], 1e-300)).reshape(2, 2, *shape)
    return means[0], means[1]


def _around(figures: Array, least: Array) -> Array:
    """The largest of each place and its neighbours, and no less than an invisible wave, ``(2, nu, nv)``."""
    from scipy.ndimage import maximum_filter

    most = maximum_filter(figures, (1, 3, 3), mode="nearest")
    return np.asarray(np.maximum(most, np.maximum(least, 1e-300)[:, None, None]))


def _strip(ends: Array, at: Array) -> Array:
    return np.asarray(np.searchsorted(ends[:-1], at))
