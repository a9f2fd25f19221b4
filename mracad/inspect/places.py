"""Roughness place by place: whether an edit made waves where a face was smooth, which no sum over the face shows.

A face is divided into places with sides of half the wavelength of the edit.  What an edit takes from one spreads to
those beside it, so bending and curvature variation of a place (their means over it) are compared with the largest of
the place itself and of the eight about it before.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from mracad.inspect.creases import Crossing
from mracad.inspect.curvature import Forms
from mracad.model.cells import Quadrature

Array = np.ndarray

SIDES = 2
"""Sides of a place in a wavelength."""

SLOPE = 1.4e-4
"""Steepest slope of a wave that shows nowhere, radians: what an edit may add to an angle between faces."""

SMALL = 0.05
"""Area over that of the largest place up to which a place at the boundary counts for nothing."""


@dataclass(frozen=True, eq=False)
class Placed:
    """What an edit did to the places of a face, ``(nu, nv)`` each; zero where there is no face.

    Attributes
    ----------
    spread : ndarray
        By how much bending or curvature variation exceeds the largest about the place before, over that.
    lost : ndarray
        Share that the place lost of the one of which it lost more.
    curvature : ndarray
        Largest curvature now, 1/mm.
    turn : ndarray
        Largest angle between normals before and after, radians.
    opened : ndarray
        By how much the angle across a knot line grew, where it grew most, radians.
    unsettled : ndarray
        As for :class:`mracad.inspect.roughness.Change`.
    area : ndarray
        mm², zero where a place is too small to count.
    ends : (ndarray, ndarray)
        Parameters at which places end, along u and v.
    """

    spread: Array
    lost: Array
    curvature: Array
    turn: Array
    opened: Array
    unsettled: Array
    area: Array
    ends: tuple[Array, Array]

    def at(self, u: Array, v: Array) -> tuple[Array, Array]:
        """Numbers of the places at parameters, along u and along v."""
        return _strip(self.ends[0], u), _strip(self.ends[1], v)


@dataclass(frozen=True, eq=False)
class Places:
    """Places of a face before an edit.

    Attributes
    ----------
    order : ndarray of int (q,)
        The points of a quadrature, place by place.
    first, filled : ndarray of int (places,)
        Where each place that has points begins among them, and its number.
    shape : (int, int)
        Places along u and v.
    ends : (ndarray, ndarray)
        Parameters at which they end.
    area : ndarray (nu, nv)
        mm², zero where a place is too small.
    before, around : ndarray (2, nu, nv)
        Means of bending and curvature variation; the largest of each place and those beside it, and of what shows
        nowhere.
    """

    order: Array
    first: Array
    filled: Array
    shape: tuple[int, int]
    ends: tuple[Array, Array]
    area: Array
    before: Array
    around: Array

    @classmethod
    def of(cls, rule: Quadrature, form: Forms, areas: Array, wavelength: float) -> Places:
        """Places of the faces that a rule goes over, with the forms of the surface and areas (mm²) at its points."""
        from scipy.ndimage import maximum_filter

        (rows, u), (columns, v) = (_divided(rule, form, axis, wavelength / SIDES) for axis in (0, 1))
        shape = len(u), len(v)
        cell = rows * shape[1] + columns
        order = np.argsort(cell, kind="stable")
        filled, first = np.unique(cell[order], return_index=True)
        bare = np.zeros(shape)
        places = cls(order, first, filled, shape, (u, v), bare, bare, bare)
        area = places._gathered(np.add, areas)
        k = 2 * np.pi / wavelength
        flat = np.array([SLOPE**2 * k**2 / 2, SLOPE**2 * k**4 / 8])[:, None, None]
        before = places._means(form, areas)
        around = np.maximum(maximum_filter(before, (1, 3, 3), mode="nearest"), np.maximum(flat, 1e-300))
        area = np.where(area > SMALL * area.max(initial=0.0), area, 0.0)
        return cls(order, first, filled, shape, (u, v), area, before, around)

    def compared(
        self, form: Forms, areas: Array, turned: Array, unsettled: Array, opened: Iterable[tuple[Crossing, Array]]
    ) -> Placed:
        """What became of them.

        Parameters
        ----------
        form : Forms
            Now.
        areas : ndarray (q,)
            mm², zero at points that do not count.
        turned, unsettled : ndarray (q,)
            Turns of normals (radians), and what became of singular points.
        opened : iterable of (Crossing, ndarray)
            By how much angles across knot lines grew, radians.
        """
        now, counts = self._means(form, areas), self.area > 0
        spread = np.where(counts, (now / self.around - 1).max(axis=0), 0.0)
        lost = np.where(counts, ((self.before - now) / self.around).max(axis=0), 0.0)
        peaks, turn, singular = (
            self._gathered(np.maximum, each) for each in (form.largest * (areas > 0), turned, unsettled)
        )
        return Placed(spread, lost, peaks, turn, self._opened(opened), singular, self.area, self.ends)

    def _opened(self, opened: Iterable[tuple[Crossing, Array]]) -> Array:
        found = np.zeros(self.shape)
        for crossing, grew in opened:
            line, place = np.nonzero(crossing.seen)
            at = (crossing.at[line, 0], crossing.places[place])[:: 1 - 2 * crossing.axis]
            np.fmax.at(found, tuple(_strip(ends, each) for ends, each in zip(self.ends, at, strict=True)), grew)
        return found

    def _gathered(self, how: np.ufunc, values: Array) -> Array:
        """Values ``(q,)`` put together place by place, ``(nu, nv)``."""
        found = np.zeros(self.shape).ravel()
        if len(self.first):
            found[self.filled] = how.reduceat(values[self.order], self.first)
        return found.reshape(self.shape)

    def _means(self, form: Forms, areas: Array) -> Array:
        """Means of bending and curvature variation, ``(2, nu, nv)``."""
        sums = [self._gathered(np.add, areas * each) for each in (form.bending, form.variation)]
        return np.asarray(np.stack(sums) / np.maximum(self._gathered(np.add, areas), 1e-300))


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
