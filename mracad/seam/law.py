"""Laws of joints: scalar functions along a seam by which the derivatives of its two sides are related."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

Array = np.ndarray

SHORT = 6
"""Fewest knots at which laws that are linear between them are more than interpolated."""

_POINTS = 1025


@dataclass(frozen=True, eq=False)
class Law:
    """A function of the fraction of the edge.

    Attributes
    ----------
    values : ndarray (k,)
        Coefficients of a polynomial, lowest degree first, none where it vanishes; or values at even fractions.
    pieces : int
        0 for a polynomial.  Otherwise conditions take it as linear between the knots along the seam, for which so many
        even spans are short enough, if the first and the last are half as long.
    """

    values: Array
    pieces: int = 0

    @property
    def degree(self) -> int:
        """−1 where it vanishes."""
        return 1 if self.pieces else len(self.values) - 1

    def at(self, share: Array, knots: Array) -> Array:
        """Values ``(q,)`` at fractions, given the fractions of the knots, in order, 0 and 1 among them."""
        if not self.pieces:
            return np.asarray(np.polynomial.polynomial.polyval(share, np.append(self.values, 0.0)))
        return np.asarray(np.interp(share, knots, self._chords(knots)))

    def _chords(self, knots: Array) -> Array:
        """Values at knots between which it is taken as linear.

        They are exact, but at both ends slopes are: where three patches meet, their second derivatives could not agree
        otherwise.  Nor does it bend where it vanishes: with jumps in brackets, δ_n is smooth at a knot only if
        [b'] δ_t + b [δ_tt] = 0, which would make δ_t vanish.
        """
        even = np.linspace(0.0, 1.0, len(self.values))
        values: Array = np.interp(knots, even, self.values)
        if len(knots) < SHORT:
            return values
        for end, near in ((0, 1), (-1, -2)):
            slope = np.polyval(np.polyder(np.polyfit(even[:3], self.values[:: 1 + 2 * end][:3], 2)), 0.0)
            values[near] = values[end] + slope * abs(knots[near] - knots[end])
        low, middle, high = np.abs(values[:-2]), np.abs(values[1:-1]), np.abs(values[2:])
        least = (middle <= low) & (middle < high) & (middle < np.maximum(low, high) / 2)
        k = 2 + np.flatnonzero(least[1:-1])
        ahead, behind = knots[k + 1] - knots[k], knots[k] - knots[k - 1]
        values[k] = (ahead * values[k - 1] + behind * values[k + 1]) / (ahead + behind)
        return values

    def part(self, low: float, high: float) -> Law:
        """The law of the part between two fractions, rescaled to 0 … 1."""
        size = high - low
        if not self.pieces:
            return Law(_composed(self.values, low, size))
        share, even = np.linspace(low, high, _POINTS), np.linspace(0.0, 1.0, len(self.values))
        return Law(np.interp(share, even, self.values), math.ceil(size * self.pieces))

    def over(self, size: float) -> Law:
        """The law divided by a number."""
        return replace(self, values=self.values / size)


def breaks(pieces: int) -> Array:
    """Fractions of the knots that are enough for a law of so many pieces."""
    return np.concatenate([[0.0, 0.5 / pieces], np.arange(1, pieces) / pieces, [1.0 - 0.5 / pieces, 1.0]])


NONE = Law(np.empty(0))
"""The law that vanishes."""


def constant(value: float) -> Law:
    """The law that has one value."""
    return Law(np.array([value]))


def polynomials(share: Array, values: Array, degree: int) -> Array:
    """Coefficients ``(degree + 1, k)`` of the polynomials nearest to values ``(q, k)`` at fractions; none for −1."""
    if degree < 0:
        return np.empty((0, values.shape[1]))
    return np.asarray(np.polynomial.polynomial.polyfit(share, values, degree))


def _composed(coefficients: Array, low: float, size: float) -> Array:
    """Coefficients of p(low + size x) from those of p(x)."""
    result = np.zeros(len(coefficients))
    for k in range(len(result)):
        result[k] = np.polynomial.polynomial.polyval(low, coefficients) * size**k / math.factorial(k)
        coefficients = np.polynomial.polynomial.polyder(coefficients)
    return result
