"""Compiled code for :mod:`mracad.bspline.surface`: points and derivatives at scattered parameters."""

from __future__ import annotations

from typing import Any

from mracad.compiled import Compiled

FEW, MANY = 5_000, 10_000_000
"""Numbers of points above which it pays to load the compiled code, and to compile it."""


def _gather(poles: Any, places: Any, functions: Any, found: Any) -> None:
    """Points and derivatives, products added up in the order of control points, first along u.

    Parameters
    ----------
    poles : tuple
        Control points of all surfaces, and the number of their coordinates.
    places : tuple
        Rows and columns of those that matter for each point, which are added; numbers of points, rows and columns.
    functions : tuple
        Functions and derivatives ``(points, orders, rows)`` and ``(points, orders, columns)``, and number of orders.
    found : tuple
        ``(derivatives, points, coordinates)``, and memory for ``(orders, columns, coordinates)`` numbers.
    """
    (p, size), (rows, columns, count, a, b), (in_u, in_v, orders) = poles, places, functions
    result, partial = found
    for q in range(count):
        for r in range(orders):
            for j in range(b):
                _blend(
                    (in_u, (q * orders + r) * a), (rows, q * a, columns[q * b + j]), (a, size), p,
                    (partial, (r * b + j) * size),
                )  # fmt: skip
        order = 0
        for total in range(orders):
            for s in range(total + 1):
                to, start, at = (order * count + q) * size, (total - s) * b * size, (q * orders + s) * b
                for k in range(size):
                    value = in_v[at] * partial[start + k]
                    for j in range(1, b):
                        value += in_v[at + j] * partial[start + j * size + k]
                    result[to + k] = value
                order += 1


def _blend(factors: Any, places: Any, shape: Any, poles: Any, found: Any) -> None:
    """The sum of control points times factors."""
    (f, start), (rows, first, column), (count, size), (x, to) = factors, places, shape, found
    for k in range(size):
        value = f[start] * poles[(rows[first] + column) * size + k]
        for i in range(1, count):
            value += f[start + i] * poles[(rows[first + i] + column) * size + k]
        x[to + k] = value


_REAL, _WHOLE, _PLACES = "float64*", "int64", "int64*"
GATHER = Compiled(
    _gather,
    (
        (_REAL, _WHOLE),
        (_PLACES, _PLACES, _WHOLE, _WHOLE, _WHOLE),
        (_REAL, _REAL, _WHOLE),
        (_REAL, _REAL),
    ),
    (_blend,),
    work=(FEW, MANY),
)
