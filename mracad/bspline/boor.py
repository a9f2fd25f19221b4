"""Compiled code for :mod:`mracad.bspline.basis`: from parameters to functions and derivatives in one call."""

from __future__ import annotations

from typing import Any

from mracad.compiled import Compiled

FEW, MANY = 5_000, 4_000_000
"""Numbers of parameters above which it pays to load the compiled code, and to compile it."""


def _evaluate(knots: Any, at: Any, orders: Any, found: Any) -> None:
    """Functions and derivatives that do not vanish at parameters.

    Parameters
    ----------
    knots : tuple
        All knots; breaks, the spans between them, and their number; the degree.
    at : tuple
        Parameters, their number, and whether limits are taken from the right.
    orders : tuple
        Orders of derivatives, their number, and the least.
    found : tuple
        First function at each parameter; values ``(at, orders, d + 1)``; memory for ``(d + 1, d + 1)`` numbers.
    """
    every, breaks, spans, count, d = knots
    x, number, right = at
    for q in range(number):
        low, high = 0, count + 1  # as numpy's searchsorted among the breaks
        while low < high:
            middle = (low + high) >> 1
            if breaks[middle] < x[q] or (right and breaks[middle] <= x[q]):
                low = middle + 1
            else:
                high = middle
        span = spans[min(max(low - 1, 0), count - 1)]
        found[0][q] = span - d
        _raise(every, (span, d, d - orders[2]), x[q] - every[span], found[2])
        for k in range(orders[1]):
            _differentiate(every, (span, d, orders[0][k]), found[2], (found[1], (q * orders[1] + k) * (d + 1)))


def _raise(knots: Any, place: Any, x: Any, table: Any) -> None:
    """Values of the functions of all degrees on a span, up to one, a row of a table each."""
    span, d, most = place
    origin = knots[span]
    table[0] = 1.0
    for k in range(1, most + 1):
        new, old, first = k * (d + 1), (k - 1) * (d + 1), span + 1 - k
        table[new] = 0.0
        for j in range(k):
            low, high, value = knots[first + j] - origin, knots[span + 1 + j] - origin, table[old + j]
            width = high - low
            table[new + j] = (high - x) / width * value + table[new + j]
            table[new + j + 1] = (x - low) / width * value


def _differentiate(knots: Any, place: Any, table: Any, found: Any) -> None:
    """Derivatives of one order, from the functions of a degree lower by that."""
    span, d, order = place
    values, to = found
    least = d - order
    for j in range(d + 1):
        values[to + j] = table[max(least, 0) * (d + 1) + j] if j <= least else 0.0
    origin = knots[span]
    for k in range(max(least, 0) + 1, d + 1):
        below = 0.0
        for j in range(k):
            width = (knots[span + 1 + j] - origin) - (knots[span + 1 - k + j] - origin)
            slope = k / width * values[to + j]
            values[to + j], below = below - slope, slope
        values[to + k] = below


_REAL, _WHOLE, _PLACES = "float64*", "int64", "int64*"
EVALUATE = Compiled(
    _evaluate,
    (
        (_REAL, _REAL, _PLACES, _WHOLE, _WHOLE),
        (_REAL, _WHOLE, _WHOLE),
        (_PLACES, _WHOLE, _WHOLE),
        (_PLACES, _REAL, _REAL),
    ),
    (_raise, _differentiate),
    work=(FEW, MANY),
)
