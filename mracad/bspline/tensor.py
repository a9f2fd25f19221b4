"""Compiled code for :mod:`mracad.bspline.jets`: derivatives at pairs of parameters, from those along u."""

from __future__ import annotations

from typing import Any

from mracad.compiled import Compiled

FEW, MANY = 10_000, 10_000_000
"""Numbers of points above which it pays to load the compiled code, and to compile it."""


def _combine(along: Any, across: Any, orders: Any, found: Any) -> None:
    """Products of curves of control points and functions across them, added up in the order of control points.

    Parameters
    ----------
    along : tuple
        Derivatives of the curves ``(orders, size, curves, wide)``, with the last three numbers.
    across : tuple
        Curves of each row of points, their functions ``(orders, rows, order)``, the last two numbers, and the rows
        from the first to the one after the last that are wanted.
    orders : tuple
        Those of derivatives, along u and along v, and their number.
    found : pointer
        ``(orders, size, rows, wide)``.
    """
    curves, size, count, wide = along
    columns, taps, rows, order, begin, end = across
    to = 0
    for o in range(orders[2]):
        r, s = orders[0][o], orders[1][o]
        for k in range(size):
            start = (r * size + k) * count
            for row in range(begin, end):
                for j in range(order):
                    tap, at = taps[(s * rows + row) * order + j], (start + columns[row * order + j]) * wide
                    if j == 0:
                        for i in range(wide):
                            found[to + i] = tap * curves[at + i]
                    else:
                        for i in range(wide):
                            found[to + i] += tap * curves[at + i]
                to += wide


_REAL, _WHOLE, _PLACES = "float64*", "int64", "int64*"
COMBINE = Compiled(
    _combine,
    (
        (_REAL, _WHOLE, _WHOLE, _WHOLE),
        (_PLACES, _REAL, _WHOLE, _WHOLE, _WHOLE, _WHOLE),
        (_PLACES, _PLACES, _WHOLE),
        (_REAL,),
    ),
    work=(FEW, MANY),
)
